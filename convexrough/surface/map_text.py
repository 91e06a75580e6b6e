"""Maps in text files: a matrix of heights, or columns x, y and height.

Comments above a matrix may state the width and height of the map (its sizes along x and y) with a
unit, and the unit of the values (the heights).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.surface.map_arrays import SCALES, HeightGrid, on_grid
from convexrough.tabular.roles import COLUMNS, Reading, is_index
from convexrough.tabular.table import matrix, read_table
from convexrough.tabular.text import COMMENT, TextTable, read_text_table
from convexrough.tabular.units import in_text, parsed

#: A line such as "# Width: 50.0 µm", as Gwyddion writes above a matrix.
_SAID = re.compile(r"[#%;\s]*(width|height|value units?)\s*[:=]\s*(.*?)\s*", re.I)
_COMMENT = re.compile(f"{COMMENT.pattern}|{_SAID.pattern}", re.I)
_LENGTH = re.compile(r"([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(.*)")

#: Words that announce a scale, with a number; and words that announce one also without a number.
_SCALE = re.compile(
    r"pixel|scale|fa[ck]tor|mult|gain|cal(?:ib|\b)|\bz ?cal|lsb|resolution|spacing|step"
    r"|\bd[xyz]\b|[*×]\s*\d|\bx\s*\d+\s*$",
    re.I,
)
_CHANGED = re.compile(
    r"\b(counts|digits|volts?|waves|fringes|inverted|multiplied|divided|(?:nano|mi[ck]ro|milli)met\w+)\b",
    re.I,
)

#: A table with at most this many columns is not a matrix if two of them are coordinates of a grid.
MOST_COLUMNS = 6


def text_map(path: Path) -> HeightGrid:
    """The map in a text file: x, y and height if it has three columns or names; else a matrix."""
    known = ("x", "y", "height", *COLUMNS["height"].also)
    table = read_text_table(path, known, _COMMENT, is_map=True)
    width = len(table.rows[0].cells) if table.rows else 0
    read = _matrix if table.header is None and width != 3 else _list
    header = table.header.text.strip() if table.header else ""
    unread = [each for each in table.comments if not _SAID.fullmatch(each)]
    unread = [each for each in unread if each.strip("#%; ") and each.lstrip("#% ") != header]
    return read(path, table, width)._replace(comments=tuple(unread), sheet=table.style.sheet)


def states_scale(comment: str) -> bool:
    """True for a comment that seems to state a scale, such as "# Breite: 50 µm" or "# z in nm"."""
    _, marked, value = comment.replace("=", ":").rpartition(":")
    length = _LENGTH.fullmatch(value.strip())
    unit = parsed(length[2] if length else value.strip())
    if marked and unit and unit.kind == "length":
        return True
    named = map(parsed, in_text(comment))
    scaled = _CHANGED.search(comment) or (re.search(r"\d", comment) and _SCALE.search(comment))
    return bool(scaled) or any(not unit or unit.kind == "length" for unit in named)


def _matrix(path: Path, table: TextTable, width: int) -> HeightGrid:
    """The matrix of heights, with the pixel size and the units that the comments state."""
    rows = [row.number for row in table.rows]
    apart = np.diff(rows)
    if len(gaps := np.flatnonzero(apart > min(apart, default=1))):  # as between two maps
        found = f"lines without numbers between rows {rows[gaps[0]]} and {rows[gaps[0] + 1]}"
        expected = "one map in a file: remove comments and empty lines between its rows"
        raise InputError("rows", found=found, expected=expected)
    heights = matrix(path, table)
    for one, other in combinations(heights.T if width <= MOST_COLUMNS else (), 2):
        sides = [len(np.unique(each)) for each in (one, other)]
        if min(sides) > 2 and sides[0] * sides[1] == len(heights) > width:
            found = f"{width} columns without a header, two of which are coordinates"
            raise InputError("columns", found=found, expected="their names above them: x, y, z")
    if min(heights.shape) > 2:
        for place, lines in (("row", heights), ("column", heights.T)):
            for number, one, other in ((1, 0, 1), (len(lines), -1, -2)):
                line = lines[one]
                if _even(line[1:]) and not _even(lines[other, 1:]):
                    raise _not_heights(f"{place} {number}", line[~np.isnan(line)])
            off, spread = lines[-1] - lines[:-1].mean(axis=0), lines[:-1].std(axis=0)
            if (np.abs(off) < 0.01 * spread).all():
                found = f"the means of the {'columns' if place == 'row' else 'rows'}"
                raise InputError(f"last {place}", found=found, expected="heights alone")
    said = {}
    for match in filter(None, map(_SAID.fullmatch, table.comments)):
        said[match[1].lower().rstrip("s")] = match[2]
    sizes = [_LENGTH.fullmatch(said.get(name, "")) for name in ("width", "height")]
    value_unit = said.get("value unit", "")
    if sizes == [None, None]:
        return HeightGrid(heights, height_unit=value_unit)
    if None in sizes:
        only = "only a width" if sizes[0] else "only a height"
        raise InputError("comments", found=only, expected="a width and a height, or neither")
    (across, unit_x), (upwards, unit_y) = (size.groups() for size in sizes if size)
    if unit_x != unit_y:
        raise InputError("units", found=f"{unit_x} and {unit_y}", expected="one along x and y")
    lengths = [float(each.replace(",", ".")) for each in (across, upwards)]
    dy, dx = np.divide(lengths[::-1], heights.shape).tolist()
    return HeightGrid(heights, (dx, dy), unit_x, value_unit)


def _not_heights(place: str, line: Sequence[Any] | Array) -> InputError:
    """The error for a row or column `line` of coordinates or counts in place of heights."""
    said = ", ".join(f"{each:g}" for each in line[:3])
    expected = "heights alone: leave coordinates and numbers of rows and columns out, with pandas "
    expected += "by header=False, index=False"
    return InputError(place, found=f"numbers {said}, ...", expected=expected)


def _even(line: Array) -> bool:
    """True for more than four numbers at equal distances, up to rounding to six digits."""
    steps, size = np.diff(line), float(np.abs(line).max())
    return bool(
        len(steps) > 3 and steps[0] != 0 and (np.abs(steps - steps[0]) <= 1e-5 * size).all()
    )


def _list(path: Path, cells: TextTable, width: int) -> HeightGrid:
    """The map from columns x, y and height, in any order; missing points of the grid are holes.

    Other columns, which could be a mask or a factor of the heights, may only be labels.
    """
    names, number = cells.header.cells if cells.header else [], cells.style.number
    if names and all(number(name.replace(",", ".")) is not None for name in names):
        expected = "decimal points, not commas in quotes"
        raise InputError("row 1", found=names[0], expected=expected)
    first = [number(name) for name in names] if width > 3 else []
    if len(first) > 3 and None not in first[1:]:
        raise _not_heights("row 1", [each for each in first if each is not None])
    table = read_table(path, required=("x", "y", "height"), unnamed=(["x", "y", "height"],),
                       holes=("height",), how=Reading(alike=False), table=cells)  # fmt: skip
    if others := [name for name, cells in table.others.items() if not _is_label(name, cells)]:
        expected = "x, y, height and at most an index: delete other columns; nan marks holes"
        raise InputError("columns", found=", ".join(others), expected=expected)
    x, y, z = (table.columns[name] for name in ("x", "y", "height"))
    units = [table.units.get(name, "") for name in ("x", "y", "height")]
    if units[0] != units[1]:
        found = f"{units[0] or 'none'} and {units[1] or 'none'}"
        raise InputError("units", found=found, expected="one along x and y")
    return HeightGrid(*on_grid(z, x, y), units[0], units[2])


def _is_label(name: str, cells: NDArray[Any]) -> bool:
    """True for a column that cannot change heights: an index, or the same text in every row."""
    count = len(np.unique(cells))
    if is_index(name):
        return count == len(cells)
    return count == 1 and cells.dtype.kind == "U" and not SCALES.search(name)
