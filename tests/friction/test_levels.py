"""States, cycles, paths and given forces against levels in 130 digits: values and bounds."""

from dataclasses import replace
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import FRICTION, KINDS, PAPER, SCENES, in_doubt, pressed
from hypothesis import given, settings
from hypothesis import strategies as st
from levels_reference import DIGITS, displaced, reference
from multiprecision import off
from numpy.testing import assert_allclose
from scenes import hexagonal, paper, twins
from status_audit import ATTACKS, attack

import convexrough as cr
from convexrough.arithmetic.balls import Ball
from convexrough.contact import levels_of
from convexrough.friction.levels import FrictionLevels

FRACTIONS = [1e-9, 1e-6, 1e-3, 0.1, 0.35, 0.37, 0.5, 0.7, 0.9, 0.999]
NAMES = ["paper", "rough"]

#: Half a unit in the last place of the largest, and what a bound may be of it.
ULP, BOUND = 2.0**-53, 1e-14


def assert_known(values: Any, errors: Any, true: Any, bound: float = BOUND) -> None:
    """Within four units in the last place of the largest, within the bounds, and these small."""
    wrong, largest = off(values, true), float(np.abs(values).max())
    assert (wrong <= np.atleast_1d(errors)).all()
    assert wrong.max() <= 8 * ULP * largest
    assert np.max(errors) <= bound * largest


#: Every scene by both controls, and two of them by each operator at any shear force.
CASES = {*product(SCENES, ["dense"], ["approach", "load"], [1e-3, 0.37, 0.999])}
CASES |= {*product(NAMES, KINDS, ["approach"], FRACTIONS)}


@pytest.mark.sample(13)
@pytest.mark.parametrize(("name", "influence", "holding", "fraction"), sorted(CASES))
def test_states_and_cycles(name: str, influence: str, holding: str, fraction: float) -> None:
    """Every force to 1e-11 of itself, too."""
    contact = pressed(name, influence, holding)
    true, bound = reference(name, fraction, holding), BOUND if fraction > 1e-9 else 10 * BOUND
    force = fraction * FRICTION * contact.load
    state, cycle = cr.shear(contact, force=force), cr.cycle(contact, maximum=force)
    proof = state.certificate
    assert state.order == cycle.order == "proved"
    assert proof.all_proved
    statuses = np.where(true.sticks, "partial", "sliding")
    assert (state.status == np.where(contact.loads > 0, statuses, "open")).all()
    assert (off(state.forces, true.forces) <= 1e-11 * true.forces.astype(float)).all()
    with ctx.workdps(DIGITS):
        assert_known(state.forces, proof.force_errors, true.forces, bound)
        assert_known(state.displacement, proof.displacement_error, true.displacement, bound)
        assert_known(state.stick_radii, proof.stick_radius_errors, true.stick_radii)
        assert (off(state.slips, true.slips) <= proof.slip_errors).all()
        assert off(state.slips, true.slips).max() <= 8 * ULP * state.displacement
        assert_known(cycle.loss, cycle.loss_error, true.energy, bound)
        amplitude = cycle.displacement_amplitude
        assert_known(amplitude, cycle.displacement_error, true.displacement, bound)
        shares = off(cycle.asperity_losses, true.energies)
        assert shares.max() <= 8 * ULP * cycle.asperity_losses.max()
        assert (shares <= cycle.asperity_loss_errors).all()
        if true.slips.any():
            assert_known(cycle.slips, cycle.slip_errors, 2 * true.slips)
        path = cr.history(contact, forces=force * np.array([1.0, -1.0, 1.0]))
        losses = true.energy * np.array([arb(1), 3, 5]) / 4
        assert_known(path.losses, path.loss_errors, losses, bound)
        errors = path.displacement_errors[2]
        assert_known(path.displacements[2], errors, true.displacement, bound)
    if fraction >= 1e-3:  # V - V cancels as T^3
        assert cycle.balance_defect < 1e-13


@pytest.mark.parametrize("share", [0.3, 0.9])
@pytest.mark.parametrize("name", ["paper", "rough"])
def test_a_prescribed_displacement(name: str, share: float) -> None:
    contact = pressed(name)
    moved = share * cr.shear(contact, force=FRICTION * contact.load).displacement
    state = cr.shear(contact, displacement=moved)
    assert state.displacement == moved
    assert state.certificate.displacement_error == 0.0
    true = displaced(contact, moved, "approach")
    with ctx.workdps(DIGITS):
        assert_known(state.forces, state.certificate.force_errors, true.forces)
        assert_known(state.force, state.certificate.force_error, true.f * true.T)


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
    apart = cr.press(PAPER, approach=-1e-6)  # nothing touches
    judged = cr.certify_shear(apart, np.full(61, 1e-9), force=0.0)
    assert_allclose(judged.force_errors, np.full(61, 1e-9), rtol=1e-11)
    assert (judged.status == "open").all()


