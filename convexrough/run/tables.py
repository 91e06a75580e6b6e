"""Tables of numbers from CSV (or .npz) files, with the row and column of every mistake."""

from __future__ import annotations

import csv
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import FileError, InputError
from convexrough.scene.asperities import Asperities
from convexrough.scene.neighbours import nearest_distances
from convexrough.scene.scene import Scene

#: Columns that are read, and the check that each cell must pass.
CHECKS: dict[str, Callable[[str, Any], float]] = {
    "x": checks.finite,
    "y": checks.finite,
    "height": checks.finite,
    "tip_radius": checks.positive,
    "load": checks.non_negative,
}

#: Columns of asperities.csv, in this order.
ASPERITY_COLUMNS = (
    "x",
    "y",
    "height",
    "tip_radius",
    "load",
    "contact_radius",
    "gap",
    "status",
    "load_error",
)

#: Positions in a loads file may be off by this, relative to the smallest spacing.
POSITION_TOLERANCE = 1e-6


def read_text(path: Path) -> str:
    """The whole of a UTF-8 file, with or without a byte-order mark."""
    with _reading(path):
        return path.read_text(encoding="utf-8-sig")


class Table(NamedTuple):
    """Columns of numbers from a file, and what each row is called in messages."""

    columns: dict[str, Array]
    rows: list[str]


def read_table(
    path: Path, *, required: Sequence[str], optional: Sequence[str], ignored: Sequence[str] = ()
) -> Table:
    """Columns of numbers from a CSV file with a header, or from an .npz file.

    ignored : columns that may be there and are not looked at

    Raises FileError where it cannot be read, and InputError for a column that is missing, unknown
    or there twice, and for the first row with a missing, spare or wrong cell.
    """
    cells, rows = _npz_cells(path) if path.suffix == ".npz" else _csv_cells(path)
    try:
        for name in cells:
            if name not in (*required, *optional, *ignored):
                expected = f"a known column; {checks.nearest(name, (*required, *optional))}"
                raise InputError("columns", found=repr(name), expected=expected)
        for name in required:
            if name not in cells:
                raise InputError("columns", found=", ".join(cells), expected=f"a column {name!r}")
        if not rows:
            raise InputError("rows", found="none below the header", expected="at least one")
        columns = {
            name: _numbers(name, values, rows)
            for name, values in cells.items()
            if name not in ignored or name in (*required, *optional)
        }
    except InputError as error:
        raise error.within(str(path)) from error
    return Table(columns, rows)


def read_summits(path: Path, *, tip_radius: ArrayLike | None) -> Asperities:
    """Asperities from columns x, y and, where there, height and tip_radius.

    tip_radius : of all, or of each, where the file has no such column; else None
    """
    columns, rows = read_table(path, required=("x", "y"), optional=("height", "tip_radius"))
    given = columns.get("tip_radius")
    if (given is None) == (tip_radius is None):
        found = "neither" if given is None else "both"
        expected = "either a column tip_radius or that key in the scene file"
        raise InputError("tip radii", found=found, expected=expected, where=str(path))
    positions = np.column_stack((columns["x"], columns["y"]))
    radii = tip_radius if given is None else given
    assert radii is not None  # one of the two
    try:
        return Asperities(positions, radii, columns.get("height", 0.0))
    except InputError as error:
        raise error.within(f"{path} ({rows[0]} holds asperity 0)") from error


def read_loads(path: Path, scene: Scene) -> Array:
    """(n,) [force] loads from a file, in the order of the scene's asperities.

    Rows with columns x and y are matched by position; others are in the scene's order.
    """
    optional = ("x", "y")
    columns, rows = read_table(
        path, required=("load",), optional=optional, ignored=ASPERITY_COLUMNS
    )
    loads, n = columns["load"], len(scene)
    if len(loads) != n:
        raise InputError(
            "rows",
            found=len(loads),
            expected=f"{n}, one per asperity of the scene",
            where=str(path),
        )
    given = [name for name in optional if name in columns]
    if not given:
        return loads
    if len(given) == 1:
        raise InputError("columns", found=f"only {given[0]}", expected="x and y", where=str(path))
    try:
        owners = _match(scene, np.column_stack((columns["x"], columns["y"])), rows)
    except InputError as error:
        raise error.within(str(path)) from error
    ordered = np.empty(n)
    ordered[owners] = loads
    return frozen(ordered)


