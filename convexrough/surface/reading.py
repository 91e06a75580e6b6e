"""`read`: a surface from a file, with all lengths in one unit; and maps in text files.

Text holds a matrix of heights, or columns x, y and height. Comments above a matrix may state the
width and height of the map (its sizes along x and y) with a unit, and the unit of the values. The
header of an ESRI grid states the size of a pixel, the mark of holes, and that y falls row by row.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array
from convexrough.errors import InputError, blamed_on
from convexrough.surface import map_arrays
from convexrough.surface.detrend import Trend
from convexrough.surface.map_arrays import HeightGrid
from convexrough.surface.pixels import filled
from convexrough.surface.surface import Surface, checked_pixel
from convexrough.tabular.arrays import reading
from convexrough.tabular.roles import CHANGED, COLUMNS, Reading, is_index, states_factor
from convexrough.tabular.table import matrix, read_table
from convexrough.tabular.text import COMMENT, WORKBOOKS, TextTable, read_text_table
from convexrough.tabular.units import in_text, one_unit, parsed

#: Suffixes of text files.
TEXT = ("", ".csv", ".txt", ".dat", ".asc", ".tsv", ".xyz", ".gz", *WORKBOOKS)

#: Rms slopes outside this range suggest that heights and pixels are in different units.
SLOPES = (1e-5, 10.0)

#: Numbers in MARKS, numbers of absolute value at least HUGE, and the extreme numbers of a map may
#: mark holes. Such a number does so if it differs from the median of the other heights by more than
#: FAR times the range of these.
MARKS, FAR, HUGE = (-999.0, -9999.0, -99999.0, -32768.0, 9999.0, 99999.0, 32767.0), 10.0, 1e30

#: Pixel sizes count as equal up to this relative difference.
SAME = 1e-6

#: A line such as "# Width: 50.0 µm", as Gwyddion writes above a matrix.
_SAID = re.compile(r"[#%;\s]*(width|height|value units?)\s*[:=]\s*(.*?)\s*", re.I)
#: A line of the header of an ESRI grid, such as "cellsize 0.5".
_ESRI = re.compile(
    r"(ncols|nrows|[xy]llc\w+|cellsize|d[xy]|nodata_value)[\s:=]+"
    r"(nan|-?(?:\d+\.?\d*|\.\d+|\d+,(?!\d{3}$)\d*)(?:e[+-]?\d+)?)$",
    re.I,
)
_COMMENT = re.compile(f"{COMMENT.pattern}|{_SAID.pattern}|{_ESRI.pattern}", re.I)
_LENGTH = re.compile(r"([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(.*)")
#: The same without a comma that may separate thousands.
_SIZE = re.compile(rf"(?![1-9]\d*,\d{{3}}(?!\d)){_LENGTH.pattern}")

#: Words that announce a scale, with a number.
_SCALE = re.compile(
    r"pixel|scale|fa[ck]tor|mult|gain|cal(?:ib|\b)|\bz ?cal|lsb|resolution|spacing|step"
    r"|\bd[xyz]\b|[*×]\s*\d|\bx\s*\d+\s*$",
    re.I,
)

#: Words that, above a map, may mean heights that are no lengths or grow downwards.
_RAW = re.compile(r"\b((?<!\d )(?:counts|digits)|depth|down)\b", re.I)

#: A table with at most this many columns is not a matrix if two of them are coordinates of a grid.
MOST_COLUMNS = 6


def read(
    path: str | os.PathLike[str],
    *,
    pixel: float | tuple[float, float] | None = None,
    unit: str | None = None,
    height_unit: str | None = None,
    detrend: Trend | None = "plane",
    fill: bool = False,
) -> Surface:
    """The surface in a file: .npy, .npz, .mat, text, or a format that SurfaceTopography reads.

    pixel  : [unit] size of a pixel, or sizes along x and y; required if the file states none
    unit   : unit of the pixel; None if the file states it or if it is unknown
    height_unit : unit of the heights, which are converted to that of the pixel; default: the same.
        It is an error if `unit` or `height_unit` differs from what the file states
    detrend : the form that is fitted and subtracted: "plane", "sphere", "paraboloid" or None
    fill   : True to fill holes with a harmonic function, after the form is fitted to the other
        pixels; with False, holes are an error. Holes are nan, masked values, BAD in text, and marks
        far from all heights, such as -9999 or 1e38

    An .npz or .mat file contains `heights`. It may also contain `unit`, `height_unit`, `pixel`, and
    coordinates x and y: either x of each column and y of each row, or x and y of each height. Other
    numbers that could change the meaning of the heights are an error. Text contains a matrix,
    possibly with the comments on its size that Gwyddion writes, or the header of an ESRI grid. A
    matrix with three columns and without such a header is a list of x, y and height on a grid.
    Formats of instruments need the package SurfaceTopography (the extra `surface`).

    Raises FileError if the file cannot be read, or if SurfaceTopography is needed but not
    installed; InputError if the file contains no usable map.

    >>> np.savez(folder / "scan.npz", heights=np.random.default_rng(1).normal(size=(64, 64)))
    >>> cr.surface.read(folder / "scan.npz", pixel=2.5, unit="µm").size
    (160.0, 160.0)
    """
    path = checks.path("path", path, "the name of a file with a map")
    with blamed_on(path, unless_known=True):
        if not isinstance(fill, (bool, np.bool_)):
            raise InputError("fill", found=fill, expected="True or False")
        kind = path.suffix.lower()
        with reading(path):
            binary = kind == ".dat" and path.read_bytes()[:3] == map_arrays.METROPRO
            if kind in TEXT and not binary:
                grid = text_map(path)
            elif kind in (".npy", ".npz", ".mat"):
                grid = map_arrays.arrays_map(path)
                if grid.heights.ndim == 2:  # else `Surface` refuses it
                    _refuse_coordinates(grid.heights)
            else:
                grid = map_arrays.instrument_map(path)
        unclear = next(filter(states_scale, grid.comments), "")
        if unclear and not ((pixel or grid.pixel) and (height_unit or grid.height_unit)):
            expected = '"Width: 50 µm", "Height: 50 µm" and "Value units: nm" above a matrix, '
            expected += '"x [µm] y [µm] z [nm]" above columns'
            options = {"--pixel": pixel or grid.pixel, "--unit": unit or grid.unit}
            options["--height-unit"] = height_unit or grid.height_unit
            missing = " and ".join(name for name, known in options.items() if not known)
            expected += f", or also {missing} if the file is right without this line"
            raise InputError("comments", found=unclear.strip(), expected=expected)
        length = one_unit("unit", unit, grid.unit)
        upwards = one_unit("height_unit", height_unit, grid.height_unit)
        if upwards and not length:
            expected = f"the unit of the pixel, as heights are in {upwards.name}"
            raise InputError("unit", found="none", expected=expected)
        heights, holes = _unfilled(grid.heights, fill)
        if upwards and length:
            heights = heights * upwards.into(length)
        if holes is not None and detrend is None:
            heights = filled(heights)
        elif holes is not None:  # `detrend` fills them
            heights = np.where(holes, heights[~holes][0], heights)
        sizes = [checked_pixel(each) for each in (grid.pixel, pixel) if each is not None]
        if not sizes:
            expected = "its size, which the file does not state: pixel=, or --pixel"
            raise InputError("pixel", found="none", expected=expected)
        map_arrays.refuse_other(sizes[-1], sizes[0], SAME, "as the file states, or none given")
        name = length.name if length else ""
        source = ", ".join(filter(None, (str(path), grid.part)))
        surface = Surface(heights, sizes[0], name, (), holes, source, grid.comments)
        surface = surface if detrend is None else surface.detrend(detrend)
        slope = surface.rms_slope
        if not SLOPES[0] <= slope <= SLOPES[1]:
            likely = f"{SLOPES[0]:g} to {SLOPES[1]:g}"
            more = "if heights have another unit, give height_unit, or --height-unit"
            more = f"check height_unit, {upwards.name}, and unit" if upwards else more
            expected = f"{likely}; {more}"
            raise InputError("heights", found=f"rms slope {slope:.3g}", expected=expected)
        return surface


def _unfilled(heights: Array, fill: bool) -> tuple[Array, NDArray[np.bool_] | None]:
    """The heights with nan in holes, which are errors unless `fill`; and a map of them, or None."""
    if heights.size == 0:
        return heights, None  # `Surface` refuses it
    known = np.isin(heights, MARKS) | (np.abs(heights) >= HUGE)
    marks = known | np.isin(heights, (np.fmin.reduce(heights, None), np.fmax.reduce(heights, None)))
    if (rest := heights[~marks & ~np.isnan(heights)]).size:
        span = np.ptp(rest)
        marks &= (np.abs(heights - np.median(rest)) > FAR * span) & (known | (span > 0))
    else:
        marks = known
    empty = np.isnan(heights) | marks
    holes = int(np.count_nonzero(empty))
    if holes == 0:
        return heights, None
    named = [f"{each:g}" for each in np.unique(heights[empty])]
    row, column = np.argwhere(empty)[0] + 1
    found = f"{holes:,} hole{'s' * (holes > 1)} ({', '.join(named)}) in {heights.size:,} pixels"
    found += f", the first in row {row}, column {column}"
    heights = np.where(marks, np.nan, heights)
    if holes == heights.size:
        raise InputError("heights", found=found, expected="some heights")
    if not fill:
        raise InputError("heights", found=found, expected="none, or fill=True, --fill to fill them")
    return heights, empty


def text_map(path: Path) -> HeightGrid:
    """The map in a text file: x, y and height if it has names or three columns, or a matrix."""
    known = ("x", "y", "height", *COLUMNS["height"].also)
    table = read_text_table(path, known, _COMMENT, is_map=True)
    width = len(table.rows[0].cells) if table.rows else 0
    is_matrix = width != 3 or any(map(_ESRI.match, table.comments))
    read = _matrix if table.header is None and is_matrix else _list
    header = table.header.text.strip() if table.header else ""
    used = (_SAID, _ESRI) if read is _matrix else (_SAID,)
    unread = [each for each in table.comments if not any(it.fullmatch(each) for it in used)]
    unread = [each for each in unread if each.strip("#%; ") and each.lstrip("#% ") != header]
    part = f"sheet {table.style.sheet}" if table.style.sheet else ""
    return read(path, table, width)._replace(comments=tuple(unread), part=part)


def states_scale(comment: str) -> bool:
    """True for a comment that seems to state a scale, such as "# Breite: 50 µm" or "# z in nm"."""
    _, marked, value = comment.replace("=", ":").rpartition(":")
    length = _LENGTH.fullmatch(value.strip())
    unit = parsed(length[2] if length else value.strip())
    if marked and unit and unit.kind == "length":
        return True
    scaled = re.search(r"\d", comment) and _SCALE.search(comment)
    if scaled or CHANGED.search(comment) or _RAW.search(comment) or states_factor(comment):
        return True
    return any(not unit or unit.kind == "length" for unit in map(parsed, in_text(comment)))


def _matrix(path: Path, table: TextTable, width: int) -> HeightGrid:
    """The matrix of heights, with the pixel size and the units that the comments state."""
    rows = [row.number for row in table.rows]
    apart = np.diff(rows)
    if len(gaps := np.flatnonzero(apart > min(apart, default=1))):  # as between two maps
        found = f"lines without numbers between rows {rows[gaps[0]]} and {rows[gaps[0] + 1]}"
        expected = "one map in a file: remove comments and empty lines between its rows"
        raise InputError("rows", found=found, expected=expected)
    heights = matrix(path, table)
    _refuse_coordinates(heights)
    matches = filter(None, map(_SAID.fullmatch, table.comments))
    stated = [*dict.fromkeys((match[1].lower().rstrip("s"), match[2]) for match in matches)]
    if len(stated) > len(said := dict(stated)):
        found = ", ".join(map(" ".join, stated))
        raise InputError("comments", found=found, expected="the size and the unit of one map")
    if pairs := [line.groups() for line in map(_ESRI.match, table.comments) if line]:
        esri = {name.lower(): float(value.replace(",", ".")) for name, value in pairs}
        shape, once = (esri.get("nrows"), esri.get("ncols")), len(esri) == len(pairs)
        pixel = [esri[name] for name in ("cellsize", "cellsize", "dx", "dy") if name in esri]
        if said or shape != heights.shape or len(pixel) != 2 or not once:
            found = ", ".join([*said, *map(" ".join, pairs)])
            expected = "nrows {} and ncols {}, cellsize or dx and dy, each once"
            expected = expected.format(*heights.shape)
            raise InputError("header", found=found, expected=expected)
        holed = np.where(heights == esri.get("nodata_value"), np.nan, heights)
        return HeightGrid(holed[::-1], (pixel[0], pixel[1]))  # from the top down
    length = _LENGTH if table.style.decimal == "," else _SIZE
    sizes = [length.fullmatch(said.get(name, "")) for name in ("width", "height")]
    value_unit = said.get("value unit", "")
    for name, size in zip(("width", "height"), sizes, strict=True):
        if name in said and size is None:
            expected = "a length such as 50 µm, without separators of thousands"
            raise InputError("comments", found=f"{name} {said[name]}", expected=expected)
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


def _refuse_coordinates(heights: Array) -> None:
    """Raise InputError for a matrix with columns, or a first or last line, of other numbers."""
    width = heights.shape[1]
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
            with np.errstate(invalid="ignore"):  # heights may be infinite: holes
                off, spread = lines[-1] - lines[:-1].mean(axis=0), lines[:-1].std(axis=0)
            if (np.abs(off) < 0.01 * spread).all():
                found = f"the means of the {'columns' if place == 'row' else 'rows'}"
                raise InputError(f"last {place}", found=found, expected="heights alone")


def _not_heights(place: str, line: Sequence[Any] | Array) -> InputError:
    """The error for a row or column `line` of coordinates or counts in place of heights."""
    said = ", ".join(f"{each:g}" for each in line[:3])
    expected = "heights alone: leave coordinates and numbers of rows and columns out, with pandas "
    expected += "by header=False, index=False"
    return InputError(place, found=f"numbers {said}, ...", expected=expected)


def _even(line: Array) -> bool:
    """True for more than four numbers at equal distances, up to rounding to six digits."""
    steps, size = np.diff(line), float(np.abs(line).max())
    equal = np.abs(steps - steps[:1]) <= 1e-5 * size
    return bool(len(steps) > 3 and steps[0] != 0 and equal.all())


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
    return HeightGrid(*map_arrays.on_grid(z, x, y), units[0], units[2])


def _is_label(name: str, cells: NDArray[Any]) -> bool:
    """True for a column that cannot change heights: an index, or the same text in every row."""
    count = len(np.unique(cells))
    if is_index(name) and count == len(cells):
        return True
    return count == 1 and cells.dtype.kind == "U" and not map_arrays.SCALES.search(name)
