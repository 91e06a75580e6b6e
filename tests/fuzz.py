"""Mutated files through the command line: an answer, or a clear error; never anything else.

    PYTHONPATH=tests python tests/fuzz.py 0 3000        mutants by number; prints those that fall

One process runs many `mutants`, under limits of its own: processor time and memory for each,
address space for all. A warning counts as a traceback.
"""

import contextlib
import io
import json
import re
import resource
import signal
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import psutil
from mutants import LONG, Mutant, mutant

import convexrough as cr
from convexrough import cli
from convexrough.errors import ConvexroughError
from convexrough.memory import MemoryRise

#: Of processor time for one mutant, and of 100 MB in one.
SECONDS, LONG_SECONDS = 20, 120

#: Of memory beside what the file itself warrants, and what the machine is said to have.
SPARE, AVAILABLE = 2**28, 2**29

#: Times the size of a file: what reading it may take.
WARRANTED = 40

#: Scenes of more asperities are read and not computed.
MOST_ASPERITIES = 400


class Hang(BaseException):
    """Too much processor time."""


# Running them -------------------------------------------------------------------------------------


class Ran(NamedTuple):
    """What became of a mutant; `fault` is "" where all is well."""

    seed: int
    how: str
    status: int | None
    fault: str


def run(seed: int) -> Ran:
    """In a folder of its own, in this process."""
    made = mutant(seed)
    size = sum(map(len, made.files.values()))
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        for path, contents in made.files.items():
            Path(path).write_bytes(contents)
        status, said, fault = _called(made, size)
    if not fault and status == 2 and not re.search(r"(error|unreadable|Error): \S", said):
        fault = f"no reason: {said[:200]!r}"
    if not fault and status not in _statuses(made.arguments[0]):
        fault = f"status {status}: {said[:200]!r}"
    if not fault and len(said) > 20_000 and "--json" not in made.arguments:
        fault = f"{len(said)} characters: {said[:200]!r}"
    return Ran(seed, made.how, status, fault)


def _statuses(command: str) -> tuple[int, ...]:
    return (0, 1, 2) if command == "check" else (0, 2, 3, 4)


def _called(made: Mutant, size: int) -> tuple[int | None, str, str]:
    """Status, what standard error says, and the fault."""
    out, err = io.StringIO(), io.StringIO()
    rise = MemoryRise()
    signal.setitimer(signal.ITIMER_PROF, LONG_SECONDS if size > 2**24 else SECONDS)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = 2 if _large(made, err) else cli.main(made.arguments)
    except Hang:
        return None, "", f"hangs: {traceback.format_exc().splitlines()[-3:]}"
    except BaseException:
        return None, "", "".join(traceback.format_exc().splitlines(keepends=True)[-12:])
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    risen = rise.risen() or 0
    if risen > SPARE + WARRANTED * size:
        return status, err.getvalue(), f"{risen / 2**20:.0f} MiB for {size} bytes"
    return status, err.getvalue(), ""


def _large(made: Mutant, err: io.StringIO) -> bool:
    """Whether it is a scene that would take long, as it should."""
    if made.arguments[0] == "check":
        return False
    try:
        large = len(cr.read_scene("a.toml").scene) > MOST_ASPERITIES
    except ConvexroughError:
        return False
    if large:
        print("error: read only, as it is large", file=err)
    return large


def limited() -> None:
    """This process from here on."""

    def too_long(*_: object) -> None:
        raise Hang

    signal.signal(signal.SIGPROF, too_long)
    warnings.simplefilter("error")
    for seed in range(6):  # what is imported, and kept, when first used
        run(seed)
    held = psutil.Process().memory_info().vms
    most = held + AVAILABLE + 2 * SPARE + 12 * LONG
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    psutil.virtual_memory = lambda: SimpleNamespace(available=AVAILABLE)  # type: ignore


def main(first: int, last: int) -> Iterator[Ran]:
    limited()
    for seed in range(first, last):
        yield run(seed)


if __name__ == "__main__":
    seen: Counter[str] = Counter()
    for ran in main(int(sys.argv[1]), int(sys.argv[2])):
        seen[f"status {ran.status}"] += 1
        if ran.fault:
            print(json.dumps(ran._asdict()), flush=True)
    print(json.dumps(seen))
