"""Arrays in .npy, .npz, MATLAB's .mat and Parquet files."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.errors import ConvexroughError, ExtraError, FileError, file_errors, needed

Columns = dict[str, list[Any]]

#: Names of arrays, and words of comments, for factors or offsets; the end of "heights x 1000".
FACTORS = re.compile(
    r"(?<![a-z])(scale[ds]?|fa[ck]tors?|multipl[iy]\w*|times|divided|gain|offsets?)(?![a-z])", re.I
)
TIMES = re.compile(r"[^\d\s](\s*[*×÷]|\s+[x/])\s*[+-]?[.,]?\d\S*\s*$")

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


def read_arrays(path: Path, known: Sequence[str]) -> tuple[Columns, list[tuple[str, str]]]:
    """Columns of a file by name or number from 1; place and text of arrays that may state units.

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
        columns = _of_one_shape(path, arrays, known)
        if not columns:
            expected = "vectors by name, or only one matrix or structure"
            raise FileError(f"{path}: found {', '.join(named)}, expected {expected}")
    wanted = [name for name in columns if name.lower() in known] or list(columns)
    lengths = {len(columns[name]) for name in wanted}
    if len(lengths) > 1:
        found = ", ".join(f"{len(columns[name])} numbers in {name}" for name in wanted)
        raise FileError(f"{path}: found {found}, expected as many in each")
    kept = {name: values for name, values in columns.items() if len(values) in lengths}
    said = list[tuple[str, str]]()
    for name, value in named.items() if len(named) > 1 else ():
        neutral, held = 0 if "offset" in name.lower() else 1, parts(value)
        if FACTORS.search(name) and any(part != neutral for part in held):
            raise FileError(f"{path}: found {name}, expected columns that need no factor or offset")
        if name not in kept and any(isinstance(part, str) for part in held):
            said.append((f"array {name}", f"{name}: {', '.join(map(str, held))}"))
    return kept, said


def parts(value: Any) -> list[Any]:
    """The numbers and texts in an array."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [each for part in value for each in parts(part)]
    return [value.decode("utf-8", "replace") if isinstance(value, bytes) else value]


def _is_table(name: str, values: Any, known: Sequence[str]) -> bool:
    """True if the only array of a file holds several columns (x, y, load), not one quantity."""
    if not name or name.startswith("arr_"):
        return True
    is_matrix = isinstance(values, np.ndarray) and values.ndim > 1 and min(values.shape) > 1
    return is_matrix and (name.lower() not in known or len(values[0]) <= 3)


def _of_one_shape(path: Path, arrays: dict[str, NDArray[Any]], known: Sequence[str]) -> Columns:
    """All vectors; or all arrays of one two-dimensional shape, if all `known` arrays have it."""
    shapes = {name: each.shape for name, each in arrays.items() if name.lower() in known}
    axes = {each.size: name for name, each in arrays.items() if name.lower() in ("x", "y")}
    wide = [shape for shape in shapes.values() if len(shape) > 1]
    if wide and len(axes) == 2 == len(wide[0]) and axes.keys() == {*wide[0]}:  # lengths show order
        names = [axes[size] for size in wide[0]]
        mesh = np.meshgrid(*(arrays[name] for name in names), indexing="ij")
        arrays = arrays | dict(zip(names, mesh, strict=True))
    if wide and (len(shapes) == 1 or {arrays[name].shape for name in shapes} != {wide[0]}):
        found = ", ".join(f"{name} of {' x '.join(map(str, it))}" for name, it in shapes.items())
        expected = "vectors, or matrices x, y (as of meshgrid) and values of one shape"
        expected += ": vectors x, y do not show what the rows are" * (len({*wide[0]}) == 1)
        raise FileError(f"{path}: found {found} numbers, expected {expected}")
    return {name: each.ravel().tolist() for name, each in arrays.items()
            if (each.shape == wide[0] if wide else each.ndim == 1)}  # fmt: skip


def _table(values: NDArray[Any]) -> Columns:
    """The columns of a record array or a matrix, by name or number; a vector is one column."""
    if values.dtype.names:
        return {name: np.atleast_1d(values[name]).tolist() for name in values.dtype.names}
    if values.ndim > 2:
        raise ValueError(f"{values.ndim} dimensions")
    return {str(i + 1): column.tolist() for i, column in enumerate(np.atleast_2d(values.T))}


def _matlab(path: Path) -> dict[str, Any]:
    """The variables of a file or, if its only variable is a structure, its fields; those of other
    structures by names such as info.unit, and cell arrays of texts and numbers as text."""
    from scipy.io import loadmat  # takes 0.1 s to import

    with path.open("rb") as raw:
        if b"\x89HDF" in raw.read(1024):
            raise FileError(f"{path}: MATLAB's version 7.3, which is HDF5; save(..., '-v7')")
    with foreign():
        found = loadmat(str(path), appendmat=False, simplify_cells=True)
    named = {name: each for name, each in found.items() if not name.startswith("__")}
    only = next(iter(named.values())) if len(named) == 1 else None
    if isinstance(only, list) and only and all(isinstance(each, dict) for each in only):
        for (k, each), name in product(enumerate(only, 1), only[0]):
            if (count := np.size(each[name])) != 1:
                said = f"{count} values in {name} of structure {k}, expected one in each"
                raise FileError(f"{path}: found {said}")
        return {name: np.array([each[name] for each in only]) for name in only[0]}
    return dict(_flat("", only if isinstance(only, dict) else named))


def _flat(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        cells = value.ravel().tolist()
        if any(isinstance(each, str) for each in cells) and not any(map(np.ndim, cells)):
            texts = all(isinstance(each, str) for each in cells)
            value = np.array(cells if texts else " ".join(map(str, cells)))
        else:
            value = cells
    if isinstance(value, list):
        value = dict(enumerate(value, 1))
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
