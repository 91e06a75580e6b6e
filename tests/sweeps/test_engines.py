"""The same table whoever computes it: processes, threads, Dask, in any order and any batches."""

import multiprocessing
import os
import random
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sweep_files import Deadly, same, sweeping, tables

import convexrough as cr
from convexrough.sweeps import engines, running
from convexrough.sweeps.sources import Tables
from convexrough.sweeps.sweep_file import plan_of

#: Whatever ran before in this process, and whichever threads it left, nothing is forked.
SPAWN = multiprocessing.get_context("spawn")

PLAN = plan_of(tables(sweep={"seeds": 10}), Path("sweep"))
WHOLE = cr.sweep(tables(sweep={"seeds": 10}), executor=ThreadPoolExecutor(1))


class Backwards(Executor):
    """Computes the last batch first, in this process."""

    def __init__(self) -> None:
        self._given: list[tuple[Future[Any], Any, Any]] = []
        self._timer = threading.Timer(0.2, self._compute)

    def submit(self, function: Any, /, *arguments: Any, **keys: Any) -> Future[Any]:
        if not self._given:
            self._timer = threading.Timer(0.2, self._compute)
            self._timer.start()
        future: Future[Any] = Future()
        self._given.append((future, function, arguments))
        return future

    def _compute(self) -> None:
        while self._given:
            future, function, arguments = self._given.pop()
            future.set_result(function(*arguments))


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_processes(workers: int) -> None:
    assert same(cr.sweep(tables(sweep={"seeds": 10}), workers=workers), WHOLE)


@pytest.mark.parametrize(
    "executor",
    [lambda: ThreadPoolExecutor(3), lambda: ProcessPoolExecutor(2, mp_context=SPAWN), Backwards],
    ids=["threads", "processes of the user", "backwards"],
)
def test_executors(executor: Any) -> None:
    given = executor()
    assert same(cr.sweep(tables(sweep={"seeds": 10}), executor=given), WHOLE)
    given.shutdown()


@pytest.mark.parametrize("most", [1, 3, 7, 1000])
def test_batches(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "MOST_SCENES", most)
    with ThreadPoolExecutor(1) as here:
        assert same(cr.sweep(tables(sweep={"seeds": 10}), executor=here), WHOLE)


def test_a_scene_that_kills_is_found_and_named() -> None:
    contents = sweeping(seeds=24, over={"asperities.height_std": [1e-6]})
    plan = plan_of(contents, Path("sweep"))
    assert isinstance(plan.source, Tables)
    deadly = replace(plan, source=Deadly(plan.source.grid, plan.source.path, worst=17))
    with engines.processes(2) as engine:
        table = running.run(deadly, engine).table
    rows = table.read()
    assert np.flatnonzero(rows["status"] == "failed").tolist() == [17]
    assert rows["message"][17] == "the process that computed it died, twice"
    with ThreadPoolExecutor(1) as here:
        alone = cr.sweep(contents, executor=here).read()
    others = np.arange(24) != 17
    assert rows["contacts"][others].tobytes() == alone["contacts"][others].tobytes()


def test_an_executor_that_broke_is_said_to_be() -> None:
    plan = replace(PLAN, source=Deadly(PLAN.source.grid, PLAN.source.path, worst=3))  # type: ignore[attr-defined]
    with (
        ProcessPoolExecutor(1, mp_context=SPAWN) as mine,
        pytest.raises(cr.WorkerError, match="of no use any more"),
    ):
        running.run(plan, engines.Given(mine))


SCRIPT = """
import convexrough as cr
from sweep_files import SMALL
table = cr.sweep(SMALL, workers=2, out="a")
print(len(table))
"""


def test_a_script_needs_no_guard(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, env=environment, capture_output=True,
        text=True, timeout=120, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "16\n", "")


LINEAR = """
import sys
from concurrent.futures import ThreadPoolExecutor
import numpy as np
import convexrough as cr
from sweep_files import tables
many = tables(asperities={"spacing": 0.0012, "tip_radius": 0.01},
              sweep={"seeds": 2, "measure": ["load", "loss", "certificate", "approach"]})
with ThreadPoolExecutor(2) as here:
    rows = cr.sweep(many, executor=here).read()
np.savez(sys.argv[1], **rows)
"""


def test_threads_of_linear_algebra_do_not_matter(tmp_path: Path) -> None:
    found = []
    for threads in ("1", "2", "7"):
        names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
        environment = {**os.environ, **dict.fromkeys(names, threads)}
        environment["PYTHONPATH"] = os.pathsep.join(sys.path)
        out = tmp_path / f"{threads}.npz"
        subprocess.run([sys.executable, "-c", LINEAR, str(out)], env=environment, check=True)
        found.append(np.load(out))
    for name in found[0].files:
        assert found[0][name].tobytes() == found[1][name].tobytes(), name
        assert found[0][name].tobytes() == found[2][name].tobytes(), name


def test_the_threads_are_given_back() -> None:
    from threadpoolctl import threadpool_info

    from convexrough.threads import one_thread

    def threads() -> set[int]:
        return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}

    before = threads()
    with one_thread, one_thread:
        assert threads() == {1}
    assert threads() == before


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as found:
        yield found


def test_dask(cluster: Any) -> None:
    with engines.dask(cluster.scheduler_address) as engine:
        assert same(running.run(PLAN, engine).table, WHOLE)


def test_a_worker_of_dask_is_killed(cluster: Any, tmp_path: Path) -> None:
    contents = tables(sweep={"seeds": 60})
    plan = plan_of(contents, Path("sweep"))
    killed: list[int] = []

    def kill(news: str) -> None:
        if "of 240 scenes" in news and not killed:
            pids = list(engine.client.run(os.getpid).values())
            killed.append(random.choice(pids))
            os.kill(killed[0], signal.SIGKILL)

    with engines.dask(cluster.scheduler_address) as engine:
        table = running.run(plan, engine, out=tmp_path / "a", announce=kill).table
    assert killed
    with ThreadPoolExecutor(1) as here:
        assert same(table, cr.sweep(contents, executor=here))
    assert set(table.read(["status"])["status"]) == {"certified"}


def test_a_scheduler_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    dask = pytest.importorskip("dask")
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
        pytest.raises(cr.InputError, match=r"scheduler: found tcp://127\.0\.0\.1:9"),
        engines.dask("tcp://127.0.0.1:9"),
    ):
        pass
    with pytest.raises(cr.InputError, match="scheduler: found nonsense"), engines.dask("nonsense"):
        pass


@pytest.mark.parametrize("spacing", [0.0025, 0.0005], ids=["matrix", "lattice"])
def test_sharing_changes_no_bit(spacing: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes one after the other, and each as the first of its batch."""
    lattice = {"spacing": spacing, "tip_radius": 8 * spacing, "within": 0.0102}
    measured = {"seeds": 3, "measure": ["load", "approach", "certificate", "loss"]}
    contents = tables(
        asperities=lattice, sweep=measured | {"over": {"asperities.height_std": [1e-7]}}
    )
    with ThreadPoolExecutor(1) as here:
        shared = cr.sweep(contents, executor=here)
        monkeypatch.setattr(running, "MOST_SCENES", 1)
        assert same(shared, cr.sweep(contents, executor=here))
