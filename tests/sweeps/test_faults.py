"""Whatever is killed, and whenever: nothing is half-written, and resuming gives the same table.

One kill in every run of the tests; with --full, 30 of the command and 30 of its workers.
"""

import os
import random
import shutil
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import psutil
import pytest
from sweep_files import SMALL, same, started, tables, toml

import convexrough as cr
from convexrough.sweeps.parts import _whole, missing, open_folder

CONTENTS = tables(sweep={"seeds": 60})
SCENES = 240


@pytest.fixture(scope="module")
def whole() -> cr.SweepTable:
    with ThreadPoolExecutor(1) as here:
        return cr.sweep(CONTENTS, executor=here)


def kills(request: pytest.FixtureRequest) -> int:
    return 30 if request.config.option.full else 1


def begun(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    (folder / "a.toml").write_text(toml(CONTENTS))
    return started(folder, "a.toml", "--workers", "2", *arguments)


def workers(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """Children that compute; a helper of multiprocessing is none."""
    try:
        children = psutil.Process(process.pid).children()
        return [each for each in children if "spawn_main" in " ".join(each.cmdline())]
    except psutil.Error:
        return []


def rows(folder: Path) -> int:
    """How many scenes are there; each part of them whole."""
    if not (folder / "a-sweep/manifest.json").exists():
        return 0
    found = open_folder(folder / "a-sweep")
    assert all(map(_whole, found.parts()))
    return SCENES - sum(map(len, missing(found.parts(), range(SCENES))))


def test_the_command_is_killed_at_any_moment(
    request: pytest.FixtureRequest, tmp_path: Path, whole: cr.SweepTable
) -> None:
    began = time.monotonic()
    assert begun(tmp_path).communicate()[1] == ""
    usual = time.monotonic() - began
    shutil.rmtree(tmp_path / "a-sweep")
    delays = random.Random(request.config.option.seed)
    known = killed = 0
    while killed < kills(request):
        process = begun(tmp_path, "--resume")
        deadline = time.monotonic() + delays.uniform(0.0, usual)
        while time.monotonic() < deadline and process.poll() is None:
            time.sleep(0.02)
        children = workers(process)
        killed += process.poll() is None
        process.kill()
        process.communicate()
        _, alive = psutil.wait_procs(children, timeout=30)
        assert not alive  # workers end with those who started them
        assert rows(tmp_path) >= known
        known = rows(tmp_path)
        if known == SCENES:
            assert same(cr.open_sweep(tmp_path / "a-sweep"), whole)
            shutil.rmtree(tmp_path / "a-sweep")
            known = 0
    process = begun(tmp_path, "--resume")
    out, err = process.communicate()
    assert (process.returncode, err) == (0, "")
    table = cr.open_sweep(tmp_path / "a-sweep")
    assert same(table, whole)
    assert {path.suffix for path in (tmp_path / "a-sweep/parts").iterdir()} <= {".parquet", ".npz"}
    assert f"rows        {SCENES}\n" in out


def test_workers_are_killed_at_any_moment(
    request: pytest.FixtureRequest, tmp_path: Path, whole: cr.SweepTable
) -> None:
    delays = random.Random(request.config.option.seed)
    killed = 0
    while killed < kills(request):
        process = begun(tmp_path)
        for _ in range(4):
            deadline = time.monotonic() + delays.uniform(0.5, 3.0)
            while time.monotonic() < deadline and process.poll() is None:
                time.sleep(0.02)
            if children := workers(process):
                delays.choice(children).kill()
                killed += 1
        out, err = process.communicate(timeout=300)
        assert (process.returncode, err) == (0, ""), out
        assert same(cr.open_sweep(tmp_path / "a-sweep"), whole)
        shutil.rmtree(tmp_path / "a-sweep")


@pytest.mark.sample(2)
@pytest.mark.parametrize("delay", [0.3, 1.0, 2.0, None])
def test_an_interrupt_keeps_what_was_computed(tmp_path: Path, delay: float | None) -> None:
    """None: until the first rows are there."""
    many = tables(sweep={"seeds": 300})
    (tmp_path / "a.toml").write_text(toml(many))
    process = subprocess.Popen(
        ["python", "-c", INTERRUPTIBLE], cwd=tmp_path, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    assert process.stdout is not None
    process.stdout.readline()
    deadline = time.monotonic() + 60
    parts = tmp_path / "a-sweep/parts"
    while time.monotonic() < deadline and not list(parts.glob("0*")):
        time.sleep(0.05 if delay is None else delay)
        if delay is not None:
            break
    before = len(list(parts.glob("0*"))) if parts.exists() else 0
    children = workers(process)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: the workers get it, too
    _, said = process.communicate(timeout=60)
    assert (process.returncode, said) == (130, "convexrough: interrupted\n")
    assert not psutil.wait_procs(children, timeout=30)[1]
    if delay is None:
        table = cr.open_sweep(tmp_path / "a-sweep")
        assert len(list(parts.iterdir())) > before  # what workers were about came back, too
        assert 0 < len(table) < 1200
        assert set(table.read(["status"])["status"]) == {"certified"}
    elif parts.exists():
        assert not list(parts.glob(".*"))


INTERRUPTIBLE = (
    "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "print('started', flush=True); sys.argv[1:] = ['sweep', 'a.toml', '--workers', '2']; "
    "from convexrough.__main__ import main; sys.exit(main())"
)

FULL = """
set -e
mkdir tiny
mount -t tmpfs -o size=24k tmpfs tiny
set +e
python -m convexrough sweep a.toml --workers 1 --out tiny/a 2> said
echo status $?
set -e
mount -o remount,size=4m tiny
python -m convexrough sweep a.toml --workers 1 --out tiny/a --resume 2>> said
cp -r tiny/a kept
umount tiny
"""


def test_a_full_disk(tmp_path: Path, whole: cr.SweepTable) -> None:
    namespace = ["unshare", "--user", "--map-root-user", "--mount"]
    trial = subprocess.run([*namespace, "true"], capture_output=True, check=False)
    if trial.returncode != 0:
        pytest.skip("this system lets nobody mount a file system of 24 KiB")
    (tmp_path / "a.toml").write_text(toml(CONTENTS))
    done = subprocess.run(
        [*namespace, "sh", "-c", FULL], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    said = (tmp_path / "said").read_text()
    assert done.returncode == 0, done.stderr + said
    assert "status 2" in done.stdout
    assert "cannot be written: No space left on device" in said
    assert "Traceback" not in said
    assert "found " in done.stdout  # some parts were there, and were kept
    assert same(cr.open_sweep(tmp_path / "kept"), whole)
    assert not list((tmp_path / "kept/parts").glob(".*"))


def test_parts_of_a_job_array_at_the_same_time(tmp_path: Path, whole: cr.SweepTable) -> None:
    (tmp_path / "a.toml").write_text(toml(CONTENTS))
    jobs = [started(tmp_path, "a.toml", "--workers", "1", "--part", f"{k}/2") for k in (1, 2)]
    said = [job.communicate() for job in jobs]
    assert [job.returncode for job in jobs] == [0, 0], said
    assert same(cr.open_sweep(tmp_path / "a-sweep"), whole)


def test_a_changed_file_is_refused(command: Any, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(toml(SMALL))
    assert command("sweep", "a.toml", "--workers", "1")[0] == 0
    (tmp_path / "a.toml").write_text(toml(tables(sphere={"radius": 1.1})))
    status, _, err = command("sweep", "a.toml", "--workers", "1", "--resume")
    assert status == 2
    assert "a-sweep: holds another sweep, 16 scenes of a.toml by version" in err
