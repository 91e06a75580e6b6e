"""Slips and losses by the appendix of Dini and Hills (2009), equations [A1] to [A15].

Their crossing, and where they must agree with `shear`. Forces and stick discs are those of `shear`;
docs/validation.md says how the methods differ. Displacements and energies are for both bodies, and
so twice those of the paper.
"""

from typing import Any

import numpy as np
import pytest
from friction_scenes import pressed
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import convexrough as cr
from convexrough import fields
from convexrough.sphere.smooth import smooth


def slips(state: cr.ShearState) -> Any:
    """(n,) [length] slips of sliding asperities, 0 for others; positive along positive Q."""
    contact, adhered = state.contact, state.stick_radii > 0
    u = fields.shear_displacement(state, contact.scene.contact_points)  # along the force
    stuck = u[adhered].mean() if adhered.any() else max(u, key=abs)
    return np.where((contact.loads > 0) & ~adhered, stuck - u, 0.0)


def cycle_energy(contact: cr.Contact, maximum: float) -> float:
    """[force length] lost per steady cycle: by `cr.cycle`, with 4 f P_i times these slips."""
    state, cycle = cr.shear(contact, force=maximum), cr.cycle(contact, maximum=maximum)
    return float(cycle.loss + 4 * 0.5 * contact.loads @ (slips(state) - state.slips))


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize(("by_appendix", "crossing"), [(True, 0.385524), (False, 0.387687)])
def test_where_the_losses_cross(nu: float, by_appendix: bool, crossing: float) -> None:
    contact = pressed("paper", nu=nu)
    hertz = smooth(contact.scene, load=contact.load)

    def over_smooth(t: float) -> float:
        Q = t * hertz.largest_force
        loss = cycle_energy(contact, Q) if by_appendix else cr.cycle(contact, maximum=Q).loss
        return float(loss / hertz.energy(Q) - 1)

    assert brentq(over_smooth, 0.3, 0.5, xtol=1e-9) == pytest.approx(crossing, abs=1e-6)


@pytest.mark.parametrize("fraction", [0.37, -0.8, 1.0])
def test_at_poissons_ratio_0_slips_are_those_of_shear(fraction: float) -> None:
    """But for discs in place of points, an error of the displacements that slips are made of."""
    contact = pressed("paper", nu=0.0)
    state = cr.shear(contact, force=fraction * 0.5 * contact.load)
    assert np.count_nonzero(state.slips) >= 6
    error = contact.model_error * abs(state.displacement)
    assert_allclose(slips(state), state.slips, rtol=0, atol=2 * error)
    assert not np.allclose(slips(state), state.slips, rtol=0, atol=0.01 * error)
