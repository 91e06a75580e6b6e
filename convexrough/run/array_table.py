"""Columns of .npy, .npz and Parquet files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.errors import FileError

Columns = dict[str, NDArray[Any]]


def read_arrays(path: Path) -> Columns:
    """Columns by name; by number, from "1", where they have none.

    Raises FileError where what reads Parquet is not installed, and whatever the readers raise.
    """
    columns = _parquet(path) if path.suffix.lower() == ".parquet" else _arrays(path)
    if len({len(values) for values in columns.values()}) > 1:
        raise ValueError("arrays of different lengths")
    return columns


def _arrays(path: Path) -> Columns:
    """Columns of .npy or .npz by name, or by number where they have none."""
    with path.open("rb") as raw:
        loaded = np.load(raw, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            named = {"": loaded}
        else:
            with loaded:
                named = {name: loaded[name] for name in loaded.files}
    if len(named) > 1 or not named:
        return {name: np.atleast_1d(values) for name, values in named.items()}
    (name, values), *_ = named.items()
    if values.dtype.names:
        return {each: np.atleast_1d(values[each]) for each in values.dtype.names}
    table = np.atleast_2d(values.T)  # columns, or the one
    if values.ndim > 2:
        raise ValueError(f"{values.ndim} dimensions")
    if len(table) == 1 and name and not name.startswith("arr_"):
        return {name: table[0]}
    return {str(i + 1): column for i, column in enumerate(table)}


def _parquet(path: Path) -> Columns:
    try:
        from pyarrow import parquet
    except ImportError as error:
        advice = "needs pyarrow: pip install 'convexrough[parquet]'"
        raise FileError(f"{path}: {advice}") from error
    with path.open("rb") as raw:
        read = parquet.read_table(raw)
    return {name: read.column(name).to_numpy() for name in read.column_names}
