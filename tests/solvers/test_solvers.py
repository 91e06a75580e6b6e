"""Solvers: cone and bristle programs, and Newton's method for thousands of asperities."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import NAMED, PAPER_APPROACH, hexagonal, paper, prescribed
from status_audit import assert_agree

import convexrough as cr
from convexrough.influence import Kind, lattice
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import BristleQP, Conic, ConicCVXPY, Newton, Solution, TooDenseError
from convexrough.solvers.conic import ConeBoxes, lifted_program, solve_in
from convexrough.solvers.newton import ALL_ITERATED

SOLVERS = [Conic(), ConicCVXPY(), ConicCVXPY(solver="QOCO")]  # SCS takes many steps
each_solver = pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)
each_control = pytest.mark.parametrize("control", ["approach", "load"])


def problem_of(scene: cr.Scene, approach: float, control: str = "approach") -> NormalProblem:
    return NormalProblem.assemble(scene, **prescribed(scene, approach, control))


def disagreement(found: Solution, expected: Solution) -> float:
    """Largest difference of the loads over the largest load."""
    return float(np.abs(found.loads - expected.loads).max() / expected.loads.max())


@pytest.mark.sample(2)
@each_solver
@each_control
def test_five_cones_where_four_do_not_reach(solver: Any, control: str) -> None:
    """Blunt asperities, of which one or more are between S = 21/25 and 1."""
    scene = hexagonal(tip_radius=0.35)
    problem = problem_of(scene, PAPER_APPROACH, control)
    expected = Newton().solve(problem)
    assert 0.84 < problem.convexity_number(expected.loads) < 1
    four = ConeBoxes.choose(problem)
    assert four.S.max() == pytest.approx(21 / 25)
    with pytest.raises(TooDenseError, match=r"estimate of .*: 0 \(0\.9.*less than 0.84; Newton's"):
        solve_in(solver, problem, four)
    assert disagreement(solver.solve(problem), expected) < 1e-12
    raw = replace(solver, newton_step=False)
    accepted = 1e-6 if solver in SOLVERS[:2] else 10 * np.sqrt(raw.tolerance)  # of its page
    assert disagreement(raw.solve(problem), expected) < accepted
    certificate = cr.press(scene, approach=PAPER_APPROACH, solver=solver).certificate
    assert (certificate.scope, certificate.all_proved) == ("local", True)


@pytest.mark.sample(2)
@each_solver
@each_control
def test_too_dense_is_refused(solver: Any, control: str) -> None:
    """The refusal names exactly the asperities that Newton's method finds beyond the range."""
    scene = hexagonal(tip_radius=0.6)
    problem = problem_of(scene, PAPER_APPROACH, control)
    loads = Newton().solve(problem).loads
    theta = problem.shells / problem.compliance(loads)
    with pytest.raises(TooDenseError, match=r": 0 \(1\.\d+\).*less than 1; Newton") as refusal:
        solver.solve(problem)
    assert isinstance(refusal.value, cr.ConvexroughError)
    assert set(problem.candidates[theta > 1]) <= set(refusal.value.asperities)
    assert f"found {len(refusal.value.asperities)}, by index" in str(refusal.value)
    assert (refusal.value.ratios > 1 - 1e-6).all()
    assert refusal.value.ratios.max() == pytest.approx(theta.max(), rel=0.15)


def test_a_first_order_solver_is_judged_by_the_contact_law() -> None:
    """A hundred steps of SCS: not enough alone, enough to begin with."""
    problem = problem_of(paper(), PAPER_APPROACH)
    expected = Newton().solve(problem)
    hasty = ConicCVXPY(solver="SCS", max_iterations=100)
    assert disagreement(hasty.solve(problem), expected) < 1e-12
    said = r"^conic in CVXPY \(SCS\): loads err .* by 0\.00\d+ of .*, accepted 0.000316; try newton"
    with pytest.raises(cr.SolverError, match=said) as missed:
        replace(hasty, newton_step=False).solve(problem)
    error = np.abs(missed.value.iterate - expected.loads).max() / expected.loads.max()
    assert 3e-4 < error < 1e-2
    loose = ConicCVXPY(solver="SCS", newton_step=False, tolerance=1e-6)
    assert disagreement(loose.solve(problem), expected) < 10 * np.sqrt(loose.tolerance)


