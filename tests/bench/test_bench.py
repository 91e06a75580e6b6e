"""The benchmark: what it writes. No time is tested."""

import json
from pathlib import Path
from typing import Any

import pytest
from scene_files import rows

from convexrough.bench import measure, suite
from convexrough.comparison import every_solver

SMALL = (("lattice", 61),)


def test_command(command: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suite, "WORK", SMALL)
    monkeypatch.setattr(suite, "PRESSES", (*SMALL, ("scattered", 61)))
    monkeypatch.setattr(suite, "FOLLOWING", dict.fromkeys(suite.FOLLOWING, SMALL))
    monkeypatch.setattr(suite, "SWEEPS", ((61, 200, 1),))
    monkeypatch.setattr(suite, "ROUNDS", 1)
    monkeypatch.setattr(measure, "LEAST_RUNS", 1)
    made = suite.run(quick=True)
    monkeypatch.setattr(suite, "run", lambda quick: made)
    ran = command("bench", "--quick", "--json")
    assert (ran.status, ran.err) == (0, "")
    folder, summary = tmp_path / "bench-results", json.loads(ran.out)
    written = {path.name for path in folder.iterdir()}
    assert written == {"files.json", "bench.json", "rows.csv", "work-precision.png", "cost.png"}
    assert len(rows(folder / "rows.csv")) == len(made.rows)
    assert summary == json.loads((folder / "bench.json").read_text())
    assert {"schema", "version", "machine", "seconds", "exponents", "verdicts"} < set(summary)
    solvers = {each["solver"] for each in summary["rows"]}
    assert {"newton, lattice", *(solver.name for solver in every_solver()[:5])} <= solvers
    assert {"bristles", "bristles + Newton step"} <= solvers
    assert command("bench", "--quick").refuses("bench-results: not empty")
    said = command("bench", "--quick", "--force", "--no-figures")
    assert (said.status, f"products on {made.machine['cores']} cores" in said.out) == (0, True)
