"""Heights on a regular grid, from points in any order, and what a file states about them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.errors import InputError

#: Largest accepted distance of a coordinate from the grid, in pixels.
OFF_GRID = 0.05


class HeightGrid(NamedTuple):
    """The heights in a file, and what the file states about them."""

    heights: Array  # nan where the file states none; marks of holes such as -9999 are unchanged
    pixel: tuple[float, float] | None = None  # along x and y
    unit: str = ""  # of the pixel
    height_unit: str = ""
    comments: tuple[str, ...] = ()  # those that `read` does not understand
    sheet: str = ""  # the name of the sheet of a workbook, in quotes


def refuse_other(
    said: tuple[float, float], there: tuple[float, float], tolerance: float, why: str
) -> None:
    if not np.allclose(said, there, rtol=tolerance, atol=0.0):
        expected = f"{there[0]:g} by {there[1]:g}, {why}"
        raise InputError("pixel", found=f"{said[0]:g} by {said[1]:g}", expected=expected)


def on_grid(heights: Array, x: Array, y: Array) -> tuple[Array, tuple[float, float]]:
    """The map, with nan at missing points, and its pixel (dx, dy).

    x, y : coordinates of each height in any order, or x of each column and y of each row
    """
    vectors = heights.ndim > 1 and x.ndim == y.ndim == 1
    shape, y = ((len(y), len(x)), y[:, None]) if vectors else (x.shape, y)
    if heights.shape != shape or not (vectors or y.shape == shape):
        found, expected = (" by ".join(map(str, it)) for it in (heights.shape, shape))
        expected += ", as y and x require" if vectors or x.shape == y.shape else ", for y, too"
        expected += "; transpose it" if heights.T.shape == shape else ""
        raise InputError("heights", found=found, expected=expected)
    (column, dx), (row, dy) = steps("x", x), steps("y", y)
    shape = int(row.max()) + 1, int(column.max()) + 1
    if math.prod(shape) > 4 * heights.size + 100:
        found = f"{heights.size:,} points of a grid of {math.prod(shape):,}"
        raise InputError("x, y", found=found, expected="a regular grid")
    place = (row * shape[1] + column).ravel()
    count = np.bincount(place)
    if (most := count.max()) > 1:
        k = np.unravel_index(int(np.argmax(count[place] == most)), heights.shape)
        at = [f"{np.broadcast_to(each, heights.shape)[k]:g}" for each in (x, y)]
        found = f"the point {', '.join(at)} {most} times"
        raise InputError("x, y", found=found, expected="each point once")
    grid = np.full(shape, np.nan)
    grid.ravel()[place] = heights.ravel()
    return grid, (dx, dy)


def steps(name: str, values: Array) -> tuple[Indices, float]:
    """The index, from 0, of the grid line of each coordinate, and the distance of grid lines."""
    levels = np.unique(values)
    apart = np.diff(levels)
    if not np.isfinite(levels).all() or len(levels) < 2:
        found = "one value or none" if len(levels) < 2 else "values that are not finite"
        raise InputError(name, found=found, expected="coordinates on a grid")
    clear = apart[apart > 1e-3 * apart.max()]  # smaller differences are rounding errors
    span = float(levels[-1] - levels[0])
    # Lines of the grid can be missing. Rounded coordinates differ from the lines by less than one
    # unit of the last digit: half a unit from their own rounding, and half from that of the ends.
    digit = _last_digit(levels)
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
