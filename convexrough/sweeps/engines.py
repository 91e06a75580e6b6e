"""Who computes the batches: processes here, Dask workers anywhere, or any executor.

All are executors of `concurrent.futures`; what is different is how many batches they take at once,
what they raise where a worker died, and whether they can be had anew.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from types import ModuleType
from typing import Any, Protocol

from convexrough.errors import ExtraError, InputError, WorkerError
from convexrough.sweeps.batch import Batch, Rows, compute

#: Batches that an executor of somebody else's is given at once.
AT_ONCE = 64

#: [s] that a pool is waited for when it is given up: its workers stop after the scene they are at.
ENDING = 10.0

#: What an executor raises where a worker died with a batch.
LOST: tuple[type[BaseException], ...] = (BrokenExecutor,)


class Engine(Protocol):
    """Where batches are computed.

    lost : what a future raises where the worker of its batch died
    """

    @property
    def lost(self) -> tuple[type[BaseException], ...]: ...

    def at_once(self) -> int:
        """How many batches to give it before the first is back."""
        ...

    def submit(self, batch: Batch) -> Future[Rows]: ...

    def renew(self) -> bool:
        """Replace workers that are gone; False where that is not in its hands."""
        ...

    def stop(self) -> bool:
        """Have workers give back what they have; False where they cannot be told."""
        ...


@dataclass
class Given:
    """An executor of the user's, who also ends it."""

    executor: Executor
    lost: tuple[type[BaseException], ...] = LOST

    def at_once(self) -> int:
        return AT_ONCE

    def submit(self, batch: Batch) -> Future[Rows]:
        return self.executor.submit(compute, batch)

    def renew(self) -> bool:
        return False

    def stop(self) -> bool:
        return False


@dataclass
class Processes:
    """Processes of this machine, started as new interpreters: no lock or thread is inherited."""

    workers: int
    lost: tuple[type[BaseException], ...] = LOST
    _pool: ProcessPoolExecutor | None = None
    _context: Any = field(default_factory=lambda: multiprocessing.get_context("spawn"))

    def __post_init__(self) -> None:
        self._stopping = self._context.RawValue(ctypes.c_bool, False)  # no lock to die with

    def at_once(self) -> int:
        return 2 * self.workers

    def submit(self, batch: Batch) -> Future[Rows]:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self.workers,
                mp_context=self._context,
                initializer=_begin,
                initargs=(self._stopping,),
            )
        with _sheltered():
            return self._pool.submit(_compute_here, batch)

    def renew(self) -> bool:
        self.close()
        return True

    def stop(self) -> bool:
        self._stopping.value = True
        return True

    def close(self) -> None:
        """Waits for the pool to end, if that is soon: Python ending it may leave a traceback."""
        if self._pool is not None:
            ending = {"wait": True, "cancel_futures": True}
            thread = threading.Thread(target=self._pool.shutdown, kwargs=ending, daemon=True)
            thread.start()
            thread.join(ENDING)
            self._pool = None


@dataclass
class Dask:
    """Workers of a Dask cluster, which may come and go."""

    client: Any
    lost: tuple[type[BaseException], ...] = LOST

    def __post_init__(self) -> None:
        from distributed import KilledWorker

        self.lost = (KilledWorker,)
        self._executor: Executor = self.client.get_executor(pure=False)

    def at_once(self) -> int:
        try:
            threads = sum(self.client.nthreads().values())
        except OSError as error:
            raise WorkerError(f"the scheduler of Dask is gone: {error}") from error
        return max(4, 2 * int(threads))

    def submit(self, batch: Batch) -> Future[Rows]:
        return self._executor.submit(compute, batch)

    def renew(self) -> bool:
        return True  # its workers are the scheduler's business

    def stop(self) -> bool:
        return False


@contextmanager
def processes(workers: int | None = None) -> Iterator[Processes]:
    """As many processes, or as many as this one may use processors."""
    engine = Processes(processors() if workers is None else workers)
    try:
        yield engine
    finally:
        engine.stop()
        engine.close()


@contextmanager
def dask(address: str) -> Iterator[Dask]:
    """The cluster of a Dask scheduler.

    address : of the scheduler, "tcp://host:port"; or its file, "scheduler.json"; or "local" for a
        cluster of its own on this machine

    Raises ExtraError where Dask is not installed, and InputError where nobody answers.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise ExtraError("dask") from error
    try:
        if address == "local":
            client = Client(n_workers=processors(), threads_per_worker=1, dashboard_address=None)
        elif address.endswith(".json"):
            client = Client(scheduler_file=address)
        else:
            client = Client(address)
    except (OSError, ValueError, TimeoutError) as error:
        expected = 'a scheduler of Dask that answers, its file, or "local"'
        raise InputError("scheduler", found=f"{address} ({error})", expected=expected) from error
    try:
        yield Dask(client)
    finally:
        client.close()


def processors() -> int:
    """How many this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def _sheltered() -> Iterator[None]:
    """New processes do not run the user's script, which need not be guarded, and no interrupt.

    A terminal interrupts them, too, and what is blocked here they have blocked for ever.
    """
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    masks = hasattr(signal, "pthread_sigmask")  # not everywhere
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    try:
        yield
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        sys.modules["__main__"] = script


_told_to_stop: Callable[[], bool]


def _begin(stopping: Any) -> None:
    """What a process of ours does first: its end and its interrupts are its parent's business."""
    global _told_to_stop
    _told_to_stop = lambda: bool(stopping.value)  # noqa: E731
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(
        target=_end_with, args=(multiprocessing.parent_process(),), daemon=True
    ).start()


def _end_with(parent: BaseProcess | None) -> None:
    """A parent that was killed cannot say so."""
    if parent is not None:
        parent.join()
        os._exit(1)


def _compute_here(batch: Batch) -> Rows:
    return compute(batch, _told_to_stop)
