"""The statuses and bounds of vector friction under attack: wrong states, and loads in doubt."""

import numpy as np
import pytest
from friction_scenes import FRICTION, VECTOR_NAMES, found, in_doubt, lengths, pressed, with_friction
from hypothesis import given, settings
from hypothesis import strategies as st
from multiprecision import NotProved
from scenes import random_scenes, scattered, solve_exactly
from status_audit import ATTACKS, Tally, attack, audit_vectors

import convexrough as cr
from convexrough import FrictionNewton, shear_vector
from convexrough.arithmetic.balls import Ball
from convexrough.vector_shear.certificate import certify_vectors
from convexrough.vector_shear.problem import FrictionProblem, VectorState


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from(["paper", "rough"]),
    st.floats(1e-6, 0.999),
    st.sampled_from([*ATTACKS, "turn", "displacement", "slip"]),
    st.integers(0, 2**32 - 1),
)
def test_attacks_on_the_statuses(name: str, fraction: float, kind: str, seed: int) -> None:
    """States that are wrong must not be given a wrong status, nor a bound that is too small."""
    contact = pressed(name, nu=0.5)
    problem = contact.cached(FrictionProblem)
    total = np.array([0.8, 0.6]) * fraction * problem.loads.sum()
    good = FrictionNewton().solve(problem, total)
    rng = np.random.default_rng(seed)
    displacement, slips = good.displacement, good.slips.copy()
    sizes, size = lengths(good.increments), 10.0 ** rng.uniform(-14, -1)
    q = good.increments * (attack(kind, sizes, rng) / sizes)[:, None]
    if kind == "turn":
        q += size * rng.standard_normal((len(q), 1)) * q[:, ::-1] * [-1, 1]
    elif kind == "slip":
        slips[rng.integers(len(slips))] += size * displacement
    elif kind == "displacement":
        displacement = displacement * (1 + size * rng.standard_normal(2))
    q /= np.maximum(lengths(q) / problem.loads, 1.0)[:, None]
    wrong = good._replace(increments=q, displacement=displacement, slips=slips)
    known = certify_vectors(problem, good, Ball.exact(total))
    bounds = certify_vectors(problem, wrong, Ball.exact(total))
    sliding = lengths(good.slips) > 0
    assert not (bounds.sliding & ~sliding).any()
    assert not (bounds.partial & sliding).any()
    assert (lengths(q - good.increments) <= bounds.increments + known.increments).all()
    assert (lengths(wrong.slips - good.slips) <= bounds.slips + known.slips).all()
    moved = np.hypot(*(displacement - good.displacement))
    assert moved <= bounds.displacement_error + known.displacement_error


@settings(max_examples=15, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 6),
    st.sampled_from([0.3, 0.9, 2.5]),
    st.one_of(st.floats(1e-12, 0.999), st.floats(-13, -3).map(lambda x: 1 - 10**x)),
    st.floats(0, 0.5),
    st.floats(0, 2 * np.pi),
)
def test_statuses_and_bounds_against_exact_states(
    seed: int, count: int, crowding: float, fraction: float, nu: float, angle: float
) -> None:
    """Overlapping discs and the last parts of gross sliding included."""
    scene, approach = scattered(seed, count, crowding, 0.3)
    contact = cr.press(with_friction(scene, nu=nu), approach=approach)
    if contact.load == 0:
        return
    force = fraction * FRICTION * contact.load * np.array([np.cos(angle), np.sin(angle)])
    try:
        full = solve_exactly(scene, approach=approach, start=contact.loads, digits=60)
        audit_vectors("usual", contact, full, force, Tally())
    except (NotProved, cr.SolverError):
        return  # neither the oracle nor Newton's method is on trial


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", VECTOR_NAMES)
@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_bounds_are_sharp_up_to_where_all_slide(name: str, nu: float) -> None:
    for fraction, most in ((1e-9, 2e-12), (0.5, 2e-12), (0.99, 2e-12), (0.9999, 1e-10)):
        state = found(name, nu, fraction)
        largest, travel = lengths(state.forces).max(), np.hypot(*state.displacement)
        assert state.certificate.force_errors.max() < most * largest
        assert state.certificate.displacement_error < 1e4 * most * travel


