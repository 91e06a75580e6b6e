"""The comparison of all solvers: what it finds, what it makes of those that fail, its command."""

import json
import re
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scene_files import scene_text
from scenes import NAMED, PAPER_APPROACH, paper, random_scenes

import convexrough as cr
from convexrough import compare as comparing
from convexrough.compare import Answer, compare, contradictions
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import BristleQP, Newton, Solution

#: How far the loads of each solver may be from Newton's, over the largest load.
LIMITS = {
    "newton": 0.0,
    "conic + Newton step": 1e-12,
    "conic": 1e-7,
    "conic in CVXPY + Newton step": 1e-12,
    "conic in CVXPY": 1e-7,
    "conic in CVXPY (SCS) + Newton step": 1e-12,
    "conic in CVXPY (QOCO) + Newton step": 1e-12,
    "bristles + Newton step": 3e-9,
    "bristles": 0.6 / 64**2,
}


@dataclass(frozen=True)
class Sloppy:
    """Newton's loads, each off by up to `error` of the largest; or what `instead` raises."""

    error: float = 0.0
    instead: Exception | None = None
    name: str = "sloppy"

    def solve(self, problem: NormalProblem, start: Any = None) -> Solution:
        if self.instead is not None:
            raise self.instead
        solution = Newton().solve(problem, start)
        noise = np.random.default_rng(0).uniform(-1, 1, len(problem)) * solution.loads.max()
        noise[problem.approach_bound + problem.offsets < 1e-9] = 0.0
        loads = np.maximum(solution.loads + self.error * noise, 0.0)
        return replace(solution, loads=loads, refine=False, trial=None)


@pytest.mark.sample(2)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("name", NAMED)
def test_all_agree(name: str, control: str) -> None:
    scene, approach = NAMED[name]
    reference = cr.press(scene, approach=approach)
    comparison = compare(scene, **{control: getattr(reference, control)})
    assert [entry.solver for entry in comparison.entries] == [*LIMITS]
    assert comparison.contradictions == ()
    assert comparison.certified
    for entry in comparison.entries:
        assert (entry.outcome, entry.message) == ("answered", "")
        assert entry.disagreement <= LIMITS[entry.solver], entry.solver
        assert entry.different_statuses == entry.different_contacts == 0
        assert entry.contact is not None
        assert entry.contact.certificate.holds
        assert entry.contact.certificate.duality_gap >= 0
    raw = comparison.entries[-1]
    assert raw.disagreement > 1e-6  # it is another discretisation, not the reference again


@settings(max_examples=25, deadline=None)
@given(random_scenes(crowding=2.0), st.floats(1e-12, 0.3), st.booleans())
def test_certified_answers_never_exclude_each_other(
    found: tuple[cr.Scene, float], error: float, by_load: bool
) -> None:
    scene, approach = found
    prescribed = {"approach": approach}
    if by_load and (load := cr.press(scene, approach=approach).load) > 0:
        prescribed = {"load": load}
    comparison = compare(scene, **prescribed, solvers=[Sloppy(error), BristleQP(16, False)])
    assert comparison.contradictions == ()


# Forged proofs: what a mistake in the mathematics would look like.


def forged(contact: cr.Contact, **changes: Any) -> Answer:
    return Answer("forged", contact.loads, replace(contact.certificate, **changes))


def shifted(values: Any, index: int, by: float) -> Any:
    values = np.array(values)
    values[index] += by
    return values


@pytest.fixture(scope="module")
def contact() -> cr.Contact:
    return cr.press(paper(), approach=PAPER_APPROACH)


def test_each_kind_of_contradiction(contact: cr.Contact) -> None:
    wider = contact.certificate.load_errors + 1e-12 * contact.loads.max()  # than a last digit
    proof = replace(contact.certificate, load_errors=wider)
    true = Answer("newton", contact.loads, proof)
    assert contradictions(true, true) == []
    bound = proof.load_errors[7]
    near = true._replace(loads=shifted(true.loads, 7, 1.9 * bound))
    assert contradictions(true, near) == []
    far = true._replace(loads=shifted(true.loads, 7, 2.1 * bound))
    (line,) = contradictions(true, far)
    assert line.startswith(f"newton and newton: loads of asperities 7: {true.loads[7]:.6g} +- ")

    outermost = int(np.argmax(proof.gaps))
    wide = shifted(proof.gaps, outermost, 3 * proof.gap_errors[outermost])
    (line,) = contradictions(true, forged(contact, gaps=wide))
    assert f"gaps of asperities {outermost}: " in line

    (line,) = contradictions(true, forged(contact, approach=6e-5))
    assert "approach 5.0000000000000002e-05 +- 0 and 6" in line
    assert contradictions(true, forged(contact, approach=6e-5, approach_error=2e-5)) == []

    statuses = np.where(proof.status == "open", "contact", "open")
    (line,) = contradictions(true, forged(contact, status=statuses))
    assert "statuses of asperities 0: contact and open; 1: " in line
    assert line.endswith("; and 56 more")
    undecided = np.full(len(statuses), "undecided")
    assert contradictions(true, forged(contact, status=undecided)) == []
    assert contradictions(true, forged(contact, status=statuses, scope="none")) == []


