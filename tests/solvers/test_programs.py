"""Programs in standard form: what is sent holds at the solution, and comes back in its order."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import NAMED, PAPER_APPROACH, paper

import convexrough as cr
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import BristleQP, Conic, Newton, Solution, programs
from convexrough.solvers.bristles import BristleProgram
from convexrough.solvers.cone_boxes import ConeBoxes
from convexrough.solvers.conic import LiftedProgram
from convexrough.solvers.programs import RawAnswer, run_osqp
from convexrough.vector_shear.cones import FrictionConic
from convexrough.vector_shear.problem import VectorProblem

CONTROLS = ("approach", "load")


def solved(name: str, control: str) -> tuple[NormalProblem, Solution]:
    scene, approach = NAMED[name]
    prescribed = {control: getattr(cr.press(scene, approach=approach), control)}
    problem = NormalProblem.assemble(scene, **prescribed)
    return problem, Newton().solve(problem)


def cost(program: Any, x: Any) -> float:
    """Of x, by the upper triangle that is sent."""
    upper = program.quadratic
    whole = upper + upper.T
    whole.setdiag(upper.diagonal())
    return float(0.5 * x @ (whole @ x) + program.linear @ x)


@pytest.mark.sample(2)
@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("five", [False, True])
def test_the_cone_program_holds_the_contact(five: bool, control: str) -> None:
    """True powers of t are feasible, every cone is tight, and the cost is the energy."""
    problem, solution = solved("rough", control)
    boxes = ConeBoxes.choose(problem, five=five)
    lifted = LiftedProgram.assemble(problem, boxes)
    program = lifted.apply()
    loads = solution.loads[boxes.members]
    t = np.cbrt(loads / boxes.loads)
    powers = [t**k for k in range(1 if five else 2, 6)]
    x = np.concatenate([loads, *powers, t**5 - t**6])
    slack = program.constant - program.constraints @ x
    assert program.equalities == len(loads) + (control == "load")
    assert_allclose(slack[: program.equalities], 0.0, atol=1e-14)
    cones = slack[program.equalities :].reshape(program.cones, 3)
    assert program.cones == (5 if five else 4) * len(loads)
    assert_allclose(np.hypot(*cones[:, 1:].T), cones[:, 0], atol=1e-14)
    energy = problem.energy(solution.loads, problem.influence.apply(solution.loads))
    if control == "load":  # counted from the bound
        energy -= problem.approach_bound * solution.loads.sum()
    assert cost(program, x) == pytest.approx(energy, rel=1e-12)

    multipliers = np.full(len(slack), problem.approach_bound - solution.approach)
    back = lifted.invert(RawAnswer(x, multipliers, 7, "Solved"))
    assert_allclose(back.loads, loads, rtol=0)
    assert back.approach == pytest.approx(solution.approach, rel=1e-15)
    assert back.iterations == 7


@pytest.mark.parametrize("control", CONTROLS)
def test_the_bristle_program_bounds_the_energy(control: str) -> None:
    """Any spread of the loads over their bristles costs more than the contact, by O(1 / m^2)."""
    problem, solution = solved("rough", control)
    energy = problem.energy(solution.loads, problem.influence.apply(solution.loads))
    excess = []
    for m in (16, 32):
        row = BristleProgram.assemble(problem, m, "bristles")
        program = row.apply()
        raw = run_osqp(program, "bristles", 1e-8, 20_000)
        inside = program.constraints @ raw.x
        assert (inside > program.lower - 1e-9).all()
        assert (inside < program.upper + 1e-9).all()
        found = row.invert(raw)
        assert found.iterations == raw.iterations
        assert_allclose(found.loads, raw.x[: len(problem)], atol=1e-8 * found.loads.max())
        excess.append(cost(program, raw.x) - energy)
    assert 0 < excess[1] < 0.3 * excess[0]


@pytest.mark.parametrize("solver", [Conic(), BristleQP()], ids=lambda each: each.name)
def test_an_answer_that_is_not_a_number(solver: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    of_numbers = programs._of_numbers

    def spoilt(raw: RawAnswer, *names: str) -> RawAnswer:
        return of_numbers(raw._replace(x=raw.x * np.nan, iterations=3), *names)

    monkeypatch.setattr(programs, "_of_numbers", spoilt)
    with pytest.raises(cr.SolverError, match=rf"^{solver.name[:5]}.* is not a number, after 3"):
        cr.press(paper(), approach=PAPER_APPROACH, solver=solver)


def test_too_large_for_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refused before anything is made."""
    import psutil

    problem, _ = solved("paper", "approach")
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=2**30))
    boxes = replace(ConeBoxes.choose(problem), members=np.arange(10**5))
    with pytest.raises(cr.InputError, match=r"asperities of the cone program: found 1e\+05"):
        LiftedProgram.assemble(problem, boxes)


def test_a_refused_friction_program_gives_its_last_forces() -> None:
    contact = cr.press(replace(paper(), friction=0.3), approach=PAPER_APPROACH)
    problem = VectorProblem.of(contact)
    total = np.array([0.3, 0.4]) * problem.loads.sum()
    with pytest.raises(cr.SolverError, match=r"accepted are 1e-18 and 1e-14; try") as refused:
        FrictionConic(accepted=1e-18).solve(problem, total)
    assert refused.value.iterate is not None
    assert_allclose(refused.value.iterate.sum(axis=0), total, rtol=1e-7)
