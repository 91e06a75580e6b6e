"""What every test may ask for, and how random scenes are drawn.

Random scenes are new on every run by hand, and the same ones in continuous integration.
"""

import os
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import settings

from convexrough import cli

_approx = pytest.approx


def _relative(
    expected: Any, rel: float | None = None, abs: float | None = None, nan_ok: bool = False
) -> Any:
    """`pytest.approx` without its absolute tolerance of 1e-12: many losses are smaller."""
    if abs is None:
        rel, abs = 1e-6 if rel is None else rel, 0.0
    return _approx(expected, rel=rel, abs=abs, nan_ok=nan_ok)


pytest.approx = _relative

settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("ci")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--full", action="store_true", help="10,000 scenes audited, 60 sweeps killed")


class Outcome(NamedTuple):
    status: int
    out: str
    err: str


@pytest.fixture
def command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Any:
    """Run the command line in an empty folder, in this process."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> Outcome:
        status = cli.main(arguments)
        return Outcome(status, *capsys.readouterr())

    return call