# The command.


def test_command_where_solvers_fail_and_contradict(
    command: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A contradiction weighs more than solvers that fail."""

    def fail(*_: Any, **__: Any) -> None:
        raise cr.SolverError("conic: stopped")

    (tmp_path / "a.toml").write_text(scene_text())
    monkeypatch.setattr(cr.solvers.ConicCVXPY, "solve", fail)
    ran = command("compare", "a.toml")
    assert ran.status == 4
    assert re.search(r"^bristles +\S+ +\S+ +\S+ +global +same +\d+ +\S+ +\S+$", ran.out, re.M)
    assert re.search(r"^conic in CVXPY  +failed( +-){7}$", ran.out, re.M)
    assert "convexrough: warning: conic in CVXPY: failed\n" in ran.err
    press = cr.press

    def lying(*arguments: Any, solver: Any, **options: Any) -> cr.Contact:
        """Every load of the bristles is called exact."""
        contact = press(*arguments, solver=solver, **options)
        if solver.name != "bristles":
            return contact
        exact = np.zeros(len(contact.loads))
        return replace(contact, certificate=replace(contact.certificate, load_errors=exact))

    monkeypatch.setattr(comparing, "press", lying)
    ran = command("compare", "a.toml")
    assert ran.status == 3
    assert "convexrough: warning: contradiction: newton and bristles: loads of " in ran.err


MINE = """
from dataclasses import replace
import numpy as np
from convexrough.solvers import Newton, Solution

class Mine:
    name = "mine"
    def solve(self, problem, start=None):
        found = Newton().solve(problem)
        return replace(found, loads=self.changed(found.loads), refine=False, trial=None)
    def changed(self, loads):
        return loads

class Zero(Mine):
    name = "zero"
    def changed(self, loads):
        return 0 * loads

class Exit(Mine):
    name = "exit"
    def changed(self, loads):
        raise SystemExit(0)

class Short(Mine):
    name = "short"
    def solve(self, problem, start=None):
        return Solution.of(problem, np.ones(3), 1.0, 1)

class NoSolver: ...
"""


def test_a_solver_of_ones_own_by_its_name(
    command: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", sys.path[:])
    (tmp_path / "desk_solvers.py").write_text(MINE)
    (tmp_path / "scene.toml").write_text(scene_text())
    asked = ("compare", "scene.toml", "--solver")
    ran = command(*asked, "desk_solvers.Mine", "--json", "--log", "log.csv")
    assert [each["solver"] for each in json.loads(ran.out)["compare"]] == ["newton", "mine"]
    assert (tmp_path / "log.csv").read_text().startswith("solver,step,objective,residual\nnewton,")
    wrong = command(*asked, "desk_solvers.Zero")
    assert wrong.status == 3
    assert "zero disagrees: its loads differ from those of newton by 1 of the largest" in wrong.err
    wide = command(*asked, "desk_solvers.Zero", "--within", "2")
    assert wide.status == 0
    assert "zero: 37 contacts differ from those of newton: they have a load above 1e-06" in wide.err
    left = command(*asked, "desk_solvers.Exit")
    assert (left.status, "exit: failed" in left.err) == (4, True)
    assert "loads of shape (3,), expected (" in command(*asked, "desk_solvers.Short").out
    for name, said in (
        ("desk_solvers.Yours", "no attribute 'Yours'"),
        ("desk_solvers.NoSolver", "found type NoSolver, which has no method solve, expected one"),
        ("newtom", "found 'newtom', expected one of"),
    ):
        wrong = command(*asked, name)
        assert (wrong.status, said in wrong.err) == (2, True)
    profiled = command("gallery", "--profile", "few", "--solver", "desk_solvers.Mine", "--json")
    mine = json.loads(profiled.out)["profile"][1]
    assert mine["right"] == mine["contact set right"] == len(mine["outcomes"]) > 0
