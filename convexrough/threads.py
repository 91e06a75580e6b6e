"""Work on parts of large arrays, some parts on each core: numpy and transforms let others run."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ContextDecorator, nullcontext
from types import TracebackType
from typing import Any, TypeVar

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


class OneThread(ContextDecorator):
    """Linear algebra in one thread, while any thread of this process is inside.

    Two add up in another order, and are in the way of threads that work on arrays here. The last
    to leave gives the others back.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._limits: Any = None

    def __enter__(self) -> OneThread:
        with self._lock:
            self._inside += 1
            if self._limits is None:
                import scipy.linalg  # noqa: F401  what is not loaded yet cannot be told
                from threadpoolctl import threadpool_limits

                _free()
                self._limits = threadpool_limits(1)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0 and self._limits is not None:
                _free()
                self._limits.restore_original_limits()
                self._limits = None
                _free()


def _free() -> None:
    """Let this thread set limits: threadpoolctl 3.8 heeds only the thread that was first."""
    from threadpoolctl import OpenBLASController

    if hasattr(OpenBLASController, "clear_controlling_thread"):
        OpenBLASController.clear_controlling_thread(force=True)


one_thread = OneThread()


def one_where(numbers: int) -> AbstractContextManager[object]:
    """`one_thread` for work on arrays of so many numbers, if that is worth threads of its own."""
    return one_thread if worthwhile(numbers) > 1 else nullcontext()
