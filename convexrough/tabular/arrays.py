"""Arrays in .npy, .npz, MATLAB's .mat and Parquet files."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import NDArray

from convexrough.errors import ConvexroughError, ExtraError, FileError, file_errors, needed

Columns = dict[str, list[Any]]

#: Names of arrays beside columns that could change their meaning.
SCALES = re.compile(r"unit|(?<![a-z])(scale|fa[ck]tor|multipl|gain|offset)", re.I)

#: Extensions of files of arrays.
ARRAYS = (".npy", ".npz", ".mat", ".parquet")


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """A context manager: turn errors of the body, in which a file is read, into FileErrors."""
    try:
        with file_errors(path, "be read"):
            yield
    except ExtraError as error:
        raise FileError(f"{path}: {error}") from error
    except ConvexroughError:
        raise
    except UnicodeDecodeError as error:
        found = f"not UTF-8 text, at byte {error.start}: save it as UTF-8"
        raise FileError(f"{path}: {found}") from error
    except UnicodeError as error:
        raise FileError(f"{path}: not text: {error}") from error
    except (ValueError, EOFError, zlib.error) as error:  # also those of `foreign`
        raise FileError(f"{path}: not an {path.suffix} file: {error}") from error


@contextmanager
def foreign() -> Iterator[None]:
    """A context manager: turn errors of the body, except OSError, into ValueErrors. For corrupted
    files numpy, scipy, pyarrow and openpyxl raise errors of many undocumented kinds."""
    try:
        yield
    except OSError:
        raise
    except Exception as error:
        reason = str(error)
        raise ValueError(reason if " " in reason else repr(error)) from error


def named_arrays(path: Path) -> dict[str, Any]:
    """The arrays of a file by name; the name of an unnamed array is ""."""
    if own := {".mat": _matlab, ".parquet": _parquet}.get(path.suffix.lower()):
        return own(path)
    with path.open("rb") as raw, foreign():
        first = raw.read(6)
        if not first.startswith((b"\x93NUMPY", b"PK")):
            raise ValueError(f"it begins with {first.decode('latin-1')!r}")
        raw.seek(0)
        loaded = np.load(raw, allow_pickle=False)
        named = {"": loaded} if isinstance(loaded, np.ndarray) else loaded
        arrays = {name: np.asarray(values) for name, values in named.items()}
        for values in arrays.values():
            if values.dtype.kind == "U":  # numpy accepts invalid characters
                np.char.decode(np.char.encode(values, "utf-8"), "utf-8")
        return arrays


def read_arrays(path: Path, known: Sequence[str]) -> tuple[Columns, list[str]]:
    """Columns of a file by name or number from 1; and its texts, as comments.

    known : names to read, in lower case; other columns are kept only if they have the same length.
        If no column has one of these names, all columns are read
    """
    named = named_arrays(path) or {"": np.zeros(0)}
    first, values = next(iter(named.items()))
    if len(named) == 1 and _is_table(first, values, known):
        columns = _table(np.asarray(values))
    else:
        arrays = {name: np.atleast_1d(np.squeeze(each)) for name, each in named.items()
                  if isinstance(each, np.ndarray) and each.ndim}  # fmt: skip
        columns = _of_one_shape(arrays, known)
        if not columns:
            expected = "vectors or matrices of one shape by name, or only one matrix or structure"
            raise FileError(f"{path}: found {', '.join(named)}, expected {expected}")
    wanted = [name for name in columns if name.lower() in known] or list(columns)
    lengths = {len(columns[name]) for name in wanted}
    if len(lengths) > 1:
        found = ", ".join(f"{len(columns[name])} numbers in {name}" for name in wanted)
        raise FileError(f"{path}: found {found}, expected as many in each")
    kept = {name: values for name, values in columns.items() if len(values) in lengths}
    rest = {
        name: parts(value) for name, value in named.items() if len(named) > 1 and name not in kept
    }
    if scale := next(filter(SCALES.search, rest), ""):
        expected = "columns that need no unit, factor or offset; name a unit as in load_mN"
        raise FileError(f"{path}: found {scale}, expected {expected}")
    texts = {name: " ".join(map(str, held)) for name, held in rest.items()
             if any(isinstance(part, str) for part in held)}  # fmt: skip
    return kept, [f"{name}: {text}" for name, text in texts.items()]


def parts(value: Any) -> list[Any]:
    """The numbers and texts in an array, a list or a structure."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, dict):
        value = [*value.values()]
    if isinstance(value, (list, tuple)):
        return [each for part in value for each in parts(part)]
    return [value.decode("utf-8", "replace") if isinstance(value, bytes) else value]


def _is_table(name: str, values: Any, known: Sequence[str]) -> bool:
    """True if the only array of a file holds several columns (x, y, load), not one quantity."""
    if not name or name.startswith("arr_"):
        return True
    is_matrix = isinstance(values, np.ndarray) and values.ndim > 1 and min(values.shape) > 1
    return is_matrix and (name.lower() not in known or len(values[0]) <= 3)


def _of_one_shape(arrays: dict[str, NDArray[Any]], known: Sequence[str]) -> Columns:
    """All vectors; or all arrays of one shape, as of meshgrid, if all `known` arrays have it."""
    shapes = [each.shape for name, each in arrays.items() if name.lower() in known]
    wide = shapes[0] if len(shapes) > 1 and len({*shapes}) == 1 and len(shapes[0]) > 1 else None
    return {name: each.ravel().tolist() for name, each in arrays.items()
            if (each.shape == wide if wide else each.ndim == 1)}  # fmt: skip


def _table(values: NDArray[Any]) -> Columns:
    """The columns of a record array or a matrix, by name or number; a vector is one column."""
    if values.dtype.names:
        return {name: np.atleast_1d(values[name]).tolist() for name in values.dtype.names}
    if values.ndim > 2:
        raise ValueError(f"{values.ndim} dimensions")
    return {str(i + 1): column.tolist() for i, column in enumerate(np.atleast_2d(values.T))}


def _matlab(path: Path) -> dict[str, Any]:
    """The variables of a file or, if its only variable is a structure, its fields; those of other
    structures by names such as info.unit."""
    with path.open("rb") as raw:
        if b"\x89HDF" in raw.read(1024):
            raise FileError(f"{path}: MATLAB's version 7.3, which is HDF5; save(..., '-v7')")
    with foreign():
        found = scipy.io.loadmat(str(path), appendmat=False, simplify_cells=True)
    named = {name: each for name, each in found.items() if not name.startswith("__")}
    only = next(iter(named.values())) if len(named) == 1 else None
    return dict(_flat("", only if isinstance(only, dict) else named))


def _flat(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _flat(f"{name}.{key}" if name else key, each)
    else:
        yield name, value


def _parquet(path: Path) -> dict[str, Any]:
    needed("pyarrow")
    from pyarrow import parquet

    with path.open("rb") as raw, foreign():
        read = parquet.read_table(raw)
        columns = {name: read.column(name).to_pylist() for name in read.column_names}
    return {name: np.array(column, dtype=object) for name, column in columns.items()}
