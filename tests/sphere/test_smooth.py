"""The smooth sphere against one asperity in the whole package."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

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
        cycle = cr.cycle(contact, maximum=abs(force))
        assert cycle.loss == pytest.approx(hertz.energy(abs(force)), rel=1e-12)
        # 1 - t is known to rounding only: near gross sliding the stick disc is not known better
        error = hertz.contact_radius * 1e-15 ** (1 / 3)
        assert state.stick_radii[0] == pytest.approx(hertz.stick_radius(force), rel=1e-9, abs=error)
        assert_allclose(
            fields.traction(state, np.column_stack((0.6 * r, 0.8 * r))),
            hertz.traction(r, force),
            rtol=1e-9,
        )
