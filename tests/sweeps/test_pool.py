"""The same table whoever computes it, in any order and batches, and whatever is killed."""

import logging
import multiprocessing
import os
import random
import shutil
import signal
import time
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil
import pytest
from scene_files import INTERRUPTIBLE, SMALL, same, scripted, sweeping, swept, tables, toml

import convexrough as cr
from convexrough.progress import logged
from convexrough.sweeps import plan
from convexrough.sweeps.plan import plan_of
from convexrough.sweeps.sweep import dask, run

#: Whatever ran before in this process, and whichever threads it left, nothing is forked.
SPAWN = multiprocessing.get_context("spawn")

CONTENTS = tables(sweep={"seeds": 16, "measure": ["contact", "load"]})
PLAN = plan_of(CONTENTS, Path("sweep"))
SCENES, PARTS = 64, 32


@pytest.fixture(scope="module")
def whole() -> cr.SweepTable:
    return swept(CONTENTS)


class Shuffled(Executor):
    """Computes every batch before the first is asked for, the last ones first."""

    def __init__(self) -> None:
        self._given: list[tuple[Future[Any], Any, Any]] = []

    def submit(self, function: Any, /, *arguments: Any, **keys: Any) -> Future[Any]:
        self._given.append((Future(), function, arguments))
        if len(self._given) == -(-PLAN.source.count // PLAN.manifest["batch"]):
            for future, work, given in reversed(self._given):
                future.set_result(work(*given))
        return self._given[-1][0]


def test_executors(whole: cr.SweepTable) -> None:
    for executor in (ThreadPoolExecutor(3), ProcessPoolExecutor(1, mp_context=SPAWN), Shuffled()):
        with executor:
            assert same(cr.sweep(CONTENTS, executor=executor), whole), executor


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
    with threadpool_limits(1):
        one = swept(many)
    with threadpool_limits(2):
        assert same(one, swept(many))


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    apart = {"processes": True, "dashboard_address": ":0"}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **apart) as found:
        yield found


def test_dask(cluster: Any, whole: cr.SweepTable) -> None:
    with dask(cluster.scheduler_address) as engine:
        assert same(run(PLAN, engine)[0], whole)


def test_a_worker_of_dask_is_killed(cluster: Any, tmp_path: Path, whole: cr.SweepTable) -> None:
    killed: list[int] = []

    def kill(record: logging.LogRecord) -> None:
        if "of 64 scenes" in record.getMessage() and not killed:
            killed.append(random.choice(workers))
            os.kill(killed[0], signal.SIGKILL)

    workers = [each.pid for each in cluster.workers.values()]
    with dask(cluster.scheduler_address) as engine, logged(kill):
        table = run(PLAN, engine, out=tmp_path / "a")[0]
    assert killed
    assert same(table, whole)
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


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "a.toml").write_text(toml(CONTENTS))
    return tmp_path


def kills(request: pytest.FixtureRequest) -> int:
    return 30 if request.config.option.full else 1


def rows(folder: Path) -> int:
    """How many scenes are there; each part of them whole."""
    return len(cr.open_sweep(folder / "a-sweep").read()["scene"])


#: The command, which is killed when it has written its n-th file and is about to name it.
KILLED = """
import os, signal, sys
import psutil
from convexrough.cli import main
left, replace = int(sys.argv[1]), os.replace
def name(*paths):
    global left
    left -= 1
    if left == 0:
        print(*(each.pid for each in psutil.Process().children()), flush=True)
        os.kill(os.getpid(), signal.SIGKILL)
    replace(*paths)
os.replace = name
main(["sweep", "a.toml", "--workers", "1", "--resume"])
"""


