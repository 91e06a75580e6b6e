"""The same table whoever computes it: processes, threads, Dask, in any order and any batches."""

import multiprocessing
import os
import random
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from sweep_files import reported_to, same, tables

import convexrough as cr
from convexrough.sweeps import plan
from convexrough.sweeps.file import plan_of
from convexrough.sweeps.pool import dask
from convexrough.sweeps.sweep import run

#: Whatever ran before in this process, and whichever threads it left, nothing is forked.
SPAWN = multiprocessing.get_context("spawn")

MANY = tables(sweep={"seeds": 10, "measure": ["contact", "load"]})
PLAN = plan_of(MANY, Path("sweep"))
WHOLE = cr.sweep(MANY, executor=ThreadPoolExecutor(1))


class Shuffled(Executor):
    """Computes every batch before the first is asked for, the last ones first."""

    def __init__(self) -> None:
        self._given: list[tuple[Future[Any], Any, Any]] = []

    def submit(self, function: Any, /, *arguments: Any, **keys: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self._given.append((future, function, arguments))
        if len(self._given) == PLAN.parts:
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
@pytest.mark.parametrize("most", [1, 3, 7, 1000])
def test_batches(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "MOST_SCENES", most)
    with ThreadPoolExecutor(1) as here:
        assert same(cr.sweep(MANY, executor=here), WHOLE)


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
        with threadpool_limits(threads), ThreadPoolExecutor(1) as here:
            found.append(cr.sweep(many, executor=here))
    assert same(*found)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as found:
        yield found


def test_dask(cluster: Any) -> None:
    with dask(cluster.scheduler_address) as engine:
        assert same(run(PLAN, engine).table, WHOLE)


def test_a_worker_of_dask_is_killed(cluster: Any, tmp_path: Path) -> None:
    contents = tables(sweep={"seeds": 16, "measure": ["load"]})
    plan = plan_of(contents, Path("sweep"))
    killed: list[int] = []

    def kill(news: str) -> None:
        if "of 64 scenes" in news and not killed:
            killed.append(random.choice(workers))
            os.kill(killed[0], signal.SIGKILL)

    workers = [each.pid for each in cluster.workers.values()]
    with dask(cluster.scheduler_address) as engine, reported_to(kill):
        table = run(plan, engine, out=tmp_path / "a").table
    assert killed
    with ThreadPoolExecutor(1) as here:
        assert same(table, cr.sweep(contents, executor=here))
    assert set(table.read(["status"])["status"]) == {"certified"}


@pytest.mark.parametrize("influence", ["dense", "lattice"])
def test_sharing_changes_no_bit(influence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes one after the other, and each as the first of its batch."""
    measured = {"seeds": 2, "measure": ["load", "approach", "load_error", "loss"]}
    over = {"over": {"asperities.height_std": [1e-7]}}
    contents = tables(solver={"influence": influence}, sweep=measured | over)
    with ThreadPoolExecutor(1) as here:
        shared = cr.sweep(contents, executor=here)
        monkeypatch.setattr(plan, "MOST_SCENES", 1)
        assert same(shared, cr.sweep(contents, executor=here))