def test_a_force_that_may_be_the_limit_of_a_rounded_load() -> None:
    levels = pressed("rough").cached(FrictionLevels)
    P = sum(Fraction(float(part)) for part in levels.top.load.mid) * Fraction(levels.units.force)
    assert 0 < levels.load - P < 1e-16 * levels.load
    with pytest.raises(cr.ProofError, match="so near f P that gross sliding is not excluded"):
        levels.at(levels.load - P)


def test_levels_of_a_fine_lattice_are_proved_where_the_bound_of_a_rim_is_tiny() -> None:
    """The largest possible load of some asperity, 1e-23, is less than the error bounds of loads."""
    scene = replace(hexagonal(0.0025 / 12, 0.02 / 12, 0.01), friction=0.5)
    contact = cr.press(scene, approach=5e-5)
    state = cr.shear(contact, force=0.45 * contact.load)
    assert state.order.startswith("proved")
    assert state.certificate.displacement_error < 1e-14 * state.displacement


def test_a_response_to_what_is_hardly_known_is_no_failure() -> None:
    """A right side with a large error was taken for a singular system."""
    level = cr.press(paper(), approach=5e-5).cached(levels_of).top
    right = Ball.around(np.linspace(0.0, 1.0, len(level.problem)), 10.0)
    found = level.response(right, Ball.exact(0.0))
    assert np.isfinite(found.loads.radius).all()


@pytest.mark.parametrize("radius", [1e12, 1e20])
def test_onsets_on_a_body_that_is_nearly_flat(radius: float) -> None:
    """Asperities touch one after another at loads that are 0 up to the rounding of P."""
    scene = replace(hexagonal(within=0.0052), sphere_radius=radius, friction=0.5)
    contact = cr.press(scene, approach=1.8789852661499484e-05)
    assert_allclose(cr.onset_of_sliding(contact), 0.5 * contact.load, rtol=1e-12)


@settings(max_examples=16, deadline=None)
@given(
    st.sampled_from(NAMES),
    st.sampled_from(FRACTIONS),
    st.sampled_from([*ATTACKS, "full"]),
    st.integers(0, 2**32 - 1),
    st.sampled_from([*KINDS, 3, 5, 8]),
)
def test_attacks(name: str, fraction: float, kind: str, seed: int, loads: Any) -> None:
    """No bound is too small, no status is wrong; also of rounded loads, whose doubt counts.

    Forces with something wrong; "full" are the largest that friction bears.
    """
    contact, rng = pressed(name, loads if loads in KINDS else "dense"), np.random.default_rng(seed)
    force, forces = fraction * FRICTION * contact.load, FRICTION * contact.loads
    if kind != "full":
        forces = rng.choice([1, 1, -1]) * attack(kind, cr.shear(contact, force=force).forces, rng)
    contact = contact if loads in KINDS else in_doubt(contact, loads)
    judged, truth = cr.certify_shear(contact, forces, force=force), reference(name, fraction)
    assert (off(forces, truth.forces) <= judged.force_errors).all()
    assert (judged.status != np.where(truth.slips > 0, "partial", "sliding")).all()
    assert not (truth.loads > 0)[judged.status == "open"].any()


def test_an_uncertified_contact_gets_no_status() -> None:
    scene, load = twins()
    contact = cr.press(scene, load=load)
    assert contact.certificate.scope == "none"
    limit = FRICTION * contact.load
    force = 0.1 * limit
    state, cycle = cr.shear(contact, force=force), cr.cycle(contact, maximum=force)
    vectors = [cr.shear_vector(contact, force=each).certificate for each in (force, limit)]
    judged = cr.certify_shear(contact, 0.1 * contact.loads, force=force)
    for known in (state.certificate, judged, *vectors):
        assert known.scope == "none"
        assert not known.all_proved
        assert (known.status == "undecided").all()
    assert np.isinf(state.certificate.force_errors).all()
    assert np.isinf([cycle.loss_error, state.certificate.displacement_error]).all()
    assert state.forces.sum() == pytest.approx(force, rel=1e-12)
    assert cycle.loss > 0
