"""Commands as processes: killed, interrupted, out of room, or without a reader; spoiled files."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from scene_files import HEXAGONAL, INTERRUPTIBLE, scene_text, scripted

from convexrough.atomic import remove_unfinished

TESTS, BATCH = Path(__file__).parent.parent, 18
forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="trials are forked processes")


def ended(*command: str, **options: Any) -> tuple[int, str, str]:
    """Status and output of a process of its own, without the threads of this one."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    return done.returncode, done.stdout, done.stderr


python = partial(ended, sys.executable)


def printed(program: str, *numbers: int) -> list[str]:
    """By a program of the tests."""
    path = os.pathsep.join([str(TESTS.parent), str(TESTS)])
    env = os.environ | {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
    status, out, err = python(str(TESTS / program), *map(str, numbers), env=env, timeout=3600)
    assert status == 0, err[-2000:]
    return out.splitlines()


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
def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path: Path, command: Any) -> None:
    """And of one that still runs, or of the user, nothing."""
    (tmp_path / "a.toml").write_text(scene_text())
    folder = tmp_path / "out"
    folder.mkdir()
    process = python("-c", "import os; print(os.getpid())")[1].strip()
    left = folder / f".summary.json.{process}.unfinished"
    for line in ("run a.toml --out out --no-figures", "new out/b.toml"):
        left.write_text("{")
        assert command(*line.split()).status == 0
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
    said = "convexrough: error: a.toml: cannot be written: File too large\n"
    assert python("-c", code, cwd=tmp_path) == (2, "", said)
    assert list(tmp_path.iterdir()) == []


def test_a_line_is_completed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("_CONVEXROUGH_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", "convexrough run --pr")
    monkeypatch.setenv("COMP_CWORD", "2")
    assert python("-m", "convexrough", cwd=tmp_path) == (0, "plain,--proof\n", "")


def test_an_interrupt_while_an_object_is_freed(tmp_path: Path) -> None:
    """Python ignores errors of `__del__`, so this interrupt would be lost."""
    code = (
        "import signal, sys, convexrough.cli.program as program\n"
        "from convexrough.__main__ import main\n"
        "class Freed:\n"
        "    def __del__(self): signal.raise_signal(signal.SIGINT)\n"
        "def status(arguments):\n"
        "    import time; Freed(); [time.sleep(0.01) for _ in range(1000)]\n"
        "program._status = status\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler); sys.exit(main())"
    )
    assert python("-c", code) == (130, "", "convexrough: interrupted\n")


@pytest.mark.sample(1)
@pytest.mark.parametrize("delay", [0.02, 0.1, 0.3, 0.6, 1.0])
def test_an_interrupt_at_any_moment(tmp_path: Path, delay: float) -> None:
    rough = HEXAGONAL.replace("0.0025", "1e-4").replace("0.02", "8e-4")
    (tmp_path / "a.toml").write_text(scene_text(rough + "height_std = 1e-7\nseed = 1"))
    running = scripted(tmp_path, INTERRUPTIBLE, "run", "a.toml")
    running.stdout.readline()
    time.sleep(delay)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate()
    assert (running.returncode, said) == (130, "convexrough: interrupted\n")
    assert not [path for path in tmp_path.rglob(".*") if path.is_file()]


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("where", "status", "said"),
    [
        (">&-", 0, ""),
        ("| true", 1, ""),  # as in `convexrough run a.toml | head -0`
        (">/dev/full", 1, "standard output: No space left on device"),
    ],
)
def test_an_output_that_nobody_takes(tmp_path: Path, where: str, status: int, said: str) -> None:
    (tmp_path / "a.toml").write_text(scene_text())
    run = f"sleep 0.2; '{sys.executable}' -m convexrough run a.toml --no-figures"
    *_, heard = ended("sh", "-c", f"({run}; echo $? >status) {where}", cwd=tmp_path)
    assert int((tmp_path / "status").read_text()) == status
    assert heard == (f"convexrough: error: {said}\n" if said else "")
    assert (tmp_path / "a-results" / "summary.json").exists()
