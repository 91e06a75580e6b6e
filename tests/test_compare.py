"""The comparison of all solvers: what it finds, what it makes of those that fail, its command."""

import json
import re
import sys
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scene_files import scene_text
from scenes import PAPER_APPROACH, paper, random_scenes

import convexrough as cr
from convexrough import comparison as comparing
from convexrough.comparison import Answer, compare, contradictions, every_solver
from convexrough.normal.certificate import OPEN, TOUCHING
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import BristleQP, ConicCVXPY, Newton

#: Every solver, and how far its loads may be off, of the largest.
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
    """Newton's loads, each off by up to `error` of the largest; or `instead`, raised if it can."""

    error: float = 0.0
    instead: Any = None
    name: str = "sloppy"

    def solve(self, problem: NormalProblem, start: Any = None) -> Any:
        if isinstance(self.instead, Exception):
            raise self.instead
        if self.instead is not None:
            return self.instead
        solution = Newton().solve(problem, start)
        noise = np.random.default_rng(0).uniform(-1, 1, len(problem)) * solution.loads.max()
        noise[problem.approach_bound + problem.offsets < 1e-9] = 0.0
        loads = np.maximum(solution.loads + self.error * noise, 0.0)
        return replace(solution, loads=loads, refine=False, trial=None)


def test_solvers_that_are_not_installed_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    for missing in ("scs", "qoco"):
        monkeypatch.setitem(sys.modules, missing, None)
    names = [solver.name for solver in every_solver()]
    assert names == [name for name in LIMITS if "(" not in name]
    few = [ConicCVXPY(solver="SCS")]
    _, asked = compare(paper(), approach=PAPER_APPROACH, solvers=few).entries
    assert asked.outcome == "failed"
    assert "SCS is not installed" in asked.message
    assert asked.message.split("; ")[-1].startswith("pip install scs, or choose one of CLARABEL")


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


def test_solvers_that_do_not_answer() -> None:
    refusal = cr.InputError("scene", found="this", expected="another")
    instead = cr.SolverError("sloppy: stopped"), refusal, ValueError("boom"), 5
    others = [*(Sloppy(instead=each) for each in instead), BristleQP(16)]
    entries = compare(paper(), approach=5e-5, solvers=others).entries[1:]
    said = [f"{entry.outcome} {entry.message}" for entry in entries]
    assert said[:2] == ["failed sloppy: stopped", f"refused {refusal}"]
    assert re.fullmatch(r"failed ValueError: boom \(test_compare\.py:\d+\)", said[2])
    assert said[3:] == ["failed sloppy: returned int, expected a Solution", "answered "]
    for entry in entries[:2]:
        assert np.isnan(entry.disagreement)
        assert (entry.contact, entry.different_statuses, entry.memory) == (None, None, None)


# Forged proofs: what a mistake in the mathematics would look like.


def test_each_kind_of_contradiction() -> None:
    contact = cr.press(paper(), approach=PAPER_APPROACH)
    wider = contact.certificate.load_errors + 1e-12 * contact.loads.max()  # than a last digit
    proof = replace(contact.certificate, load_errors=wider)
    true, last = Answer("newton", contact.loads, proof), np.arange(61) == np.argmax(proof.gaps)
    seventh = (np.arange(61) == 7) * proof.load_errors
    depths = partial(tuple, (3 * last * proof.gap_errors - proof.gaps, proof.gap_errors))
    codes = np.where(proof.status == "open", TOUCHING, OPEN)
    for loads, changes, said in (
        (0, {}, ""),
        (1.9 * seventh, {}, ""),
        (2.1 * seventh, {}, rf"loads of asperities 7: {true.loads[7]:.6g} \+- "),
        (0, {"_depths": depths}, f"gaps of asperities {last.argmax()}: "),
        (0, {"approach": 6e-5}, r"approach 5.0000000000000002e-05 \+- 0 and 6"),
        (0, {"approach": 6e-5, "approach_error": 2e-5}, ""),
        (0, {"codes": codes}, "statuses of asperities 0: contact and open; 1: .*; and 56 more$"),
        (0, {"codes": 0 * codes}, ""),
        (0, {"codes": codes, "scope": "none"}, ""),
    ):
        other = Answer("forged", contact.loads + loads, replace(proof, **changes))
        found = contradictions(true, other)
        assert len(found) == bool(said)
        assert re.match(f"newton and forged: {said}" if said else "", "".join(found))


