"""Maps in text files: matrices of heights, and lists of x, y and height."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.errors import InputError
from convexrough.tabular.table import COLUMNS, Reading, matrix, read_table
from convexrough.tabular.text import COMMENT, TextTable, read_text_table
from convexrough.tabular.units import parsed

#: A line such as "# Width: 50.0 µm", as Gwyddion writes above a matrix.
_SAID = re.compile(r"[#%;\s]*(width|height|value units?)\s*[:=]\s*(.*?)\s*", re.I)
_COMMENT = re.compile(f"{COMMENT.pattern}|{_SAID.pattern}", re.I)
_LENGTH = re.compile(r"([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(.*)")

#: A unit of length anywhere in a comment ("um" is also a German word), and words before a scale.
_UNIT = re.compile(
    r"(?<![^\W\d])(?:nm|µm|μm|mm|Å|angstroms?|microns?|(?:nano|micro|milli)met(?:er|re)s?)(?!\w)"
    r"|(?:[\d(\[,:=]|\bin)\s*um(?!\w)|纳米|微米|毫米",
    re.I,
)
_SCALE = re.compile(r"pixel|scale|factor|resolution|spacing|\bd[xyz]\b", re.I)

#: Largest accepted distance of a coordinate from the grid, in pixels.
OFF_GRID = 0.05


class HeightGrid(NamedTuple):
    """The heights in a file, with nan for holes, and the pixel and units that the file states.

    pixel : size along x and y; None if not stated
    unit, height_unit : units of the pixel and of the heights; "" if not stated
    unclear : the first comment that states a length or a unit of length, but not in words that
        `read_grid` knows; "" if there is none
    """

    heights: Array
    pixel: tuple[float, float] | None = None
    unit: str = ""
    height_unit: str = ""
    unclear: str = ""


def read_grid(path: Path) -> HeightGrid:
    """The map in a text file: a matrix of heights, a line for each row; or columns x, y and height.

    Files with three columns are taken as x, y and height. Comments above a matrix may state the
    width and height with a unit, and the unit of the values.

    Raises FileError if the file is not text, and InputError with row and column if it contains no
    map.
    """
    table = read_text_table(path, ("x", "y", "height", *COLUMNS["height"].also), _COMMENT)
    return _map(path, table)._replace(unclear=next(filter(_unclear, table.comments), ""))


def _unclear(comment: str) -> bool:
    """True for a comment that seems to state a scale, such as "# Breite: 50 µm" or "# z in nm"."""
    if _SAID.fullmatch(comment):
        return False
    _, marked, value = comment.replace("=", ":").rpartition(":")
    length = _LENGTH.fullmatch(value.strip())
    unit = parsed(length[2] if length else value.strip())
    if marked and unit and unit.kind == "length":
        return True
    return bool(_UNIT.search(comment) or (re.search(r"\d", comment) and _SCALE.search(comment)))


def _map(path: Path, table: TextTable) -> HeightGrid:
    width = len(table.rows[0].cells) if table.rows else 0
    if table.header is None and width != 3:
        apart = np.diff([row.number for row in table.rows])
        if len(gaps := np.flatnonzero(apart > min(apart, default=1))):
            before, after = (table.rows[gaps[0] + i].number for i in (0, 1))
            found = f"lines without numbers between rows {before} and {after}"
            expected = "one map in a file: remove comments and empty lines between its rows"
            raise InputError("rows", found=found, expected=expected, where=str(path))
        heights = matrix(path, table)
        if min(heights.shape) > 2:
            _refuse_numbers(path, "row 1", heights[0, 1:], heights[1, 1:])
            _refuse_numbers(path, "column 1", heights[1:, 0], heights[1:, 1])
            for place, of, grid in (("row", "columns", heights), ("column", "rows", heights.T)):
                off, spread = grid[-1] - grid[:-1].mean(axis=0), grid[:-1].std(axis=0)
                if (np.abs(off) < 0.01 * spread).all():
                    found = f"the means of the {of}"
                    raise InputError(f"last {place}", found=found, expected="heights alone",
                                     where=str(path))  # fmt: skip
        return _said(table.comments, heights)
    names = table.header.cells if table.header else []
    if names and all(table.style.number(name.replace(",", ".")) is not None for name in names):
        expected = "decimal points, not commas in quotes"
        raise InputError("row 1", found=names[0], expected=expected, where=str(path))
    if table.header and width > 3:
        first = [table.style.number(cell) for cell in table.header.cells[1:]]
        if len(first) > 2 and None not in first:
            raise _not_heights(path, "row 1", first)
    if table.header and len(table.header.cells) < 3 < width:
        expected = "a comment, which begins with #; the unit of heights as # Value units: nm"
        where = f"{path}: row {table.header.number}"
        found = repr(table.header.text[:60])
        raise InputError("text", found=found, expected=expected, where=where)
    return _from_list(path, table)


def _refuse_numbers(path: Path, place: str, line: Array, second: Array) -> None:
    """Raise InputError if the row or column `line` holds coordinates or numbers, not heights."""
    if _even(line) and not _even(second):
        raise _not_heights(path, place, line.tolist())


def _not_heights(path: Path, place: str, line: Sequence[Any]) -> InputError:
    """The error for a row or column `line` with coordinates or numbers in place of heights."""
    said = ", ".join(f"{each:g}" for each in line[:3])
    expected = (
        "heights alone: leave coordinates and numbers of rows and columns out, with pandas by "
        "header=False, index=False"
    )
    return InputError(place, found=f"numbers {said}, ...", expected=expected, where=str(path))


def _even(line: Array) -> bool:
    """True for numbers at equal distances, up to rounding to six digits."""
    steps, size = np.diff(line), float(np.abs(line).max())
    return bool(
        len(steps) > 3 and steps[0] != 0 and (np.abs(steps - steps[0]) <= 1e-5 * size).all()
    )


def _said(comments: Sequence[str], heights: Array) -> HeightGrid:
    """The matrix `heights`, with the pixel and the units that comments state."""
    said = {}
    for found in filter(None, map(_SAID.fullmatch, comments)):
        said[found[1].lower().rstrip("s")] = found[2]
    sizes = [_LENGTH.fullmatch(said.get(name, "")) for name in ("width", "height")]
    value_unit = said.get("value unit", "")
    if sizes == [None, None]:
        return HeightGrid(heights, height_unit=value_unit)
    if None in sizes:
        only = "only a width" if sizes[0] else "only a height"
        raise InputError("comments", found=only, expected="a width and a height, or neither")
    (width, unit_x), (height, unit_y) = (size.groups() for size in sizes if size)
    if unit_x != unit_y:
        raise InputError("units", found=f"{unit_x} and {unit_y}", expected="one along x and y")
    rows, columns = heights.shape
    across, upwards = (float(each.replace(",", ".")) for each in (width, height))
    return HeightGrid(heights, (across / columns, upwards / rows), unit_x, value_unit)


def _from_list(path: Path, cells: TextTable) -> HeightGrid:
    """The map from columns x, y and height, in any order; missing points of the grid are holes."""
    table = read_table(path, required=("x", "y", "height"), unnamed=(("x", "y", "height"),),
                       holes=("height",),
                       how=Reading(alike=False), table=cells)  # fmt: skip
    x, y, z = (table.columns[name] for name in ("x", "y", "height"))
    units = [table.units.get(name, "") for name in ("x", "y", "height")]
    if units[0] != units[1]:
        found = f"{units[0] or 'none'} and {units[1] or 'none'}"
        raise InputError("units", found=found, expected="one along x and y", where=str(path))
    heights, pixel = on_grid(path, x, y, z)
    return HeightGrid(heights, pixel, units[0], units[2])


def on_grid(path: Path, x: Array, y: Array, z: Array) -> tuple[Array, tuple[float, float]]:
    """The map from points (n,) in any order, and the pixel (dx, dy); missing points are nan."""
    (column, dx), (row, dy) = steps(path, "x", x), steps(path, "y", y)
    heights = np.full((int(row.max()) + 1, int(column.max()) + 1), np.nan)
    if heights.size > 4 * len(z) + 100:
        found = f"{len(z):,} points of a grid of {heights.size:,}"
        raise InputError("x, y", found=found, expected="a regular grid", where=str(path))
    place = row * heights.shape[1] + column
    once, count = np.unique(place, return_counts=True)
    if len(once) < len(z):
        k = int(np.argmax(place == once[np.argmax(count)]))
        found = f"the point {x[k]:g}, {y[k]:g} {count.max()} times"
        raise InputError("x, y", found=found, expected="each point once", where=str(path))
    heights[row, column] = z
    return heights, (dx, dy)


def steps(path: Path, name: str, values: Array) -> tuple[Indices, float]:
    """For coordinates in a list: the number of the grid line of each, and the lines' spacing."""
    levels = np.unique(values)
    apart = np.diff(levels)
    if not np.isfinite(levels).all() or len(levels) < 2:
        found = "one value or none" if len(levels) < 2 else "values that are not finite"
        raise InputError(name, found=found, expected="coordinates on a grid", where=str(path))
    clear = apart[apart > 1e-3 * apart.max()]  # smaller differences are rounding errors
    span = float(levels[-1] - levels[0])
    digit = _last_digit(levels)
    # Lines of the grid can be missing; if coordinates are rounded, their differences vary.
    for count, rounded in ((np.rint(span / np.median(clear)), 0.0), (len(clear), digit)):
        step = span / count
        lines = (values - levels[0]) / step
        number = np.rint(lines)
        off = np.abs(lines - number)
        if off.max() <= OFF_GRID + (rounded / step if rounded < step / 4 else 0.0):
            return number.astype(np.intp), step
    worst = float(values[np.argmax(off)])
    expected = f"coordinates {step:g} apart, on a regular grid, in columns x, y and height"
    raise InputError(name, found=f"{worst:g}", expected=expected, where=str(path))


def _last_digit(values: Array) -> float:
    """The largest power of ten of which all values are multiples; 0 if they have many digits."""
    first = int(np.floor(np.log10(np.abs(values).max())))
    for power in range(first, first - 10, -1):
        parts = values / 10.0**power
        if np.abs(parts - np.rint(parts)).max() < 1e-5:
            return 10.0**power
    return 0.0
