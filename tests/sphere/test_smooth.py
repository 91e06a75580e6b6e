"""The smooth sphere: quadrature, 60 digits, one asperity in the whole package, dense arrays."""

from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from numpy.testing import assert_allclose
from scenes import MATERIAL, PAPER_APPROACH

import convexrough as cr
from convexrough import fields
from convexrough.sphere.smooth import SmoothSphere, smooth

R, RHO, FRICTION = 1.3, 0.4, 0.35
RELATIVE = 1 / (1 / R + 1 / RHO)
LOAD, NU = 2e-6, 0.3
FRACTIONS = np.array([1e-12, 1e-6, 1e-3, 0.1, 0.37, 0.5, 0.9, 0.999, 1.0])


def sphere(friction: float | None = FRICTION, nu: float = NU) -> SmoothSphere:
    asperities = cr.Asperities([(0.0, 0.0)], 1.0)  # of no consequence
    return smooth(
        cr.Scene(RELATIVE, asperities, cr.Material(3.0, nu), friction, geometry="summit"), load=LOAD
    )


def one_asperity(nu: float = NU) -> cr.Contact:
    """A sphere pressed on one other: a smooth sphere of their relative radius."""
    asperities = cr.Asperities([(0.0, 0.0)], RHO)
    return cr.press(
        cr.Scene(R, asperities, cr.Material(3.0, nu), FRICTION, geometry="summit"), load=LOAD
    )


@pytest.mark.sample(2)
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_one_asperity_is_a_smooth_sphere_under_shear(nu: float, sign: int) -> None:
    contact, hertz = one_asperity(nu), sphere(nu=nu)
    r = hertz.contact_radius * np.array([0.0, 0.2, 0.6, 0.95, 1.2])
    for force in sign * FRACTIONS * hertz.largest_force:
        state = cr.shear(contact, force=force)
        assert state.displacement == pytest.approx(hertz.displacement(force), rel=1e-13)
        # 1 - t is known to rounding only: near gross sliding the stick disc is not known better
        error = hertz.contact_radius * 1e-15 ** (1 / 3)
        assert state.stick_radii[0] == pytest.approx(hertz.stick_radius(force), rel=1e-9, abs=error)
        assert_allclose(
            fields.traction(state, np.column_stack((0.6 * r, 0.8 * r))),
            hertz.traction(r, force),
            rtol=1e-9,
        )


def exact(t: Any, nu: Any) -> dict[str, Any]:
    """The formulas of Cattaneo, Mindlin and Deresiewicz as printed, in 60 digits."""
    with ctx.workdps(60):
        f, P, radius, E = (arb(v) for v in (FRICTION, LOAD, RELATIVE, 3.0))
        t, nu = arb(t), arb(nu)
        G, a = E * (1 - nu), (3 * P * radius / (4 * E)).root(3)
        left = (1 - t).root(3)  # c / a
        p0, c = 2 * E * a / (arb.pi() * radius), a * left
        scale = 9 * (2 - nu) * f**2 * P**2 / (5 * G * a)
        loss = 1 - left**5 - 5 * t / 6 * (1 + left**2)

        def traction(r: float) -> Any:
            whole = f * p0 * (1 - (arb(r) / a) ** 2).sqrt()
            return whole - (f * p0 * left * (1 - (arb(r) / c) ** 2).sqrt() if arb(r) < c else 0)

        return {
            "displacement": float(3 * (2 - nu) * f * P / (8 * G * a) * (1 - left**2)),
            "stick_radius": float(c),
            "energy": float(scale * loss),
            "energy_scale": float(scale),
            "traction": [float(traction(float(a) * part)) for part in (0.0, 0.25, 0.5)],
        }


@pytest.mark.sample(6)
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("t", [1e-15, 1e-9, 1e-3, 0.05, 0.3, 0.49, 0.51, 0.8, 1 - 1e-6])
def test_sixty_digits(t: float, nu: float) -> None:
    hertz, true = sphere(nu=nu), exact(t, nu)
    Q, a = t * hertz.largest_force, hertz.contact_radius
    tolerance = 1e-14 + 1e-16 / (1 - t)
    assert hertz.energy_scale == pytest.approx(true["energy_scale"], rel=1e-14)
    for name in ("displacement", "stick_radius", "energy"):
        value = float(getattr(hertz, name)(Q))
        assert value == pytest.approx(true[name], rel=tolerance), name
    r = np.array([0, a / 4, a / 2])
    assert_allclose(hertz.traction(r, Q), true["traction"], rtol=1e-13)


def differences(spacing: float) -> list[float]:
    """Approach, displacement and losses of small asperities over the smooth sphere's, less 1."""
    asperities = cr.Asperities.hexagonal(
        spacing=spacing, tip_radius=8 * spacing, within=1.01 * np.sqrt(2 * PAPER_APPROACH)
    )
    contact = cr.press(
        cr.Scene(1.0, asperities, MATERIAL, friction=0.5, geometry="summit"),
        approach=PAPER_APPROACH,
    )
    hertz = smooth(contact.scene, load=contact.load)
    Q, more = 0.5 * hertz.largest_force, 0.75 * hertz.largest_force
    ratios = (
        contact.approach / hertz.approach,
        cr.shear(contact, force=Q).displacement / hertz.displacement(Q),
        cr.cycle(contact, maximum=Q).loss / hertz.energy(Q),
        cr.cycle(contact, maximum=more).loss / hertz.energy(more),
    )
    return [ratio - 1 for ratio in ratios]


def test_many_small_asperities_are_a_smooth_sphere() -> None:
    """With tip radii in proportion to the spacing b, every difference is of first order in b.

    The local indentation of an asperity is k P^(2/3): its load goes with b^2 and k with b^(-1/3).
    How many asperities slide goes in jumps, and the losses with it: their rates scatter about 1.
    """
    coarse, fine = differences(0.01 / 8), differences(0.01 / 16)
    rates = np.log2(np.divide(coarse, fine))
    assert_allclose(rates, 1.0, atol=0.2)
    assert_allclose(rates[:2], 1.0, atol=0.1)
    assert_allclose(fine, [0.0453, 0.0126, 0.0316, 0.0412], rtol=0.01)  # softer, and so costlier