def _match(scene: Scene, points: Array, rows: list[str]) -> Indices:
    """The asperity at each point; every asperity exactly once, as there are as many points."""
    from scipy.spatial import cKDTree  # 0.1 s to import: only when rows have positions

    positions = scene.asperities.positions
    spacing = float(scene.asperities.tip_radii[0])
    if len(positions) > 1:
        spacing = float(nearest_distances(positions).min())
    distances, owners = map(np.asarray, cKDTree(positions).query(points))
    if (worst := float(distances.max())) > POSITION_TOLERANCE * spacing:
        i = int(np.argmax(distances))
        raise InputError(
            rows[i],
            found=f"position {points[i].tolist()}, {worst:g} from the nearest asperity",
            expected="a position of the scene",
        )
    _, first = np.unique(owners, return_index=True)
    if len(first) < len(owners):
        i = int(np.setdiff1d(np.arange(len(owners)), first)[0])
        j = int(np.flatnonzero(owners == owners[i])[0])
        raise InputError(
            rows[i], found=f"the same position as in {rows[j]}", expected="each asperity once"
        )
    return owners


def _csv_cells(path: Path) -> tuple[dict[str, list[Any]], list[str]]:
    """Cells of each column, as text, and the name of each row: its line in the file."""
    reader = csv.reader(StringIO(read_text(path)), strict=True)
    try:
        lines = [(reader.line_num, line) for line in reader]
    except csv.Error as error:
        raise FileError(f"{path}: row {reader.line_num}: not a CSV file: {error}") from error
    while lines and not lines[-1][1]:
        lines.pop()  # empty lines at the end
    if not lines:
        raise FileError(f"{path}: empty")
    header = [name.strip() for name in lines[0][1]]
    if len(set(header)) < len(header):
        twice = next(name for name in header if header.count(name) > 1)
        raise InputError("columns", found=f"{twice!r} twice", expected="once", where=str(path))
    for number, line in lines[1:]:
        if len(line) != len(header):
            found, expected = f"{len(line)} cells", f"{len(header)}, as in the header"
            raise InputError(f"row {number}", found=found, expected=expected, where=str(path))
    cells = {name: [line[i] for _, line in lines[1:]] for i, name in enumerate(header)}
    return cells, [f"row {number}" for number, _ in lines[1:]]


def _npz_cells(path: Path) -> tuple[dict[str, list[Any]], list[str]]:
    """The same from arrays; rows count from 0."""
    with _reading(path), path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
        cells = {name: np.atleast_1d(file[name]).tolist() for name in file.files}
    lengths = {len(values) for values in cells.values()}
    if len(lengths) != 1:
        found = f"lengths {sorted(lengths)}"
        raise InputError("arrays", found=found, expected="one length", where=str(path))
    return cells, [f"entry {i}" for i in range(lengths.pop())]


def _numbers(name: str, cells: list[Any], rows: list[str]) -> Array:
    check = CHECKS[name]
    pairs = zip(rows, cells, strict=True)
    return frozen(np.array([check(f"{row}, column {name}", _read(cell)) for row, cell in pairs]))


def _read(cell: Any) -> Any:
    """The number that a cell says; or the cell itself, for a check to refuse."""
    try:
        return float(cell)
    except (TypeError, ValueError):
        return cell


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Everything that keeps a file from being read, as a FileError."""
    try:
        yield
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: not UTF-8 text, at byte {error.start}") from error
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise FileError(f"{path}: not an .npz file: {error}") from error
