"""Maps in files of instruments, read with the package SurfaceTopography."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from warnings import catch_warnings

import numpy as np

from convexrough.errors import FileError, InputError
from convexrough.surface.grid import HeightGrid
from convexrough.surface.surface import checked_pixel


def read_instrument(path: Path, pixel: float | tuple[float, float] | None) -> HeightGrid:
    """The default channel of heights in a file that SurfaceTopography can read.

    pixel : size of a pixel, for files that do not state the size of the map

    Raises FileError if SurfaceTopography cannot read the file or is not installed.
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
                raise InputError("file", found="no heights", expected=expected, where=str(path))
            channel = reader.default_channel
            given: dict[str, Any] = {}
            if channel.physical_sizes is None and pixel is not None:
                counts = zip(channel.nb_grid_pts, checked_pixel(pixel), strict=True)
                given["physical_sizes"] = tuple(count * size for count, size in counts)
            topography = reader.topography(**given)
    except ReadFileError as error:
        reason = str(error).partition("\n")[0] or type(error).__name__
        if reason.startswith("tried"):  # each of its formats, with an error for each
            reason = "it is in none of its formats; export the map as text, for example"
        raise FileError(f"{path}: SurfaceTopography cannot read it: {reason}") from error
    if topography.dim != 2:
        raise InputError("file", found="a line scan", expected="a map", where=str(path))
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
    sizes = topography.physical_sizes
    size: Any = None if sizes is None else tuple(np.divide(sizes, heights.shape).tolist())
    unit = str(topography.unit or "")
    return HeightGrid(heights.T.copy(), size, unit, unit)
