"""Work on parts of large arrays in several threads."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import cache
from typing import Any, TypeVar

Part = TypeVar("Part")

#: Up to this many numbers, the work takes less time than sharing it among threads.
MANY = 2**17


def cores() -> int:
    """The number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on macOS and Windows
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def worthwhile(numbers: int) -> int:
    """The number of threads to use for arrays of this many numbers."""
    return cores() if numbers > MANY else 1


def each(work: Callable[[Part], object], parts: Iterable[Part], threads: int) -> None:
    """Call work(part) for each part, in any order, also in this thread; raise one of its errors.
    No call may write what another call reads."""
    todo = iter(list(parts))  # `next` of a list's iterator is atomic

    def some() -> None:
        for part in todo:
            work(part)

    others: list[Future[None]] = []
    try:
        for _ in range(threads - 1):
            try:
                others.append(_pool().submit(some))
            except RuntimeError as error:  # also where the process ends: this thread does the work
                if "shutdown" not in str(error):
                    raise  # the system refuses another thread
        some()
    finally:
        started = [other for other in others if not other.cancel()]
        wait(started)
    for other in started:
        other.result()  # raises its error


@cache
def _pool() -> ThreadPoolExecutor:
    """The threads besides the caller's, which wait for work until the process ends."""
    return ThreadPoolExecutor(max(1, cores() - 1))


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_pool.cache_clear)  # a child has none of these threads


def chunks(length: int, size: int) -> Iterator[slice]:
    """Slices of at most this size that cover an array of this length."""
    for start in range(0, length, size):
        yield slice(start, min(start + size, length))


_lock = threading.Lock()
_inside: list[Any] = []


@contextmanager
def one_thread() -> Iterator[None]:
    """A context manager: linear algebra in the body uses one thread, until the last thread leaves
    it. Several threads would round sums differently and slow down those of `each`."""
    with _lock:
        if not _inside:
            _free()
        _inside.append(_inside[0] if _inside else _libraries().limit(limits=1))
    try:
        yield
    finally:
        with _lock:
            limits = _inside.pop()
            if not _inside:
                _free()
                limits.restore_original_limits()
                _free()


@cache
def _libraries() -> Any:
    """The libraries of linear algebra, which take a millisecond to find."""
    import scipy.linalg  # noqa: F401  limits apply only to libraries loaded before the first call
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def _free() -> None:
    """Let this thread set limits; threadpoolctl 3.8 accepts them only from the first thread."""
    from threadpoolctl import OpenBLASController

    if hasattr(OpenBLASController, "clear_controlling_thread"):
        OpenBLASController.clear_controlling_thread(force=True)


def one_where(numbers: int) -> AbstractContextManager[object]:
    """`one_thread()` if arrays of this many numbers use several threads, else no effect."""
    return one_thread() if worthwhile(numbers) > 1 else nullcontext()