# The command.


@pytest.mark.parametrize("normal", ["approach = 5e-5", "load = 3.6e-7"])
def test_all_agree(command: Any, tmp_path: Path, normal: str) -> None:
    more = '[units]\nlength = "mm"\nforce = "N"\n'
    (tmp_path / "a.toml").write_text(scene_text(normal=normal, more=more))
    ran = command("compare", "a.toml")
    assert (ran.status, ran.err) == (0, "")
    assert "asperities         37 contact, 24 open\n" in ran.out
    assert "duality gap        in N mm, " in ran.out
    table = ran.out.splitlines()[-len(LIMITS) - 1 :]
    heads = "solver disagreement load error duality gap certificate statuses iterations seconds MB"
    assert table[0].split() == heads.split()
    assert len({len(line) for line in table}) == 1
    cells = r" +(\S+) +\S+ +(\S+) +global +same +\d+ +\S+ +\S+"
    for (name, limit), line in zip(LIMITS.items(), table[1:], strict=True):
        found = re.fullmatch(re.escape(name) + cells, line)
        assert found is not None
        assert float(found[1]) <= limit
        assert float(found[2]) >= 0
    assert float(found[1]) > 1e-6  # bristles are another discretisation, not the reference again
    assert list(tmp_path.iterdir()) == [tmp_path / "a.toml"]


