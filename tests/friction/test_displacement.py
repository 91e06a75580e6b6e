"""Displacements beyond gross sliding; loops by Masing's rule; what a cycle says of stiffness."""

import numpy as np
import pytest
from friction_scenes import FRICTION, KINDS, pressed
from numpy.testing import assert_allclose

import convexrough as cr


def test_a_displacement_beyond_gross_sliding() -> None:
    contact = pressed("paper")
    last = cr.shear(contact, force=FRICTION * contact.load).displacement
    for wrong in (1.01 * last, np.nan):
        with pytest.raises(cr.InputError, match="displacement"):
            cr.shear(contact, displacement=wrong)
    light = cr.press(contact.scene, approach=-1e-6)
    assert cr.shear(light, displacement=0.0).force == 0.0


def test_stiffness_and_loss_factor() -> None:
    contact = pressed("rough")
    limit = FRICTION * contact.load
    cycle = cr.cycle(contact, maximum=0.5 * limit, minimum=-0.1 * limit)
    loop = cycle.loop(400)
    half = np.ptp(loop.displacements) / 2
    assert cycle.secant_stiffness == pytest.approx(0.3 * limit / half, rel=1e-12)
    # The area of the loop over 2 pi times that of the triangle under its tip.
    assert cycle.loss_factor == pytest.approx(loop.area / (np.pi * 0.3 * limit * half), rel=1e-3)


@pytest.mark.sample(3)
@pytest.mark.parametrize("influence", KINDS)
@pytest.mark.parametrize(("high", "low"), [(0.6, -0.6), (0.6, 0.2), (0.2, -0.8), (-0.3, -0.3)])
def test_loops_are_the_history_that_they_stand_for(influence: str, high: float, low: float) -> None:
    contact = pressed("rough", influence)
    limit = FRICTION * contact.load
    cycle = cr.cycle(contact, maximum=high * limit, minimum=low * limit)
    chosen = [40, 3, 90]
    loop = cycle.loop(24, asperities=chosen)
    first = [cycle.minimum] if abs(low) > abs(high) else []
    past = cr.history(contact, forces=np.concatenate((first, loop.forces)))
    body = slice(len(first), None)
    scale = np.abs(loop.displacements).max()
    assert_allclose(loop.displacements, past.displacements[body], atol=1e-11 * scale)
    assert_allclose(loop.asperity_forces, past.asperity_forces[body][:, chosen], atol=1e-11 * limit)
    loaded = contact.loads[chosen] > 0
    theirs = np.where(loaded, past.asperity_displacements[body][:, chosen], 0.0)
    assert_allclose(loop.asperity_displacements, theirs, atol=1e-11 * scale)
    assert loop.asperities.tolist() == chosen
