"""`read`: a surface from a file, with all lengths in one unit."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.errors import InputError, blamed_on
from convexrough.surface.detrend import Trend
from convexrough.surface.map_arrays import arrays_map, instrument_map, refuse_other
from convexrough.surface.map_text import states_scale, text_map
from convexrough.surface.pixels import filled
from convexrough.surface.surface import Surface, checked_pixel
from convexrough.tabular.arrays import reading
from convexrough.tabular.text import WORKBOOKS
from convexrough.tabular.units import one_unit

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
    possibly with the comments on its size that Gwyddion writes. A matrix with three columns is a
    list of x, y and height on a grid. Formats of instruments need the package SurfaceTopography
    (the extra `surface`).

    Raises FileError if the file cannot be read, or if SurfaceTopography is needed but not
    installed; InputError if the file contains no usable map.

    >>> np.savez(folder / "scan.npz", heights=np.random.default_rng(1).normal(size=(64, 64)))
    >>> cr.surface.read(folder / "scan.npz", pixel=2.5, unit="µm").size
    (160.0, 160.0)
    """
    with blamed_on(path, unless_known=True):
        path = Path(path)
        kind = path.suffix.lower()
        with reading(path):
            if kind in TEXT:
                grid = text_map(path)
            else:
                is_known = kind in (".npy", ".npz", ".mat")
                grid = arrays_map(path) if is_known else instrument_map(path, pixel)
        unclear = next(filter(states_scale, grid.comments), "")
        if unclear and not ((pixel or grid.pixel) and (height_unit or grid.height_unit)):
            expected = '"Width: 50 µm", "Height: 50 µm" and "Value units: nm" above a matrix, '
            expected += '"x [µm] y [µm] z [nm]" above columns, or all three options'
            expected += " --pixel, --unit, --height-unit, if the file is right without this line"
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
        if (stated := pixel if grid.pixel is None else grid.pixel) is None:
            expected = "its size, which the file does not state: pixel=, or --pixel"
            raise InputError("pixel", found="none", expected=expected)
        size = checked_pixel(stated)
        given = size if pixel is None else checked_pixel(pixel)
        refuse_other(given, size, SAME, "as the file states, or none given")
        name = length.name if length else ""
        source = f"{path}, sheet {grid.sheet}" if grid.sheet else str(path)
        surface = Surface(heights, size, name, (), holes, source, grid.comments)
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
    found = f"{holes:,} holes ({', '.join(named)}) in {heights.size:,} pixels"
    found += f", the first in row {row}, column {column}"
    heights = np.where(marks, np.nan, heights)
    if holes == heights.size:
        raise InputError("heights", found=found, expected="some heights")
    if not fill:
        raise InputError("heights", found=found, expected="none, or fill=True, --fill to fill them")
    return heights, empty
