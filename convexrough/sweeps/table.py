"""The table of a sweep, in memory or in a folder."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.errors import InputError, needed
from convexrough.record import Record, frame_of, in_text
from convexrough.sweeps.batch import Columns
from convexrough.sweeps.folder import Folder, open_folder

if TYPE_CHECKING:
    import dask.dataframe
    import pandas
    from matplotlib.axes import Axes

#: The quantiles that are computed by default.
USUAL = (0.05, 0.25, 0.5, 0.75, 0.95)

#: [bytes] memory for one number of a table together with its copy in a data frame.
CELL = 24


def open_sweep(folder: str | os.PathLike[str]) -> SweepTable:
    """The table of a complete or incomplete sweep in a folder. Rows are read when needed.

    Raises FileError if the folder contains no sweep.

    >>> made = cr.sweep([scene], load=3e-7, measure=["load"], out=folder / "a", workers=1)
    >>> cr.open_sweep(folder / "a").counts()
    {'certified': 1, 'undecided': 0, 'failed': 0}
    """
    found = open_folder(checks.path("folder", folder, "the folder of a sweep"))
    return SweepTable(found.manifest, found)


@dataclass(frozen=True, eq=False, repr=False)
class SweepTable(Record):
    """A table with a row for each computed scene, in the order of the sweep.

    manifest  : description of the sweep
    folder    : folder of the parts; None if the table is in memory
    in_memory : the columns by name; None if the table is in a folder

    The columns are `scene` (its number), the swept keys, `seed` (-1 if nothing is random), `status`
    ("certified", "undecided" or "failed"), `message` (why the scene is not certified, and
    warnings), and the measured numbers (nan if the scene failed).

    >>> loads = [1e-7, 2e-7, 3e-7]
    >>> table = cr.sweep([scene] * 3, load=loads, measure=["contact"], workers=1)
    >>> print(table.read(["normal.load", "contact"])["contact"], table.complete, table.counts())
    [19. 31. 37.] True {'certified': 3, 'undecided': 0, 'failed': 0}
    >>> [block["contact"].tolist() for block in table.blocks(["contact"])]
    [[19.0, 31.0, 37.0]]
    >>> print(table.quantiles(["contact"], at=[0.5])["0.5"])
    [19. 31. 37.]
    >>> frame = table.to_dataframe(["contact"])
    >>> axes = table.plot("contact", "normal.load")
    """

    manifest: Mapping[str, Any]
    folder: Folder | None = None
    in_memory: Columns | None = None

    @property
    def columns(self) -> list[str]:
        """The names of all columns."""
        return list(self.manifest["columns"])

    @property
    def swept(self) -> list[str]:
        """The swept keys, with random keys last."""
        return self.columns[1 : self.columns.index("seed")]

    @property
    def points(self) -> list[str]:
        """The swept keys that are not random. A combination of their values is a grid point."""
        return [key for key in self.swept if key not in self.manifest["drawn"]]

    @property
    def measured(self) -> list[str]:
        """The names of the columns with measured numbers."""
        return self.columns[self.columns.index("message") + 1 :]

    @property
    def scenes(self) -> int:
        """The number of scenes of the sweep."""
        return int(self.manifest["scenes"])

    @property
    def complete(self) -> bool:
        """True if every scene has a row."""
        return len(self) == self.scenes

    def __len__(self) -> int:
        """The number of rows."""
        if self.in_memory is not None:
            return len(self.in_memory["scene"])
        return sum(map(len, self.folder.parts())) if self.folder is not None else 0

    def blocks(self, names: Sequence[str] | None = None) -> Iterator[Columns]:
        """Yield some columns, by default all, one part at a time; for large tables.

        Raises InputError for unknown names, FileError for a damaged part.
        """
        names = self._chosen(names, self.columns)
        if self.in_memory is not None:
            yield {name: self.in_memory[name] for name in names}
            return
        assert self.folder is not None  # else the table is in memory
        for part in self.folder.parts():
            yield self.folder.read(part, names)

    def read(self, names: Sequence[str] | None = None) -> Columns:
        """Some columns, by default all, as arrays.

        Raises InputError for unknown names, or if the arrays do not fit in memory; FileError for a
        damaged part.
        """
        wanted = self._chosen(names, self.columns)
        checks.fits_in_memory("rows", len(self), CELL * len(wanted))
        blocks = list(self.blocks(wanted))
        if not blocks:
            return {name: np.empty(0) for name in wanted}
        return {name: np.concatenate([block[name] for block in blocks]) for name in wanted}

    def counts(self) -> dict[str, int]:
        """The number of rows with each status."""
        counts = dict.fromkeys(("certified", "undecided", "failed"), 0)
        for block in self.blocks(["status"]):
            for status in counts:
                counts[status] += int(np.count_nonzero(block["status"] == status))
        return counts

    def to_dataframe(self, columns: Sequence[str] | None = None) -> pandas.DataFrame:
        """A pandas data frame with some columns, by default all.

        Raises ExtraError if pandas is not installed; InputError if the table does not fit in memory
        (then use `to_dask`).
        """
        attributes = {name: self.manifest[name] for name in ("sweep", "version", "source")}
        return frame_of(self.read(columns), **attributes)

    def to_dask(self, columns: Sequence[str] | None = None) -> dask.dataframe.DataFrame:
        """A Dask data frame with some columns, by default all; parts are read when needed.

        Raises ExtraError if Dask is not installed; InputError for unknown names, or if the table
        has no rows or is not in a folder.

        >>> made = cr.sweep([scene], load=3e-7, measure=["load"], out=folder / "b", workers=1)
        >>> len(made.to_dask(["load"]))
        1
        """
        frames_of_dask = needed("dask.dataframe", "dask")
        names = self._chosen(columns, self.columns)
        if self.folder is None or not len(self):
            raise InputError("table", found="no parts", expected="rows in a folder")
        frame, parts = partial(_frame, self.folder, names), self.folder.parts()
        found: dask.dataframe.DataFrame
        found = frames_of_dask.from_map(frame, parts, meta=frame(parts[0]).iloc[:0])
        return found

    def plot(
        self, measured: str | None = None, over: str | None = None, axes: Axes | None = None
    ) -> Axes:
        """Axes with the median and bands of quantiles of a measured number against a swept key.

        measured, over : names of columns; default: the first measured number and the first swept
            key. Up to four combinations of the other swept keys that are not random have bands of
            their own; more combinations share one pair of bands
        axes : where to draw; default: new axes

        Raises InputError if nothing is swept, if there are no rows, and for unknown names.
        """
        from convexrough.plots.style import TICK, label, literal  # only here: loads matplotlib
        from convexrough.sweeps.figures import draw_quantiles

        if not self.swept or not len(self):
            expected = "rows, and a key in [sweep.over], [sweep.together] or [sweep.draw]"
            raise InputError("table", found="nothing to draw", expected=expected)
        measured = self.measured[0] if measured is None else measured
        over = self.swept[0] if over is None else over
        self._chosen([measured], self.measured)
        others = [key for key in self.points if key != over]
        columns = self.read([over, *others, "status", measured])
        axes = draw_quantiles(columns, measured, over, others, axes)
        if missing := self.scenes - len(self):
            said = (axes.get_title("left"), f"{missing:,} scenes are missing")
            axes.set_title(", ".join(filter(None, said)), fontsize=TICK, loc="left")
        label(axes, literal(self._said(over)), literal(self._said(measured)))
        return axes

    def quantiles(
        self, measured: Sequence[str] | None = None, at: Sequence[float] = USUAL
    ) -> Columns:
        """Quantiles over seeds, as columns by name.

        measured : names of measured numbers, by default all;  at : quantiles, from 0 to 1

        There is a row for each computed grid point and each measured number. The columns are those
        of `points`, `quantity` (the name of the number), `scenes` (number of computed scenes),
        `undecided` and `failed` (numbers of such scenes), and quantiles of the values that are not
        nan (nan if there are none).

        Raises InputError for unknown names, and for quantiles that are not from 0 to 1.
        """
        checks.sequence("at", at, "a list of quantiles, from 0 to 1")
        at = [checks.between(f"at[{i}]", it, 0, 1) for i, it in enumerate(at)]
        names = self._chosen(measured, self.measured)
        about = self.read([*self.points, "scene", "status"])
        ends = np.flatnonzero(np.diff(about["scene"] // int(self.manifest["each"]))) + 1
        points = np.split(np.arange(len(about["scene"])), ends) if len(about["scene"]) else []
        good, doubtful = about["status"] != "failed", ("undecided", "failed")
        rows: list[tuple[Any, ...]] = []
        for name in names:
            values = self.read([name])[name]
            for place, point in enumerate(points):
                known = values[point][good[point] & ~np.isnan(values[point])]
                found = _quantiles(known, at) if len(known) else np.full(len(at), np.nan)
                keys = (about[key][point[0]] for key in self.points)
                counts = ((about["status"][point] == it).sum() for it in doubtful)
                rows.append((place, *keys, name, len(point), *counts, *found))
        rows.sort(key=lambda row: row[0])
        heads = (*self.points, "quantity", "scenes", *doubtful, *(f"{part:g}" for part in at))
        return {head: np.array([row[i] for row in rows]) for i, head in enumerate(heads, 1)}

    def _said(self, name: str) -> str:
        table, _, key = name.rpartition(".") if name in self.swept else ("", "", name)
        label = (f"{table}: {key}" if table else key).replace("_", " ")
        unit = self.manifest["units"].get(name, "")
        return f"{label} ({unit})" if unit else label

    def _chosen(self, names: Sequence[str] | None, known: list[str]) -> list[str]:
        """The given names, by default all known ones. Raises InputError for unknown names."""
        checks.sequence("columns", names := known if names is None else names, "a list of names")
        for name in names:
            if name not in known:
                expected = f"a column of the table: {checks.nearest(str(name), known)}"
                raise InputError("column", found=repr(name), expected=expected)
        return list(names)

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "rows", f"{len(self):,} of {self.scenes:,} scenes"
        yield "status", ", ".join(f"{n:,} {status}" for status, n in self.counts().items() if n)
        yield "swept", in_text(", ".join(self.swept))
        yield "measured", in_text(", ".join(self.measured))
        yield "source", in_text(self.manifest["source"])
        yield "folder", in_text("none" if self.folder is None else self.folder.path)


def _quantiles(values: Array, at: Sequence[float]) -> Array:
    """Quantiles as by `np.quantile`; some of the values may be infinite."""
    with np.errstate(invalid="ignore"):
        inner = np.quantile(values, at)
        low, high = (np.quantile(values, at, method=end) for end in ("lower", "higher"))
        outer = np.where(low == high, low, low + high)  # one or both are infinite
    return np.where(np.isfinite(inner), inner, outer)


def _frame(folder: Folder, names: Sequence[str], part: range) -> pandas.DataFrame:
    return frame_of(folder.read(part, names))
