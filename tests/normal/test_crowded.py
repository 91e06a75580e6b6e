"""Crowded contacts: what is fixed open, overlapping shells, and what other solutions are like."""

import itertools
from typing import Any

import multiprecision
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scenes import OPERATORS, hexagonal, on_sphere, operators, solve_exactly
from status_audit import assert_honest, excess

import convexrough as cr
from convexrough.arithmetic.pairs import Pair
from convexrough.bench.scenes import scene as bench
from convexrough.contact import levels_of
from convexrough.convex.definite import proved_sparse_margin
from convexrough.influence import Kind
from convexrough.influence.coupling import inverse_distances
from convexrough.influence.dense import DenseInfluence
from convexrough.normal.boxes import CROWDED_MARGINS, overlapping_margin, overlaps
from convexrough.normal.problem import NormalProblem
from convexrough.normal.proved import solution_in
from convexrough.normal.refine import trial
from convexrough.solvers import Newton


def random_points(seed: int, count: int, size: float = 1.0) -> cr.Scene:
    """Asperities with no least distance; size 1 is the paper's."""
    rng = np.random.default_rng(seed)
    r, angle = 0.01 * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    points = np.column_stack((r * np.cos(angle), r * np.sin(angle)))
    tips = size * 0.02 * np.sqrt(61 / count) * rng.lognormal(0, 0.2, count)
    return on_sphere(points, tips, friction=0.5)


@settings(max_examples=40, deadline=None)
@example(234, 2, 2.0, "dense", -11.0)  # a load just beyond the box where the energy is convex
@example(350, 10, 2.0, "dense", -3.0)  # asperities that are fixed open, and loads on them
@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 20),
    st.floats(0.2, 4.0),
    st.sampled_from(OPERATORS),
    st.floats(-17, -3),
)
def test_random_points_are_judged_honestly(
    seed: int, count: int, size: float, kind: Kind, digits: float
) -> None:
    """Against the exact solution next to the loads, whatever these are off by; energies too."""
    scene = random_points(seed, count, size)
    if kind not in operators(scene):
        return
    contact = cr.press(scene, approach=5e-5, influence=kind)
    off = 10.0**digits * np.random.default_rng(seed).standard_normal(count)
    wrong = np.where(contact.loads > 0, contact.loads * (1 + off), np.abs(off) * contact.load)
    for control in ({"approach": 5e-5}, {"load": contact.load}):
        judged = cr.certify(scene, wrong, **control, influence=kind)
        try:
            exact = solve_exactly(scene, **control, start=contact.loads + 1e-30 * contact.load)
        except multiprecision.NotProved:
            continue
        near = multiprecision.off(contact.loads, exact.loads).max() < 1e-9 * contact.load
        if judged.scope == "none" or not (near or judged.scope == "global"):
            continue  # the exact one is another solution
        assert_honest(judged, wrong, exact)
        if "approach" in control:
            assert excess(scene, wrong, exact) <= judged.duality_gap
            assert digits > -10 or judged.duality_gap < 1e-9 * 5e-5 * contact.load


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(6))
def test_random_points_are_proved(seed: int) -> None:
    """Through a matrix and through a mesh: what used to be undecided is decided."""
    scene = random_points(seed, 300)
    for kind in ("dense", "scattered"):
        contact = cr.press(scene, approach=5e-5, influence=kind)
        certificate = contact.certificate
        assert contact.crowding > 1.5
        assert certificate.scope == "local"
        assert certificate.all_proved
        assert certificate.fixed_open == (contact.status == "open").sum()
        assert certificate.load_error < 1e-6 * contact.loads.max()
        assert "fixed open" in certificate.meaning


def test_a_box_that_fixes_an_asperity_open_holds_no_load_on_it() -> None:
    known = levels_of(cr.press(random_points(0, 300), approach=5e-5)).top
    problem, box, state = known.problem, known.box, known.trial
    assert solution_in(problem, box, state)[0]
    loads = state.loads.high.copy()
    loads[np.flatnonzero(box.fixed_open)[0]] = 1e-30 * loads.max()
    spoiled = trial(problem, Pair.exact(loads), state.missing, problem.product(Pair.exact(loads)))
    assert not solution_in(problem, box, spoiled)[0]


