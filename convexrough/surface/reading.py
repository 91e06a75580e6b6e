"""`read`: a surface from a file, with all lengths in one unit.

A map is a matrix of heights, or a list of x, y and height. Text, files of arrays (.npy, .npz, .mat)
and files of instruments can contain one.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple
from warnings import catch_warnings

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.errors import FileError, InputError, blamed_on
from convexrough.surface.detrend import Trend
from convexrough.surface.holes import filled
from convexrough.surface.surface import Surface, checked_pixel
from convexrough.tabular.arrays import named_arrays, reading
from convexrough.tabular.roles import COLUMNS, Reading, is_index
from convexrough.tabular.table import matrix, read_table
from convexrough.tabular.text import COMMENT, WORKBOOKS, TextTable, read_text_table
from convexrough.tabular.units import in_text, one_unit, parsed

#: Suffixes of text files.
TEXT = ("", ".csv", ".txt", ".dat", ".asc", ".tsv", ".xyz", ".gz", *WORKBOOKS)

#: Names that the array of heights may have in a file with several arrays.
HEIGHTS = ("heights", "height", "z")

#: STATED: arrays of an .npz or .mat file that state the pixel and the units. SCALES: parts of names
#: of arrays that probably change the meaning of the heights. An array with such a name is an error,
#: even if it is a text or a vector.
STATED = ("pixel", "unit", "height_unit")
SCALES = re.compile(
    "unit|scale|factor|multipl|gain|offset|lsb|pixel|spacing|step|resol|calib|^d[xyz]$", re.I
)

#: Rms slopes outside this range suggest that heights and pixels are in different units.
SLOPES = (1e-5, 10.0)

#: Three kinds of numbers may mark holes: those in MARKS, those of absolute value at least HUGE, and
#: the largest and the smallest number. Such a number marks holes if it differs from the median of
#: the other heights by more than FAR times their range.
MARKS, FAR, HUGE = (-999.0, -9999.0, -99999.0, -32768.0, 9999.0, 99999.0, 32767.0), 10.0, 1e30

#: Two pixel sizes count as equal up to this relative difference.
SAME = 1e-6

#: A pixel stated in a file of arrays may differ from the steps of x and y, which may be rounded, by
#: this fraction.
ROUNDED = 1e-3

#: A line such as "# Width: 50.0 µm", as Gwyddion writes above a matrix.
_SAID = re.compile(r"[#%;\s]*(width|height|value units?)\s*[:=]\s*(.*?)\s*", re.I)
_COMMENT = re.compile(f"{COMMENT.pattern}|{_SAID.pattern}", re.I)
_LENGTH = re.compile(r"([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(.*)")

#: Words that announce a scale.
_SCALE = re.compile(r"pixel|scale|factor|resolution|spacing|\bd[xyz]\b", re.I)

#: A table of at most this many columns is not a map if two of them are coordinates of a grid.
MOST_COLUMNS = 6

#: Largest accepted distance of a coordinate from the grid, in pixels.
OFF_GRID = 0.05


class HeightGrid(NamedTuple):
    """The heights in a file, and the pixel and units that the file states.

    heights : nan where the file states no height; marks such as -9999 are unchanged
    pixel : size of a pixel along x and y; None if not stated
    unit, height_unit : units of the pixel and of the heights; "" if not stated
    unclear : the first comment that states a length or a unit of length, but not in words that
        `read` knows; "" if there is none
    sheet : the name of the sheet of a workbook, in quotes; else ""
    """

    heights: Array
    pixel: tuple[float, float] | None = None
    unit: str = ""
    height_unit: str = ""
    unclear: str = ""
    sheet: str = ""


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
    height_unit : unit of the heights; by default that of the pixel. It is an error if `unit` or
        `height_unit` differs from what the file states. Heights in another unit than the pixel are
        converted to the unit of the pixel
    detrend : the form whose best fit is subtracted: "plane", "sphere" or "paraboloid"; None to
        subtract nothing
    fill   : True to fill holes with a harmonic function, after the form is fitted to the other
        pixels; False to refuse holes. Holes are nan, masked values, BAD in text, and marks far from
        all heights, such as -9999 or 1e38

    An .npz or .mat file contains `heights`. It may also contain `unit`, `height_unit`, `pixel`, and
    coordinates x and y: either x of each column and y of each row, or x and y of each height. Other
    numbers that could change the meaning of the heights are an error. Text contains a matrix,
    possibly with the comments on its size that Gwyddion writes. A matrix with three columns is a
    list of x, y and height on a grid. Formats of instruments need the package SurfaceTopography
    (the extra `surface`).

    Raises FileError if the file cannot be read, or needs SurfaceTopography, which is not installed;
    InputError if the file contains no usable map.

    >>> np.savez(folder / "scan.npz", heights=np.random.default_rng(1).normal(size=(64, 64)))
    >>> cr.surface.read(folder / "scan.npz", pixel=2.5, unit="µm").size
    (160.0, 160.0)
    """
    with blamed_on(path, unless_known=True):
        grid = _grid(Path(path), pixel)
        if grid.unclear and not ((pixel or grid.pixel) and (height_unit or grid.height_unit)):
            expected = '"Width: 50 µm", "Height: 50 µm" and "Value units: nm", or all three options'
            expected += " --pixel, --unit, --height-unit, if the file is right without this line"
            raise InputError("comments", found=grid.unclear.strip(), expected=expected)
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
        size = _pixel(grid.pixel, pixel)
        name = length.name if length else ""
        source = f"{path}, sheet {grid.sheet}" if grid.sheet else str(path)
        surface = Surface(heights, size, name, filled_pixels=holes, source=source)
        surface = surface if detrend is None else surface.detrend(detrend)
        slope = surface.rms_slope
        if not SLOPES[0] <= slope <= SLOPES[1]:
            likely = f"{SLOPES[0]:g} to {SLOPES[1]:g}"
            more = "if heights have another unit, give height_unit, or --height-unit"
            more = f"check height_unit, {upwards.name}, and unit" if upwards else more
            expected = f"{likely}; {more}"
            raise InputError("heights", found=f"rms slope {slope:.3g}", expected=expected)
        return surface


