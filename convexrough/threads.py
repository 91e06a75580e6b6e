"""Work on parts of large arrays, some parts on each core: numpy and transforms let others run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Part = TypeVar("Part")

#: Work on no more numbers than this is done sooner than threads are started.
MANY = 2**18


def cores() -> int:
    """How many this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on macOS and Windows
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def worthwhile(numbers: int) -> int:
    """How many to start for work on arrays of so many numbers."""
    return cores() if numbers > MANY else 1


def each(work: Callable[[Part], object], parts: Iterable[Part], threads: int) -> None:
    """work(part) for each part, in any order; parts must not write to what another reads.

    Threads are started here and have ended when this returns: a process may be forked at any time.
    """
    if threads == 1:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(work, parts):
            pass  # an error in a part is raised here


def chunks(length: int, size: int) -> Iterator[slice]:
    """Slices that cover an array, of this size at most."""
    for start in range(0, length, size):
        yield slice(start, min(start + size, length))
