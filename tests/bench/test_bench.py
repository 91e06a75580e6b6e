"""The benchmark: its reference, and what it writes. No time is tested."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import multiprecision
import numpy as np
import pytest
from scene_files import rows

from convexrough.bench import measure, suite
from convexrough.bench.measure import reference
from convexrough.bench.rows import Bench
from convexrough.bench.scenes import APPROACH, scene

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


@pytest.mark.parametrize("family", ["lattice", "rough"])
def test_reference_against_50_digits(family: Any) -> None:
    each = scene(family, 1.0)
    found = reference(each)
    exact = multiprecision.solve(each, approach=APPROACH)
    off = np.abs(multiprecision.errors(found, exact.loads)).max() / found.max()
    assert 0 < off <= measure.ACCURATE
    assert measure.relative_error(found * 1.001, found) == pytest.approx(1e-3, rel=1e-6)


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
        *("files.json", "bench.json", "rows.csv", "work-precision.png", "cost.png")
    }
    assert len(rows(folder / "rows.csv")) == len(tiny().rows)
    summary = json.loads(ran.out)
    assert summary == json.loads((folder / "bench.json").read_text())
    assert {"schema", "version", "machine", "seconds", "exponents", "verdicts"} < set(summary)
    assert {each["solver"] for each in summary["rows"]} >= {
        *("newton", "newton, lattice", "conic", "conic + Newton step", "conic in CVXPY"),
        *("conic in CVXPY + Newton step", "bristles", "bristles + Newton step"),
    }
    assert command("bench", "--quick").refuses("bench-results: not empty")
    said = command("bench", "--quick", "--force", "--no-figures")
    assert said.status == 0
    assert f"in products on {tiny().machine['cores']} cores" in said.out