def test_command_with_a_log(command: Any, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(scene_text())
    both = "compare a.toml --log log.csv --solver conic --solver conic_cvxpy"
    ran = command(*both.split())
    assert (ran.status, "\nconic in CVXPY + Newton step  " in ran.out) == (0, True)
    first, *rows = (tmp_path / "log.csv").read_text().splitlines()
    assert first == "solver,step,objective,residual"
    steps = [row.split(",") for row in rows]
    assert list(dict.fromkeys(name for name, *_ in steps)) == ["newton", "conic + Newton step"]
    assert all(np.isfinite([float(number) for number in row]).all() for _, *row in steps)
    assert command("compare", "a.toml", "--log", "log.csv").refuses("log.csv: exists already")


def test_command_when_a_solver_fails_and_on_a_contradiction(command: Any, monkeypatch: Any) -> None:
    """A contradiction weighs more: here every load of the bristles is called exact."""

    def fail(*_: Any, **__: Any) -> None:
        raise cr.SolverError("bristles: stopped")

    def lying(*arguments: Any, solver: Any, **options: Any) -> cr.Contact:
        contact = cr.press(*arguments, solver=solver, **options)
        if solver.name != "bristles":
            return contact
        exact = np.zeros(len(contact.loads))
        return replace(contact, certificate=replace(contact.certificate, load_errors=exact))

    Path("a.toml").write_text(scene_text())
    with monkeypatch.context() as patch:
        patch.setattr(BristleQP, "solve", fail)
        ran = command("compare", "a.toml")
    assert ran.status == 4
    assert re.search(r"^bristles  +failed( +-){7}$", ran.out, re.M)
    assert ran.out.endswith("\nbristles: stopped\n")
    assert "convexrough: warning: bristles: failed\n" in ran.err
    monkeypatch.setattr(comparing, "press", lying)
    monkeypatch.setattr(ConicCVXPY, "solve", fail)
    ran = command("compare", "a.toml")
    assert ran.status == 3
    assert "convexrough: warning: contradiction: newton and bristles: loads of " in ran.err


MINE = """
import numpy as np
from convexrough.solvers import Newton, Solution
print("on import")

class Mine:
    name, refine = "mine", False
    def solve(self, problem, start=None):
        print("on solving")
        found = Newton().solve(problem)
        loads = self.changed(found.loads)
        return Solution.of(problem, loads, found.approach, 1, refine=self.refine)
    def changed(self, loads):
        return loads

class Zero(Mine):
    name, changed = "zero", lambda self, loads: 0 * loads

class Spurious(Mine):
    name, changed = "spurious", lambda self, loads: np.maximum(loads, 1e-4 * loads.max())

class Ones(Mine):  # the loads of a solver are judged as they are
    name, changed = "newton", lambda self, loads: np.ones(len(loads))

class Refined(Ones):
    refine = True

class Far(Refined):  # loads from which no Newton step leads to smaller residuals
    changed = lambda self, loads: np.where(np.arange(len(loads)) == 0, 1e9, 0.0)

class Words(Mine):
    changed = lambda self, loads: ["1"] * len(loads)

class NoSolver: ...
class NoName:
    def solve(self, problem, start=None): ...
class Needs:
    def __init__(self, what): ...
"""


def test_a_solver_of_ones_own_by_its_name(command: Any, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(sys, "path", sys.path[:])
    broken = {"unlicensed": "raise RuntimeError('no licence')", "broken": "def ("}
    for module, text in {"desk": MINE, **broken}.items():
        (tmp_path / f"{module}.py").write_text(text)
    (tmp_path / "scene.toml").write_text(scene_text())
    one, two, three = ["newton", "mine"], ["newton", "newton (2)"], "newton + refinement"
    ones = "Ones --solver desk.Refined"
    for line, status, names, said in (
        ("Mine", 0, one, "on import\non solving\n"),
        ("Zero", 3, None, "zero disagrees: its loads differ from those of newton by 1 of the larg"),
        ("Zero --within 2", 0, None, "zero: 37 contacts differ from those of newton: one solver"),
        # The loads are right to 1e-4, the claimed contacts are not.
        ("Spurious", 0, None, "spurious: 24 contacts differ from those of newton"),
        ("Spurious", 0, None, "same; 24 contacts differ"),
        ("Words", 4, None, "expected real numbers"),
        ("Far", 3, two, ""),
        (ones, 3, [*two, three], ""),
    ):
        json_or_text = ["--json"] if names else []
        ran = command("compare", "scene.toml", "--solver", *f"desk.{line}".split(), *json_or_text)
        assert (ran.status, said in ran.err + ran.out) == (status, True), line
        if names:
            assert [each["solver"] for each in json.loads(ran.out)["compare"]] == names
    for name, pattern in (
        ("desk.Yours", "no attribute 'Yours'"),
        ("no_module.Mine", "No module named 'no_module'"),
        ("desk.Needs", "missing 1 required .* of a solver that needs no arguments"),
        ("desk.NoSolver", "found type NoSolver, expected one of .* and a method `solve`"),
        ("desk.NoName", "found type NoName, expected one of .* a text `name`"),
        ("newtom", "found 'newtom', expected one of"),
        ("unlicensed.Solver", r"found unlicensed.Solver \(Run"),
        ("broken.Solver", r"found broken.Solver \(Syn"),
    ):
        wrong = command("compare", "scene.toml", "--solver", name)
        assert (wrong.status, wrong.out) == (2, "")
        assert re.search(pattern, wrong.err)
    asked = f"gallery few --json --profile --solver desk.Mine --solver desk.{ones}"
    ran = command(*asked.split())
    profile = json.loads(ran.out)["profile"]
    assert (ran.status, [each["solver"] for each in profile]) == (3, [*one, two[1], three])
    count = len(profile[0]["outcomes"])
    assert [each["right"] for each in profile] == [count, count, 0, count]
    assert profile[1]["contact set right"] == count > 0
    assert command(*asked.split()[:6]).status == 0
