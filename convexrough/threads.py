"""Work on parts of large arrays in several threads."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any, TypeVar

Part = TypeVar("Part")

#: Up to this many numbers, the work takes less time than starting threads.
MANY = 2**18


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
    No call may write what another call reads. At the end no other thread runs: fork is safe."""
    todo, errors = iter(list(parts)), list[BaseException]()  # `next` of a list's iterator is atomic

    def some() -> None:
        try:
            for part in todo:
                work(part)
        except BaseException as error:
            errors.append(error)

    others = [threading.Thread(target=some) for _ in range(threads - 1)]
    for other in others:
        other.start()
    some()
    for other in others:
        other.join()
    if errors:
        raise errors[0]


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
            import scipy.linalg  # noqa: F401  limits apply only to loaded libraries
            from threadpoolctl import threadpool_limits

            _free()
            limits = threadpool_limits(1)
        else:
            limits = _inside[0]
        _inside.append(limits)
    try:
        yield
    finally:
        with _lock:
            if len(_inside) == 1:
                _free()
                limits.restore_original_limits()
                _free()
            _inside.pop()


def _free() -> None:
    """Let this thread set limits; threadpoolctl 3.8 accepts them only from the first thread."""
    from threadpoolctl import OpenBLASController

    if hasattr(OpenBLASController, "clear_controlling_thread"):
        OpenBLASController.clear_controlling_thread(force=True)


def one_where(numbers: int) -> AbstractContextManager[object]:
    """`one_thread()` if arrays of this many numbers use several threads, else no effect."""
    return one_thread() if worthwhile(numbers) > 1 else nullcontext()