def all_states(scene: cr.Scene, approach: float) -> list[Any]:
    """Every solution, by every set of asperities that might touch."""
    found = []
    for many in range(len(scene) + 1):
        for touching in itertools.combinations(range(len(scene)), many):
            start = np.zeros(len(scene))
            start[list(touching)] = 1e-8
            try:
                exact = solve_exactly(scene, approach=approach, start=start)
            except multiprecision.NotProved:
                continue
            loads = np.array([float(load) for load in exact.loads])
            if all(np.abs(loads - other).max() > 1e-12 for other in found):
                found.append(loads)
    return found


@pytest.mark.parametrize("distance", [2e-4, 4e-4, 6e-4, 1e-3])
def test_other_solutions_are_as_the_certificate_says(distance: float) -> None:
    """Twins, where there are two or three solutions: each is judged, and says true things."""
    points = np.array([[0.0, 0.0], [distance, 0.0], [3e-3, 0.0]])
    scene, approach = on_sphere(points), 5e-5
    states = all_states(scene, approach)
    assert states
    inverse = inverse_distances(points, points)
    nearest = 1 / inverse.max(axis=1)
    given = [(mine, cr.certify(scene, mine, approach=approach)) for mine in states]
    proved = [(mine, judged) for mine, judged in given if judged.scope != "none"]
    assert proved or distance == 4e-4  # crowding just above pi: only both touching is found
    for mine, judged in proved:
        assert judged.scope == "local" or len(states) == 1
        for other in states:
            if np.abs(other - mine).max() < 1e-12:
                continue
            radii = np.cbrt(0.75 * other * scene.relative_radii)
            crowding = float((np.add.outer(radii, radii) * inverse).max())
            assert crowding > judged.other_solutions_crowding
            assert not judged.other_solutions_cover or (radii > nearest).any()


@pytest.mark.parametrize("load", [0.0, 1e-12])
def test_loads_at_the_bounds_of_their_ranges_prove_nothing(load: float) -> None:
    """Small loads lie in a box where the energy is convex, but least where loads are at bounds."""
    scene, approach = on_sphere([[0, 0], [5.7e-4, 0]], heights=[-1.5e-5, 0.0]), 5e-5
    (only,) = all_states(scene, approach)
    assert only[0] == 0 < only[1]
    given = np.full(2, load)
    exact = solve_exactly(scene, approach=approach, start=only)
    assert_honest(cr.certify(scene, given, approach=approach), given, exact)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 120), st.floats(0.05, 4.0))
