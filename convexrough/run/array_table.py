"""Columns of .npy, .npz and Parquet files."""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.errors import FileError

Columns = dict[str, list[Any]]

#: What the readers of arrays raise besides OSError, in files that are not what they are named.
SPOILED = (
    *(ValueError, TypeError, EOFError, SyntaxError, KeyError, OverflowError, RuntimeError),
    *(zipfile.BadZipFile, zlib.error, struct.error, TokenError),
)


def read_arrays(path: Path, known: Sequence[str]) -> Columns:
    """Columns by name; by number, from "1", where they have none.

    known : names that may be wanted, in lower case; of others only those as long as these are kept

    Raises FileError where what reads Parquet is not installed, OSError, and SPOILED.
    """
    columns = _parquet(path) if path.suffix.lower() == ".parquet" else _arrays(path)
    wanted = [name for name in columns if name.lower() in known] or list(columns)
    lengths = {len(columns[name]) for name in wanted}
    if len(lengths) > 1:
        raise ValueError(f"arrays of lengths {sorted(lengths)}")
    return {name: values for name, values in columns.items() if len(values) in lengths}


def _arrays(path: Path) -> Columns:
    with path.open("rb") as raw:
        loaded = np.load(raw, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            return _table(loaded)
        with loaded:
            named = {name: np.asarray(loaded[name]) for name in loaded.files}
    (first, values), *others = named.items() or [("", np.zeros(0))]
    if not others and (values.ndim > 1 or first.startswith("arr_")):
        return _table(values)
    return {name: values.tolist() for name, values in named.items() if values.ndim == 1}


def _table(values: NDArray[Any]) -> Columns:
    """Columns of a record array, of a matrix, or the one that a vector is."""
    if values.dtype.names:
        return {name: np.atleast_1d(values[name]).tolist() for name in values.dtype.names}
    if values.ndim > 2:
        raise ValueError(f"{values.ndim} dimensions")
    return {str(i + 1): column.tolist() for i, column in enumerate(np.atleast_2d(values.T))}


def _parquet(path: Path) -> Columns:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        advice = "needs pyarrow: pip install 'convexrough[parquet]'"
        raise FileError(f"{path}: {advice}") from error
    try:
        with path.open("rb") as raw:
            read = parquet.read_table(raw)
        return {name: read.column(name).to_pylist() for name in read.column_names}
    except pyarrow.ArrowException as error:
        raise ValueError(str(error)) from error
