"""The certificate under attack: whatever it is given, no status and no bound may be wrong.

Also of crowded contacts: what is fixed open, overlapping shells, what other solutions are like.
"""

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import multiprecision
import numpy as np
import pytest
import scenes
from hypothesis import example, given, settings
from hypothesis import strategies as st
from status_audit import ATTACKS, assert_honest, attack, excess

import convexrough as cr
from convexrough.arithmetic.pairs import Pair
from convexrough.contact import levels_of
from convexrough.convex.definite import proved_sparse_margin
from convexrough.influence.coupling import Kind, inverse_distances
from convexrough.influence.dense import DenseInfluence
from convexrough.normal import boxes
from convexrough.normal.problem import NormalProblem
from convexrough.normal.proved import proved, solution_in
from convexrough.normal.refine import trial, trial_of
from convexrough.solvers import Newton


def judged(
    scene: cr.Scene,
    loads: Any,
    operator: Kind | None = None,
    exactly: Callable[..., Any] = scenes.reference,
    **control: float,
) -> cr.Certificate:
    """What is said of these loads, and true."""
    found = cr.certify(scene, loads, influence=operator, **control)
    if found.scope == "none":
        assert (found.status == "undecided").all()
        assert np.isinf([found.load_errors, found.gap_errors]).all()
        assert found.approach_error == (np.inf if "load" in control else 0.0)
    else:
        assert_honest(found, loads, exactly(scene, **control))
    return found


@pytest.mark.sample(6)
@pytest.mark.parametrize("kind", ATTACKS)
@pytest.mark.parametrize(("name", "operator"), scenes.CASES)
def test_attacks_on_known_scenes(name: str, operator: Kind, kind: str) -> None:
    scene, approach = scenes.EVERY[name]
    contact = cr.press(scene, approach=approach)
    for seed in range(3):
        wrong = attack(kind, contact.loads, np.random.default_rng(seed))
        judged(scene, wrong, operator, approach=approach)
        if wrong.any():
            judged(scene, wrong, operator, load=contact.load)


@pytest.mark.sample(2)
@pytest.mark.parametrize("kind", ATTACKS)
@pytest.mark.parametrize("operator", scenes.OPERATORS)
def test_attacks_on_a_local_certificate(operator: Kind, kind: str) -> None:
    """Where only a box is convex: loads outside it must not be proved, nor their neighbours."""
    scene = scenes.hexagonal(0.0012, 0.2)
    contact = cr.press(scene, approach=scenes.PAPER_APPROACH, influence="dense")
    assert contact.certificate.scope == "local"
    for seed in range(4):
        wrong = attack(kind, contact.loads, np.random.default_rng(seed))
        certificate = cr.certify(scene, wrong, approach=scenes.PAPER_APPROACH, influence=operator)
        assert kind != "none" or certificate.scope == "local"
        if certificate.scope == "none":
            continue
        slack = 2 * contact.certificate.load_error
        assert (np.abs(wrong - contact.loads) <= certificate.load_errors + slack).all()
        assert not ((certificate.status == "open") & (contact.status == "contact")).any()
        assert not ((certificate.status == "contact") & (contact.status == "open")).any()


@settings(max_examples=12, deadline=None)
@given(
    scenes.random_cases(crowding=1.2, most=10), st.sampled_from(ATTACKS), st.integers(0, 2**32 - 1)
)
def test_attacks_on_random_scenes(sampled: Any, kind: str, seed: int) -> None:
    scene, approach, operator = sampled
    contact = cr.press(scene, approach=approach)
    wrong = attack(kind, contact.loads, np.random.default_rng(seed))
    exactly = partial(scenes.solve_exactly, start=contact.loads)
    certificate = judged(scene, wrong, operator, exactly, approach=approach)
    assert kind != "none" or certificate.scope == "none" or certificate.all_proved
    if contact.load == 0:
        return
    candidates = NormalProblem.assemble(scene, load=contact.load).candidates
    if wrong[candidates].any():  # else there is nothing to scale to the load: an InputError
        judged(scene, wrong, operator, exactly, load=contact.load)


