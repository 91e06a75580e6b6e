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
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import smooth


def slips(state: cr.ShearState) -> Any:
    """(n,) [length] slips of sliding asperities, 0 for others; positive along positive Q."""
    contact, adhered = state.contact, state.stick_radii > 0
    touching = contact.loads > 0
    u = np.zeros(len(contact.loads))  # surface displacement along the force
    u[touching] = fields.shear_displacement(state, contact.scene.contact_points[touching])
    stuck = u[adhered].mean() if adhered.any() else max(u, key=abs)
    return np.where(touching & ~adhered, stuck - u, 0.0)


def cycle_energy(contact: cr.Contact, maximum: float) -> float:
    """[force length] energy lost per steady cycle between `maximum` and -`maximum` [force]."""
    state, scene = cr.shear(contact, force=maximum), contact.scene
    limits = 0.5 * contact.loads
    indentations = contact.contact_radii**2 / scene.relative_radii
    scales = 4.8 * mindlin.ratio(scene.material.poisson_ratio) * 0.5 * indentations
    shares = np.minimum(np.abs(state.forces) / np.where(limits > 0, limits, 1.0), 1.0)
    forwards = np.sign(state.force) * slips(state)
    return float((limits * (scales * mindlin.loss(shares) + 4.0 * forwards)).sum())


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_the_losses_cross_earlier_than_by_shear(nu: float) -> None:
    contact = pressed("paper", nu=nu)
    hertz = smooth(contact.scene, load=contact.load)
    limit = hertz.largest_force

    def appendix_over_smooth(t: float) -> float:
        return float(cycle_energy(contact, t * limit) / hertz.energy(t * limit) - 1)

    def over_smooth(t: float) -> float:
        return float(cr.cycle(contact, maximum=t * limit).loss / hertz.energy(t * limit) - 1)

    assert brentq(appendix_over_smooth, 0.3, 0.5, xtol=1e-9) == pytest.approx(0.385524, abs=1e-6)
    assert brentq(over_smooth, 0.3, 0.5, xtol=1e-9) == pytest.approx(0.387687, abs=1e-6)


@pytest.mark.parametrize("fraction", [0.37, -0.8, 1.0])
def test_at_poissons_ratio_0_slips_are_those_of_shear(fraction: float) -> None:
    """But for discs in place of points, an error of the displacements that slips are made of."""
    contact = pressed("paper", nu=0.0)
    state = cr.shear(contact, force=fraction * 0.5 * contact.load)
    assert np.count_nonzero(state.slips) >= 6
    error = contact.model_error * abs(state.displacement)
    assert_allclose(slips(state), state.slips, rtol=0, atol=2 * error)
    assert not np.allclose(slips(state), state.slips, rtol=0, atol=0.01 * error)
