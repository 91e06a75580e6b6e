"""The same table whoever computes it: processes, threads, Dask, in any order and any batches."""

import logging
import multiprocessing
import os
import random
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import pytest
from sweep_files import same, sweeping, swept, tables

import convexrough as cr
from convexrough.progress import logged
from convexrough.sweeps import plan
from convexrough.sweeps.plan import plan_of
from convexrough.sweeps.sweep import dask, run

#: Whatever ran before in this process, and whichever threads it left, nothing is forked.
SPAWN = multiprocessing.get_context("spawn")

MANY = tables(sweep={"seeds": 10, "measure": ["contact", "load"]})
PLAN = plan_of(MANY, Path("sweep"))
WHOLE = swept(MANY)


class Shuffled(Executor):
    """Computes every batch before the first is asked for, the last ones first."""

    def __init__(self) -> None:
        self._given: list[tuple[Future[Any], Any, Any]] = []

    def submit(self, function: Any, /, *arguments: Any, **keys: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self._given.append((future, function, arguments))
        if len(self._given) == -(-PLAN.source.count // PLAN.manifest["batch"]):
            for future, function, arguments in reversed(self._given):
                future.set_result(function(*arguments))
        return self._given[-1][0]


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    "executor",
    [lambda: ThreadPoolExecutor(3), lambda: ProcessPoolExecutor(1, mp_context=SPAWN), Shuffled],
    ids=["threads", "processes of the user", "the last first"],
)
def test_executors(executor: Any) -> None:
    given = executor()
    assert same(cr.sweep(MANY, executor=given), WHOLE)
    given.shutdown()


@pytest.mark.sample(2)
@pytest.mark.parametrize("most", [1, 3, 7, 40])
@pytest.mark.parametrize("influence", ["dense", "lattice"])
def test_batches(most: int, influence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Values; bounds of errors are those of trial loads, whose last bits depend on the batch."""
    measured = {"seeds": 10, "measure": ["contact", "load", "approach", "loss"]}
    contents = tables(solver={"influence": influence}, sweep=measured)
    whole = swept(contents)
    monkeypatch.setattr(plan, "LEAST_BATCHES", 1)
    monkeypatch.setattr(plan, "MOST_SCENES", most)
    batches = swept(contents)
    assert batches.manifest["batch"] == most != whole.manifest["batch"]
    assert same(batches, whole)


class Dying(Executor):
    """Computes here. A batch with scene 17 kills its process, after which none may compute."""

    def __init__(self, *, replaced: bool) -> None:
        self.replaced, self.dead = replaced, False

    def submit(self, function: Any, /, *arguments: Any, **keys: Any) -> Future[Any]:
        if self.dead and not self.replaced:
            raise BrokenProcessPool("a process died")
        future: Future[Any] = Future()
        if 17 in arguments[0].numbers:
            self.dead = True
            future.set_exception(BrokenProcessPool("a process died"))
        else:
            future.set_result(function(*arguments))
        return future


def test_a_scene_that_kills_costs_its_batch_and_is_named(tmp_path: Path) -> None:
    """It breaks an executor that replaces no processes, which is said."""
    contents = sweeping(seeds=24, over={"asperities.height_std": [1e-6]})
    said = "the process that computed scenes 17 to 17 died twice"
    with pytest.raises(cr.WorkerError, match=said):
        cr.sweep(contents, executor=Dying(replaced=True), out=tmp_path / "a")
    assert cr.open_sweep(tmp_path / "a").read()["scene"].tolist() == [*range(17), *range(18, 24)]
    assert same(swept(contents, out=tmp_path / "a", resume=True), swept(contents))
    with pytest.raises(cr.WorkerError, match="executor is broken"):
        cr.sweep(contents, executor=Dying(replaced=False))


def test_threads_of_linear_algebra_do_not_matter() -> None:
    """Of matrices so large that two threads round otherwise."""
    from threadpoolctl import threadpool_limits

    many = tables(
        asperities={"spacing": 0.0008, "tip_radius": 0.0064},
        solver={"influence": "dense"},
        cycle=None,
        sweep={"seeds": 2, "measure": ["load", "load_error", "approach"],
               "over": {"asperities.height_std": [1e-7]}},
    )  # fmt: skip
    found = []
    for threads in (1, 2):
        with threadpool_limits(threads):
            found.append(swept(many))
    assert same(*found)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    apart = {"processes": True, "dashboard_address": ":0"}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **apart) as found:
        yield found


def test_dask(cluster: Any) -> None:
    with dask(cluster.scheduler_address) as engine:
        assert same(run(PLAN, engine)[0], WHOLE)


def test_a_worker_of_dask_is_killed(cluster: Any, tmp_path: Path) -> None:
    contents = tables(sweep={"seeds": 16, "measure": ["load"]})
    plan = plan_of(contents, Path("sweep"))
    killed: list[int] = []

    def kill(record: logging.LogRecord) -> None:
        if "of 64 scenes" in record.getMessage() and not killed:
            killed.append(random.choice(workers))
            os.kill(killed[0], signal.SIGKILL)

    workers = [each.pid for each in cluster.workers.values()]
    with dask(cluster.scheduler_address) as engine, logged(kill):
        table = run(plan, engine, out=tmp_path / "a")[0]
    assert killed
    assert same(table, swept(contents))
    assert set(table.read(["status"])["status"]) == {"certified"}


def test_a_scheduler_that_does_not_answer() -> None:
    """It is refused, and does not stay the client of all later work with Dask, which would wait."""
    distributed = pytest.importorskip("distributed")
    config = pytest.importorskip("dask").config
    with (
        config.set({"distributed.comm.timeouts.connect": "1s"}),
        pytest.raises(cr.InputError, match=r"scheduler: found tcp://127\.0\.0\.1:9"),
        dask("tcp://127.0.0.1:9"),
    ):
        pass
    with pytest.raises(cr.InputError, match="scheduler: found nonsense"), dask("nonsense"):
        pass
    with pytest.raises(ValueError, match="No client"):
        distributed.default_client()