def _pixel(
    found: tuple[float, float] | None, given: float | tuple[float, float] | None
) -> tuple[float, float]:
    """The pixel that the file states or, if the file states none, the given pixel.

    Raises InputError if the two differ, or if both are missing.
    """
    if (known := found if given is None else given) is None:
        expected = "its size, which the file does not state: pixel=, or --pixel"
        raise InputError("pixel", found="none", expected=expected)
    said = checked_pixel(known)
    there = said if found is None else checked_pixel(found)
    _refuse_other(said, there, SAME, "as the file says, or none given")
    return there


def _refuse_other(
    said: tuple[float, float], there: tuple[float, float], tolerance: float, why: str
) -> None:
    if not np.allclose(said, there, rtol=tolerance, atol=0.0):
        expected = f"{there[0]:g} by {there[1]:g}, {why}"
        raise InputError("pixel", found=f"{said[0]:g} by {said[1]:g}", expected=expected)


def _unfilled(heights: Array, fill: bool) -> tuple[Array, NDArray[np.bool_] | None]:
    """The heights with nan in holes, and a map of the holes (None if there are no holes).

    Raises InputError for holes unless `fill` is true, and if all pixels are holes.
    """
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
    found = f"{holes:,} holes ({', '.join(named)}) in {heights.size:,} pixels"
    found += f", the first in row {row}, column {column}"
    heights = np.where(marks, np.nan, heights)
    if holes == heights.size:
        raise InputError("heights", found=found, expected="some heights")
    if not fill:
        raise InputError("heights", found=found, expected="none, or fill=True, --fill to fill them")
    return heights, empty


def _grid(path: Path, pixel: float | tuple[float, float] | None) -> HeightGrid:
    kind = path.suffix.lower()
    with reading(path):
        if kind in TEXT:
            return _text(path)
        return _arrays(path) if kind in (".npy", ".npz", ".mat") else _instrument(path, pixel)


def _text(path: Path) -> HeightGrid:
    """The map in a text file: a matrix of heights, or columns x, y and height.

    A file with three columns is read as x, y and height. Comments above a matrix may state the
    width and height with a unit, and the unit of the values.

    Raises FileError if the file is not text, and InputError with row and column if it contains no
    map.
    """
    known = ("x", "y", "height", *COLUMNS["height"].also)
    table = read_text_table(path, known, _COMMENT, is_map=True)
    unclear = next(filter(_unclear, table.comments), "")
    return _map(path, table)._replace(unclear=unclear, sheet=table.style.sheet)


