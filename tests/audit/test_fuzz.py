"""Spoiled files of every kind: an answer or a clear error, in time and in the memory they warrant.

18 fresh mutants by default, 3,000 with --full. Each batch is a process of its own under limits of
memory and processor time (`fuzz`).
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

BATCH = 18
FUZZ = Path(__file__).parent.parent / "fuzz.py"


def batch(first: int) -> list[dict[str, object]]:
    """What falls among these, and at the end how many had each status."""
    package = FUZZ.parent.parent
    path = os.pathsep.join([str(package), str(FUZZ.parent)])
    done = subprocess.run(
        [sys.executable, str(FUZZ), str(first), str(first + BATCH)],
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True, text=True, check=False, timeout=1200,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_mutants(pytestconfig: pytest.Config) -> None:
    fresh = 10_000 + pytestconfig.option.seed * BATCH
    seen: set[str] = set()
    for first in range(0, 3_006, BATCH) if pytestconfig.option.full else [fresh]:
        *faults, counts = batch(first)
        assert faults == []
        assert sum(counts.values()) == BATCH
        seen |= set(counts)
    if pytestconfig.option.full:
        assert {"status 0", "status 2"} <= seen
