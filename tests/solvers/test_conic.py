"""The cone program and the bristle program: against Newton's method and the certificate."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scenes import NAMED, PAPER_APPROACH, hexagonal, paper, prescribed

import convexrough as cr
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import BristleQP, Conic, ConicCVXPY, Newton, Solution, TooDenseError
from convexrough.solvers.conic import ConeBoxes, LiftedProgram, solve_in

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
    contact = cr.press(scene, approach=PAPER_APPROACH, solver=solver)
    assert contact.certificate.scope == "local"
    assert contact.certificate.all_proved


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
    assert missed.value.iterate is not None
    error = np.abs(missed.value.iterate - expected.loads).max() / expected.loads.max()
    assert 3e-4 < error < 1e-2
    loose = ConicCVXPY(solver="SCS", newton_step=False, tolerance=1e-6)
    assert disagreement(loose.solve(problem), expected) < 10 * np.sqrt(loose.tolerance)


@pytest.mark.parametrize("factor", [0.99, 0.0, np.nan])
def test_wrong_loads_are_not_returned(factor: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a solver that claims to have solved it."""
    honest = Conic.answer

    def wrong(*arguments: Any) -> Any:
        true = honest(*arguments)
        return true._replace(loads=factor * true.loads)

    monkeypatch.setattr(Conic, "answer", wrong)
    with pytest.raises(cr.SolverError, match=r"^conic: loads.*; try"):
        Conic(newton_step=False).solve(problem_of(paper(), PAPER_APPROACH))


def test_too_large_for_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refused before anything is made."""
    import psutil

    problem = NormalProblem.assemble(paper(), approach=PAPER_APPROACH)
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=2**30))
    boxes = replace(ConeBoxes.choose(problem), members=np.arange(10**5))
    with pytest.raises(cr.InputError, match=r"asperities of the cone program: found 1e\+05"):
        LiftedProgram.assemble(problem, boxes)


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