def _unclear(comment: str) -> bool:
    """True for a comment that seems to state a scale, such as "# Breite: 50 µm" or "# z in nm"."""
    if _SAID.fullmatch(comment):
        return False
    _, marked, value = comment.replace("=", ":").rpartition(":")
    length = _LENGTH.fullmatch(value.strip())
    unit = parsed(length[2] if length else value.strip())
    if marked and unit and unit.kind == "length":
        return True
    if any(not (unit := parsed(each)) or unit.kind == "length" for each in in_text(comment)):
        return True
    return bool(re.search(r"\d", comment) and _SCALE.search(comment))


def _map(path: Path, table: TextTable) -> HeightGrid:
    width = len(table.rows[0].cells) if table.rows else 0
    if table.header is None and width != 3:
        _refuse_gaps([row.number for row in table.rows])
        heights = matrix(path, table)
        for one, other in combinations(heights.T if width <= MOST_COLUMNS else (), 2):
            sides = [len(np.unique(each)) for each in (one, other)]
            if min(sides) > 2 and sides[0] * sides[1] == len(heights) > width:
                found = f"{width} columns without a header, two of which are coordinates"
                raise InputError("columns", found=found, expected="their names above them: x, y, z")
        if min(heights.shape) > 2:
            for place, lines in (("row", heights), ("column", heights.T)):
                if _even(lines[0, 1:]) and not _even(lines[1, 1:]):
                    raise _not_heights(f"{place} 1", lines[0][~np.isnan(lines[0])])
                off, spread = lines[-1] - lines[:-1].mean(axis=0), lines[:-1].std(axis=0)
                if (np.abs(off) < 0.01 * spread).all():
                    found = f"the means of the {'columns' if place == 'row' else 'rows'}"
                    raise InputError(f"last {place}", found=found, expected="heights alone")
        return _said(table.comments, heights)
    names = table.header.cells if table.header else []
    if names and all(table.style.number(name.replace(",", ".")) is not None for name in names):
        expected = "decimal points, not commas in quotes"
        raise InputError("row 1", found=names[0], expected=expected)
    first = [table.style.number(name) for name in names] if width > 3 else []
    if len(first) > 3 and None not in first[1:]:
        raise _not_heights("row 1", [each for each in first if each is not None])
    if table.header and len(names) < 3 < width:
        expected = "a comment, which begins with #; the unit of heights as # Value units: nm"
        found = repr(table.header.text[:60])
        raise InputError(f"row {table.header.number}: text", found=found, expected=expected)
    return _from_list(path, table)


def _refuse_gaps(rows: Sequence[int]) -> None:
    """Raise InputError if lines without numbers interrupt the rows, as between two maps."""
    apart = np.diff(rows)
    if len(gaps := np.flatnonzero(apart > min(apart, default=1))):
        before, after = rows[gaps[0]], rows[gaps[0] + 1]
        found = f"lines without numbers between rows {before} and {after}"
        expected = "one map in a file: remove comments and empty lines between its rows"
        raise InputError("rows", found=found, expected=expected)


def _not_heights(place: str, line: Sequence[Any] | Array) -> InputError:
    """The error for a row or column of coordinates or counts (`line`) in place of heights."""
    said = ", ".join(f"{each:g}" for each in line[:3])
    expected = (
        "heights alone: leave coordinates and numbers of rows and columns out, with pandas by "
        "header=False, index=False"
    )
    return InputError(place, found=f"numbers {said}, ...", expected=expected)


def _even(line: Array) -> bool:
    """True for more than four numbers at equal distances, up to rounding to six digits."""
    steps, size = np.diff(line), float(np.abs(line).max())
    return bool(
        len(steps) > 3 and steps[0] != 0 and (np.abs(steps - steps[0]) <= 1e-5 * size).all()
    )


def _said(comments: Sequence[str], heights: Array) -> HeightGrid:
    """The matrix `heights`, with the pixel and the units that the comments state."""
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
    """The map from columns x, y and height, in any order; missing points of the grid are holes.

    Other columns could be a mask or a factor. They are an error, except an index.
    """
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
    heights, pixel = _on_grid(x, y, z)
    return HeightGrid(heights, pixel, units[0], units[2])