@pytest.mark.sample(2)
@pytest.mark.parametrize("digits", [3, 8])
@pytest.mark.parametrize("fraction", [1e-6, 0.37, 0.99])
def test_doubt_about_the_loads_is_counted(fraction: float, digits: int) -> None:
    """Friction starts from balls that hold the true loads, however the loads were rounded."""
    contact = pressed("paper")
    doubtful = in_doubt(contact, digits)
    force = fraction * FRICTION * contact.load
    truth, state = shear_vector(contact, force=force), shear_vector(doubtful, force=force)
    known = state.certificate
    assert known.all_proved
    assert (lengths(state.forces - truth.forces) <= known.force_errors).all()
    assert (state.status == truth.status).all()


@pytest.mark.sample(2)
@pytest.mark.parametrize("count", [1, 2, 3, 5])
@pytest.mark.parametrize("fraction", [1 - 1e-6, 1 - 1e-9, 1 - 1e-11])
def test_the_last_one_is_proved_to_stick(count: int, fraction: float) -> None:
    """Without Poisson's ratio nothing turns, so that below f P not all slide."""
    scene, approach = scattered(count, count, 0.5, 0.1)
    contact = cr.press(with_friction(scene, nu=0.0), approach=approach)
    state = shear_vector(contact, force=fraction * FRICTION * contact.load * np.array([0.6, 0.8]))
    assert (state.status == "partial").sum() == 1
    assert (state.status == "sliding").sum() == (contact.loads > 0).sum() - 1


def test_the_last_one_is_not_said_to_stick_where_all_slide() -> None:
    """With it forces turn, and all slide a little below f P: nobody may be said to stick there.

    Forces that turn as little as here come nearest to a wrong word.
    """
    all_slide = 0
    for seed in range(4):
        scene, approach = scattered(seed, 2 + seed % 3, 0.6, 0.3)
        contact = cr.press(with_friction(scene, nu=0.02), approach=approach)
        for missing in 10.0 ** np.arange(-12, -2, 1.0):
            force = (1 - missing) * FRICTION * contact.load
            try:
                state = shear_vector(contact, force=force * np.array([0.6, 0.8]))
            except cr.SolverError:
                continue  # so near to gross sliding Newton's method may say that it has no answer
            slides = lengths(state.slips) > 0
            all_slide += bool(slides[contact.loads > 0].all())
            assert not (state.status[slides] == "partial").any()
    assert all_slide > 5


@settings(max_examples=8, deadline=None)
@given(random_scenes(crowding=0.9), st.floats(1e-3, 0.999), st.floats(0, 0.5))
def test_the_duality_gap_bounds_what_forces_cost_too_much(
    sampled: tuple[cr.Scene, float], fraction: float, nu: float
) -> None:
    scene, approach = sampled
    contact = cr.press(with_friction(scene, nu=nu), approach=approach)
    if contact.load == 0 or contact.certificate.scope == "none":
        return
    problem = contact.cached(FrictionProblem)
    total = np.array([fraction * problem.loads.sum(), 0.0])

    def energy(state: VectorState) -> float:
        return problem.energy(state.increments, problem.couple(state.increments))

    def duality_gap(state: VectorState) -> float:
        return certify_vectors(problem, state, Ball.exact(total)).excess

    best = FrictionNewton().solve(problem, total)
    least = energy(best)
    assert 0 <= duality_gap(best) <= 1e-11 * least
    short = best._replace(increments=0.99 * best.increments)
    assert duality_gap(short) > 5e-3 * least  # 1 % of the total is missing
    # Forces in proportion to the loads are borne too, and have the right total.
    other = best._replace(increments=fraction * np.outer(problem.loads, [1.0, 0.0]))
    for scale in (0.5, 1.0, 2.0):
        moved = other._replace(displacement=scale * best.displacement)
        assert duality_gap(moved) >= (energy(other) - least) * (1 - 1e-9) - 1e-11 * least
