"""Friction states: against 80 digits, and against their own equations."""

import numpy as np
import pytest
from friction_scenes import FRACTIONS, FRICTION, KINDS, NAMES, off, pressed, with_friction
from hypothesis import given, settings
from hypothesis import strategies as st
from levels_reference import reference as exact
from numpy.testing import assert_allclose
from scenes import MATERIAL, PAPER_APPROACH, paper, random_scenes

import convexrough as cr
from convexrough.influence.coupling import inverse_distances
from convexrough.sphere import mindlin


@pytest.mark.sample(10)
@pytest.mark.parametrize("fraction", FRACTIONS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("influence", KINDS)
def test_eighty_digits(influence: str, name: str, fraction: float) -> None:
    """Every force to 1e-11 of itself, the loss to 1e-10, at any shear force; and every bound.

    Transforms round the largest and the smallest alike: their forces are good to 1e-11 of the
    largest.
    """
    contact, truth = pressed(name, influence), exact(name, fraction)
    force = fraction * FRICTION * contact.load
    state = cr.shear(contact, force=force)
    certificate = state.certificate
    for i, true in enumerate(truth.forces):
        size = float(true) if influence == "dense" else state.forces.max()
        assert off(state.forces[i], true) <= 1e-11 * size
        assert off(state.forces[i], true) <= certificate.force_errors[i]
        assert off(state.slips[i], truth.slips[i]) <= certificate.slip_errors[i]
        if truth.slips[i] > 0:
            assert certificate.status[i] == "sliding"
        else:
            assert certificate.status[i] == ("partial" if truth.loads[i] > 0 else "open")
    assert certificate.holds
    assert off(state.displacement, truth.displacement) <= 1e-12 * state.displacement
    assert off(state.displacement, truth.displacement) <= certificate.displacement_error
    assert certificate.force_errors.max() <= 1e-9 * state.forces.max()
    cycle = cr.cycle(contact, maximum=force)
    assert off(cycle.loss, truth.energy) <= 1e-10 * float(truth.energy)
    if fraction >= 1e-3:  # V - V cancels as T^3
        assert cycle.balance_defect < 1e-10


@pytest.mark.sample(8)
@pytest.mark.parametrize("fraction", [*FRACTIONS, 1 - 1e-12, 1.0])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("influence", KINDS)
def test_the_displacements_balance(influence: str, name: str, fraction: float) -> None:
    """X = displacement_i + sum_j c_t A_ij Q_j at every loaded asperity; the forces add up to Q."""
    contact = pressed(name, influence)
    scene = contact.scene
    state = cr.shear(contact, force=fraction * FRICTION * contact.load)
    assert state.forces.sum() == pytest.approx(state.force, rel=1e-14)
    ratio = mindlin.ratio(0.3)
    coupling = inverse_distances(scene.contact_points, scene.contact_points) / np.pi
    there = state.displacements + ratio * coupling @ state.forces / scene.material.contact_modulus
    assert_allclose(there[contact.loads > 0], state.displacement, rtol=1e-12)
    # Johnson's formula for the own deflection of those that stick in part.
    sticks = state.status == "partial"
    P, a = contact.loads[sticks], contact.contact_radii[sticks]
    t = state.forces[sticks] / (FRICTION * P)
    G = scene.material.shear_modulus
    if fraction > 1e-2:
        own = 3 * (2 - 0.3) * FRICTION * P / (8 * G * a) * (1 - (1 - t) ** (2 / 3))
        assert_allclose(state.displacements[sticks], own, rtol=1e-10)
    if fraction < 0.9999:  # beyond, 1 - t has lost its digits
        assert_allclose(state.stick_radii[sticks], a * (1 - t) ** (1 / 3), rtol=1e-9)
    assert (state.stick_radii[state.status == "sliding"] == 0).all()


def test_the_paper_at_half_the_limit() -> None:
    """Exactly the six asperities of ring A slide; A starts near 0.352, B near 0.616."""
    contact = pressed("paper")
    ring = np.round((contact.scene.asperities.distances / 0.0025) ** 2)
    limit = FRICTION * contact.load
    state = cr.shear(contact, force=0.5 * limit)
    assert set(ring[state.status == "sliding"]) == {9}
    assert (state.status == "sliding").sum() == 6
    onsets = cr.onset_of_sliding(contact) / limit
    assert_allclose(onsets[ring == 9], 0.352, atol=5e-4)
    assert_allclose(onsets[ring == 7], 0.616, atol=1e-3)
    assert np.ptp(onsets[ring == 7]) < 1e-13  # symmetric rings slide together
    assert np.nanmax(onsets) == pytest.approx(1.0, abs=1e-12)
    assert np.isnan(onsets[contact.loads == 0]).all()


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("influence", KINDS)
def test_onsets_are_where_sliding_starts(influence: str, name: str) -> None:
    contact = pressed(name, influence)
    some = np.flatnonzero(contact.loads)[::7]
    onsets = dict(zip(some, cr.onset_of_sliding(contact, which=some), strict=True))
    for i in some:
        if onsets[i] < 0.999 * FRICTION * contact.load:
            before = cr.shear(contact, force=onsets[i] * (1 - 1e-9))
            after = cr.shear(contact, force=onsets[i] * (1 + 1e-9))
            assert before.slips[i] == 0
            assert after.slips[i] > 0
            # ... and nothing less would do: the slip is first order in the excess.
            assert after.slips[i] < 1e-8 * after.displacement


def test_zero_and_the_limit() -> None:
    contact = pressed("paper")
    limit = FRICTION * contact.load
    rest = cr.shear(contact, force=0.0)
    assert (rest.forces == 0).all()
    assert rest.displacement == 0
    assert rest.certificate.holds
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
    back = cr.shear(contact, force=-0.3 * limit)
    forth = cr.shear(contact, force=0.3 * limit)
    assert (back.forces == -forth.forces).all()
    assert back.displacement == -forth.displacement


def test_gross_sliding_is_refused() -> None:
    contact = pressed("paper")
    limit = FRICTION * contact.load
    for force in (1.01 * limit, -1.01 * limit):
        with pytest.raises(cr.InputError, match=r"1\.01 f P: gross sliding"):
            cr.shear(contact, force=force)
    with pytest.raises(cr.InputError, match="found nan, expected at most f P"):
        cr.shear(contact, force=float("nan"))
    frictionless = cr.press(paper(), approach=PAPER_APPROACH)
    with pytest.raises(cr.InputError, match="coefficient of friction"):
        cr.shear(frictionless, force=1e-9)


def test_nothing_loaded() -> None:
    scene = with_friction(
        cr.Scene(1.0, cr.Asperities([[1e-3, 0], [2e-3, 0]], 0.01), MATERIAL, geometry="summit")
    )
    contact = cr.press(scene, approach=1e-7)
    state = cr.shear(contact, force=0.0)
    assert (state.forces == 0).all()
    assert (state.status == "open").all()
    with pytest.raises(cr.InputError, match="at most f P = 0"):
        cr.shear(contact, force=1e-9)


@settings(max_examples=20, deadline=None)
@given(random_scenes(crowding=0.9), st.floats(1e-6, 0.999), st.floats(0, 0.5))
def test_random_scenes(sampled: tuple[cr.Scene, float], fraction: float, nu: float) -> None:
    """The friction law holds, and where loads only fall it is the reduced normal contact."""
    scene, approach = sampled
    contact = cr.press(with_friction(scene, nu=nu), approach=approach)
    if contact.load == 0 or contact.certificate.scope == "none":
        return
    force = fraction * FRICTION * contact.load
    state = cr.shear(contact, force=force)
    assert state.forces.sum() == pytest.approx(force, rel=1e-12)
    assert (np.abs(state.forces) <= FRICTION * contact.loads * (1 + 1e-14)).all()
    reduced = cr.press(scene, load=contact.load * (1 - fraction))
    if (reduced.loads <= contact.loads).all():
        difference = FRICTION * (contact.loads - reduced.loads)
        assert_allclose(state.forces, difference, rtol=1e-9, atol=1e-11 * FRICTION * contact.load)
        for i, status in enumerate(state.status):
            if status == "sliding":
                assert reduced.status[i] != "contact"
            if status == "partial":
                assert reduced.status[i] != "open"


@pytest.mark.parametrize("force", [[1e-8, 2e-8], "a", None, 1 + 1j])
def test_a_force_is_a_number(force: object) -> None:
    with pytest.raises(cr.InputError):
        cr.shear(pressed("paper"), force=force)  # type: ignore[arg-type]


def test_onsets_do_not_depend_on_levels_found_before() -> None:
    """At a root an asperity touches with a load that no ball tells from 0."""
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025, tip_radius=0.02, within=0.0102, height_std=1e-6, seed=1
    )
    scene = cr.Scene(1.0, asperities, MATERIAL, FRICTION, geometry="summit")
    onsets = []
    for amplitudes in ((), (0.1, 0.2, 0.3, 0.37, 0.4, 0.5)):
        contact = cr.press(scene, load=3e-7)
        for amplitude in amplitudes:
            cr.cycle(contact, maximum=amplitude * FRICTION * 3e-7)
        onsets.append(cr.onset_of_sliding(contact))
    assert np.isfinite(onsets[0]).sum() == (contact.status == "contact").sum()
    assert_allclose(onsets[1], onsets[0], rtol=1e-15)