def _is_label(name: str, cells: NDArray[Any]) -> bool:
    """True for an index, and for the same text in every row, which cannot change heights."""
    count = len(np.unique(cells))
    if is_index(name):
        return count == len(cells)
    return count == 1 and cells.dtype.kind == "U" and not SCALES.search(name)


def _arrays(path: Path) -> HeightGrid:
    found = {name: np.asarray(values) for name, values in named_arrays(path).items()}
    named = {name.lower(): values for name, values in found.items()} | found
    chosen = "" if "" in found else _chosen(found)
    others = [
        name
        for name, values in found.items()
        if name != chosen
        and name.lower() not in (*STATED, "x", "y")
        and (SCALES.search(name) or _may_change(values, named[chosen]))
    ]
    if others:
        expected = f"{', '.join(STATED)}, x, y and no other numbers beside heights, in which nan "
        expected += "marks holes"
        raise InputError("arrays", found=", ".join(others), expected=expected)
    size = checked_pixel(np.squeeze(named["pixel"])) if "pixel" in named else None
    units = [str(named[name]) if name in named else "" for name in STATED[1:]]
    heights = np.squeeze(_numbers(named[chosen]))
    axes = [np.atleast_1d(np.squeeze(_numbers(named[name]))) for name in "xy" if name in named]
    if len(axes) == 1:
        only = f"only {'x' if 'x' in named else 'y'}"
        raise InputError("arrays", found=only, expected="x and y, or neither")
    if not axes and heights.ndim == 2 and heights.shape[1] == 3:  # as in a text file
        *axes, heights = heights.T
    if axes:
        heights, steps = _placed(heights, *axes)
        size = size or steps
        _refuse_other(size, steps, ROUNDED, "the steps of x and y")
    return HeightGrid(heights, size, *units)


def _may_change(values: NDArray[Any], heights: NDArray[Any]) -> bool:
    """True for numbers that could change the meaning of heights: a factor, a mask, coordinates."""
    alike = values.size in (1, heights.size, *heights.shape)
    return values.dtype.kind in "biufc" and (alike or values.ndim > 1) and values.size > 0


def _chosen(found: dict[str, NDArray[Any]]) -> str:
    """The name of the array of heights."""
    maps = [name for name in found if found[name].ndim == 2 and name.lower() not in ("x", "y")]
    likely = [name for name in found if name.lower() in HEIGHTS] or maps
    likely = ["heights"] if "heights" in likely else likely
    if len(likely) != 1:
        names = ", ".join(likely or found) or "none"
        raise InputError("arrays", found=names, expected='one called "heights"')
    return likely[0]


def _placed(heights: Array, x: Array, y: Array) -> tuple[Array, tuple[float, float]]:
    """The result of `_on_grid`; x and y belong to columns and rows, or to the single heights."""
    vectors = heights.ndim > 1 and x.ndim == y.ndim == 1
    shape, y = ((len(y), len(x)), y[:, None]) if vectors else (x.shape, y)
    if heights.shape != shape or not (vectors or y.shape == shape):
        found, expected = (" by ".join(map(str, it)) for it in (heights.shape, shape))
        expected += ", as y and x are long" if vectors or x.shape == y.shape else ", y as well"
        expected += "; transpose it" if heights.T.shape == shape else ""
        raise InputError("heights", found=found, expected=expected)
    return _on_grid(x, y, heights)


def _numbers(values: NDArray[np.generic]) -> Array:
    if values.dtype.kind not in "iuf":
        found = f"an array of {values.dtype}"
        raise InputError("heights", found=found, expected="an array of real numbers")
    return np.asarray(values, dtype=np.float64)


def _on_grid(x: Array, y: Array, z: Array) -> tuple[Array, tuple[float, float]]:
    """The map from heights z in any order, and the pixel (dx, dy); missing points are nan.

    x, y : coordinates of each height, or x of each column (n,) and y of each row (m, 1)
    """
    (column, dx), (row, dy) = steps("x", x), steps("y", y)
    shape = int(row.max()) + 1, int(column.max()) + 1
    if math.prod(shape) > 4 * z.size + 100:
        found = f"{z.size:,} points of a grid of {math.prod(shape):,}"
        raise InputError("x, y", found=found, expected="a regular grid")
    place = (row * shape[1] + column).ravel()
    count = np.bincount(place)
    if (most := count.max()) > 1:
        k = np.unravel_index(int(np.argmax(count[place] == most)), z.shape)
        at = [f"{np.broadcast_to(each, z.shape)[k]:g}" for each in (x, y)]
        found = f"the point {', '.join(at)} {most} times"
        raise InputError("x, y", found=found, expected="each point once")
    heights = np.full(shape, np.nan)
    heights.ravel()[place] = z.ravel()
    return heights, (dx, dy)