@pytest.mark.parametrize("steps", [-2, -1, 0, 1, 2])
def test_touching_to_rounding(steps: int) -> None:
    """A gap or a load of a roundoff: the status is that of exact arithmetic."""
    r, load = 1e-3, 1e-7
    k = (9 / (16 * (1 / (1 + 100)))) ** (1 / 3)
    approach = k * load ** (2 / 3)
    height = load / (np.pi * r) - approach + r**2 / 2
    height += steps * np.spacing(height)
    scene = scenes.on_sphere([[0, 0], [r, 0]], 0.01, [0, height])
    contact, exact = cr.press(scene, approach=approach), scenes.reference(scene, approach=approach)
    assert_honest(contact.certificate, contact.loads, exact)
    assert (contact.certificate.scope, contact.certificate.all_proved) == ("global", True)
    assert list(contact.status) == ["contact", "contact" if exact.loads[1] > 0 else "open"]


def test_touching_exactly_is_undecided() -> None:
    """Neither load nor gap: two asperities that first touch at approach 0, all numbers exact."""
    scene = scenes.on_sphere([[0.0, 0.0], [0.5, 0.0]], heights=[0.0, 0.125])
    contact = cr.press(scene, approach=0.0)
    assert list(contact.status) == ["undecided", "undecided"]
    assert list(contact.loads) == [0.0, 0.0]
    assert not contact.certificate.all_proved


@pytest.mark.parametrize("kind", scenes.OPERATORS)
def test_scopes(kind: Kind) -> None:
    """From easy to hard: the shells, the Cholesky test or secants, a local box, nothing."""

    def pressed(spacing: float, tip_radius: float) -> cr.Certificate:
        scene = scenes.hexagonal(spacing, tip_radius)
        return cr.press(scene, approach=scenes.PAPER_APPROACH, influence=kind).certificate

    shells, cholesky = pressed(0.0012, 0.01), pressed(0.0012, 0.03)
    local, crowded = pressed(0.0012, 0.2), pressed(0.0025, 5.0)
    assert shells.scope == cholesky.scope == "global"
    assert local.scope == crowded.scope == "local"
    assert shells.convexity_number < 0.75
    assert (cholesky.convexity_number in (0.9, 0.999)) == (kind == "dense")
    assert local.all_proved
    assert crowded.fixed_open > local.fixed_open == 0
    scene, load = scenes.twins()
    if kind in scenes.operators(scene):
        nothing = cr.press(scene, load=load, influence=kind).certificate
        assert (nothing.scope, nothing.all_proved) == ("none", False)
        assert np.isinf(nothing.load_errors).all()
        assert (nothing.status == "undecided").all()
        assert list(nothing.in_the_way) == [0, 1]


