"""What every test may ask for, and how random scenes are drawn.

Random scenes are new on every run by hand, and the same ones in continuous integration. Of a test
marked `sample(n)` only n of its cases run, drawn anew each time; `--full` runs all of them.
"""

import os
import random
import sys
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import settings
from scene_files import scene_text

import convexrough as cr
from convexrough import cli

_approx = pytest.approx


def _relative(expected: Any, rel: Any = None, abs: Any = None, nan_ok: bool = False) -> Any:
    """`pytest.approx` without its absolute tolerance of 1e-12: many losses are smaller."""
    if abs is None:
        rel, abs = 1e-6 if rel is None else rel, 0.0
    return _approx(expected, rel=rel, abs=abs, nan_ok=nan_ok)


pytest.approx = _relative

settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("ci")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--full", action="store_true", help="long audits and samples run whole")
    parser.addoption("--seed", type=int, help="what samples are drawn by; a new one if not given")


def pytest_configure(config: pytest.Config) -> None:
    """The seed is drawn once: processes of pytest-xdist inherit it from the first."""
    config.addinivalue_line("markers", "sample(n): so many cases of a test, drawn anew each time")
    if config.option.seed is None:
        sample = str(random.SystemRandom().randrange(10**6))
        config.option.seed = int(os.environ.setdefault("CONVEXROUGH_SAMPLES", sample))


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    if not config.option.full:
        terminalreporter.write_line(f"samples were drawn by --seed {config.option.seed}")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the cases that are not drawn."""
    if config.option.full:
        return
    cases: dict[tuple[str, int], list[pytest.Item]] = defaultdict(list)
    for item in items:
        if sample := item.get_closest_marker("sample"):
            cases[item.nodeid.partition("[")[0], *sample.args].append(item)
    left_out: set[pytest.Item] = set()
    for (test, many), found in cases.items():
        random.Random(f"{config.option.seed} {test}").shuffle(found)
        left_out |= {*found[many:]}
    config.hook.pytest_deselected(items=[item for item in items if item in left_out])
    items[:] = [item for item in items if item not in left_out]


class Outcome(NamedTuple):
    status: int
    out: str
    err: str

    def refuses(self, reason: str) -> bool:
        """Exit status 2, and nothing but messages, this one among them."""
        return (self.status, self.out) == (2, "") and reason in self.err


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> Any:
    """Run the command line in an empty folder, in this process."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> Outcome:
        return Outcome(cli.main(arguments), *capsys.readouterr())

    return call


@pytest.fixture
def run(command: Any) -> Any:
    """Write a scene to a.toml, and run it without figures."""

    def call(text: str, *options: str) -> Any:
        Path("a.toml").write_text(text, encoding="utf-8")
        return command("run", "a.toml", "--no-figures", *options)

    return call


@pytest.fixture
def read(tmp_path: Path) -> Any:
    """Write a scene, given as for `scene_text`, and read it."""

    def call(*parts: str, **tables: str) -> cr.SceneFile:
        path = tmp_path / "scene.toml"
        path.write_text(scene_text(*parts, **tables), encoding="utf-8")
        return cr.read_scene(path)

    return call


class Here(ThreadPoolExecutor):
    """In place of processes, which need a second each to start; other tests start some."""

    def __init__(self, workers: int | None = None) -> None:
        super().__init__(1)
        self.workers = 1


@pytest.fixture
def no_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("convexrough.sweeps.sweep.Processes", Here)


@pytest.fixture(autouse=True)
def figures_are_closed() -> Iterator[None]:
    """Once a test has imported pyplot, `plot` opens its figures; more than 20 cause a warning."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")
