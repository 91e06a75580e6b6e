"""`read`: a surface from a file, with all lengths in one unit."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.errors import InputError, blamed_on
from convexrough.surface.detrend import Trend
from convexrough.surface.grid import HeightGrid, on_grid, read_grid, steps
from convexrough.surface.holes import filled
from convexrough.surface.surface import Surface, checked_pixel
from convexrough.tabular.arrays import named_arrays, reading
from convexrough.tabular.text import WORKBOOKS
from convexrough.tabular.units import one_unit

#: Suffixes of text files.
TEXT = ("", ".csv", ".txt", ".dat", ".asc", ".tsv", ".xyz", ".gz", *WORKBOOKS)

#: Names that the array of heights may have in an .npz file with several arrays.
HEIGHTS = ("heights", "height", "z")

#: Names that say in an .npz or .mat file what its heights and pixels are, and parts of names that
#: probably do, also if they are those of texts or of vectors.
STATED = ("pixel", "unit", "height_unit")
SCALES = re.compile(
    "unit|scale|factor|multipl|gain|offset|lsb|pixel|spacing|step|resol|calib|^d[xyz]$", re.I
)

#: Rms slopes outside this range suggest that heights and pixels are in different units.
SLOPES = (1e-5, 10.0)

#: Possible marks of holes are MARKS, numbers of at least the size HUGE, and the largest and the
#: smallest number. They mark holes if they differ from the median of the other heights by more than
#: FAR times the range of the other heights.
MARKS, FAR, HUGE = (-999.0, -9999.0, -99999.0, -32768.0, 9999.0, 99999.0, 32767.0), 10.0, 1e30

#: Two pixel sizes count as equal up to this relative difference.
SAME = 1e-6

#: Steps of x and y, which may be rounded, count as equal up to this relative difference.
ROUNDED = 1e-3


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
    unit   : unit of the pixel, and of the heights unless `height_unit` is given; optional. A
        different unit in the file is an error. Heights in another known unit are converted
    detrend : the form whose best fit is subtracted: "plane", "sphere" or "paraboloid"; None: none
    fill   : True to fill holes with a harmonic function; else holes are an error. Holes are nan,
        masked, BAD in text, and marks such as -9999 or 1e38 far from all heights

    An .npz or .mat file contains `heights`, and may contain `unit`, `height_unit`, and `pixel` or x
    and y, of columns and rows or of each height; other numbers that could change the meaning of the
    heights are refused. Text contains a matrix, possibly with Gwyddion's comments on its size. A
    matrix with three columns is a list of x, y and height on a grid. Formats of instruments need
    the extra `surface`.

    Raises FileError if the file cannot be read or SurfaceTopography is needed and not installed;
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
        heights, holes = _mended(grid.heights, fill)
        if upwards and length:
            heights = heights * upwards.into(length)
        size = _pixel(grid.pixel, pixel)
        name = length.name if length else ""
        surface = Surface(heights, size, name, filled_pixels=holes, source=str(path))
        slope = surface.rms_slope
        if not SLOPES[0] <= slope <= SLOPES[1]:
            likely = f"{SLOPES[0]:g} to {SLOPES[1]:g}"
            more = "if heights have another unit, give height_unit, or --height-unit"
            more = f"check height_unit, {upwards.name}, and unit" if upwards else more
            expected = f"{likely}; {more}"
            raise InputError("heights", found=f"rms slope {slope:.3g}", expected=expected)
        return surface if detrend is None else surface.detrend(detrend)


def _pixel(
    found: tuple[float, float] | None, given: float | tuple[float, float] | None
) -> tuple[float, float]:
    if given is None:
        if found is None:
            expected = "its size, which the file does not state: pixel=, or --pixel"
            raise InputError("pixel", found="none", expected=expected)
        return checked_pixel(found)
    if found is None:
        return checked_pixel(given)
    said, there = checked_pixel(given), checked_pixel(found)
    if not np.allclose(said, there, rtol=SAME, atol=0):
        expected = f"{there[0]:g} by {there[1]:g}, as the file says, or none given"
        raise InputError("pixel", found=f"{said[0]:g} by {said[1]:g}", expected=expected)
    return there


def _mended(heights: Array, fill: bool) -> tuple[Array, NDArray[np.bool_] | None]:
    """The heights with holes filled, and a map of the pixels that were holes, or None."""
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
    return filled(heights), empty


def _grid(path: Path, pixel: float | tuple[float, float] | None) -> HeightGrid:
    kind = path.suffix.lower()
    with reading(path):
        if kind in TEXT:
            return read_grid(path)
        if kind in (".npy", ".npz", ".mat"):
            return _arrays(path)
        from convexrough.surface.instruments import read_instrument  # slow to import

        return read_instrument(path, pixel)


def _arrays(path: Path) -> HeightGrid:
    found = {name: np.asarray(values) for name, values in named_arrays(path).items()}
    named = {name.lower(): values for name, values in found.items()} | found
    chosen = "" if "" in found else _chosen(path, found)
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
        raise InputError("arrays", found=", ".join(others), expected=expected, where=str(path))
    both = checked_pixel(np.squeeze(named["pixel"])) if "pixel" in named else None
    units = [str(named[name]) if name in named else "" for name in STATED[1:]]
    heights = np.squeeze(_numbers(named[chosen]))
    columns = {name: named[name] for name in "xy" if name in named}
    if len(columns) == 1:
        only = f"only {next(iter(columns))}"
        raise InputError("arrays", found=only, expected="x and y, or neither", where=str(path))
    if not columns and heights.ndim == 2 and heights.shape[1] == 3:  # as in a text file
        *both_axes, heights = heights.T
        columns = dict(zip("xy", both_axes, strict=True))
    if columns:
        axes = (np.atleast_1d(np.squeeze(_numbers(columns[it]))) for it in "xy")
        heights, apart = _placed(path, heights, *axes)
        if both is not None and not np.allclose(both, apart, rtol=ROUNDED, atol=0.0):
            expected = f"{apart[0]:g} by {apart[1]:g}, the steps of x and y"
            said = f"{both[0]:g} by {both[1]:g}"
            raise InputError("pixel", found=said, expected=expected, where=str(path))
        both = both or apart
    return HeightGrid(heights, both, *units)


def _may_change(values: NDArray[Any], heights: NDArray[Any]) -> bool:
    """True for numbers that could change the meaning of heights: a factor, a mask, coordinates."""
    alike = values.size in (1, heights.size, *heights.shape)
    return values.dtype.kind in "biufc" and (alike or values.ndim > 1) and values.size > 0


def _chosen(path: Path, found: dict[str, NDArray[Any]]) -> str:
    """The name of the array of heights."""
    maps = [name for name in found if found[name].ndim == 2 and name.lower() not in ("x", "y")]
    likely = [name for name in found if name.lower() in HEIGHTS] or maps
    likely = ["heights"] if "heights" in likely else likely
    if len(likely) != 1:
        names = ", ".join(likely or found) or "none"
        raise InputError("arrays", found=names, expected='one called "heights"', where=str(path))
    return likely[0]


def _placed(path: Path, heights: Array, x: Array, y: Array) -> tuple[Array, tuple[float, float]]:
    """Heights sorted by x and y, which are two vectors or two matrices, and the pixel (dx, dy)."""
    vectors = x.ndim == y.ndim == 1
    if heights.ndim == 1 and x.shape == y.shape == heights.shape:
        return on_grid(path, x, y, heights)
    shape = (len(y), len(x)) if vectors else x.shape
    if heights.shape != shape or not (vectors or y.shape == shape):
        found = " by ".join(map(str, heights.shape))
        expected = f"{' by '.join(map(str, shape))}, as y and x are long"
        expected += "; transpose it" if heights.T.shape == shape else ""
        raise InputError("heights", found=found, expected=expected, where=str(path))
    (column, dx), (row, dy) = (steps(path, name, it) for name, it in (("x", x), ("y", y)))
    placed = np.full((int(row.max()) + 1, int(column.max()) + 1), np.nan)
    placed[row[:, None] if vectors else row, column] = heights
    return placed, (dx, dy)


def _numbers(values: NDArray[np.generic]) -> Array:
    if values.dtype.kind not in "iuf":
        found = f"an array of {values.dtype}"
        raise InputError("heights", found=found, expected="an array of real numbers")
    return np.asarray(values, dtype=np.float64)
