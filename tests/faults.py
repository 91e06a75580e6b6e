"""Commands that are killed, interrupted, out of room or in each other's way: what they leave.

    PYTHONPATH=tests python tests/faults.py $(seq 0 299)    trials by number; prints those that fall

Each trial is a process forked from one that has imported everything.
"""

import contextlib
import io
import json
import os
import random
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

import matplotlib
from scene_files import FRICTION, HEXAGONAL, STAGES, scene_text

from convexrough import cli
from convexrough.__main__ import main

RUN = ["run", "new.toml", "--out", "out", "--html", "--proof"]

#: Commands, all of which write to the folder out.
COMMANDS = {
    "run": RUN,
    "run without figures": [*RUN, "--no-figures"],
    "paper": ["paper", "--out", "out", "--html"],
    "paper without figures": ["paper", "--out", "out", "--no-figures"],
    "verify": ["verify", "new.toml", "loads.csv", "--out", "out", "--proof"],
    "new": ["new", "out/fresh.toml"],
}

#: What happens to them.
FAULTS = ("kill", "interrupt", "full", "twice", "kill, again")

#: What may be left of a file that was being written by a process that was killed.
UNFINISHED = re.compile(r"\.(.+)\.(\d+)\.unfinished")

Files = dict[str, bytes]


def trial(
    seed: int, durations: dict[str, float], finished: dict[str, Files]
) -> tuple[str, str, int, str]:
    """In a folder of its own: the command, its fault, its status, and what fell, "" if nothing."""
    rng = random.Random(seed)
    name = _command(seed)
    fault = FAULTS[seed // len(COMMANDS) % len(FAULTS)]
    force = name not in ("verify", "new") and rng.random() < 0.5
    arguments = [*COMMANDS[name], *(["--force"] if force else [])]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        prepare(folder)
        earlier = finished["old" if name.startswith("run") else name]
        left = {**earlier, "notes.txt": b"mine"} if force else {}  # and a file of the user
        for file, data in left.items():
            (folder / "out" / file).write_bytes(data)
        status, said = _tried(folder, arguments, fault, rng, durations[name])
        found = contents(folder / "out")
        refused = status == 2 and name in ("verify", "new")  # what is there already is not theirs
        what = _wrong(found, left, finished[name], fault, refused)
    allowed = (130, -signal.SIGKILL, 0, 2, 3)
    if not what and (status not in allowed or "Traceback" in said):
        what = f"status {status}: {said[-600:]}"
    return name, fault, status, what


def _command(seed: int) -> str:
    return list(COMMANDS)[seed % len(COMMANDS)]


def prepare(folder: Path) -> None:
    """What commands read; the loads are those that they would be."""
    for name, approach in (("new", "2e-5"), ("old", "1e-5")):
        layout, more = f"{HEXAGONAL}within = 0.003", FRICTION + STAGES
        text = scene_text(layout, f"approach = {approach}", more)
        (folder / f"{name}.toml").write_text(text)
    (folder / "loads.csv").write_text("load\n" + "1e-9\n" * 7)
    (folder / "said").touch()  # a process may be killed before it says anything
    (folder / "out").mkdir()


def _tried(
    folder: Path, arguments: list[str], fault: str, rng: random.Random, duration: float
) -> tuple[int, str]:
    """Status of the command that it happens to (of the last one), and what they say."""
    limit = rng.choice([500, 1000, 5000, 20_000, 100_000]) if fault == "full" else None
    running = [_forked(folder, arguments, limit)]
    if fault == "twice":
        time.sleep(rng.uniform(0, duration / 2))
        running.append(_forked(folder, arguments, limit))
    if fault in ("kill", "interrupt", "kill, again"):
        time.sleep(rng.uniform(0, 1.05 * duration))
        os.kill(running[0], signal.SIGINT if fault == "interrupt" else signal.SIGKILL)
    status = max(_ended(process) for process in running)
    if fault == "kill, again":
        again = {"verify": [], "new": []}.get(arguments[0], ["--force"])
        status = _ended(_forked(folder, [*arguments, *again], None))
    return status, (folder / "said").read_text()


def _ended(process: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def _forked(folder: Path, arguments: list[str], limit: int | None) -> int:
    """A process that runs the command; limit [bytes] of each file."""
    # An interrupt of the child must not come before there is somebody to take it.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    if process := os.fork():
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return process
    status = 130  # of an interrupt before the command has begun
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        os.chdir(folder)
        said = os.open("said", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(said, 2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        sys.argv = ["convexrough", *arguments]
        status = 99
        status = main()  # takes interrupts as the command begins or ends, and in callbacks
    except BaseException:
        if status == 99:
            os.write(2, traceback.format_exc().encode())
    finally:
        os._exit(status)


def contents(folder: Path) -> Files:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def _wrong(found: Files, before: Files, finished: Files, fault: str, refused: bool) -> str:
    """What a folder holds that it should not; nothing is touched where another run was refused."""
    for file, data in found.items():
        killed = fault == "kill" or (fault == "kill, again" and refused)
        if killed and UNFINISHED.fullmatch(file):
            continue
        if data == before.get(file):
            continue
        if file not in finished:
            return f"{file} is left"
        if why := _incomplete(file, data, finished[file]):
            return f"{file}: {why}"
    if before and found.get("notes.txt") != before.get("notes.txt"):
        return "a file of the user's is gone"
    if fault == "kill, again" and not refused and set(finished) - set(found):
        return f"not there after another run: {set(finished) - set(found)}"
    return ""


def _incomplete(name: str, data: bytes, whole: bytes) -> str:
    """Why a file is not what it should be: the same as undisturbed, but for times."""
    kind = name.rpartition(".")[2]
    if kind in ("csv", "toml"):
        return "" if data == whole else "not as undisturbed"
    if kind == "json":
        try:
            json.loads(data)
        except ValueError as error:
            return f"{error}"
    end = {"html": b"</html>", "png": b"IEND\xaeB`\x82"}.get(kind, b"")
    return "" if data.rstrip(b"\n").endswith(end) else "torn"


def undisturbed(names: set[str]) -> tuple[dict[str, float], dict[str, Files]]:
    """How long these commands take, and what they write; under "old" an earlier run's."""
    durations: dict[str, float] = {}
    finished: dict[str, Files] = {}
    old = ["run", "old.toml", "--out", "out", "--no-figures"]
    for name in [*names, "old"]:
        with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
            prepare(Path(place))
            said = io.StringIO()
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                cli.main(COMMANDS.get(name, old))
            finished[name] = contents(Path("out"))
        with tempfile.TemporaryDirectory() as place:
            prepare(Path(place))
            begin = time.monotonic()  # now that all is imported
            _ended(_forked(Path(place), COMMANDS.get(name, old), None))
            durations[name] = time.monotonic() - begin
    return durations, finished


if __name__ == "__main__":
    matplotlib.use("agg")
    seeds = list(map(int, sys.argv[1:]))
    durations, finished = undisturbed({_command(seed) for seed in seeds})
    seen: Counter[str] = Counter()
    for seed in seeds:
        name, fault, status, what = trial(seed, durations, finished)
        seen[f"{fault}: {status}"] += 1
        if what:
            print(json.dumps([seed, name, fault, status, what]), flush=True)
    print(json.dumps(seen))
