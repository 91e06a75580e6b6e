"""`sweep`: compute many scenes, and return a table; and the workers that compute the batches."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent import futures
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager, nullcontext, suppress
from datetime import timedelta
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import frozen
from convexrough.errors import InputError, WorkerError, needed
from convexrough.progress import LOGGER
from convexrough.scene.scene import Scene
from convexrough.sweeps.batch import Batch, Columns, compute, different
from convexrough.sweeps.folder import make_folder, part_from
from convexrough.sweeps.plan import Plan, plan_of, plan_of_scenes
from convexrough.sweeps.table import SweepTable
from convexrough.threads import cores

#: Largest number of scenes that one call computes; for more, each call computes a share.
MOST = 10**8

#: Largest numbers of batches submitted at a time to a given executor, and for each local process;
#: and of batches that may be lost because their workers die.
AT_ONCE, EACH, MOST_LOST = 1000, 2, 64

#: Held while `__main__` is replaced.
SHELTER = threading.Lock()


def sweep(
    what: str | os.PathLike[str] | Mapping[str, Any] | Iterable[Scene],
    *,
    measure: Sequence[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    part: tuple[int, int] | None = None,
    approach: ArrayLike | None = None,
    load: ArrayLike | None = None,
    cycle: Sequence[float] = (),
    shear: Sequence[float] = (),
) -> SweepTable:
    """A table with a row for each of many scenes and a column for each measured number.

    docs/how-to/sweep.md describes sweep files.

    what     : a sweep file; or its tables, as a mapping; or scenes
    approach, load : only if `what` is scenes, and only one of the two: approaches [length] or loads
        [force]; one number for all scenes, or one for each scene
    cycle, shear : only if `what` is scenes: amplitudes of cycles and shear forces, as fractions of
        the friction limit (coefficient of friction times load)
    measure  : names of numbers in summary.json, such as "cycle.loss", or their last parts ("loss");
        replaces the list of a sweep file
    out      : folder for the results; default: the results are only returned
    executor : any executor of `concurrent.futures`; default: processes
    workers  : number of processes; default: the number of cores that this process may use
    resume   : continue an interrupted sweep in the folder
    overwrite : first remove another sweep from the folder, or earlier rows of these scenes
    part     : (k, n): compute only the k-th of n shares of the scenes, with k from 1 to n

    The table is the same, bit for bit, for any executor, any order of computing and any number of
    interruptions. In the row of a failed scene, `message` states the reason.

    Raises FileError and InputError for wrong input, before the sweep begins; WorkerError if workers
    died twice while computing the same scenes, died too often, or have other versions of packages.

    >>> scenes = [cr.Scene(R, scene.asperities, scene.material) for R in (0.9, 1.0, 1.1)]
    >>> table = cr.sweep(scenes, approach=5e-5, measure=["contact", "load"], workers=1)
    >>> print(table.read()["contact"])
    [37. 37. 43.]
    """
    if resume and overwrite:
        expected = "one of them: continue the sweep in the folder, or remove it"
        raise InputError("resume, overwrite", found="both", expected=expected)
    if out is None and (resume or overwrite):
        expected = "the folder of an earlier sweep, as resume and overwrite need one"
        raise InputError("out", found="none", expected=expected)
    given: dict[str, Any] = dict(approach=approach, load=load, cycle=cycle, shear=shear)
    if not isinstance(what, (str, os.PathLike, Mapping)):
        plan = plan_of_scenes(what, measure, approach, load, cycle, shear)
    elif own := [name for name, it in given.items() if it is not None and np.size(it)]:
        raise InputError(own[0], found="given", expected="none: the sweep tables state it")
    else:
        plan = plan_of(what, measure=measure)
    if executor is not None:
        checks.instance("executor", executor, Executor)
    elif workers is not None:
        checks.whole("workers", workers)
    with nullcontext(executor) if executor is not None else Processes(workers) as mine:
        return run(plan, mine, out=out, resume=resume, overwrite=overwrite, part=part)[0]


def run(
    plan: Plan,
    executor: Executor,
    *,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    overwrite: bool = False,
    part: tuple[int, int] | None = None,
) -> tuple[SweepTable, dict[str, Any]]:
    """The table of a plan, with its missing rows computed; arguments as for `sweep`. And by name: a
    message about rows that are `found`, the number of scenes that are `computed`, and `seconds`."""
    began, folder, found = time.monotonic(), None, ""
    todo = _share(plan, part)
    if out is not None:
        folder = make_folder(Path(out), plan.manifest, overwrite=overwrite)
        for each in todo if overwrite else ():
            folder.file(each.start).unlink(missing_ok=True)
        todo, found = folder.missing(todo, resume)
        LOGGER.info(found)
    count = sum(map(len, todo))
    parts = [Batch(plan.source, plan.columns, range(0)).table([])]  # no rows, all columns
    for columns in _report_progress(computed(map(plan.batch, todo), executor), count):
        if folder is None:
            parts.append(columns)
        else:
            folder.write(columns)
    did = {"found": found, "computed": count, "seconds": time.monotonic() - began}
    if folder is not None:
        return SweepTable(folder.manifest, folder), did
    parts.sort(key=lambda each: each["scene"][0] if len(each["scene"]) else -1)
    rows = {name: frozen(np.concatenate([each[name] for each in parts])) for name in parts[0]}
    return SweepTable(plan.manifest, None, rows), did


def _share(plan: Plan, part: tuple[int, int] | None) -> list[range]:
    """The parts (ranges of scenes) in share k of n shares, for `part` = (k, n); all for None."""
    if part is not None and not (isinstance(part, tuple) and len(part) == 2):
        raise InputError("part", found=repr(part), expected="(K, N) with K from 1 to N")
    k, n = (checks.whole("part", each) for each in part or (1, 1))
    if not 1 <= k <= n:
        raise InputError("part", found=f"{k}/{n}", expected="K/N with K from 1 to N")
    size = plan.manifest["batch"]
    parts = -(-plan.manifest["scenes"] // size)
    first, stop = parts * (k - 1) // n, parts * k // n
    if (count := (stop - first) * size) > MOST:
        expected = f"at most {MOST:,} at once: compute the sweep in parts (K/N)"
        where = str(plan.manifest["source"])
        raise InputError("scenes", found=f"about {count:,}", expected=expected, where=where)
    return [part_from(plan.manifest, number * size) for number in range(first, stop)]


def _report_progress(found: Iterator[Columns], count: int) -> Iterator[Columns]:
    """Yield `found` unchanged, and log the progress."""
    began, done, failed = time.monotonic(), 0, 0
    for columns in found:
        yield columns
        done += len(columns["status"])
        failed += int(np.count_nonzero(columns["status"] == "failed"))
        rate = done / max(time.monotonic() - began, 1e-9)
        left = timedelta(seconds=round((count - done) / rate))
        said = f"{done:,} of {count:,} scenes, {rate:,.3g} per second, {left} left"
        LOGGER.info(said + (f", {failed:,} failed" if failed else ""))


def computed(batches: Iterable[Batch], executor: Executor) -> Iterator[Columns]:
    """Yield the rows of batches, in order of completion; lost ones again at the end, one by one.
    Raises WorkerError as `sweep` does."""
    dead = []
    for batch in (yield from _together(iter(batches), executor)):
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
    with SHELTER:
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

    address : "tcp://host:port", the path of a .json file, or "local" for a new cluster here

    Raises ExtraError if Dask is not installed; InputError if no scheduler answers.
    """
    client_of = needed("distributed", "dask").Client
    given: Any = {"address": address}
    if address == "local":
        given = {"n_workers": cores(), "threads_per_worker": 1, "dashboard_address": None}
    elif address.endswith(".json"):
        given = {"scheduler_file": address}
    try:
        client = client_of(**given, set_as_default=False)  # else a failing one stays the default
    except (OSError, ValueError, TimeoutError) as error:
        expected = 'a scheduler of Dask that answers, its file, or "local"'
        raise InputError("scheduler", found=f"{address} ({error})", expected=expected) from error
    with client:
        yield _OnDask(client)


class _OnDask(Executor):
    """An executor on the workers of a Dask client. If a worker dies while its result is fetched,
    Dask's own `get_executor` fails or waits forever."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def submit(self, function: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:
        future, remote = Future[Any](), self._client.submit(function, *given, **named, pure=False)

        def fetch(_: object) -> None:
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(remote.result())
                except futures.CancelledError as error:  # the worker died, or the scheduler
                    alive = self._client.status == "running"
                    future.set_exception(BrokenExecutor(str(error)) if alive else error)
                except Exception as error:
                    future.set_exception(error)

        remote.add_done_callback(fetch)
        future.add_done_callback(lambda it: it.cancelled() and remote.cancel())
        return future
