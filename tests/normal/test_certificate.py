"""The certificate under attack: whatever it is given, no status and no bound may be wrong."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import (
    CASES,
    MATERIAL,
    NAMED,
    OPERATORS,
    PAPER_APPROACH,
    hexagonal,
    on_sphere,
    operators,
    paper,
    prescribed,
    random_cases,
    reference,
    solve_exactly,
    twins,
)
from status_audit import ATTACKS, assert_honest, attack, excess

import convexrough as cr
from convexrough.arithmetic.pairs import Pair
from convexrough.influence.coupling import Kind
from convexrough.normal.boxes import MARGINS, box_of_touching, convex_margin, tried
from convexrough.normal.problem import NormalProblem


@pytest.mark.sample(4)
@pytest.mark.parametrize("kind", ATTACKS)
@pytest.mark.parametrize(("name", "operator"), CASES)
def test_attacks_on_known_scenes(name: str, operator: Kind, kind: str) -> None:
    scene, approach = NAMED[name]
    exact = reference(scene, approach=approach)
    contact = cr.press(scene, approach=approach)
    for seed in range(3):
        wrong = attack(kind, contact.loads, np.random.default_rng(seed))
        judged = cr.certify(scene, wrong, approach=approach, influence=operator)
        assert_honest(judged, wrong, exact)
        if wrong.any():
            exact_load = reference(scene, load=contact.load)
            judged = cr.certify(scene, wrong, load=contact.load, influence=operator)
            assert_honest(judged, wrong, exact_load)


@pytest.mark.sample(2)
@pytest.mark.parametrize("kind", ATTACKS)
@pytest.mark.parametrize("operator", OPERATORS)
def test_attacks_on_a_local_certificate(operator: Kind, kind: str) -> None:
    """Where only a box is convex: loads outside it must not be proved, nor their neighbours."""
    scene = hexagonal(0.0012, 0.2)
    contact = cr.press(scene, approach=PAPER_APPROACH, influence="dense")
    assert contact.certificate.scope == "local"
    for seed in range(4):
        wrong = attack(kind, contact.loads, np.random.default_rng(seed))
        certificate = cr.certify(scene, wrong, approach=PAPER_APPROACH, influence=operator)
        assert kind != "none" or certificate.scope == "local"
        if certificate.scope == "none":
            continue
        distance = np.abs(wrong - contact.loads)
        slack = 2 * contact.certificate.load_error
        assert (distance <= certificate.load_errors + slack).all()
        assert not ((certificate.status == "open") & (contact.status == "contact")).any()
        assert not ((certificate.status == "contact") & (contact.status == "open")).any()


@settings(max_examples=12, deadline=None)
@given(random_cases(crowding=1.2, most=10), st.sampled_from(ATTACKS), st.integers(0, 2**32 - 1))
def test_attacks_on_random_scenes(sampled: Any, kind: str, seed: int) -> None:
    scene, approach, operator = sampled
    contact = cr.press(scene, approach=approach)
    wrong = attack(kind, contact.loads, np.random.default_rng(seed))
    certificate = cr.certify(scene, wrong, approach=approach, influence=operator)
    if certificate.scope != "none" and contact.load > 0:
        exact = solve_exactly(scene, approach=approach, start=contact.loads)
        assert_honest(certificate, wrong, exact)
        if kind == "none":
            assert certificate.all_proved
    if contact.load == 0:
        return
    candidates = NormalProblem.assemble(scene, load=contact.load).candidates
    if wrong[candidates].any():  # else there is nothing to scale to the load: an InputError
        certificate = cr.certify(scene, wrong, load=contact.load, influence=operator)
        if certificate.scope != "none":
            exact = solve_exactly(scene, load=contact.load, start=contact.loads)
            assert_honest(certificate, wrong, exact)


@pytest.mark.parametrize("steps", [-2, -1, 0, 1, 2])
def test_touching_to_rounding(steps: int) -> None:
    """A gap or a load of a roundoff: the status is that of exact arithmetic."""
    r, load = 1e-3, 1e-7
    k = (9 / (16 * (1 / (1 + 100)))) ** (1 / 3)
    approach = k * load ** (2 / 3)
    height = load / (np.pi * r) - approach + r**2 / 2
    height += steps * np.spacing(height)
    scene = on_sphere([[0, 0], [r, 0]], 0.01, [0, height])
    contact, exact = cr.press(scene, approach=approach), reference(scene, approach=approach)
    assert_honest(contact.certificate, contact.loads, exact)
    assert contact.certificate.scope == "global"
    assert list(contact.status) == ["contact", "contact" if exact.loads[1] > 0 else "open"]
    assert contact.certificate.all_proved


def test_touching_exactly_is_undecided() -> None:
    """Neither load nor gap: two asperities that first touch at approach 0, all numbers exact."""
    contact = cr.press(on_sphere([[0.0, 0.0], [0.5, 0.0]], heights=[0.0, 0.125]), approach=0.0)
    assert list(contact.status) == ["undecided", "undecided"]
    assert list(contact.loads) == [0.0, 0.0]
    assert not contact.certificate.all_proved


@pytest.mark.parametrize("kind", OPERATORS)
def test_scopes(kind: Kind) -> None:
    """From easy to hard: the shells, the Cholesky test or secants, a local box, nothing."""

    def pressed(spacing: float, tip_radius: float) -> cr.Certificate:
        scene = hexagonal(spacing, tip_radius)
        return cr.press(scene, approach=PAPER_APPROACH, influence=kind).certificate

    shells, cholesky = pressed(0.0012, 0.01), pressed(0.0012, 0.03)
    local, crowded = pressed(0.0012, 0.2), pressed(0.0025, 5.0)
    assert shells.scope == cholesky.scope == "global"
    assert local.scope == crowded.scope == "local"
    assert shells.convexity_number < 0.75
    assert (cholesky.convexity_number in (0.9, 0.999)) == (kind == "dense")
    assert local.all_proved
    assert crowded.fixed_open > local.fixed_open == 0
    scene, load = twins()
    if kind in operators(scene):
        nothing = cr.press(scene, load=load, influence=kind).certificate
        assert (nothing.scope, nothing.all_proved) == ("none", False)
        assert np.isinf(nothing.load_errors).all()
        assert (nothing.status == "undecided").all()
        assert list(nothing.in_the_way) == [0, 1]


@pytest.mark.sample(3)
@pytest.mark.parametrize("operator", OPERATORS)
@pytest.mark.parametrize("seed", range(20))
def test_the_box_is_as_convex_as_it_says(seed: int, operator: Kind) -> None:
    """For any loads: also of a few large contacts among many asperities that are open."""
    rng = np.random.default_rng(seed)
    lattice = cr.Asperities.square(spacing=1e-3, tip_radius=0.05, within=6e-3)
    scene = cr.Scene(1e3, lattice, MATERIAL, geometry="summit")
    touching = rng.choice(len(scene), 2 + seed // 5, replace=False)
    radii = np.zeros(len(scene))
    radii[touching] = 1e-3 * rng.uniform(0.6, 0.75, len(touching))
    problem = NormalProblem.assemble(scene, approach=1e-3, influence=operator)
    loads = 4 / 3 * radii**3 / scene.relative_radii / problem.units.force
    boxes = [tried(problem, loads, problem.plain_product(Pair.exact(loads)))]
    boxes += [box_of_touching(problem, loads, loads > 0, room * loads) for room in (0.0, 0.1)]
    for box in filter(None, boxes):
        root = 1 / np.sqrt(box.compliance)  # 0 where fixed open
        hessian = np.eye(len(scene)) + root[:, None] * problem.influence.matrix * root
        assert np.linalg.eigvalsh(hessian)[0] >= 1 - box.convexity_number - 1e-12


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 3))
def test_the_convex_margin_is_a_lower_bound(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    scene = on_sphere(rng.uniform(-1, 1, (12, 2)) * 1e-2)
    problem = NormalProblem.assemble(scene, approach=1e-4)
    h = problem.compliance(problem.bounds(problem.approach_bound) * size)
    hessian = problem.influence.matrix / np.sqrt(h) / np.sqrt(h)[:, None] + np.eye(12)
    margin = convex_margin(problem.influence, h, MARGINS)
    smallest = np.linalg.eigvalsh(hessian)[0]
    assert margin <= max(smallest, 0.0)
    assert margin > 0 or smallest < 1.1e-3


@pytest.mark.sample(5)
@pytest.mark.parametrize("seed", range(40))
def test_gaps_of_screened_neighbours_that_nearly_coincide(seed: int) -> None:
    """Where contact points are rounded, so is their distance, to whom it may concern."""
    rng, tips = np.random.default_rng(seed), np.array([1e-3, 1e-4])
    first = rng.uniform(-1, 1, 2)
    points = np.array([first, first + 10.0 ** rng.uniform(-11, -2) * rng.normal(size=2)])
    heights = (points**2).sum(axis=1) / 2 / (1 + tips) + [1e-4, -2e-4]  # drops, and unlike
    scene = cr.Scene(1.0, cr.Asperities(points, tips, heights), MATERIAL, None, "closest")
    contact = cr.press(scene, approach=1e-4)
    assert_honest(contact.certificate, contact.loads, reference(scene, approach=1e-4))


@pytest.mark.sample(2)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("kind", operators(paper()))
def test_screened_asperities_are_open_whatever_the_loads(kind: Kind, control: str) -> None:
    """With the whole load on one asperity, gaps are known to within more than themselves."""
    scene = paper()
    given = prescribed(scene, 3e-5, control)
    candidates = NormalProblem.assemble(scene, **given).candidates
    screened = np.setdiff1d(np.arange(61), candidates)
    wrong = np.zeros(61)
    wrong[candidates[-1]] = cr.press(scene, approach=3e-5).load
    wrong[60] = 1e-9
    certificate = cr.certify(scene, wrong, **given, influence=kind)
    assert certificate.scope == "global"
    assert (certificate.gap_errors[screened] > certificate.gaps[screened]).all()
    assert (certificate.status[screened] == "open").all()
    assert certificate.load_errors[60] == 1e-9
    assert_honest(certificate, wrong, reference(scene, **given))


def test_no_loads_under_load_control() -> None:
    """Also if the only load is on an asperity that cannot touch, or all are too small to scale."""
    solution = cr.press(paper(), load=1e-7).loads
    assert solution[-1] == 0
    for loads in (np.zeros(61), np.r_[np.zeros(60), 1e-7], np.full(61, 5e-324)):
        assert (cr.certify(paper(), loads, load=1e-7).load_errors >= np.abs(loads - solution)).all()
        verdict = cr.verify(paper(), loads, load=1e-7)
        assert not verdict.holds
        assert verdict.suspects[0] in {int(np.argmax(solution)), 60}


@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-9, 1e-3])
@pytest.mark.parametrize("control", ["approach", "load"])
def test_the_duality_gap_is_that_of_float64_loads(control: str, off: float) -> None:
    """Of pressed loads, and with an error of the largest; both are scaled to a prescribed load."""
    scene = paper("closest")
    given = prescribed(scene, PAPER_APPROACH, control)
    contact, exact = cr.press(scene, **given), reference(scene, **given)
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
    scene, approach = NAMED["rough"]
    contact, exact = (f(scene, approach=approach) for f in (cr.press, reference))
    wrong = contact.loads.copy()
    wrong[np.argmax(scene.asperities.distances)] += size * contact.load
    above = excess(scene, wrong, exact)
    gap = cr.certify(scene, wrong, approach=approach).duality_gap
    assert 0 < above <= gap <= 1.01 * above + contact.certificate.duality_gap


@pytest.mark.parametrize("factor", [3.0, 1e25])
def test_loads_far_too_large_under_load_control(factor: float) -> None:
    """Scaled to the total they are right; as they are, they are off by all but a little."""
    scene = paper()
    load = cr.press(scene, approach=PAPER_APPROACH).load
    given = factor * cr.press(scene, load=load).loads
    assert_honest(cr.certify(scene, given, load=load), given, reference(scene, load=load))


@pytest.mark.parametrize("control", ["approach", "load"])
def test_a_load_too_small_for_own_units_is_not_lost(control: str) -> None:
    scene = replace(paper(), material=cr.Material(1e12, 0.3))
    given = prescribed(scene, PAPER_APPROACH, control)
    exact, wrong = reference(scene, **given), cr.press(scene, **given).loads.copy()
    problem = NormalProblem.assemble(scene, **given)
    assert problem.units.force > 8
    open_ones = np.setdiff1d(problem.candidates, np.flatnonzero(wrong))
    assert len(open_ones)
    wrong[open_ones] = 5e-324
    assert_honest(cr.certify(scene, wrong, **given), wrong, exact)


def test_the_energy_of_loads_where_nothing_can_touch() -> None:
    """It is known at a prescribed approach; under a prescribed load it changes the scaling."""
    scene = paper()
    contact = cr.press(scene, load=1e-8)
    assert 60 not in NormalProblem.assemble(scene, load=1e-8).candidates
    loads = contact.loads.copy()
    loads[60] = 1e-3 * loads.max()
    at_approach = cr.certify(scene, loads, approach=contact.approach)
    assert 0 < at_approach.duality_gap < np.inf
    assert cr.certify(scene, loads * (1e-8 / loads.sum()), load=1e-8).duality_gap == np.inf
    assert cr.certify(scene, contact.loads, load=1e-8).duality_gap < 1e-20
