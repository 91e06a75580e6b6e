"""The scenes of a sweep, and the batches of consecutive scenes that one worker computes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import scipy

from convexrough.errors import FileError, InputError, MistakesError
from convexrough.run.asperity_file import read_summits
from convexrough.run.scene_file import Task, digest, regular, tasks_of
from convexrough.run.stage import Columns as Columns
from convexrough.run.study import validate
from convexrough.sweeps.grid import Grid, table_in, with_values
from convexrough.sweeps.measures import FAILURES, Column, Measured, measured, measured_together
from convexrough.threads import one_thread
from convexrough.version import __version__

#: Versions of the packages on which the last bits of rows depend.
VERSIONS = {"convexrough": __version__, "numpy": np.__version__, "scipy": scipy.__version__}

#: Number of layouts (exact positions) of asperities that the cache keeps; the entry of the column
#: `seed` if nothing is random.
KEPT, NO_SEED = 8, -1


@dataclass(frozen=True)
class Tables:
    """The scenes of the sweep file at `path`."""

    grid: Grid
    tables: Mapping[str, Any]  # the file except its table [sweep]
    path: Path
    inputs: Mapping[str, str]  # the digests of the files of asperities, by name

    @property
    def count(self) -> int:
        return self.grid.count

    def labels(self, numbers: range) -> Columns:
        """The columns that identify scenes: the swept keys and the seed."""
        points = [self.grid.point(number) for number in numbers]
        known = table_in(self.tables, "asperities").get("seed", NO_SEED)
        found: Columns = {}
        for key in self.grid.keys:
            values = [point[key] for point, _ in points]
            numeric = all(isinstance(it, (int, float)) for it in self.grid.axes.get(key, ()))
            text = [it if isinstance(it, str) else repr(it) for it in values]  # a list as text
            found[key] = np.array(values, np.float64) if numeric else np.array(text)
        seeds = [known if seed is None else seed for _, seed in points]
        return found | {"seed": np.array(seeds, dtype=np.int64)}

    def part(self, numbers: Sequence[int]) -> Tables:
        """A source that has these scenes at least, for a worker."""
        return self

    def opened(self) -> Callable[[int], Task]:
        """A function from numbers to scenes; consecutive scenes share common data. Raises FileError
        if a file of asperities is not as it was when the sweep was planned."""
        for name, known in self.inputs.items():
            if digest(self.path.parent / name) != known:
                raise FileError(f"{self.path.parent / name}: changed since the sweep began")
        summits, lattice = lru_cache(KEPT)(read_summits), lru_cache(KEPT)(regular)

        @lru_cache(1)
        def checked(number: int) -> Callable[[int | None], Task]:
            values, seed = self.grid.point(number)
            study, mistakes = validate(with_values(self.tables, values, seed))
            if study is None:
                raise MistakesError(self.path, self.grid.blame(mistakes, seed))
            return tasks_of(self.path, study, summits=summits, lattice=lattice)

        def task(number: int) -> Task:
            """Scenes that differ only in the seed of heights and tip radii share one check."""
            made = checked(number if self.grid.draw else number - number % self.grid.each)
            return made(self.grid.point(number)[1])

        return task


@dataclass(frozen=True)
class Tasks:
    """Scenes made in Python, by their numbers; `control` is "approach" or "load"."""

    tasks: Mapping[int, Task]
    control: str

    @property
    def count(self) -> int:
        return len(self.tasks)

    def labels(self, numbers: range) -> Columns:
        given = [getattr(self.tasks[number], self.control) for number in numbers]
        return {
            f"normal.{self.control}": np.array(given, dtype=np.float64),
            "seed": np.full(len(numbers), NO_SEED, dtype=np.int64),
        }

    def part(self, numbers: Sequence[int]) -> Tasks:
        return Tasks({number: self.tasks[number] for number in numbers}, self.control)

    def opened(self) -> Callable[[int], Task]:
        return self.tasks.__getitem__


#: The scenes of a sweep, by their numbers from 0.
Source: TypeAlias = Tables | Tasks


@dataclass(frozen=True)
class Batch:
    """The numbers of consecutive scenes of a source, and the columns to measure."""

    source: Source
    columns: tuple[Column, ...]
    numbers: range

    def __str__(self) -> str:
        return f"{self.numbers[0]} to {self.numbers[-1]}"

    def table(self, rows: Sequence[Measured | str]) -> Columns:
        """The columns of the table, by name; a row is a text if the scene failed."""
        values = np.full((len(rows), len(self.columns)), np.nan)
        statuses, messages = [], []
        for own, row in zip(values, rows, strict=True):
            if isinstance(row, str):
                statuses.append("failed")
                messages.append(row)
                continue
            # nan if this scene does not have a number that the first scene has
            own[:] = [row.numbers.get((it.number, it.row), np.nan) for it in self.columns]
            statuses.append("undecided" if row.doubts else "certified")
            messages.append("; ".join(filter(None, (row.doubts, row.cautions))))
        return {
            "scene": np.array(self.numbers, dtype=np.int64),
            **self.source.labels(self.numbers),
            "status": np.array(statuses, dtype=np.str_),
            "message": np.array(messages, dtype=np.str_),
            **{column.name: values[:, i] for i, column in enumerate(self.columns)},
        }


def compute(batch: Batch) -> tuple[Columns, Mapping[str, str]]:
    """The columns of a batch, and the versions of the packages that computed them.

    The values of a scene do not depend on the other scenes of the batch, except for the last bits
    of error bounds: the rounding of matrix products depends on the number of rows. The row of a
    failed scene contains the message of its error.
    """
    wanted = {column.stage for column in batch.columns}
    rows = {(column.number, column.row) for column in batch.columns}
    names = {name for name, _ in rows}

    def alone(asked: Task) -> Measured:
        found = measured(asked.press(), asked.stages, wanted)
        for name, row in found.numbers:
            if name in names and (name, row) not in rows:
                expected = "the rows of the first scene: put the longest lists first in [sweep]"
                raise InputError(name, found=f"row {row}, without a column", expected=expected)
        return found

    with one_thread():
        ask = batch.source.opened()
        found: dict[int, Any] = {number: _attempt(ask, number) for number in batch.numbers}
        tasks = {number: it for number, it in found.items() if not isinstance(it, str)}
        found |= (together := measured_together(tasks, batch.columns))
        for number, task in tasks.items():
            if number not in together:
                found[number] = _attempt(alone, task)
    return batch.table(list(found.values())), VERSIONS


def _attempt(work: Callable[[Any], Any], given: Any) -> Any:
    """The result of `work`, or the message of an error that means that one scene failed."""
    try:
        return work(given)
    except FAILURES as error:
        return "; ".join(str(error).splitlines()) or type(error).__name__


def different(versions: Mapping[str, str]) -> str:
    """The versions that differ from those in this process, as text; "" if there are none."""
    said = (f"{name} {versions.get(name)} instead of {here}" for name, here in VERSIONS.items()
            if versions.get(name) != here)  # fmt: skip
    return ", ".join(said)
