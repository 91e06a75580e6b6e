"""Vector friction: states, as a cone program, and statuses and bounds under attack."""

import re
from functools import cache
from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, in_doubt, lengths, pressed, shaded, with_friction
from hypothesis import given, settings
from hypothesis import strategies as st
from multiprecision import NotProved
from numpy.testing import assert_allclose
from scenes import PAPER_APPROACH, hexagonal, random_scenes, scattered, solve_exactly
from status_audit import ATTACKS, Tally, attack, audit_vectors

import convexrough as cr
from convexrough import FrictionConic, FrictionNewton, VectorShearState, shear_vector
from convexrough.arithmetic.balls import Ball
from convexrough.vector_shear import cones
from convexrough.vector_shear.certificate import certify_vectors
from convexrough.vector_shear.problem import FrictionProblem, VectorState

FRACTIONS = [1e-9, 1e-3, 0.1, 0.3, 0.5, 0.8, 0.99]
NAMES = ["paper", "rough", "steel", "rough, closest"]


@cache
def contact_of(scene: str | float, nu: float) -> cr.Contact:
    """A scene by its name, or the paper's with tips of this radius."""
    if isinstance(scene, str):
        return pressed(scene, nu=nu)
    return cr.press(with_friction(hexagonal(tip_radius=scene), nu=nu), approach=PAPER_APPROACH)


@cache
def found(scene: str | float, nu: float, fraction: float, conic: bool = False) -> VectorShearState:
    contact, solver = contact_of(scene, nu), FrictionConic() if conic else None
    return shear_vector(contact, force=fraction * FRICTION * contact.load, solver=solver)


@pytest.mark.parametrize("fraction", [*FRACTIONS, 0.9999, 1 - 1e-9, 1.0])
@pytest.mark.parametrize("name", NAMES)
def test_without_poissons_ratio_it_is_ciavarella_and_jaeger(name: str, fraction: float) -> None:
    contact = pressed(name, nu=0.0)
    force = fraction * FRICTION * contact.load
    state, scalar = shear_vector(contact, force=force), cr.shear(contact, force=force)
    assert_allclose(state.forces[:, 0], scalar.forces, rtol=1e-10)
    assert (state.forces[:, 1] == 0).all()
    assert state.disagreement < 1e-10
    close = 1e-10 if fraction < 1 else 1e-13
    assert_allclose(state.displacement, [scalar.displacement, 0.0], rtol=close)
    atol = close * scalar.displacement
    assert_allclose(state.slips[:, 0], scalar.slips, rtol=10 * close, atol=atol)
    assert_allclose(state.stick_radii, scalar.stick_radii, rtol=1e-6)
    assert set(state.status[contact.loads == 0]) == {"open"}
    if fraction < 1:  # below f P not all slide
        assert (state.status == scalar.status).all()
        nearly = shear_vector(contact, force=(1 - 1e-11) * FRICTION * contact.load)
        assert (nearly.status == "partial").sum() == 1


@pytest.mark.parametrize(
    ("nu", "fraction", "forces", "transverse", "travel", "sliding"),
    [
        (0.3, 0.5, 0.0272, 0.0128, 1.21373, 6),
        (0.3, 0.8, 0.0228, 0.0169, 1.21375, 18),
        (0.5, 0.5, 0.0526, 0.0245, 1.49751, 6),
        (0.5, 0.8, 0.0441, 0.0323, 1.49760, 18),
    ],
)
def test_the_error_of_the_papers_assumption(
    nu: float, fraction: float, forces: float, transverse: float, travel: float, sliding: int
) -> None:
    """The numbers of docs/theory/vector-friction.md, for the paper's scene."""
    contact, state = pressed("paper", nu=nu), found("paper", nu, fraction)
    assert state.disagreement == pytest.approx(forces, abs=6e-5)
    largest = FRICTION * contact.loads.max()
    assert np.abs(state.forces[:, 1]).max() / largest == pytest.approx(transverse, rel=0.02)
    reference = cr.shear(pressed("paper", nu=0.0), force=fraction * FRICTION * contact.load)
    assert state.displacement[0] / reference.displacement == pytest.approx(travel, abs=6e-6)
    assert (state.status == "sliding").sum() == sliding
    assert state.certificate.all_proved
    assert state.iterations <= 6


@pytest.mark.parametrize("nu", [0.3, 0.5])
@pytest.mark.parametrize("fraction", [0.99, 0.999, 0.9999, 1 - 1e-6, 1 - 1e-9, 1 - 1e-12])
def test_close_to_gross_sliding(fraction: float, nu: float) -> None:
    """All slide before Q = f P: then forces only turn, and the displacement grows as 1 / root."""
    state = found("paper", nu, fraction)
    assert state.residual < 1e-10
    if fraction >= 0.9999:
        assert (lengths(state.slips) > 0).sum() == 37
        assert not (state.status == "partial").any()
        assert (state.status == "sliding").sum() >= 30
    if fraction == 1 - 1e-9:
        farther = found("paper", nu, 1 - 1e-11)
        ratio = farther.displacement[0] / state.displacement[0]
        assert ratio == pytest.approx(10.0, rel=1e-2)


