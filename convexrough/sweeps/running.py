"""A plan carried out: what is missing is computed, and kept as it comes."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from convexrough.errors import FileError, InputError
from convexrough.progress import Announce
from convexrough.sweeps.batch import MOST_SCENES, VERSIONS, Batch, Rows, compute
from convexrough.sweeps.engines import Engine
from convexrough.sweeps.measures import units
from convexrough.sweeps.parts import Folder, best_format, length, make_folder, missing
from convexrough.sweeps.sources import Tables
from convexrough.sweeps.sweep_file import Plan
from convexrough.sweeps.table import SweepTable, joined
from convexrough.sweeps.work import Work
from convexrough.version import __version__

#: Scenes that one call computes at most; of a larger sweep a part may be asked for.
MOST = 10**8

#: A small sweep is cut into so many batches for each that is handed out at once.
SHARES = 4


class Found(NamedTuple):
    """What was in the folder before: scenes of this share, and files that were removed."""

    scenes: int = 0
    damaged: int = 0
    unfinished: int = 0

    def __str__(self) -> str:
        said = [f"found {self.scenes:,} scenes"]
        if self.damaged:
            said.append(f"{self.damaged:,} damaged parts removed")
        if self.unfinished:
            said.append(f"{self.unfinished:,} unfinished files removed")
        return ", ".join(said)


@dataclass(frozen=True)
class Done:
    """A table, what was found before, and what was computed: scenes, in how many seconds."""

    table: SweepTable
    found: Found
    computed: int
    seconds: float


def run(
    plan: Plan,
    engine: Engine,
    *,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    part: tuple[int, int] | None = None,
    announce: Announce | None = None,
) -> Done:
    """`sweep` of a plan by an engine; its arguments are as there."""
    began = time.monotonic()
    tell: Announce = announce or (lambda news: None)
    numbers = _share(plan.source.count, part)
    folder, todo, found = None, [numbers], Found()
    _refuse_too_many(plan, numbers)
    if out is not None:
        folder = make_folder(Path(out), manifest(plan))
        todo, found = _missing(folder, numbers, resume)
        tell(str(found))
    held = [compute(_batch(plan, range(numbers.start, numbers.start)))]  # no rows, all columns
    count = sum(map(length, todo))
    for rows in _told(Work(_batches(plan, todo, count, engine), engine).rows(), count, tell):
        if folder is None:
            held.append(rows)
        else:
            folder.write(rows)
    if folder is None:
        table = SweepTable(manifest(plan), None, joined(held))
    else:
        table = SweepTable(folder.manifest, folder)
    return Done(table, found, count, time.monotonic() - began)


def manifest(plan: Plan) -> dict[str, Any]:
    """What a folder says of its sweep; the same whenever it is made.

    each : scenes that differ by their seed alone
    """
    grid = plan.source.grid if isinstance(plan.source, Tables) else None
    return {
        "schema": 1,
        "version": __version__,
        "sweep": plan.identity,
        "scenes": plan.source.count,
        "each": 1 if grid is None else grid.each,
        "columns": plan.columns,
        "drawn": [] if grid is None else [draw.key for draw in grid.draws],
        "measure": list(plan.measures),
        "units": _units(plan),
        "format": best_format(),
        **plan.said,
        "versions": VERSIONS,
    }


#: Keys of a scene file that are lengths and forces.
LENGTHS = (
    *("sphere.radius", "normal.approach", "asperities.spacing", "asperities.tip_radius"),
    *("asperities.within", "asperities.height_std"),
)
FORCES = ("normal.load",)


def _units(plan: Plan) -> dict[str, str]:
    """What columns are in, where the file names its units."""
    if not isinstance(plan.source, Tables):
        return {}
    named = plan.source.grid.tables.get("units", {})
    length, force = named.get("length", ""), named.get("force", "")
    keys = {key: length for key in plan.source.grid.keys if key in LENGTHS and length}
    keys |= {key: force for key in plan.source.grid.keys if key in FORCES and force}
    return keys | units(plan.measures, plan.stages, length, force)


def _share(count: int, part: tuple[int, int] | None) -> range:
    """The numbers of the k-th of n parts, of all where no part is asked for."""
    k, n = part or (1, 1)
    if not 1 <= k <= n:
        raise InputError("part", found=f"{k}/{n}", expected="K/N with K from 1 to N")
    return range(count * (k - 1) // n, count * k // n)


def _missing(folder: Folder, numbers: range, resume: bool) -> tuple[list[range], Found]:
    """What there is to do, and what was found; FileError where that is not to be gone on with."""
    parts = folder.parts()
    there = length(numbers) - sum(map(length, missing(parts, numbers)))
    if there and not resume:
        raise FileError(
            f"{folder.path}: holds {there:,} of these {length(numbers):,} scenes already; "
            f"--resume computes the rest, --out takes another folder"
        )
    damaged, unfinished = folder.clear(numbers)
    todo = missing(folder.parts(), numbers)
    return todo, Found(length(numbers) - sum(map(length, todo)), damaged, unfinished)


def _batches(plan: Plan, todo: Iterable[range], count: int, engine: Engine) -> Iterator[Batch]:
    most = max(1, min(MOST_SCENES, math.ceil(count / (SHARES * engine.at_once()))))
    for numbers in todo:
        for first in range(numbers.start, numbers.stop, most):
            some = range(first, min(first + most, numbers.stop))
            yield _batch(plan, some)


def _batch(plan: Plan, numbers: range) -> Batch:
    source = plan.source.part(numbers)
    return Batch(source, plan.measures, plan.stages, numbers.start, numbers.stop)


def _refuse_too_many(plan: Plan, numbers: range) -> None:
    """How many scenes, and how long: the first one is timed."""
    if (count := length(numbers)) <= MOST:
        return
    each = compute(_batch(plan, range(numbers.start, numbers.start + 1))).seconds
    raise InputError(
        "scenes",
        found=f"{count:,}, which take {duration(count * each)} of one processor",
        expected=f"at most {MOST:,} at once; a part of the sweep (K/N) may be that small",
        where=str(plan.said["source"]),
    )


def _told(found: Iterator[Rows], count: int, tell: Announce) -> Iterator[Rows]:
    """The rows themselves; how far they have come is told on the way."""
    began, done, failed = time.monotonic(), 0, 0
    for rows in found:
        yield rows
        done += len(rows)
        failed += int(np.count_nonzero(rows.columns["status"] == "failed"))
        rate = done / max(time.monotonic() - began, 1e-9)
        said = f"{done:,} of {count:,} scenes, {rate:,.3g} a second, "
        said += f"{duration((count - done) / rate)} left"
        tell(said + (f", {failed:,} failed" if failed else ""))


def duration(seconds: float) -> str:
    """In the unit that suits."""
    for size, unit in ((365.25 * 86400, "years"), (86400, "days"), (3600, "h"), (60, "min")):
        if seconds >= 2 * size:
            return f"{seconds / size:,.0f} {unit}"
    return f"{seconds:.0f} s"