@pytest.mark.parametrize("factor", [0.9, 0.0, np.nan])
def test_wrong_loads_are_not_returned(factor: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a solver that claims to have solved it."""
    honest = Conic.answer

    def wrong(*arguments: Any) -> Any:
        true = honest(*arguments)
        return true._replace(loads=factor * true.loads)

    monkeypatch.setattr(Conic, "answer", wrong)
    with pytest.raises(cr.SolverError, match=r"^conic: loads.*; try"):
        Conic(newton_step=False).solve(problem_of(paper(), PAPER_APPROACH))
    with pytest.raises(cr.SolverError, match=r"^conic . Newton step: (loads|Newton steps changed)"):
        Conic().solve(problem_of(paper(), PAPER_APPROACH))


def test_too_large_for_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = problem_of(paper(), PAPER_APPROACH)
    monkeypatch.setattr("psutil.virtual_memory", lambda: SimpleNamespace(available=2**30))
    boxes = replace(ConeBoxes.choose(problem), members=np.arange(10**5))
    with pytest.raises(cr.InputError, match=r"asperities of the cone program: found 1e\+05"):
        lifted_program(problem, boxes)


@pytest.mark.sample(2)
@each_control
@pytest.mark.parametrize("name", ["rough", "rough, closest"])
def test_second_order(name: str, control: str) -> None:
    problem, counts = problem_of(*NAMED[name], control), np.array([16, 32, 64, 128])
    true = Newton().solve(problem).loads
    found = [BristleQP(int(m), newton_step=False).solve(problem).loads for m in counts]
    errors = (np.array(found) - true) / true.max()
    assert (np.abs(errors).max(axis=1) < 0.65 / counts**2).all()
    mean_square = np.sqrt(np.mean(errors**2, axis=1))
    order = -np.polyfit(np.log(counts), np.log(mean_square), 1)[0]
    assert order == pytest.approx(2.0, abs=0.15)


def finer(k: float, within: float = 0.01, **rough: Any) -> cr.Scene:
    """The paper's sphere on a lattice k times finer, of tips k times smaller."""
    return hexagonal(0.0025 / k, 0.02 / k, within, **rough)


def edited(
    whole: cr.Scene, *, most: float = 0.0, raised: Any = 0.0, share: float = 1.0
) -> cr.Scene:
    """Each asperity moved sideways at random, and up; away from the axis only a share is left."""
    a, rng = whole.asperities, np.random.default_rng(6)
    places = a.positions + rng.uniform(-most, most, (len(whole), 2))
    # All those near the axis, where a lattice is looked for.
    kept = (a.distances < 3e-3) | (rng.random(len(whole)) < share)
    few = cr.Asperities(places[kept], a.tip_radii[kept], (a.heights + raised)[kept])
    return replace(whole, asperities=few)


#: Scenes of 1000 to 3500 candidates, each in the convex range.
LARGE = {
    "heights": finer(6, height_std=1e-7, seed=1),
    "rough": finer(6, height_std=1e-6, tip_radius_cv=0.1, seed=2),
    "closest": replace(finer(6, height_std=1e-6, seed=3), geometry="closest"),
    "screened": finer(6, within=0.02, height_std=1e-7, seed=4),
    "sparse": edited(finer(7, height_std=1e-7, seed=4), share=0.6),
    "scattered": edited(finer(6, height_std=1e-6, seed=2), most=5e-5),
    "flat": replace(edited(finer(6, height_std=1e-6, seed=2), raised=-5e-5), sphere_radius=np.inf),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("kind", ["lattice", "scattered"])
@pytest.mark.parametrize("name", LARGE)
def test_as_through_the_matrix(name: str, kind: Kind, control: str) -> None:
    """Loads agree within what is proved of each, and to 1e-12; statuses are the same."""
    pressed = LARGE[name]
    if kind == "lattice" and pressed.lattice is None:
        with pytest.raises(cr.InputError, match="lattice"):
            cr.press(pressed, approach=PAPER_APPROACH, influence=kind)
        return
    given = prescribed(pressed, PAPER_APPROACH, control)
    dense, contact = (cr.press(pressed, **given, influence=each) for each in ("dense", kind))
    assert ALL_ITERATED < contact.candidates < 3500
    assert contact.influence == kind
    assert contact.certificate.all_proved
    assert contact.certificate.load_error <= 1e-8 * contact.loads.max()
    assert contact.iterations <= 12
    assert dense.certificate.all_proved
    assert np.abs(contact.loads - dense.loads).max() <= 1e-12 * dense.loads.max()
    assert_agree(contact, dense, "load", "gap")
    assert (contact.status == dense.status).all()
    assert contact.approach == pytest.approx(PAPER_APPROACH, rel=1e-12)
    assert contact.crowding == pytest.approx(dense.crowding, rel=1e-9)
    assert contact.model_error == pytest.approx(dense.model_error, rel=0.03)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("control", "sharp"), [("approach", 2**14), ("approach", 0), ("load", 0)])
def test_those_left_out_at_first_are_found(
    control: str, sharp: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The contact lies beside the axis, and across from it there are peaks. In rings about the axis
    they are alike, so the start takes the surface to sink where it does not.

    sharp : Lattices of more sites are refined near the contact alone
    """
    monkeypatch.setattr(lattice, "MANY", (sharp, 2**17))
    whole = finer(7)
    x, y = whole.asperities.positions.T
    peaks = (np.hypot(x + 0.006, y) < 0.003) & (np.arange(len(whole)) % 20 == 0)
    level = np.where(peaks, -3.45e-5, -((x - 0.006) ** 2 + y**2) / 2)
    pressed = edited(whole, raised=level + whole.drops)
    known = cr.press(pressed, approach=5e-5, influence="dense")
    assert known.certificate.all_proved
    assert (known.status[peaks] == "contact").any()
    found = cr.press(pressed, **{control: getattr(known, control)}, influence="lattice")
    assert found.candidates > ALL_ITERATED
    apart = found.certificate.gap_errors + known.certificate.gap_errors
    assert_allclose(found.loads, known.loads, rtol=0, atol=1e-15 * known.loads.max())
    assert (np.abs(found.certificate.gaps - known.certificate.gaps) <= apart).all()


def test_the_start_is_good() -> None:
    """Two approaches at which rings that begin on a smooth sphere fail, and a flat."""
    fine = finer(12)
    flat = replace(hexagonal(0.0025 / 9, 0.004 / 9, 0.012), sphere_radius=np.inf)
    cases = (fine, 4.147157190635452e-05), (fine, 4.79933110367893e-05), (flat, 2e-4)
    for pressed, approach in cases:
        assert cr.press(pressed, approach=approach).iterations <= 5
