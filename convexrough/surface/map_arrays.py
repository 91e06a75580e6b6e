"""Maps in files of arrays (.npy, .npz, .mat) and of instruments."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from warnings import catch_warnings

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.errors import FileError, InputError
from convexrough.surface.height_grid import HeightGrid, on_grid, refuse_other
from convexrough.surface.surface import checked_pixel
from convexrough.tabular.arrays import named_arrays

#: Names of arrays of an .npz or .mat file: of the heights; of the pixel and the units; and parts of
#: names of other arrays that probably change the meaning of the heights, which are errors.
HEIGHTS = ("heights", "height", "z")
STATED = ("pixel", "unit", "height_unit")
SCALES = re.compile(
    "unit|scale|factor|multipl|gain|offset|lsb|pixel|spacing|step|resol|calib|^d[xyz]$", re.I
)

#: Largest relative difference of a stated pixel from the steps of x and y, which may be rounded.
ROUNDED = 1e-3


def arrays_map(path: Path) -> HeightGrid:
    """The map in a .npy, .npz or .mat file."""
    found = {name: np.asarray(values) for name, values in named_arrays(path).items()}
    named = {name.lower(): values for name, values in found.items()} | found
    chosen = "" if "" in found else _chosen(found)

    def may_change(name: str, values: NDArray[Any]) -> bool:
        """True for what may change the meaning of heights: a factor, a mask, coordinates."""
        alike = values.size in (1, named[chosen].size, *named[chosen].shape)
        numbers = values.dtype.kind in "biufc" and (alike or values.ndim > 1) and values.size > 0
        return bool(SCALES.search(name)) or numbers

    rest = {it: found[it] for it in found if it != chosen and it.lower() not in (*STATED, "x", "y")}
    others = [name for name, values in rest.items() if may_change(name, values)]
    if others:
        expected = f"{', '.join(STATED)}, x, y and no other numbers beside heights, in which nan "
        expected += "marks holes"
        raise InputError("arrays", found=", ".join(others), expected=expected)
    size = checked_pixel(np.squeeze(named["pixel"])) if "pixel" in named else None
    unit, height_unit = (str(named.get(name, "")) for name in STATED[1:])
    heights = np.squeeze(_numbers(named[chosen]))
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
    return HeightGrid(heights, size, unit, height_unit)


def _chosen(found: dict[str, NDArray[Any]]) -> str:
    """The name of the array of heights."""
    maps = [name for name in found if found[name].ndim == 2 and name.lower() not in ("x", "y")]
    likely = [name for name in found if name.lower() in HEIGHTS] or maps
    likely = ["heights"] if "heights" in likely else likely
    if len(likely) != 1:
        names = ", ".join(likely or found) or "none"
        raise InputError("arrays", found=names, expected='one called "heights"')
    return likely[0]


def _numbers(values: NDArray[np.generic]) -> Array:
    if values.dtype.kind not in "iuf":
        found = f"an array of {values.dtype}"
        raise InputError("heights", found=found, expected="an array of real numbers")
    return np.asarray(values, dtype=np.float64)


def instrument_map(path: Path, pixel: float | tuple[float, float] | None) -> HeightGrid:
    """The heights of the default channel of a file that SurfaceTopography can read.

    pixel : size of a pixel, used if the file does not state the size of the map
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
        if reason.startswith("tried"):  # a list with an error for each of its formats
            reason = "it is in none of its formats; export the map as text, for example"
        raise FileError(f"{path}: SurfaceTopography cannot read it: {reason}") from error
    if topography.dim != 2:
        raise InputError("file", found="a line scan", expected="a map")
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
    sizes = topography.physical_sizes
    size: Any = None if sizes is None else tuple(np.divide(sizes, heights.shape).tolist())
    unit = str(topography.unit or "")
    return HeightGrid(heights.T.copy(), size, unit, unit)
