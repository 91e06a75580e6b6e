"""`read`: a surface from a file, with all lengths in one unit; and maps in text files.

Text holds a matrix of heights, or columns x, y and height. Comments above a matrix may state the
width and height of the map (its sizes along x and y) with a unit, and the unit of the values. The
header of an ESRI grid states the size of a pixel, the mark of holes, and that y falls row by row.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

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
from convexrough.tabular.roles import COLUMNS, Reading, is_index, shortened
from convexrough.tabular.table import matrix, read_table, summary_in_last
from convexrough.tabular.text import WORKBOOKS, Cells, read_cells
from convexrough.tabular.units import one_unit

#: Suffixes of text files.
TEXT = ("", ".csv", ".txt", ".dat", ".asc", ".tsv", ".xyz", ".gz", *WORKBOOKS)

#: Rms slopes outside this range suggest that heights and pixels are in different units.
SLOPES = (1e-5, 10.0)

#: The extreme numbers of a map mark holes if they differ from the median of the other heights by
#: more than FAR times the range of these.
FAR = 10.0

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
#: A number, without a comma that may separate thousands, and a unit.
_SIZE = re.compile(
    r"(?![1-9]\d*,\d{3}(?!\d))([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(.*)"
)

#: A table with at most this many columns and more rows is a list, unless a header says otherwise.
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
    arrays are an error. Text contains a matrix, possibly with the comments on its size that
    Gwyddion writes, or the header of an ESRI grid; other comments are an error unless the file or
    the caller states the pixel and `height_unit`. A matrix with three columns and without such a
    header is a list of x, y and height on a grid. Formats of instruments need the package
    SurfaceTopography (the extra `surface`).

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
                    _refuse_other_numbers(grid)
            else:
                grid = map_arrays.instrument_map(path)
        stated = (pixel is not None or grid.pixel) and (height_unit or grid.height_unit)
        if grid.comments and not stated:
            expected = "no such line, as it could state sizes or units, or also --pixel and "
            expected += "--height-unit, or names of columns as z [nm]"
            raise InputError("comments", found=shortened(grid.comments[0]), expected=expected)
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
    marks = np.isin(heights, (np.fmin.reduce(heights, None), np.fmax.reduce(heights, None)))
    rest = heights[~marks & ~np.isnan(heights)]
    span = np.ptp(rest) if rest.size else 0.0
    marks &= (np.abs(heights - np.median(rest)) > FAR * span) if span else False
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
    cells = read_cells(path, known, is_map=True)
    esri = [line.groups() for line in map(_ESRI.match, cells.comments) if line]
    listed = cells.header is not None or (len(cells.columns) == 3 and not esri)
    grid = _list(path, cells) if listed else _matrix(matrix(path, cells), esri, cells.comments)
    unread = [each for each in cells.comments if each.strip("#%; ")]
    if not listed:
        _refuse_other_numbers(grid)
        unread = [each for each in unread if not _SAID.fullmatch(each) and not _ESRI.match(each)]
    part = str(cells.style) if cells.style.sheet else ""
    return grid._replace(comments=tuple(unread), part=part)


def _matrix(heights: Array, esri: Sequence[Sequence[str]], comments: Sequence[str]) -> HeightGrid:
    """The matrix of heights, with the pixel size and the units that the comments state."""
    stated = [line.groups() for line in map(_SAID.fullmatch, comments) if line]
    said = {name.lower().rstrip("s"): value for name, value in stated}
    if esri:
        held = {name.lower(): float(value.replace(",", ".")) for name, value in esri}
        shape, once = (held.get("nrows"), held.get("ncols")), len(held) == len(esri)
        pixel = [held[name] for name in ("cellsize", "cellsize", "dx", "dy") if name in held]
        if said or shape != heights.shape or len(pixel) != 2 or not once:
            expected = "nrows {} and ncols {}, cellsize or dx and dy, each once"
            expected = expected.format(*heights.shape)
            found = ", ".join([*said, *map(" ".join, esri)])
            raise InputError("header", found=found, expected=expected)
        holed = np.where(heights == held.get("nodata_value"), np.nan, heights)
        return HeightGrid(holed[::-1], (pixel[0], pixel[1]))  # from the top down
    sizes = [_SIZE.fullmatch(said[name]) for name in ("width", "height") if name in said]
    if len(stated) > len(said) or None in sizes or len(sizes) == 1:
        expected = "a width and a height, as 50 µm without separators of thousands, or neither"
        found = ", ".join(f"{name.lower()} {value}" for name, value in stated)
        raise InputError("comments", found=found, expected=expected)
    if not sizes:
        return HeightGrid(heights, height_unit=said.get("value unit", ""))
    (across, unit_x), (upwards, unit_y) = (size.groups() for size in sizes if size)
    if unit_x != unit_y:
        raise InputError("units", found=f"{unit_x} and {unit_y}", expected="one along x and y")
    lengths = [float(each.replace(",", ".")) for each in (across, upwards)]
    dy, dx = np.divide(lengths[::-1], heights.shape).tolist()
    return HeightGrid(heights, (dx, dy), unit_x, said.get("value unit", ""))


def _refuse_other_numbers(grid: HeightGrid) -> None:
    """Raise InputError for a matrix that seems to hold other numbers than heights: a few columns,
    or a first or last line of coordinates or means."""
    heights, (rows, width) = grid.heights, grid.heights.shape
    if grid.pixel is None and width <= MOST_COLUMNS and width < rows:
        found = f"{width} columns without a header"
        raise InputError("columns", found=found, expected="their names above them: x, y, z")
    for place, lines in (("row", heights), ("column", heights.T)) if min(rows, width) > 2 else ():
        for number, one, other in ((1, 0, 1), (len(lines), -1, -2)):
            if _even(lines[one, 1:]) and not _even(lines[other, 1:]):
                said = ", ".join(f"{each:g}" for each in lines[one] if not np.isnan(each))
                expected = "heights alone: leave coordinates and numbers of rows and columns out, "
                expected += "with pandas by header=False, index=False"
                raise InputError(f"{place} {number}", found=shortened(said), expected=expected)
        if what := summary_in_last(lines):
            found = f"the {what} of the {'columns' if place == 'row' else 'rows'}"
            raise InputError(f"last {place}", found=found, expected="heights alone")


def _even(line: Array) -> bool:
    """True for more than four numbers at equal distances, up to rounding to six digits."""
    steps, size = np.diff(line), float(np.abs(line).max())
    equal = np.abs(steps - steps[:1]) <= 1e-5 * size
    return bool(len(steps) > 3 and steps[0] != 0 and equal.all())


def _list(path: Path, cells: Cells) -> HeightGrid:
    """The map from columns x, y, height, and perhaps an index, in any order; missing points of the
    grid are holes."""
    table = read_table(path, required=("x", "y", "height"), unnamed=(["x", "y", "height"],),
                       holes=("height",), how=Reading(alike=False), cells=cells)  # fmt: skip
    numbered = ("" if is_index(it) and len(np.unique(each)) == len(each) else it
                for it, each in table.others.items())  # fmt: skip
    if others := [*filter(None, numbered)]:
        expected = "x, y, height and at most an index: delete other columns; nan marks holes"
        raise InputError("columns", found=", ".join(others), expected=expected)
    x, y, z = (table.columns[name] for name in ("x", "y", "height"))
    units = [table.units.get(name, "") for name in ("x", "y", "height")]
    if units[0] != units[1]:
        found = f"{units[0] or 'none'} and {units[1] or 'none'}"
        raise InputError("units", found=found, expected="one along x and y")
    return HeightGrid(*map_arrays.on_grid(z, x, y), units[0], units[2])