@pytest.mark.parametrize("operator", scenes.OPERATORS)
@pytest.mark.parametrize("seed", range(20))
def test_the_box_is_as_convex_as_it_says(seed: int, operator: Kind) -> None:
    """For any loads: also of a few large contacts among many asperities that are open."""
    rng = np.random.default_rng(seed)
    lattice = cr.Asperities.square(spacing=1e-3, tip_radius=0.05, within=6e-3)
    scene = cr.Scene(1e3, lattice, scenes.MATERIAL, geometry="summit")
    touching = rng.choice(len(scene), 2 + seed // 5, replace=False)
    radii = np.zeros(len(scene))
    radii[touching] = 1e-3 * rng.uniform(0.6, 0.75, len(touching))
    problem = NormalProblem.assemble(scene, approach=1e-3, influence=operator)
    loads = 4 / 3 * radii**3 / scene.relative_radii / problem.units.force
    found = [boxes.tried(problem, loads, problem.plain_product(Pair.exact(loads)))]
    found += [boxes.box_of_touching(problem, loads, loads > 0, it * loads) for it in (0.0, 0.1)]
    for box in filter(None, found):
        root = 1 / np.sqrt(box.compliance)  # 0 where fixed open
        hessian = np.eye(len(scene)) + root[:, None] * problem.influence.matrix * root
        assert np.linalg.eigvalsh(hessian)[0] >= 1 - box.convexity_number - 1e-12


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 3))
def test_the_convex_margin_is_a_lower_bound(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    scene = scenes.on_sphere(rng.uniform(-1, 1, (12, 2)) * 1e-2)
    problem = NormalProblem.assemble(scene, approach=1e-4)
    h = problem.compliance(problem.bounds(problem.approach_bound) * size)
    hessian = problem.influence.matrix / np.sqrt(h) / np.sqrt(h)[:, None] + np.eye(12)
    margin = boxes.convex_margin(problem.influence, h, sorted(boxes.MARGINS))
    smallest = np.linalg.eigvalsh(hessian)[0]
    assert margin <= max(smallest, 0.0)
    assert margin > 0 or smallest < 1.1e-3


@pytest.mark.parametrize("seed", range(40))
def test_gaps_of_screened_neighbours_that_nearly_coincide(seed: int) -> None:
    """Where contact points are rounded, so is their distance."""
    rng, tips = np.random.default_rng(seed), np.array([1e-3, 1e-4])
    first = rng.uniform(-1, 1, 2)
    points = np.array([first, first + 10.0 ** rng.uniform(-11, -2) * rng.normal(size=2)])
    heights = (points**2).sum(axis=1) / 2 / (1 + tips) + [1e-4, -2e-4]  # drops, and unlike
    scene = cr.Scene(1.0, cr.Asperities(points, tips, heights), scenes.MATERIAL, None, "closest")
    contact = cr.press(scene, approach=1e-4)
    assert_honest(contact.certificate, contact.loads, scenes.reference(scene, approach=1e-4))


#: Loads that are wrong in unusual ways, of those of the solution.
ODD = {
    "none": lambda loads: 0.0 * loads,
    "one that cannot touch": lambda loads: np.where(np.arange(61) == 60, loads.sum(), 0.0),
    "the least numbers": lambda loads: np.full(61, 5e-324),
    "nearly the least numbers": lambda loads: np.full(61, 1e-310),
    "the least numbers where open": lambda loads: np.where(loads > 0, loads, 5e-324),
    "three times": lambda loads: 3.0 * loads,
    "far too large": lambda loads: 1e25 * loads,
    "all on one": lambda loads: np.where(np.arange(61) == 24, loads.sum(), 0.0),
}


@pytest.mark.sample(16)
@pytest.mark.parametrize("kind", ODD)
@pytest.mark.parametrize("operator", scenes.OPERATORS)
@pytest.mark.parametrize("control", ["approach", "load"])
def test_odd_loads_are_judged_honestly(control: str, operator: Kind, kind: str) -> None:
    """In the units of the proof the least numbers underflow. Scaled to a total some are right.

    Asperities that cannot touch are open, although their gaps may not be known at all.
    """
    scene = replace(scenes.paper(), material=cr.Material(1e12, 0.3))
    given = scenes.prescribed(scene, 3e-5, control)
    problem = NormalProblem.assemble(scene, **given)
    assert problem.units.force > 8
    screened = np.setdiff1d(np.arange(61), problem.candidates)
    assert {24, 60} & {*screened.tolist()} == {60}
    solution, exact = cr.press(scene, **given).loads, scenes.reference(scene, **given)
    assert (solution[problem.candidates] == 0).any()
    wrong = ODD[kind](solution)
    found = judged(scene, wrong, operator, **given)
    assert found.scope == "global"
    assert (found.status[screened] == "open").all()
    assert (found.load_errors[screened] == wrong[screened]).all()
    if wrong.any():
        assert found.duality_gap >= excess(scene, wrong, exact, given.get("load"))
    verdict = cr.verify(scene, wrong, **given)
    assert not verdict.holds
    if kind in ("none", "one that cannot touch"):
        assert verdict.suspects[0] in {int(np.argmax(solution)), 60}
    if kind == "all on one":
        assert (found.gap_errors[screened] > found.gaps[screened]).all()


@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-9, 1e-3])
@pytest.mark.parametrize("control", ["approach", "load"])
def test_the_duality_gap_is_that_of_float64_loads(control: str, off: float) -> None:
    """Of pressed loads, and with an error of the largest; both are scaled to a prescribed load."""
    scene = scenes.paper("closest")
    given = scenes.prescribed(scene, scenes.PAPER_APPROACH, control)
    contact, exact = cr.press(scene, **given), scenes.reference(scene, **given)
    wrong, certificate = contact.loads.copy(), contact.certificate
    if off:
        wrong[np.argmax(wrong)] *= 1 + off
        certificate = cr.certify(scene, wrong, **given)
    above = excess(scene, wrong, exact, given.get("load"))
    assert 0 < above <= certificate.duality_gap
    if off >= 1e-9:
        assert certificate.duality_gap <= 3 * above


