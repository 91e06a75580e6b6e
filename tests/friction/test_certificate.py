"""What is said of friction where little is known: near touching, crowded, contacts unproved."""

from dataclasses import replace

import numpy as np
import pytest
from friction_scenes import FRICTION
from scenes import MATERIAL, scattered, twins

import convexrough as cr


@pytest.mark.sample(5)
@pytest.mark.parametrize("ulps", [0, 2, -2, 8, -8])
@pytest.mark.parametrize("fraction", [1e-9, 0.25, 0.9])
def test_an_asperity_that_nearly_touches_is_decided(fraction: float, ulps: int) -> None:
    """Thirty digits tell whether it does, and bounds hold either way."""
    spacing, approach = 0.0025, 5e-5

    def scene(height: float) -> cr.Scene:
        asperities = cr.Asperities([[0, 0], [spacing, 0]], 0.02, [0, height])
        return cr.Scene(1.0, asperities, MATERIAL, FRICTION, geometry="summit")

    alone = cr.press(scene(-1.0), approach=approach).loads[0]
    height = alone / (np.pi * spacing) - approach + spacing**2 / 2
    contact = cr.press(scene(height + ulps * np.spacing(height)), approach=approach)
    state = cr.shear(contact, force=fraction * FRICTION * contact.load)
    assert state.certificate.holds
    assert np.isfinite(state.certificate.force_errors).all()
    assert state.certificate.slip_errors.max() <= 1e-15 * state.displacement


@pytest.mark.parametrize("fraction", [1e-9, 0.3, 0.7])
def test_a_crowded_contact_against_the_vector_program(fraction: float) -> None:
    """No shells prove its convexity; what proved the contact proves its friction."""
    scene, approach = scattered(0, 8, 2.0, 0.1)
    scene = replace(scene, friction=FRICTION, material=cr.Material(1.0, 0.0))
    contact = cr.press(scene, approach=approach, influence="dense")
    assert contact.crowding > 1
    assert contact.certificate.scope == "global"
    force = fraction * FRICTION * contact.load
    state, truth = cr.shear(contact, force=force), cr.shear_vector(contact, force=force)
    errors = state.certificate.force_errors + truth.certificate.force_errors
    assert (np.abs(state.forces - truth.forces[:, 0]) <= errors).all()


def test_an_uncertified_contact_gets_no_status() -> None:
    scene, load = twins()
    contact = cr.press(scene, load=load)
    assert contact.certificate.scope == "none"
    force = 0.1 * (scene.friction or 0.0) * contact.load
    state, cycle = cr.shear(contact, force=force), cr.cycle(contact, maximum=force)
    assert state.certificate.scope == "none"
    assert not state.certificate.holds
    assert (state.status == "undecided").all()
    assert np.isinf(state.certificate.force_errors).all()
    assert np.isinf([cycle.loss_error, state.certificate.displacement_error]).all()
    assert state.forces.sum() == pytest.approx(force, rel=1e-12)
    assert cycle.loss > 0
