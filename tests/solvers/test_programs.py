"""Programs in standard form: what is sent holds at the solution, and comes back in its order."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import PAPER_APPROACH, paper

import convexrough as cr
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import BristleQP, Conic, programs
from convexrough.solvers.cone_boxes import ConeBoxes
from convexrough.solvers.conic import LiftedProgram
from convexrough.solvers.programs import RawAnswer
from convexrough.vector_shear.cones import FrictionConic
from convexrough.vector_shear.problem import VectorProblem


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

    problem = NormalProblem.assemble(paper(), approach=PAPER_APPROACH)
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