@pytest.mark.parametrize("size", [1e-18, 1e-13, 1e-9])
def test_the_duality_gap_counts_loads_on_screened_asperities(size: float) -> None:
    """Under a prescribed load they change the scaling of the others, and the gap is infinite."""
    scene, approach = scenes.NAMED["rough"]
    contact, exact = (f(scene, approach=approach) for f in (cr.press, scenes.reference))
    wrong, load = contact.loads.copy(), contact.load
    wrong[np.argmax(scene.asperities.distances)] += size * load
    above = excess(scene, wrong, exact)
    gap = cr.certify(scene, wrong, approach=approach).duality_gap
    assert 0 < above <= gap <= 1.01 * above + contact.certificate.duality_gap
    assert cr.certify(scene, wrong * (load / wrong.sum()), load=load).duality_gap == np.inf
    assert cr.certify(scene, contact.loads, load=load).duality_gap < 1e-17 * load * approach


def random_points(seed: int, count: int, size: float = 1.0) -> cr.Scene:
    """Asperities with no least distance; size 1 is the paper's."""
    rng = np.random.default_rng(seed)
    r, angle = 0.01 * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    points = np.column_stack((r * np.cos(angle), r * np.sin(angle)))
    tips = size * 0.02 * np.sqrt(61 / count) * rng.lognormal(0, 0.2, count)
    return scenes.on_sphere(points, tips, friction=0.5)


@settings(max_examples=40, deadline=None)
@example(234, 2, 2.0, "dense", -11.0)  # a load just beyond the box where the energy is convex
@example(350, 10, 2.0, "dense", -3.0)  # asperities that are fixed open, and loads on them
@example(350, 10, 2.0, "dense", -11.0)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 20),
    st.floats(0.2, 4.0),
    st.sampled_from(scenes.OPERATORS),
    st.floats(-17, -3),
)
def test_random_points_are_judged_honestly(
    seed: int, count: int, size: float, kind: Kind, digits: float
) -> None:
    """Against the exact solution next to the loads, whatever these are off by; energies too."""
    scene = random_points(seed, count, size)
    if kind not in scenes.operators(scene):
        return
    contact = cr.press(scene, approach=5e-5, influence=kind)
    off = 10.0**digits * np.random.default_rng(seed).standard_normal(count)
    wrong = np.where(contact.loads > 0, contact.loads * (1 + off), np.abs(off) * contact.load)
    start = contact.loads + 1e-30 * contact.load
    for control in ({"approach": 5e-5}, {"load": contact.load}):
        found = cr.certify(scene, wrong, **control, influence=kind)
        try:
            exact = scenes.solve_exactly(scene, **control, start=start)
        except multiprecision.NotProved:
            continue
        near = multiprecision.off(contact.loads, exact.loads).max() < 1e-9 * contact.load
        if found.scope == "none" or not (near or found.scope == "global"):
            continue  # the exact one is another solution
        assert_honest(found, wrong, exact)
        if "approach" in control:
            assert excess(scene, wrong, exact) <= found.duality_gap
            assert digits > -10 or found.duality_gap < 1e-9 * 5e-5 * contact.load


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(6))
def test_random_points_are_proved(seed: int) -> None:
    """Through a matrix and through a mesh: what used to be undecided is decided."""
    scene = random_points(seed, 300)
    for kind in ("dense", "scattered"):
        contact = cr.press(scene, approach=5e-5, influence=kind)
        certificate = contact.certificate
        assert contact.crowding > 1.5
        assert (certificate.scope, certificate.all_proved) == ("local", True)
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
    for start in itertools.product([0.0, 1e-8], repeat=len(scene)):
        try:
            exact = scenes.solve_exactly(scene, approach=approach, start=start)
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
    scene, approach = scenes.on_sphere(points), 5e-5
    states = all_states(scene, approach)
    assert states
    inverse = inverse_distances(points, points)
    nearest = 1 / inverse.max(axis=1)
    given = [(mine, cr.certify(scene, mine, approach=approach)) for mine in states]
    proved = [(mine, found) for mine, found in given if found.scope != "none"]
    assert proved or distance == 4e-4  # crowding just above pi: only both touching is found
    for mine, found in proved:
        assert found.scope == "local" or len(states) == 1
        for other in states:
            if np.abs(other - mine).max() < 1e-12:
                continue
            radii = np.cbrt(0.75 * other * scene.relative_radii)
            crowding = float((np.add.outer(radii, radii) * inverse).max())
            assert crowding > found.other_solutions_crowding
            assert not found.other_solutions_cover or (radii > nearest).any()