def test_the_command_is_killed_at_any_moment(request: Any, file: Path, whole: Any) -> None:
    moments = random.Random(request.config.option.seed)
    known = killed = 0
    while killed < kills(request):
        process = scripted(file, KILLED, str(moments.randint(1, PARTS // 2)))
        children, said = process.communicate()
        assert "Traceback" not in said
        if process.returncode == 0:  # complete, so the next one begins anew
            shutil.rmtree(file / "a-sweep")
            known = 0
            continue
        killed += process.returncode == -signal.SIGKILL
        for child in map(int, children.split()[-1:]):  # workers end with those who started them
            while psutil.pid_exists(child) and psutil.Process(child).status() != "zombie":
                time.sleep(0.01)
        if (file / "a-sweep/manifest.json").exists():
            assert rows(file) >= known
            known = rows(file)
    assert same(swept(file / "a.toml", out=file / "a-sweep", resume=True), whole)
    assert {path.suffix for path in (file / "a-sweep/parts").iterdir()} == {".parquet"}


def test_workers_are_killed_at_any_moment(request: Any, file: Path, whole: Any) -> None:
    """Whoever computed dies; where that happens to one batch twice, --resume computes it."""
    chance = random.Random(request.config.option.seed)
    left = kills(request)

    def kill(record: logging.LogRecord) -> None:
        nonlocal left
        workers = []
        for each in psutil.Process().children():
            with suppress(psutil.NoSuchProcess):  # it may just have ended
                workers += [each] if "spawn_main" in " ".join(each.cmdline()) else []
        if left and workers and "of 64 scenes" in record.getMessage():
            chance.choice(workers).kill()
            left -= 1

    while True:
        with suppress(cr.WorkerError), logged(kill):
            cr.sweep(file / "a.toml", workers=1, out=file / "a-sweep", resume=True)
        if rows(file) == SCENES and left:
            shutil.rmtree(file / "a-sweep")
        elif rows(file) == SCENES:
            break
    assert left == 0
    assert same(cr.open_sweep(file / "a-sweep"), whole)


@pytest.mark.sample(1)
@pytest.mark.parametrize("event", ["a-sweep/manifest.json", "a-sweep/parts/*.parquet"])
def test_an_interrupt_keeps_what_was_computed(tmp_path: Path, event: str) -> None:
    """As soon as there is a folder, and as soon as there is a part; the terminal tells workers."""
    (tmp_path / "a.toml").write_text(toml(tables(sweep={"seeds": 1000, "measure": ["load"]})))
    process = scripted(tmp_path, INTERRUPTIBLE, "sweep", "a.toml", "--workers", "1")
    while not list(tmp_path.glob(event)):
        assert process.poll() is None
        time.sleep(0.01)
    children = psutil.Process(process.pid).children()
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate()
    psutil.wait_procs(children)
    kept = len(cr.open_sweep(tmp_path / "a-sweep"))
    more = "; the same command with --resume computes the rest" if kept else ""
    kept_here = f"{kept:,} of 4,000 scenes are kept in a-sweep{more}"
    assert (process.returncode, said) == (130, f"convexrough: interrupted: {kept_here}\n")
    assert kept > 0 or "parquet" not in event
    assert not list((tmp_path / "a-sweep/parts").glob(".*"))


#: A file that may not grow fails as one on a full disk does: in the middle of what is written.
FULL = """
import resource
import convexrough as cr
from convexrough.progress import logged
from scene_files import swept
def fill(record):
    if "of 64 scenes" in record.getMessage():
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
try:
    with logged(fill):
        swept("a.toml", out="a-sweep")
except cr.FileError as error:
    print(error)
"""


def test_a_full_disk(file: Path, whole: cr.SweepTable) -> None:
    out, said = scripted(file, FULL).communicate()
    assert said == ""
    kept = "the finished parts are kept; resume=True (--resume) computes the rest"
    assert out.endswith(f"cannot be written: File too large; {kept}\n"), out
    assert rows(file) == SCENES // PARTS
    assert not list((file / "a-sweep/parts").glob(".*"))
    assert same(swept(file / "a.toml", out=file / "a-sweep", resume=True), whole)


def test_rows_of_another_sweep_are_not_mixed_in(tmp_path: Path, monkeypatch: Any) -> None:
    """Neither by a sweep that still runs when another replaces it, nor by files that it left."""
    monkeypatch.setattr(plan, "LEAST_BATCHES", 4)
    mine, out = swept(SMALL), tmp_path / "a"

    def replace(record: logging.LogRecord) -> None:
        if record.getMessage().startswith("10 of 20 scenes"):
            shutil.copytree(out / "parts", tmp_path / "left")
            swept(SMALL, out=out, overwrite=True)

    with logged(replace), pytest.raises(cr.FileError, match="a: holds another sweep, 16 scenes"):
        swept(tables(sweep={"seeds": 5}), out=out)
    assert same(cr.open_sweep(out), mine)
    shutil.copytree(tmp_path / "left", out / "parts", dirs_exist_ok=True)
    assert same(cr.open_sweep(out), mine)
    assert same(swept(SMALL, out=out, resume=True), mine)
    assert same(swept(SMALL, out=out, overwrite=True), mine)
    assert len([*(out / "parts").iterdir()]) == 4
