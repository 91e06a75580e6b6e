"""The smooth ellipsoid: Legendre's integrals, and its losses by quadrature."""

from typing import Any

import numpy as np
import pytest
from scenes import MATERIAL
from scipy.integrate import quad
from scipy.special import ellipe, ellipk

import convexrough as cr
from convexrough.sphere.smooth import SmoothEllipsoid, smooth_reference

ALONE = cr.Asperities([(0.0, 0.0)], 1.0)  # of no consequence


def smooth(radii: Any, load: float, nu: float = 0.3) -> SmoothEllipsoid:
    found = cr.smooth(
        cr.Scene(radii, ALONE, cr.Material(3.0, nu), friction=0.4, geometry="summit"), load=load
    )
    assert isinstance(found, SmoothEllipsoid)
    return found


@pytest.mark.parametrize("radii", [(1.0, 1.001), (2.0, 0.7), (0.1, 4.0), (1.0, 1e6)])
def test_semi_axes_and_approach_by_legendres_integrals(radii: tuple[float, float]) -> None:
    """Johnson (3.26), with a the longer axis and e^2 = 1 - b^2/a^2."""
    hertz = smooth(radii, load=2e-6)
    a, b = sorted(hertz.semi_axes, reverse=True)
    assert (hertz.semi_axes[0] > hertz.semi_axes[1]) == (radii[0] > radii[1])
    m = 1 - (b / a) ** 2
    size = hertz.peak_pressure / 3.0 * b / (m * a**2)  # p0 / E* and so on
    flatter, sharper = max(radii), min(radii)
    near_round = {"rel": 1e-9} if m < 0.01 else {"rel": 1e-12}  # K - E cancels there
    assert size * (ellipk(m) - ellipe(m)) == pytest.approx(1 / (2 * flatter), **near_round)
    assert size * ((a / b) ** 2 * ellipe(m) - ellipk(m)) == pytest.approx(
        1 / (2 * sharper), **near_round
    )
    assert hertz.approach == pytest.approx(hertz.peak_pressure / 3.0 * b * ellipk(m), rel=1e-12)
    assert hertz.peak_pressure * 2 / 3 * np.pi * a * b == pytest.approx(2e-6, rel=1e-14)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_loss_is_eight_times_the_error_of_the_trapezoid(share: float) -> None:
    """W = 8 c_t f^2 {V(P) - V(L) - (P - L) (D0(P) + D0(L)) / 2}, L = P - Q / f, V' = D0."""
    load, radii, nu = 4e-6, (1.0, 3.0), 0.2
    hertz = smooth(radii, load, nu)

    def approach(P: float) -> float:
        return smooth(radii, P).approach

    left = (1 - share) * load
    area = quad(approach, left, load, epsabs=0, epsrel=1e-12)[0]
    trapezoid = (load - left) * (approach(load) + approach(left)) / 2
    loss = 8 * (2 - nu) / (2 * (1 - nu)) * 0.4**2 * (area - trapezoid)
    assert hertz.energy(share * hertz.largest_force) == pytest.approx(loss, rel=1e-6)
    stick = hertz.stick_radius(share * hertz.largest_force) / hertz.contact_radius
    assert stick == pytest.approx(np.cbrt(1 - share), rel=1e-14)


@pytest.mark.parametrize(("base", "name"), [(np.inf, "a flat"), ((np.inf, 1.0), "a cylinder")])
def test_bases_without_a_smooth_reference_say_so(base: Any, name: str) -> None:
    scene = cr.Scene(base, ALONE, MATERIAL, friction=0.5, geometry="summit")
    assert smooth_reference(scene, 1.0) is None
    with pytest.raises(cr.InputError, match=f"scene: found {name}, expected a sphere or an"):
        cr.smooth(scene, load=1.0)
    cycle = cr.cycle(cr.press(scene, load=1e-6), maximum=1e-7)
    assert cycle.loss > 0
    assert np.isnan([cycle.loss_normalised, cycle.smooth_normalised]).all()
