"""Maps in text files: matrices of heights, and lists of x, y and height."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.errors import FileError, InputError
from convexrough.text_table import SAMPLE, STYLES, Style, bare, lines_of, sniff, unit

#: What the third column of a list may be called.
HEIGHTS = ("height", "z", "h")

#: A line such as "# Width: 50.0 µm", as Gwyddion writes above a matrix.
_SAID = re.compile(r"[#%;\s]*(width|height|value units?)\s*[:=]\s*(.*?)\s*", re.I)
_LENGTH = re.compile(r"([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*(\S*)")

#: Parts of a pixel by which coordinates may be off.
OFF_GRID = 0.05


class Grid(NamedTuple):
    """Heights as a file has them, holes as nan, and what it says of them; "" and None: nothing."""

    heights: Array
    pixel: tuple[float, float] | None = None
    unit: str = ""
    height_unit: str = ""


def read_grid(path: Path) -> Grid:
    """A matrix of heights, a row of the map in each line; or columns x, y and height.

    Three columns are x, y and height, as no map is three pixels wide. A comment above a matrix may
    say its width and height with their unit, and the unit of the values.

    Raises FileError for what is no text, and InputError with row and column for what is no map.
    """
    comments: list[str] = []
    body: list[tuple[int, str]] = []
    for number, line in lines_of(path):
        text = line.strip()
        if text.startswith(("#", "%")) or (not body and _SAID.fullmatch(text)):
            comments.append(text)
        elif text:
            body.append((number, line.rstrip("\r\n")))
    if not body:
        raise FileError(f"{path}: empty")
    style = sniff([line for _, line in body[:SAMPLE]], STYLES)
    header = None
    if any(cell and style.number(cell) is None for cell in style.split(body[0][1])):
        header = style.split(body.pop(0)[1])
    if not body:
        raise FileError(f"{path}: no rows below the header")
    cells = _numbers(path, body, style)
    if header is not None or cells.shape[1] == 3:
        return _from_list(path, header, cells)
    return _said(comments, cells)


def _numbers(path: Path, body: Sequence[tuple[int, str]], style: Style) -> Array:
    """The cells of all lines; numpy reads what is plain, and what is not is read one by one."""
    lines: Sequence[str] = [line for _, line in body]
    if style.decimal == ",":
        lines = [line.replace(",", ".") for line in lines]
    separator = None if style.separator == " " else style.separator
    try:
        return np.loadtxt(lines, delimiter=separator, ndmin=2, dtype=np.float64)
    except ValueError:
        return _one_by_one(path, body, style)


def _one_by_one(path: Path, body: Sequence[tuple[int, str]], style: Style) -> Array:
    rows: list[list[float]] = []
    for number, line in body:
        cells = style.split(line)
        while cells and not cells[-1]:
            cells.pop()  # of a separator at the end of the line
        values = [float("nan") if not cell else style.number(cell) for cell in cells]
        if None in values:
            column = values.index(None)
            where = f"{path}: row {number}, column {column + 1}"
            raise InputError("height", found=repr(cells[column])[:60], expected="a number",
                             where=where)  # fmt: skip
        if rows and len(values) != len(rows[0]):
            expected = f"{len(rows[0])}, as in the first row"
            where = f"{path}: row {number}"
            raise InputError("cells", found=len(values), expected=expected, where=where)
        rows.append([value for value in values if value is not None])
    return np.array(rows)


def _said(comments: Sequence[str], heights: Array) -> Grid:
    """The matrix, with what the comments say of its size and units."""
    said = {}
    for found in filter(None, map(_SAID.fullmatch, comments)):
        said[found[1].lower().rstrip("s")] = found[2]
    sizes = [_LENGTH.fullmatch(said.get(name, "")) for name in ("width", "height")]
    value_unit = said.get("value unit", "")
    if sizes[0] is None or sizes[1] is None:
        return Grid(heights, height_unit=value_unit)
    (width, unit_x), (height, unit_y) = (size.groups() for size in sizes if size)
    if unit_x != unit_y:
        raise InputError("units", found=f"{unit_x} and {unit_y}", expected="one along x and y")
    rows, columns = heights.shape
    return Grid(heights, (float(width) / columns, float(height) / rows), unit_x, value_unit)


def _from_list(path: Path, header: Sequence[str] | None, cells: Array) -> Grid:
    """Columns x, y and height on a full or holed grid, in any order of the rows."""
    names = [bare(name).lower() for name in header or ("x", "y", "z")]
    third = next((name for name in HEIGHTS if name in names), "")
    if len(names) != cells.shape[1] or not {"x", "y"} <= set(names) or not third:
        found = ", ".join(header or names)
        expected = "columns x, y and height; or a matrix of numbers without a header"
        raise InputError("columns", found=found[:60], expected=expected, where=str(path))
    places = [names.index(name) for name in ("x", "y", third)]
    x, y, z = cells[:, places].T
    units = [unit(header[place]) if header else "" for place in places]
    if units[0] != units[1]:
        found = f"{units[0] or 'none'} and {units[1] or 'none'}"
        raise InputError("units", found=found, expected="one along x and y", where=str(path))
    (column, dx), (row, dy) = _steps(path, "x", x), _steps(path, "y", y)
    heights = np.full((int(row.max()) + 1, int(column.max()) + 1), np.nan)
    if heights.size > 4 * len(z) + 100:
        found = f"{len(z):,} points of a grid of {heights.size:,}"
        raise InputError("x, y", found=found, expected="a regular grid", where=str(path))
    if len(np.unique(row * heights.shape[1] + column)) < len(z):
        raise InputError("x, y", found="a place twice", expected="each once", where=str(path))
    heights[row, column] = z
    return Grid(heights, (dx, dy), units[0], units[2])


def _steps(path: Path, name: str, values: Array) -> tuple[Indices, float]:
    """Which line of a grid each value is on, and how far apart these are."""
    levels = np.unique(values)
    apart = np.diff(levels)
    if not np.isfinite(levels).all() or len(levels) < 2:
        found = "one value or none" if len(levels) < 2 else "values that are not finite"
        raise InputError(name, found=found, expected="places on a grid", where=str(path))
    clear = apart[apart > 1e-3 * apart.max()]  # the others are rounding of the same place
    step = float(np.median(clear))
    count = np.rint((levels[-1] - levels[0]) / step)
    step = float(levels[-1] - levels[0]) / count
    lines = (values - levels[0]) / step
    number = np.rint(lines)
    if np.abs(lines - number).max() > OFF_GRID:
        worst = float(values[np.argmax(np.abs(lines - number))])
        expected = f"places {step:g} apart"
        raise InputError(name, found=f"{worst:g}", expected=expected, where=str(path))
    return number.astype(np.intp), step
