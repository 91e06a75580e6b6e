"""The normal problem: derivatives, bounds, convexity, and contacts with known answers."""

from typing import Any

import multiprecision
import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scenes import (
    MATERIAL,
    OPERATORS,
    PAPER_APPROACH,
    on_lattice,
    operators,
    paper,
    random_cases,
    scattered,
)

import convexrough as cr
from convexrough.convex.newton import descend
from convexrough.influence import Kind
from convexrough.normal.load_control import highest_approach
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import Newton
from convexrough.solvers.pressing import Pressing
from convexrough.sphere import hertz

Case = tuple[cr.Scene, float, Kind]


def assembled(scene: cr.Scene, **control: Any) -> NormalProblem:
    return NormalProblem.assemble(scene, **control)


def test_screening_drops_only_those_that_cannot_touch() -> None:
    problem = assembled(paper(), approach=PAPER_APPROACH)
    assert len(problem) == 61  # the ring at 4 spacings lies at D = 0 to rounding, and is kept
    problem = assembled(paper(), approach=1e-5)
    inside = paper().asperities.distances < np.sqrt(2e-5)
    assert set(problem.candidates) == set(np.flatnonzero(inside))


@settings(max_examples=20, deadline=None)
@given(random_cases(crowding=1.5))
def test_a_priori_bounds(sampled: Case) -> None:
    """No solution carries more than an asperity would alone; no load, a higher approach."""
    scene, approach, kind = sampled
    contact = cr.press(scene, approach=approach)
    problem = assembled(scene, approach=approach, influence=kind)
    bounds = problem.bounds(problem.approach_bound) * problem.units.force
    assert (contact.loads[problem.candidates] <= bounds).all()
    if contact.load > 0:
        assert highest_approach(scene, contact.load, kind) >= approach * (1 - 1e-12)
        controlled = assembled(scene, load=contact.load, influence=kind)
        touching = np.flatnonzero(contact.loads)
        assert set(touching) <= set(controlled.candidates)


@settings(max_examples=20, deadline=None)
@given(random_cases(crowding=1.5), st.integers(0, 2**32 - 1))
def test_the_approach_bound_holds_for_any_weights(sampled: Case, seed: int) -> None:
    scene, approach, kind = sampled
    contact = cr.press(scene, approach=approach)
    if contact.load == 0:
        return
    problem = assembled(scene, load=contact.load, influence=kind)
    weights = np.random.default_rng(seed).random(len(problem)) ** 9
    bound = problem.overhang(weights, problem.influence.apply(weights))
    assert bound * problem.units.length >= approach * (1 - 1e-12)


@settings(max_examples=25, deadline=None)
@given(random_cases(crowding=2.0), st.floats(0.01, 1))
def test_convexity_number(sampled: Case, size: float) -> None:
    """The smallest eigenvalue of the scaled Hessian is at least 1 - theta."""
    scene, approach, kind = sampled
    problem = assembled(scene, approach=approach, influence=kind)
    if len(problem) == 0:
        return
    loads = problem.bounds(problem.approach_bound) * size
    root = 1 / np.sqrt(problem.stiffness(loads))
    hessian = np.eye(len(problem)) + root[:, None] * problem.influence.matrix * root
    theta = problem.convexity_number(loads)
    assert np.linalg.eigvalsh(hessian)[0] >= 1 - theta - 1e-12
    # theta is 2 a / (pi s), in the words of the contact radius.
    radii = hertz.contact_radius(
        problem.to_scene(loads) * problem.units.force,
        scene.material.contact_modulus,
        scene.relative_radii,
    )[problem.candidates]
    points = scene.contact_points[problem.candidates]
    apart = np.hypot(*(points[:, None] - points).T)
    np.fill_diagonal(apart, np.inf)
    true = float((4 * radii / np.pi / apart.min(axis=0)).max())
    assert theta >= true * (1 - 1e-9)
    if kind == "dense":  # a lattice takes its spacing for every distance to the nearest
        assert theta == pytest.approx(true, rel=1e-9)