def test_overlapping_shells(seed: int, count: int, width: float) -> None:
    """H^-1/2 (H + A) H^-1/2 >= S for any radii, and what is proved is below the least of it."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 2))
    lengths = rng.lognormal(0, 0.5, count) * 0.3 / np.sqrt(count)
    radii = width * lengths * rng.lognormal(0, 0.5, count)
    radii[: count // 20] *= 10.0
    pairs = overlaps(points, lengths, radii)
    if pairs is None:
        return
    indices, values, _ = pairs
    apart = np.hypot(*(points[:, None] - points).transpose(2, 0, 1))
    meet = np.triu(np.add.outer(radii, radii) > apart, 1)
    assert len(indices[0]) == len(indices[1]) == meet.sum()
    assert (meet | meet.T)[indices].all()
    S = np.diag(1 - lengths / radii)
    S[indices] = S[indices[::-1]] = values
    A, root = DenseInfluence.assemble(points, 1.0), np.sqrt(lengths)
    hessian = np.eye(count) + root[:, None] * A.matrix * root
    assert np.linalg.eigvalsh(hessian - S)[0] >= -1e-12 * hessian.max()
    least = float(np.linalg.eigvalsh(hessian)[0])
    assert overlapping_margin(A, lengths, CROWDED_MARGINS) <= max(least, 0.0)


def test_an_isolated_pair_is_proved_up_to_pi() -> None:
    A = DenseInfluence.assemble(np.array([[0.0, 0.0], [1.0, 0.0]]), 1.0)
    for crowding, proved in ((1.6, True), (3.0, True), (3.13, True), (np.pi, False), (3.2, False)):
        lengths = np.full(2, crowding / np.pi)
        assert (overlapping_margin(A, lengths, CROWDED_MARGINS) > 0) == proved


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.floats(-0.2, 0.6))
def test_sparse_elimination_proves_no_more_than_is_true(seed: int, count: int, lift: float) -> None:
    rng = np.random.default_rng(seed)
    full = np.triu(rng.normal(0, 0.3, (count, count)) * (rng.random((count, count)) < 0.1), 1)
    which, matrix = np.nonzero(full), full + full.T
    diagonal = np.full(count, lift - float(np.linalg.eigvalsh(matrix)[0]))
    errors = np.full(len(which[0]), 1e-5)
    proved = proved_sparse_margin(diagonal, which, full[which], CROWDED_MARGINS, errors)
    assert proved <= max(lift, 0.0)
    perturbed = lift - 1e-5 * float((matrix != 0).sum(axis=1).max())
    assert proved >= 0.4 * perturbed or perturbed < 3e-4 or proved == CROWDED_MARGINS[-1]


def test_lattices_exclude_more_other_solutions() -> None:
    """Where shells of the secants meet, the lattice may still say that there is one solution."""
    rng, by_lattice = np.random.default_rng(3), 0
    for size in np.linspace(3.0, 8.0, 11):
        scene = hexagonal(tip_radius=0.02 * size)
        problem = NormalProblem.assemble(scene, approach=1e-4, influence="lattice")
        loads, most = Newton().solve(problem).loads, problem.bounds(problem.approach_bound)
        found, A = cr.press(scene, approach=1e-4, influence="lattice"), problem.influence
        only = found.certificate.scope == "global"
        secant = problem.coefficients * (np.cbrt(most) ** 2 - np.cbrt(loads) ** 2) / (most - loads)
        if A.crowding(A.scale / secant) <= 1:
            assert only
            continue
        if not only:
            continue
        by_lattice += 1
        for Q in (most, *(most * rng.random((20, len(most))))):
            secant = problem.coefficients * (np.cbrt(Q) ** 2 - np.cbrt(loads) ** 2) / (Q - loads)
            assert np.linalg.eigvalsh(np.diag(secant) + A.matrix)[0] > 0
    assert 2 <= by_lattice < 11


def test_eight_thousand_on_a_lattice_have_one_solution() -> None:
    """Shells that do not overlap show it of a third as many; three times as many are too many."""
    smaller = cr.press(bench("lattice", 12.0), approach=5e-5)
    assert smaller.certificate.scope == "global"
    assert smaller.certificate.meaning == "the only solution"
    larger = cr.press(bench("lattice", 20.0), approach=5e-5)
    assert larger.certificate.scope == "local"


def test_poor_loads_of_a_prescribed_total_do_not_exclude_another_solution() -> None:
    """Of a crowded pair far from a bank of asperities either one can touch.

    The bound on the approach took the displacement of other loads than its weights.
    """
    bank = cr.Asperities.hexagonal(spacing=1.0, tip_radius=0.4, within=1.9).positions
    assert len(bank) == 13
    apart, far = 1e-2, 1e4
    loads = cr.press(on_sphere(bank, 0.4, radius=np.inf), approach=1.0).loads
    tips = (2.28 * apart) ** 2 / 0.5, (2.65 * apart) ** 2 / 0.475
    points = [*bank, (far, 0), (far + apart, 0), (-far, far)]
    heights = [0.0] * 13 + [-0.5, -0.525, -1.02]
    scene = on_sphere(points, [0.4] * 13 + [*tips, 0.4], heights, radius=np.inf)
    one = np.append(loads, [4 / 3 * np.sqrt(tips[0]) * 0.5**1.5, 0, 0])
    two = np.append(loads, [0, 4 / 3 * np.sqrt(tips[1]) * 0.475**1.5, 0])
    total = float(one.sum())
    poor = 0.05 * one
    poor[-1] = 0.95 * total
    found = [cr.certify(scene, each, load=total) for each in (poor, one, two)]
    assert [each.scope for each in found] == ["local"] * 3
    assert found[1].status[13] == found[2].status[14] == "contact"
    assert found[1].status[14] == found[2].status[13] == "open"
