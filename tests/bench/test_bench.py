"""The benchmark: its reference, what it concludes, what it writes. No time is tested."""

import csv
import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import multiprecision
import numpy as np
import pytest

import convexrough as cr
from convexrough.bench import measure, suite
from convexrough.bench.measure import Attempt, reference
from convexrough.bench.profile import profile_of
from convexrough.bench.rows import Bench, Row, better_than_default
from convexrough.bench.scenes import APPROACH, scene
from convexrough.solvers import BristleQP, Conic, Newton

SMALL = (("lattice", 61),)


@cache
def tiny() -> Bench:
    """A run of the smallest scenes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(suite, "WORK", SMALL)
        patch.setattr(suite, "PRESSES", (*SMALL, ("scattered", 61)))
        patch.setattr(suite, "FOLLOWING", dict.fromkeys(suite.FOLLOWING, SMALL))
        patch.setattr(suite, "SWEEPS", ((61, 200, 1),))
        patch.setattr(suite, "ROUNDS", 1)
        patch.setattr(measure, "LEAST_RUNS", 1)
        return suite.run(quick=True)


# The reference.


@pytest.mark.parametrize("family", ["lattice", "rough"])
def test_reference_against_50_digits(family: Any) -> None:
    each = scene(family, 1.0)
    found = reference(each, APPROACH)
    asperities = each.asperities
    exact = multiprecision.solve(
        asperities.positions,
        asperities.tip_radii,
        asperities.heights,
        sphere_radius=1.0,
        contact_modulus=1.0,
        approach=APPROACH,
    )
    off = np.abs(multiprecision.errors(found.loads, exact.loads)).max() / found.loads.max()
    assert 0 < off <= found.bound < 2e-16
    assert found.error(found.loads * 1.001) == pytest.approx(1e-3, rel=1e-6)


# What is measured, and what is said of it.


def test_rows_of_those_that_do_not_answer() -> None:
    small = scene("lattice", 1.0)
    dense = cr.Scene(1.0, cr.Asperities.hexagonal(spacing=0.0025, tip_radius=5.0, within=0.01),
                     cr.Material(1.0, 0.3), geometry="summit")  # fmt: skip
    for each, attempt, outcome, message in (
        (small, Attempt("newton", "", Newton(max_iterations=1)), "failed", "residual"),
        (dense, Attempt("conic", "", Conic()), "refused", "asperities too dense for a"),
        (scene("scattered", 1.0), Attempt("", "", Newton(), "lattice"), "refused", "lattice"),
    ):
        row = measure.measure_attempt("lattice", each, attempt, None, 0.0)
        assert (row.outcome, message in row.message) == (outcome, True)


def row(name: str, seconds: float, error: float, setting: str = "default") -> Row:
    return Row("solve", "lattice", 61, solver=name, setting=setting, seconds=seconds, error=error)


def test_who_is_better_than_the_default() -> None:
    others = [
        row("within noise", 0.95, 1e-12),
        row("less accurate", 0.5, 1.1e-12),
        row("slower", 1.2, 1e-15),
        row("better", 0.85, 1e-12),
    ]
    rows = [row("newton", 1.0, 1e-12), *others]
    assert [each.solver for each in better_than_default(rows)] == ["better"]
    assert better_than_default(others) == others
    (line,) = replace(tiny(), rows=tuple(rows)).verdicts()
    assert line.endswith("61 asperities (lattice): the default solver is not on the frontier: "
                         "better, default.")  # fmt: skip


def test_every_task_is_timed_on_the_scene_that_it_names() -> None:
    rows = {(each.task, each.family): each for each in tiny().rows if each.task != "solve"}
    for task in ("press", "from nothing", *suite.FOLLOWING):
        found = rows[task, "lattice"]
        assert (found.outcome, found.asperities) == ("answered", 61)
        assert found.seconds > 0
        assert found.product > 0
        assert found.products == found.seconds / found.product
    assert rows["press", "lattice"].touching == 37
    assert 0 < rows["press", "lattice"].bound < 1e-11
    assert np.isnan(rows["press", "scattered"].product)
    assert rows["sweep", "rough"].message == "10 scenes, 1 processes, 10 certified"
    default = next(each for each in tiny().rows if each.task == "solve" and each.default)
    assert 0 < default.error < 1e-14


# What it writes.


@pytest.fixture
def command(command: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The command line, which finds a run that was made before."""
    made = tiny()
    monkeypatch.setattr(suite, "run", lambda quick: made)
    return command


def test_command(command: Any, tmp_path: Path) -> None:
    ran = command("bench", "--quick", "--json")
    assert (ran.status, ran.err) == (0, "")
    folder = tmp_path / "bench-results"
    assert {path.name for path in folder.iterdir()} == {
        *("files.json", "bench.json", "rows.csv", "work-precision.png", "cost.png"),
    }
    with (folder / "rows.csv").open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == len(tiny().rows)
    summary = json.loads(ran.out)
    assert summary == json.loads((folder / "bench.json").read_text())
    assert {"schema", "version", "machine", "seconds", "exponents", "verdicts"} < set(summary)
    assert {each["solver"] for each in summary["rows"]} >= {
        *("newton", "newton, lattice", "conic", "conic + Newton step", "conic in CVXPY"),
        *("conic in CVXPY + Newton step", "bristles", "bristles + Newton step"),
    }
    again = command("bench", "--quick")
    assert again.status == 2
    assert "bench-results: not empty" in again.err
    said = command("bench", "--quick", "--force", "--no-figures")
    assert said.status == 0
    assert f"in products on {tiny().machine['cores']} cores" in said.out


def test_answers_are_judged_before_they_are_timed() -> None:
    found = profile_of([BristleQP(newton_step=False)], cases=["two-equal"], within=1e-9)
    assert found.solvers == ("newton", "bristles")
    assert found.outcomes == (("right",), ("wrong",))
    assert found.ratios.tolist() == [[1.0], [np.inf]]