@settings(max_examples=15, deadline=None)
@given(random_cases(crowding=0.99), st.integers(0, 2**32 - 1), st.floats(-6, 3))
def test_newton_converges_from_any_start(sampled: Case, seed: int, size: float) -> None:
    """On every convex scene, to the same answer."""
    scene, approach, kind = sampled
    contact = cr.press(scene, approach=approach)
    if contact.certificate.scope != "global" or contact.load == 0:
        return
    rng = np.random.default_rng(seed)
    start = contact.load * 10**size * rng.random(len(scene)) ** rng.uniform(0, 9)
    start *= rng.random(len(scene)) < rng.random()
    for control in ({"approach": approach}, {"load": contact.load}):
        again = cr.press(scene, start=start, influence=kind, **control)
        assert_allclose(again.loads, contact.loads, rtol=1e-9, atol=1e-12 * contact.loads.max())


#: Dense alone where the points are scattered; on a lattice, every operator.
CROWDED = [(scattered, "dense"), *((on_lattice, kind) for kind in OPERATORS)]


@pytest.mark.parametrize(("make", "kind"), CROWDED)
def test_newton_descends_where_the_energy_is_not_convex(make: Any, kind: Kind) -> None:
    """Overlapping discs: the contact law still holds at the answer, which is only local."""
    scene, approach = make(5, 30, 3.0, 0.2)
    problem = assembled(scene, approach=approach, influence=kind)
    solution = Newton().solve(problem)
    assert solution.residual < 1e-12
    contact = cr.press(scene, approach=approach, influence=kind)
    assert contact.certificate.scope != "global"


@pytest.mark.parametrize(("make", "kind"), CROWDED)
def test_every_newton_step_lowers_the_energy(make: Any, kind: Kind) -> None:
    """Also from bad starts on scenes far from convex, where full steps would not."""
    for seed in range(10):
        scene, approach = make(seed, 20, 4.0, 0.5)
        problem = assembled(scene, approach=approach, influence=kind)
        rng = np.random.default_rng(seed)
        start = problem.bounds(problem.approach_bound) * rng.random(len(problem)) ** 3
        law = Pressing(problem, float(np.abs(problem.offsets).max()))
        state = law.evaluate(hertz.indentation(start, problem.coefficients))
        for _ in range(12):
            following = descend(law, state, law.direction(state, 0.0))
            assert following.energy <= state.energy + 1e-12 * abs(state.energy)
            state = following


@pytest.mark.parametrize("kind", operators(paper()))
def test_the_residual_is_not_below_the_truth(kind: Kind) -> None:
    """Of loads known to thirty digits it is a bound, and else what float64 makes of the loads."""
    scene = paper()
    problem = assembled(scene, approach=PAPER_APPROACH, influence=kind)
    solution = Newton().solve(problem)
    if solution.trial is None:
        assert solution.residual == problem.residual(solution.loads, solution.approach)
    else:
        loads = solution.trial.loads
        with ctx.workdps(60):
            force = arb(problem.units.force)
            exact = np.full(len(scene), arb(0))
            exact[problem.candidates] = [
                force * (arb(float(high)) + arb(float(low)))
                for high, low in zip(*loads, strict=True)
            ]
            gap = multiprecision.gaps(scene, exact, arb(PAPER_APPROACH), problem.candidates)
            wrong = [abs(g) if P > 0 else -g for g, P in zip(gap, loads.high, strict=True)]
            truth = float(max(wrong) / arb(problem.units.length))
        assert truth <= solution.residual <= 1e-22 * problem.approach_bound
    assert problem.residual(solution.loads * 1.01, solution.approach) > 1e-3


def test_memory_is_asked_before_it_is_taken() -> None:
    asperities = cr.Asperities.hexagonal(spacing=2e-5, tip_radius=1e-4, within=0.0102)
    scene = cr.Scene(1.0, asperities, MATERIAL, geometry="summit")
    with pytest.raises(cr.InputError, match=r"asperities that could touch: found 9\.07e\+05"):
        cr.press(scene, approach=PAPER_APPROACH, influence="dense")
