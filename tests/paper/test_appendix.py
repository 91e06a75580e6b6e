"""The source's appendix method: its crossing and scatter, and where it must agree with `shear`."""

import numpy as np
import papers_appendix as appendix
import pytest
from numpy.testing import assert_allclose
from scenes import PAPER_APPROACH, paper
from scipy.optimize import brentq

import convexrough as cr
from convexrough.sphere.smooth import smooth


def pressed(nu: float) -> cr.Contact:
    scene = cr.Scene(1.0, paper().asperities, cr.Material(1.0, nu), 0.5, geometry="summit")
    return cr.press(scene, approach=PAPER_APPROACH)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_the_losses_cross_earlier_than_by_shear(nu: float) -> None:
    contact = pressed(nu)
    hertz = smooth(contact.scene, load=contact.load)
    limit = hertz.largest_force

    def appendix_over_smooth(t: float) -> float:
        return float(appendix.cycle_energy(contact, t * limit) / hertz.energy(t * limit) - 1)

    def over_smooth(t: float) -> float:
        return float(cr.cycle(contact, maximum=t * limit).loss / hertz.energy(t * limit) - 1)

    assert brentq(appendix_over_smooth, 0.3, 0.5, xtol=1e-9) == pytest.approx(0.385524, abs=1e-6)
    assert brentq(over_smooth, 0.3, 0.5, xtol=1e-9) == pytest.approx(0.387687, abs=1e-6)


@pytest.mark.parametrize("fraction", [0.37, -0.8, 1.0])
def test_at_poissons_ratio_0_slips_are_those_of_shear(fraction: float) -> None:
    """But for discs in place of points, an error of the displacements that slips are made of."""
    contact = pressed(0.0)
    state = cr.shear(contact, force=fraction * 0.5 * contact.load)
    assert np.count_nonzero(state.slips) >= 6
    error = contact.model_error * abs(state.displacement)
    assert_allclose(appendix.slips(state), state.slips, rtol=0, atol=2 * error)
    assert not np.allclose(appendix.slips(state), state.slips, rtol=0, atol=0.01 * error)
