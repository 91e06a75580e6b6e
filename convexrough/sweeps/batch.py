"""Batches: consecutive scenes that one worker computes, and their rows of the sweep's table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from convexrough.run.scene_file import Task
from convexrough.sweeps.measures import FAILURES, Column, Measured, measured
from convexrough.sweeps.scenes import Source
from convexrough.sweeps.together import measured_together
from convexrough.threads import one_thread
from convexrough.version import __version__

#: Versions of the packages on which the last bits of rows depend.
VERSIONS = {"convexrough": __version__, "numpy": np.__version__, "scipy": scipy.__version__}

Columns = dict[str, NDArray[Any]]

#: A row of the table: status, message, and measured numbers.
Row = tuple[str, str, list[float]]


@dataclass(frozen=True)
class Batch:
    """Consecutive scenes of a source, by their numbers, and the columns to measure."""

    source: Source
    columns: tuple[Column, ...]
    numbers: range

    def __str__(self) -> str:
        return f"{self.numbers[0]} to {self.numbers[-1]}"


class BatchRows(NamedTuple):
    """The rows of a batch, and the versions of the packages that computed them."""

    columns: Columns
    versions: Mapping[str, str]


def different(versions: Mapping[str, str]) -> str:
    """The versions that differ from those of this process, as text; "" if none differs."""
    said = (f"{name} {versions.get(name)} instead of {here}" for name, here in VERSIONS.items()
            if versions.get(name) != here)  # fmt: skip
    return ", ".join(said)


def compute(batch: Batch) -> BatchRows:
    """The rows of a batch. No row depends on other scenes; a failed scene's row has the error."""
    with one_thread():
        ask, asked, rows = batch.source.opened(), dict[int, Task](), dict[int, Row]()
        for number in batch.numbers:
            try:
                asked[number] = ask(number)
            except FAILURES as error:
                rows[number] = _failed(error, batch.columns)
        known = measured_together(asked, batch.columns)
        for number, each in asked.items():
            rows[number] = _row(each, known.get(number), batch.columns)
    return BatchRows(table(batch, [rows[number] for number in batch.numbers]), VERSIONS)


def _row(asked: Task, known: Measured | None, columns: tuple[Column, ...]) -> Row:
    """The row of one scene; `known` has its numbers if the scene was computed with others."""
    try:
        wanted = {column.stage for column in columns}
        found, unsure, warned = known or measured(asked.press(), asked.stages, wanted)
        values = [found[column.number, column.row] for column in columns]
    except FAILURES as error:
        return _failed(error, columns)
    except KeyError as error:  # a swept list may be shorter than that of the first scene
        return "failed", f"the results have no {error}", [np.nan] * len(columns)
    said = "; ".join(filter(None, (unsure, warned)))
    return ("undecided" if unsure else "certified"), said, values


def _failed(error: Exception, columns: tuple[Column, ...]) -> Row:
    said = "; ".join(str(error).splitlines()) or type(error).__name__
    return "failed", said, [np.nan] * len(columns)


def table(batch: Batch, rows: list[Row]) -> Columns:
    """The columns of the table, by name, from the rows of a batch."""
    values = np.array([values for _, _, values in rows], dtype=np.float64)
    values = values.reshape(len(rows), len(batch.columns))
    found: Columns = {"scene": np.array(batch.numbers, dtype=np.int64)}
    found |= batch.source.labels(batch.numbers)
    found["status"] = np.array([status for status, _, _ in rows], dtype=np.str_)
    found["message"] = np.array([message for _, message, _ in rows], dtype=np.str_)
    return found | {column.name: values[:, i] for i, column in enumerate(batch.columns)}
