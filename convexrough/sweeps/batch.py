"""What a worker is given: some scenes that follow each other, and what it gives back."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from convexrough.errors import ConvexroughError
from convexrough.sweeps.measures import Stages, columns, measure
from convexrough.sweeps.sources import Press, Source
from convexrough.threads import one_thread
from convexrough.version import __version__

#: Scenes of a batch, at most, ...
MOST_SCENES = 1000

#: ... and seconds after which it gives back what it has: no more is lost with a worker.
MOST_SECONDS = 60.0

#: What can go wrong in a scene without anything being wrong with the others.
FAILURES = (ConvexroughError, ArithmeticError, MemoryError, np.linalg.LinAlgError)

#: Rows are the same, bit for bit, where these are.
VERSIONS = {
    "convexrough": __version__,
    "numpy": np.__version__,
    "scipy": scipy.__version__,
}

Columns = dict[str, NDArray[Any]]

#: Status, message, and what was measured.
Row = tuple[str, str, list[float]]


@dataclass(frozen=True)
class Batch:
    """Scenes `first` to `stop` - 1."""

    source: Source
    measures: tuple[str, ...]
    stages: Stages
    first: int
    stop: int

    @property
    def numbers(self) -> range:
        return range(self.first, self.stop)

    def of(self, numbers: range) -> Batch:
        """Some of its scenes."""
        part = self.source.part(numbers)
        return replace(self, source=part, first=numbers.start, stop=numbers.stop)


@dataclass(frozen=True)
class Rows:
    """The rows of scenes that follow each other from `first` on.

    versions : of the programs that computed them
    """

    first: int
    columns: Columns
    seconds: float
    versions: Mapping[str, str] = field(default_factory=lambda: VERSIONS)

    def __len__(self) -> int:
        return len(self.columns["scene"])

    @property
    def stop(self) -> int:
        return self.first + len(self)


def different(versions: Mapping[str, str]) -> str:
    """Other versions than those here, in words; "" if they are the same."""
    said = (
        f"{name} {versions.get(name)} instead of {here}"
        for name, here in VERSIONS.items()
        if versions.get(name) != here
    )
    return ", ".join(said)


def never() -> bool:
    return False


def compute(batch: Batch, told_to_stop: Callable[[], bool] = never) -> Rows:
    """The rows of a batch, or as many as there is time for: one at least, or none if told to stop.

    A row depends on its scene alone. A scene that fails has a row that says why.
    """
    began = time.monotonic()
    rows: list[Row] = []
    with one_thread:
        press = batch.source.opened()
        for number in batch.numbers:
            if told_to_stop() or (rows and time.monotonic() - began > MOST_SECONDS):
                break
            rows.append(_row(press, number, batch))
    return _rows(batch, rows, time.monotonic() - began)


def refused(batch: Batch, message: str) -> Rows:
    """Rows of scenes that cannot be computed."""
    values = [np.nan] * len(columns(batch.measures, batch.stages))
    return _rows(batch, [("failed", message, values)] * len(batch.numbers), 0.0)


def _row(press: Press, number: int, batch: Batch) -> Row:
    try:
        values, unsure = measure(press(number), batch.measures, batch.stages)
    except FAILURES as error:
        said = "; ".join(str(error).splitlines()) or type(error).__name__
        return "failed", said, [np.nan] * len(columns(batch.measures, batch.stages))
    return ("undecided" if unsure else "certified"), unsure, values


def _rows(batch: Batch, rows: list[Row], seconds: float) -> Rows:
    numbers = range(batch.first, batch.first + len(rows))
    names = columns(batch.measures, batch.stages)
    measured = np.array([values for _, _, values in rows], dtype=np.float64)
    measured = measured.reshape(len(rows), len(names))
    table: Columns = {"scene": np.arange(numbers.start, numbers.stop, dtype=np.int64)}
    table |= batch.source.labels(numbers)
    table["status"] = np.array([status for status, _, _ in rows], dtype=np.str_)
    table["message"] = np.array([message for _, message, _ in rows], dtype=np.str_)
    table |= {name: measured[:, i].copy() for i, name in enumerate(names)}
    return Rows(batch.first, table, seconds)