@pytest.mark.parametrize("load", [0.0, 1e-12])
def test_loads_at_the_bounds_of_their_ranges_prove_nothing(load: float) -> None:
    """Small loads lie in a box where the energy is convex, but least where loads are at bounds."""
    scene, approach = scenes.on_sphere([[0, 0], [5.7e-4, 0]], heights=[-1.5e-5, 0.0]), 5e-5
    (only,) = all_states(scene, approach)
    assert only[0] == 0 < only[1]
    judged(scene, np.full(2, load), None, partial(scenes.solve_exactly, start=only), approach=5e-5)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 120), st.floats(0.05, 4.0))
def test_overlapping_shells(seed: int, count: int, width: float) -> None:
    """H^-1/2 (H + A) H^-1/2 >= S for any radii, and what is proved is below the least of it."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 2))
    lengths = rng.lognormal(0, 0.5, count) * 0.3 / np.sqrt(count)
    radii = width * lengths * rng.lognormal(0, 0.5, count)
    radii[: count // 20] *= 10.0
    pairs = boxes.overlaps(points, lengths, radii)
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
    assert boxes.overlapping_margin(A, lengths, boxes.CROWDED_MARGINS) <= max(least, 0.0)


def test_an_isolated_pair_is_proved_up_to_pi() -> None:
    A = DenseInfluence.assemble(np.array([[0.0, 0.0], [1.0, 0.0]]), 1.0)
    for crowding, convex in ((1.6, True), (3.0, True), (3.13, True), (np.pi, False), (3.2, False)):
        lengths = np.full(2, crowding / np.pi)
        assert (boxes.overlapping_margin(A, lengths, boxes.CROWDED_MARGINS) > 0) == convex


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.floats(-0.2, 0.6))
def test_sparse_elimination_proves_no_more_than_is_true(seed: int, count: int, lift: float) -> None:
    rng = np.random.default_rng(seed)
    full = np.triu(rng.normal(0, 0.3, (count, count)) * (rng.random((count, count)) < 0.1), 1)
    which, matrix = np.nonzero(full), full + full.T
    diagonal = np.full(count, lift - float(np.linalg.eigvalsh(matrix)[0]))
    errors = np.full(len(which[0]), 1e-5)
    proved = proved_sparse_margin(diagonal, which, full[which], boxes.CROWDED_MARGINS, errors)
    assert proved <= max(lift, 0.0)
    perturbed = lift - 1e-5 * float((matrix != 0).sum(axis=1).max())
    assert proved >= 0.4 * perturbed or perturbed < 3e-4 or proved == boxes.CROWDED_MARGINS[-1]


def test_lattices_exclude_more_other_solutions() -> None:
    """Where shells of the secants meet, the lattice may still say that there is one solution."""
    rng, by_lattice = np.random.default_rng(3), 0
    for size in np.linspace(3.0, 8.0, 11):
        scene = scenes.hexagonal(tip_radius=0.02 * size)
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


def test_poor_loads_of_a_prescribed_total_do_not_exclude_another_solution() -> None:
    """Of a crowded pair far from a bank of asperities either one can touch.

    The bound on the approach took the displacement of other loads than its weights.
    """
    bank = cr.Asperities.hexagonal(spacing=1.0, tip_radius=0.4, within=1.9).positions
    assert len(bank) == 13
    apart, far = 1e-2, 1e4
    loads = cr.press(scenes.on_sphere(bank, 0.4, radius=np.inf), approach=1.0).loads
    tips = (2.28 * apart) ** 2 / 0.5, (2.65 * apart) ** 2 / 0.475
    points = [*bank, (far, 0), (far + apart, 0), (-far, far)]
    heights = [0.0] * 13 + [-0.5, -0.525, -1.02]
    scene = scenes.on_sphere(points, [0.4] * 13 + [*tips, 0.4], heights, radius=np.inf)
    one = np.append(loads, [4 / 3 * np.sqrt(tips[0]) * 0.5**1.5, 0, 0])
    two = np.append(loads, [0, 4 / 3 * np.sqrt(tips[1]) * 0.475**1.5, 0])
    total = float(one.sum())
    poor = 0.05 * one
    poor[-1] = 0.95 * total
    found = [cr.certify(scene, each, load=total) for each in (poor, one, two)]
    assert [each.scope for each in found] == ["local"] * 3
    assert found[1].status[13] == found[2].status[14] == "contact"
    assert found[1].status[14] == found[2].status[13] == "open"


def test_negative_rates_are_no_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    case, weights = cr.gallery.case("ringed-dragged"), list[Any]()
    loads = np.array([float(each) for each in case.loads])
    problem = NormalProblem.assemble(case.scene, load=float(loads.sum()))
    monkeypatch.setattr(NormalProblem, "overhang", lambda it, q, _: weights.append(q) or 0.0)
    boxes.highest_by_rates(problem, loads[problem.candidates] / problem.units.force)
    assert (weights[0] >= 0).all()
    assert (weights[0][loads[problem.candidates] > 0] == 0).any()


@pytest.mark.parametrize(
    ("make", "kind"),
    [(scenes.scattered, "dense"), (scenes.scattered, "scattered"), (scenes.on_lattice, "dense")],
)
@pytest.mark.parametrize("crowding", [1.0, 1.2])
def test_a_prescribed_load_excludes_what_its_approach_excludes(
    make: Any, kind: Kind, crowding: float
) -> None:
    """With the rates dP/dL as weights, the bound on the approach is the approach."""
    found = []
    for seed in range(40):
        scene, approach = make(seed, 40, crowding, 0.5)
        contact = cr.press(scene, approach=approach, influence=kind)
        if contact.load and contact.certificate.scope == "global":
            control = {"load": contact.load, "influence": kind}
            assert cr.press(scene, **control).certificate.scope == "global"
            problem = NormalProblem.assemble(scene, **control)
            loads = contact.loads[problem.candidates] / problem.units.force
            bound = boxes.highest_by_rates(problem, loads) * problem.units.length
            found.append(bound - contact.approach)
            assert -1e-12 <= found[-1] / problem.units.length < 1e-3
    assert len(found) > 10
    assert np.median(found) < 1e-9 * approach


def test_no_load_is_proved_on_an_open_asperity() -> None:
    """Loads may be too small to be corrected: then the gap is proved in spite of them."""
    contact = cr.press(scenes.paper(), approach=scenes.PAPER_APPROACH)
    problem = NormalProblem.assemble(scenes.paper(), approach=scenes.PAPER_APPROACH)
    loads = contact.loads[problem.candidates] / problem.units.force
    k = int(np.flatnonzero(loads == 0)[0])
    loads[k] = 1e-25 * loads.max()
    level = proved(problem, trial_of(problem, loads))
    assert (level.open[k], level.touching[k]) == (True, False)
    assert level.loads.lower[k] <= 0 <= level.loads.upper[k]
