"""Friction states: against 80 digits, and against their own equations."""

import numpy as np
import pytest
from friction_scenes import FRACTIONS, FRICTION, KINDS, NAMES, off, pressed
from levels_reference import reference as exact
from numpy.testing import assert_allclose

import convexrough as cr


@pytest.mark.sample(6)
@pytest.mark.parametrize("fraction", FRACTIONS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("influence", KINDS)
def test_eighty_digits(influence: str, name: str, fraction: float) -> None:
    """Every force to 1e-11 of itself, the loss to 1e-10, at any shear force; and every bound."""
    contact, truth = pressed(name, influence), exact(name, fraction)
    force = fraction * FRICTION * contact.load
    state = cr.shear(contact, force=force)
    certificate, wrong = state.certificate, off(state.forces, truth.forces)
    size = truth.forces.astype(float) if influence == "dense" else state.forces.max()
    assert (wrong <= 1e-11 * size).all()
    assert (wrong <= certificate.force_errors).all()
    assert (off(state.slips, truth.slips) <= certificate.slip_errors).all()
    sticks = np.where(contact.loads > 0, "partial", "open")
    assert (certificate.status == np.where(truth.slips > 0, "sliding", sticks)).all()
    assert certificate.all_proved
    assert off(state.displacement, truth.displacement) <= 1e-12 * state.displacement
    assert off(state.displacement, truth.displacement) <= certificate.displacement_error
    assert certificate.force_errors.max() <= 1e-9 * state.forces.max()
    cycle = cr.cycle(contact, maximum=force)
    assert off(cycle.loss, truth.energy) <= 1e-10 * float(truth.energy)
    if fraction >= 1e-3:  # V - V cancels as T^3
        assert cycle.balance_defect < 1e-10


def test_zero_and_the_limit() -> None:
    contact = pressed("paper")
    limit = FRICTION * contact.load
    rest = cr.shear(contact, force=0.0)
    assert (rest.forces == 0).all()
    assert rest.displacement == 0
    assert rest.certificate.all_proved
    assert (rest.status[contact.loads > 0] == "partial").all()
    gross = cr.shear(contact, force=limit)
    assert_allclose(gross.forces, FRICTION * contact.loads, rtol=1e-15)
    # The last one to slide slides if Q is no less than f P of the true loads: not known.
    assert gross.status[0] == "undecided"
    assert (gross.status[1:][contact.loads[1:] > 0] == "sliding").all()
    assert np.isfinite(gross.certificate.displacement_error)
    nearly = cr.shear(contact, force=limit * (1 - 1e-12))
    assert_allclose(nearly.forces, FRICTION * contact.loads, rtol=1e-9)
    assert nearly.displacement < gross.displacement
    back, forth = (cr.shear(contact, force=sign * 0.3 * limit) for sign in (-1, 1))
    assert (back.forces == -forth.forces).all()
    assert back.displacement == -forth.displacement
