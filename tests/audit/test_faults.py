"""Commands that are killed, out of room or in each other's way, and spoiled files of every kind."""

import json
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest
from scene_files import scene_text

from convexrough.atomic import remove_unfinished

TESTS, BATCH = Path(__file__).parent.parent, 18
forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="trials are forked processes")


def printed(program: str, *numbers: int) -> list[str]:
    """By a program of the tests, in a process of its own, without the threads of this one."""
    path = os.pathsep.join([str(TESTS.parent), str(TESTS)])
    done = subprocess.run(
        [sys.executable, str(TESTS / program), *map(str, numbers)],
        env=os.environ | {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True, text=True, check=False, timeout=3600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()


@forks
def test_what_is_left(pytestconfig: pytest.Config) -> None:
    quick = [seed for seed in range(30) if seed % 6 in (1, 5)]
    sample = random.Random(pytestconfig.option.seed).sample(quick, 2)
    lines = printed("faults.py", *(range(300) if pytestconfig.option.full else sample))
    assert len(lines) == 1, lines


def test_mutants(pytestconfig: pytest.Config) -> None:
    fresh = 10_000 + pytestconfig.option.seed * BATCH
    seen: set[str] = set()
    for first in range(0, 3_006, BATCH) if pytestconfig.option.full else [fresh]:
        *fallen, counts = map(json.loads, printed("fuzz.py", first, first + BATCH))
        assert fallen == []
        assert sum(counts.values()) == BATCH
        seen |= set(counts)
    if pytestconfig.option.full:
        assert {"status 0", "status 2"} <= seen


@forks
def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path: Path, command: object) -> None:
    """And of one that still runs, or of the user, nothing."""
    (tmp_path / "a.toml").write_text(scene_text())
    folder = tmp_path / "out"
    folder.mkdir()
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    left = folder / f".summary.json.{ended.pid}.unfinished"
    left.write_text("{")
    assert command("run", "a.toml", "--out", "out", "--no-figures").status == 0  # type: ignore
    assert not left.exists()
    kept = [folder / f".a.{os.getpid()}.unfinished", folder / ".a.1.unfinished.txt", folder / ".a"]
    for path in kept:
        path.write_text("mine")
    remove_unfinished(folder)
    assert all(path.exists() for path in kept)


@forks
def test_new_on_a_full_disk_leaves_nothing(tmp_path: Path) -> None:
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)); "
    code = limit + "from convexrough.cli import main; raise SystemExit(main(['new', 'a.toml']))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr == "convexrough: error: a.toml: cannot be written: File too large\n"
    assert list(tmp_path.iterdir()) == []