def test_gross_sliding() -> None:
    """At f P itself only a displacement without bounds would turn all forces along Q."""
    contact = pressed("paper")
    state = found("paper", 0.3, 1.0)
    assert_allclose(state.forces[:, 0], FRICTION * contact.loads, rtol=1e-14)
    assert (state.forces[:, 1] == 0).all()
    assert state.displacement[0] == np.inf
    assert state.displacement[1] == 0
    assert state.residual == state.duality_gap == np.inf
    assert (state.status[contact.loads > 0] == "sliding").all()
    assert state.certificate.all_proved
    assert found("paper", 0.0, 1.0).residual < 1e-13
    for off in (-8, 8):
        rounded = shear_vector(contact, force=state.force * (1 + off * 2.0**-53))
        assert rounded.force.tolist() == state.force.tolist()
        assert (rounded.status[contact.loads > 0] == "sliding").all()


def test_where_order_fails_it_disagrees_with_what_shear_returns() -> None:
    contact = cr.press(shaded(), load=2.96)
    force = 0.15 * contact.load  # 0.3 f P
    state, other = shear_vector(contact, force=force), cr.shear(contact, force=force)
    assert other.order == "fails"
    apart = np.linalg.norm(state.forces - np.outer(other.forces, [1, 0]))
    assert_allclose(state.disagreement, apart / np.linalg.norm(other.forces), rtol=1e-12)


@pytest.mark.parametrize("fraction", [1e-40, *FRACTIONS, 0.9999])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_cones_and_newton_agree(nu: float, fraction: float) -> None:
    """On the paper's scene; and the multipliers of the friction cones are the slips."""
    newton, conic = found("paper", nu, fraction), found("paper", nu, fraction, True)
    size = lengths(newton.forces).max()
    assert lengths(newton.forces - conic.forces).max() < 1e-6 * size
    travel = newton.displacement[0]
    # What Clarabel leaves of the total moves X by more, the nearer gross sliding is.
    tolerance = 1e-10 if 0.6 < fraction < 0.9 else 1e-7 if fraction < 0.99 else 1e-6
    assert lengths(newton.slips - conic.slips).max() < tolerance * travel
    within = dict(rtol=max(tolerance, 1e-7), atol=max(tolerance, 1e-7) * travel)
    assert_allclose(newton.displacement, conic.displacement, **within)
    assert (newton.status == conic.status).all()
    assert (newton.solver, conic.solver) == ("newton", "conic")


@pytest.mark.parametrize("fraction", [1e-6, 0.2, 0.5, 0.9])
@pytest.mark.parametrize("tip_radius", [0.3, 0.5])
def test_five_cones(tip_radius: float, fraction: float) -> None:
    assert 21 / 25 < contact_of(tip_radius, 0.5).cached(FrictionProblem).share < 1
    newton, conic = (found(tip_radius, 0.5, fraction, each) for each in (False, True))
    assert lengths(newton.forces - conic.forces).max() < 1e-6 * lengths(newton.forces).max()


def test_too_dense_for_a_convex_program() -> None:
    contact = contact_of(5.0, 0.5)
    assert contact.crowding > 1
    force = 0.1 * FRICTION * contact.load
    expected = (
        r"too dense.* is 1\.\d+ of the local compliance.*convexity numbers.*: \d+ \(\d\.\d+\), "
    )
    with pytest.raises(cr.SolverError, match=expected) as caught:
        shear_vector(contact, force=force, solver=FrictionConic())
    named = re.findall(r"(\d+) \((\d\.\d+)\)", str(caught.value))
    worst = np.array([int(index) for index, _ in named])
    numbers = contact.contact_radii / (np.pi / 4 * 0.0025)
    assert_allclose([float(number) for _, number in named], numbers[worst], rtol=1e-3)
    assert numbers[worst[0]] == numbers.max()


def test_an_answer_is_judged_and_not_the_word_of_its_solver(monkeypatch: Any) -> None:
    honest = cones.run_clarabel

    def boastful(*arguments: Any, **settings: Any) -> Any:
        raw = honest(*arguments, **settings)
        return raw._replace(x=1.01 * raw.x, status="Solved")

    monkeypatch.setattr(cones, "run_clarabel", boastful)
    contact = pressed("paper")
    with pytest.raises(cr.SolverError, match="with Solved"):
        shear_vector(contact, force=0.5 * FRICTION * contact.load, solver=FrictionConic())


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


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_bounds_are_sharp_up_to_where_all_slide(name: str, nu: float) -> None:
    for fraction, most in ((1e-9, 2e-12), (0.5, 2e-12), (0.99, 2e-12), (0.9999, 1e-10)):
        state = found(name, nu, fraction)
        largest, travel = lengths(state.forces).max(), np.hypot(*state.displacement)
        assert state.certificate.force_errors.max() < most * largest
        assert state.certificate.displacement_error < 1e4 * most * travel


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


def test_the_last_one_is_not_said_to_stick_where_all_slide() -> None:
    """With Poisson's ratio forces turn, and all slide a little below f P.

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
@given(random_scenes(crowding=0.9), st.floats(1e-3, 0.999) | st.just(1 - 1e-10), st.floats(0, 0.5))
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
    lacking = np.abs(problem.loads - lengths(best.increments))
    assert duality_gap(best) >= 0.9 * lengths(best.slips) @ lacking  # by rounding
    assert 0 <= duality_gap(best) <= 1e-11 * least
    short = best._replace(increments=0.99 * best.increments)
    assert duality_gap(short) > 5e-3 * least  # 1 % of the total is missing
    # Forces in proportion to the loads are borne too, and have the right total.
    other = best._replace(increments=fraction * np.outer(problem.loads, [1.0, 0.0]))
    for scale in (0.5, 1.0, 2.0):
        moved = other._replace(displacement=scale * best.displacement)
        assert duality_gap(moved) >= (energy(other) - least) * (1 - 1e-9) - 1e-11 * least
