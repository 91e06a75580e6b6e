"""The cone programs against 50 digits, Newton's method, the certificate and each other."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import MATERIAL, PAPER_APPROACH, paper, random_scenes

import convexrough as cr
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import Conic, ConicCVXPY, Newton, Solution, TooDenseError
from convexrough.solvers.cone_boxes import ConeBoxes, solve_in
from convexrough.solvers.programs import ProgramAnswer

SOLVERS = [Conic(), ConicCVXPY()]
OTHERS = [ConicCVXPY(solver=name) for name in ("SCS", "QOCO")]
CONTROLS = ["approach", "load"]


def by_name(value: Any) -> str:
    return value.name if hasattr(value, "name") else str(value)


def problem_of(scene: cr.Scene, approach: float, control: str = "approach") -> NormalProblem:
    """Under load control with the load of that approach: one solution, found in two ways."""
    if control == "load":
        return NormalProblem.assemble(scene, load=cr.press(scene, approach=approach).load)
    return NormalProblem.assemble(scene, approach=approach)


def hexagonal(density: float, tip_radius: float = 0.02) -> cr.Scene:
    """The paper's sphere and its asperities, made smaller and put closer."""
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025 / density, tip_radius=tip_radius / density**2, within=0.0102
    )
    return cr.Scene(1.0, asperities, MATERIAL, geometry="summit")


def disagreement(found: Solution, expected: Solution) -> float:
    """Largest difference of the loads over the largest load."""
    return float(np.abs(found.loads - expected.loads).max() / expected.loads.max())


@pytest.mark.sample(2)
@pytest.mark.parametrize("solver", [*SOLVERS, OTHERS[1]], ids=by_name)  # SCS takes many steps
@pytest.mark.parametrize("control", CONTROLS)
def test_five_cones_where_four_do_not_reach(solver: Any, control: str) -> None:
    """Blunt asperities, of which one or more are between S = 21/25 and 1."""
    scene = hexagonal(1, tip_radius=0.35)
    problem = problem_of(scene, PAPER_APPROACH, control)
    expected = Newton().solve(problem)
    assert 0.84 < problem.convexity_number(expected.loads) < 1
    four = ConeBoxes.choose(problem)
    assert four.S.max() == pytest.approx(21 / 25)
    with pytest.raises(TooDenseError, match=r"asperity: 0 \(0\.9.*less than 0.84"):
        solve_in(solver, problem, four)
    assert disagreement(solver.solve(problem), expected) < 1e-12
    raw = replace(solver, newton_step=False)
    accepted = 1e-6 if solver in SOLVERS else 10 * np.sqrt(raw.tolerance)  # what its page promises
    assert disagreement(raw.solve(problem), expected) < accepted
    contact = cr.press(scene, approach=PAPER_APPROACH, solver=solver)
    assert contact.certificate.scope == "local"
    assert contact.certificate.holds


@pytest.mark.sample(2)
@pytest.mark.parametrize("solver", [*SOLVERS, OTHERS[1]], ids=by_name)
@pytest.mark.parametrize("control", CONTROLS)
def test_too_dense_is_refused(solver: Any, control: str) -> None:
    """The refusal names exactly the asperities that Newton's method finds beyond the range."""
    scene = hexagonal(1, tip_radius=0.6)
    problem = problem_of(scene, PAPER_APPROACH, control)
    loads = Newton().solve(problem).loads
    theta = problem.shells / problem.compliance(loads)
    with pytest.raises(TooDenseError, match=r"0 \(1\.\d+\).*expected less than 1$") as refusal:
        solver.solve(problem)
    assert isinstance(refusal.value, cr.ConvexroughError)
    assert set(problem.candidates[theta > 1]) <= set(refusal.value.asperities)
    assert (refusal.value.ratios > 1 - 1e-6).all()
    assert refusal.value.ratios.max() == pytest.approx(theta.max(), rel=0.15)


@settings(max_examples=30, deadline=None)
@given(random_scenes(crowding=1.4), st.sampled_from(CONTROLS))
def test_any_scene_is_solved_or_refused(sampled: tuple[cr.Scene, float], control: str) -> None:
    """Solved where Newton's answer is in the convex range, and refused where it is not."""
    scene, approach = sampled
    if cr.press(scene, approach=approach).load == 0:
        return
    problem = problem_of(scene, approach, control)
    expected = Newton().solve(problem)
    theta = problem.convexity_number(expected.loads)
    try:
        found = Conic().solve(problem)
    except TooDenseError:
        assert theta > 1 - 1e-6
    else:
        assert theta < 1 + 1e-6
        assert disagreement(found, expected) < 1e-11


def test_a_first_order_solver_is_judged_by_the_contact_law() -> None:
    """A hundred steps of SCS: not enough alone, enough to begin with."""
    problem = problem_of(paper(), PAPER_APPROACH)
    expected = Newton().solve(problem)
    hasty = ConicCVXPY(solver="SCS", max_iterations=100)
    assert disagreement(hasty.solve(problem), expected) < 1e-12
    said = (
        r"^conic in CVXPY \(SCS\): loads miss .* by 0\.00\d+ of .*, accepted 0.000316; try newton"
    )
    with pytest.raises(cr.SolverError, match=said) as missed:
        replace(hasty, newton_step=False).solve(problem)
    assert missed.value.iterate is not None
    error = np.abs(missed.value.iterate - expected.loads).max() / expected.loads.max()
    assert 3e-4 < error < 1e-2
    loose = ConicCVXPY(solver="SCS", newton_step=False, tolerance=1e-6)
    assert disagreement(loose.solve(problem), expected) < 10 * np.sqrt(loose.tolerance)


@dataclass(frozen=True)
class Wrong(Conic):
    """A solver that claims to have solved it."""

    factor: float = 1.0

    def answer(self, problem: NormalProblem, boxes: ConeBoxes) -> ProgramAnswer:
        true = super().answer(problem, boxes)
        return true._replace(loads=self.factor * true.loads)


@pytest.mark.parametrize("factor", [0.99, 0.0, np.nan])
def test_wrong_loads_are_not_returned(factor: float) -> None:
    problem = problem_of(paper(), PAPER_APPROACH)
    solver = Wrong(newton_step=False, factor=factor)
    with pytest.raises(cr.SolverError, match=r"^conic: loads.*; try"):
        solver.solve(problem)