def steps(name: str, values: Array) -> tuple[Indices, float]:
    """The index, from 0, of each coordinate's grid line, and the distance between grid lines."""
    levels = np.unique(values)
    apart = np.diff(levels)
    if not np.isfinite(levels).all() or len(levels) < 2:
        found = "one value or none" if len(levels) < 2 else "values that are not finite"
        raise InputError(name, found=found, expected="coordinates on a grid")
    clear = apart[apart > 1e-3 * apart.max()]  # smaller differences are rounding errors
    span = float(levels[-1] - levels[0])
    digit = _last_digit(levels)
    # Lines of the grid can be missing. If coordinates are rounded, they lie off the lines by less
    # than one last digit: by their own rounding, half a digit, and by that of the first and last
    # line.
    for count, rounded in ((np.rint(span / np.median(clear)), 0.0), (len(clear), digit)):
        step = span / count
        lines = (values - levels[0]) / step
        number = np.rint(lines)
        off = np.abs(lines - number)
        if off.max() <= max(OFF_GRID, rounded / step if rounded < step / 4 else 0.0):
            return number.astype(np.intp), step
    worst = float(values[np.argmax(off)])
    expected = f"coordinates {step:g} apart, on a regular grid, in columns x, y and height"
    raise InputError(name, found=f"{worst:g}", expected=expected)


def _last_digit(values: Array) -> float:
    """The largest power of ten of which all values are multiples; 0 if they have many digits."""
    first = int(np.floor(np.log10(np.abs(values).max())))
    for power in range(first, first - 10, -1):
        parts = values / 10.0**power
        if np.abs(parts - np.rint(parts)).max() < 1e-5:
            return 10.0**power
    return 0.0


def _instrument(path: Path, pixel: float | tuple[float, float] | None) -> HeightGrid:
    """The heights of the default channel of a file that SurfaceTopography can read.

    pixel : size of a pixel, used if the file does not state the size of the map

    Raises FileError if SurfaceTopography cannot read the file or is not installed; InputError if
    the file contains no map of heights.
    """
    try:
        with catch_warnings(action="ignore", category=ImportWarning):  # MPI is optional
            from SurfaceTopography import open_topography
            from SurfaceTopography.Exceptions import ReadFileError
    except ImportError as error:
        expected = "a map in .npy, .npz, .mat, text (.csv, .txt, .dat, .asc, .tsv, .xyz) or .xlsx; "
        expected += "an instrument's file needs SurfaceTopography: pip install SurfaceTopography"
        raise FileError(f"{path}: found {path.suffix}, expected {expected}") from error
    path.open("rb").close()  # raises the usual error for a missing file
    try:
        with open_topography(str(path)) as reader:
            if not reader.channels:
                expected = "a map of heights; export it as text, for example"
                raise InputError("file", found="no heights", expected=expected)
            channel = reader.default_channel
            given: dict[str, Any] = {}
            if channel.physical_sizes is None and pixel is not None:
                counts = zip(channel.nb_grid_pts, checked_pixel(pixel), strict=True)
                given["physical_sizes"] = tuple(count * size for count, size in counts)
            topography = reader.topography(**given)
    except ReadFileError as error:
        reason = str(error).partition("\n")[0] or type(error).__name__
        if reason.startswith("tried"):  # all of its formats, and lists an error for each
            reason = "it is in none of its formats; export the map as text, for example"
        raise FileError(f"{path}: SurfaceTopography cannot read it: {reason}") from error
    if topography.dim != 2:
        raise InputError("file", found="a line scan", expected="a map")
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
    sizes = topography.physical_sizes
    size: Any = None if sizes is None else tuple(np.divide(sizes, heights.shape).tolist())
    unit = str(topography.unit or "")
    return HeightGrid(heights.T.copy(), size, unit, unit)
