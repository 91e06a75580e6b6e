"""The workers that compute the batches: local processes, Dask workers, or any executor."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent import futures
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager, suppress
from functools import partial
from itertools import islice
from types import ModuleType
from typing import Any

from convexrough.errors import InputError, WorkerError, needed
from convexrough.sweeps.batch import Batch, Columns, compute, different
from convexrough.threads import cores

#: Largest number of batches submitted at a time: to a given executor; for each local process.
AT_ONCE, EACH = 1000, 2

#: The sweep ends if more batches than this are lost. A batch is lost if its worker dies.
MOST_LOST = 64


def computed(batches: Iterable[Batch], executor: Executor) -> Iterator[Columns]:
    """Yield the rows of batches, in order of completion; lost ones again at the end, one by one.

    Raises WorkerError if a batch is lost twice, if more than `MOST_LOST` batches are lost, if a
    worker has other versions of packages, or if the executor is broken or cancels a batch.
    """
    lost = yield from _together(iter(batches), executor)
    dead = []
    for batch in lost:
        dead += yield from _together(iter((batch,)), executor)
    if dead:
        which = ", ".join(map(str, dead))
        raise WorkerError(f"the process that computed scenes {which} died twice")


def _together(
    batches: Iterator[Batch], executor: Executor
) -> Generator[Columns, None, list[Batch]]:
    """Yield the rows of batches in any order; return the batches whose workers died."""
    most = EACH * executor.workers if isinstance(executor, Processes) else AT_ONCE
    pending: dict[Future[Any], Batch] = {}
    lost: list[Batch] = []
    dask = sys.modules.get("distributed")
    killed = (dask.KilledWorker,) if dask else ()
    try:
        while True:
            for batch in islice(batches, most - len(pending)):
                pending[executor.submit(compute, batch)] = batch
            if not pending:
                return lost
            for future in futures.wait(pending, return_when=futures.FIRST_COMPLETED).done:
                batch = pending.pop(future)
                try:
                    columns, versions = future.result()
                except (BrokenExecutor, *killed) as error:
                    lost.append(batch)
                    if len(lost) > MOST_LOST:
                        said = f"workers died in more than {MOST_LOST} batches: {error}"
                        raise WorkerError(said) from error
                    continue
                if other := different(versions):
                    raise WorkerError(f"a worker has other versions: {other}")
                yield columns
    except BrokenExecutor as error:  # only the caller can restart this executor
        raise WorkerError(f"the executor is broken: {error}") from error
    except futures.CancelledError as error:
        raise WorkerError("a batch was cancelled: check that the scheduler runs") from error
    finally:
        for future in pending:
            future.cancel()


class Processes(Executor):
    """An executor with processes on this machine. If one dies, new processes replace all."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers = workers or cores()
        self._context = multiprocessing.get_context("spawn")
        self._held, self._leash = self._context.Pipe(duplex=False)
        self._pool = self._begun()

    def _begun(self) -> futures.ProcessPoolExecutor:
        return futures.ProcessPoolExecutor(
            self.workers, self._context, initializer=_end_with, initargs=(self._held,)
        )

    def submit(self, function: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:
        with _sheltered():
            try:
                return self._pool.submit(function, *given, **named)
            except BrokenExecutor:
                self._pool = self._begun()
                return self._pool.submit(function, *given, **named)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = True) -> None:
        """End the processes at once, without waiting for their batches."""
        self._leash.close()
        self._pool.shutdown(wait, cancel_futures=cancel_futures)


def _end_with(pipe: Any) -> None:
    """Start a thread that ends this process when the parent's end of the pipe closes."""

    def watch() -> None:
        with suppress(EOFError, OSError):
            pipe.recv_bytes()
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _sheltered() -> Iterator[None]:
    """A context in which new processes do not run the user's script, and ignore interrupts."""
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    masks = hasattr(signal, "pthread_sigmask")  # false on Windows
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    try:
        yield
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        sys.modules["__main__"] = script


@contextmanager
def dask(address: str) -> Iterator[Executor]:
    """An executor on the workers of a Dask scheduler; workers may join and leave.

    address : "tcp://host:port" of the scheduler, the path of its .json file, or "local" for a new
        cluster on this machine

    Raises ExtraError if Dask is not installed; InputError if no scheduler answers.
    """
    client_of = needed("distributed", "dask").Client
    own = partial(client_of, set_as_default=False)  # a failing client must not stay the default
    try:
        if address == "local":
            client = own(n_workers=cores(), threads_per_worker=1, dashboard_address=None)
        elif address.endswith(".json"):
            client = own(scheduler_file=address)
        else:
            client = own(address)
    except (OSError, ValueError, TimeoutError) as error:
        expected = 'a scheduler of Dask that answers, its file, or "local"'
        raise InputError("scheduler", found=f"{address} ({error})", expected=expected) from error
    with client:
        yield client.get_executor(pure=False)
