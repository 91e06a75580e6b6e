"""Maps in files of arrays (.npy, .npz, .mat) and of instruments; heights on a regular grid."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple
from warnings import catch_warnings

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.errors import FileError, InputError
from convexrough.surface.surface import checked_pixel
from convexrough.tabular.arrays import foreign, named_arrays, parts
from convexrough.tabular.roles import shortened
from convexrough.tabular.units import bare, one_unit, unit

#: Names of arrays of an .npz or .mat file: of the heights; and of what may be beside them.
HEIGHTS = ("heights", "height", "z")
STATED = ("pixel", "unit", "height_unit", "x", "y")

#: The first bytes of a map by Zygo's MetroPro, whose name ends in .dat.
METROPRO = b"\x88\x1b\x03"

#: Largest relative difference of a stated pixel from the steps of x and y, which may be rounded.
ROUNDED = 1e-3

#: Largest accepted distance of a coordinate from the grid, in pixels.
OFF_GRID = 0.05


class HeightGrid(NamedTuple):
    """The heights in a file, and what the file states about them."""

    heights: Array  # nan where the file states none; marks of holes such as -9999 are unchanged
    pixel: tuple[float, float] | None = None  # along x and y
    unit: str = ""  # of the pixel
    height_unit: str = ""
    comments: tuple[str, ...] = ()  # those that `read` does not understand
    part: str = ""  # which part of the file it is, if the file has several


def arrays_map(path: Path) -> HeightGrid:
    """The map in a .npy, .npz or .mat file."""
    found = {name: np.asarray(values) for name, values in named_arrays(path).items()}
    named = {name.lower(): values for name, values in found.items()}
    likely = [name for name in found if bare(name).lower() in HEIGHTS]
    left = [name for name in found if name.lower() not in STATED]
    if len(chosen := likely or left) != 1:
        names = ", ".join(chosen or found) or "none"
        raise InputError("arrays", found=names, expected='one called "heights"')
    if others := [name for name in left if name not in chosen]:
        expected = f"heights and {', '.join(STATED)} alone, with nan in holes"
        raise InputError("arrays", found=shortened(", ".join(others)), expected=expected)
    size = checked_pixel(np.squeeze(named["pixel"])) if "pixel" in named else None
    said, upwards = (" ".join(map(str, parts(named.get(name, ())))) for name in STATED[1:3])
    if known := one_unit("height_unit", upwards, unit(chosen[0])):
        upwards = known.name
    heights = np.squeeze(_numbers(found[chosen[0]]))
    axes = [np.atleast_1d(np.squeeze(_numbers(named[name]))) for name in "xy" if name in named]
    if len(axes) == 1:
        only = f"only {'x' if 'x' in named else 'y'}"
        raise InputError("arrays", found=only, expected="x and y, or neither")
    if not axes and heights.ndim == 2 and heights.shape[1] == 3:  # as in a text file
        *axes, heights = heights.T
    if axes:
        heights, steps = on_grid(heights, *axes)
        size = size or steps
        refuse_other(size, steps, ROUNDED, "the steps of x and y")
    return HeightGrid(heights, size, said, upwards)


def _numbers(values: NDArray[np.generic]) -> Array:
    if values.dtype.kind not in "iuf":
        found = f"an array of {values.dtype}"
        raise InputError("heights", found=found, expected="an array of real numbers")
    return np.asarray(values, dtype=np.float64)


def instrument_map(path: Path) -> HeightGrid:
    """The first map of heights in a file that SurfaceTopography can read."""
    path.open("rb").close()  # raises the usual error for a missing file
    try:
        with catch_warnings(action="ignore", category=ImportWarning):  # MPI is optional
            from SurfaceTopography import open_topography
    except ImportError as error:
        expected = "a map in .npy, .npz, .mat, text (.csv, .txt, .dat, .asc, .tsv, .xyz) or .xlsx; "
        expected += "an instrument's file needs SurfaceTopography: pip install SurfaceTopography"
        raise FileError(f"{path}: found {path.suffix}, expected {expected}") from error
    try:
        with foreign(), open_topography(str(path)) as reader:
            maps = [channel for channel in reader.height_channels if channel.dim == 2]
            if not maps:
                raise ValueError("it has no map of heights; export one as text, for example")
            names = ", ".join(channel.name for channel in maps)
            part = f"the first of its maps {names}" if len(maps) > 1 else ""
            sized = maps[0].physical_sizes is not None
            sizes = {} if sized else {"physical_sizes": maps[0].nb_grid_pts}
            topography = reader.topography(channel_index=maps[0].index, **sizes)
            heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
    except ValueError as error:
        reason = str(error).partition("\n")[0]
        if reason.startswith("tried"):  # a list with an error for each of its formats
            reason = "it is in none of its formats; export the map as text, for example"
        raise FileError(f"{path}: SurfaceTopography cannot read it: {reason}") from error
    unit, heights = str(topography.unit or ""), heights.T.copy()
    if not sized:
        return HeightGrid(heights, height_unit=unit, part=part)
    dx, dy = np.divide(topography.physical_sizes, heights.shape[::-1]).tolist()
    return HeightGrid(heights, (dx, dy), unit, unit, part=part)


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
