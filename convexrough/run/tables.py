"""Tables of numbers from text, .npy, .npz and Parquet files, with every mistake and its line."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO, TextIOWrapper
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array
from convexrough.errors import FileError, InputError, TableError
from convexrough.run.array_table import SPOILED, read_arrays
from convexrough.scene.asperities import Asperities
from convexrough.text_table import bare, read_text_table, unit

#: Columns that are read, and the check that each cell must pass.
CHECKS: dict[str, Callable[[str, Any], float]] = {
    "tip_radius": checks.positive,
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

#: Files that are not text.
ARRAYS = (".npy", ".npz", ".parquet")

#: Mistakes of one file that are shown; the rest are counted.
MOST_MISTAKES = 10

#: Characters of a line that are shown.
MOST_SHOWN = 60

#: A column that is not read must not be named almost like one that is wanted and is missing.
LOOKS_LIKE = 0.75


def read_text(path: Path, most: int) -> str:
    """The whole of a UTF-8 file of up to `most` bytes, with or without a byte-order mark."""
    with _reading(path), path.open("rb") as file:
        contents = file.read(most + 1)
        if len(contents) > most:
            raise FileError(f"{path}: more than {most / 2**20:g} MiB")
        return TextIOWrapper(BytesIO(contents), encoding="utf-8-sig").read()


class Table(NamedTuple):
    """Columns of a file by what they are read as, and how it was read.

    columns : numbers, or text where it was asked for
    rows    : what each row is called in messages;  lines : its text, "" where there is none
    units   : of columns whose header names one;  style : how text was read, "" where it was none
    """

    columns: dict[str, NDArray[Any]]
    rows: list[str]
    lines: list[str]
    units: dict[str, str]
    style: str

    def mistake(self, row: int, what: str) -> str:
        """A mistake in a row, with its line."""
        return _shown(f"{self.rows[row]}{what}", self.lines[row])


class _Source(NamedTuple):
    """Cells of a file, by column; no header: named by number, from 1."""

    header: list[str] | None
    columns: list[Sequence[Any]]
    rows: list[str]
    lines: list[str]
    style: str
    number: Callable[[Any], float | None]
    mistakes: list[str]


def read_table(
    path: Path,
    *,
    required: Sequence[str],
    optional: Sequence[str] = (),
    text: Sequence[str] = (),
    columns: Mapping[str, str] | None = None,
    unnamed: Sequence[Sequence[str]] = (),
) -> Table:
    """Columns of a file with a header; others in it are not looked at.

    required, optional, text : what is read, the last as text, and only where it is there
    columns : the header, or the number from 1, of what is called otherwise in the file
    unnamed : what is meant where there is no header, and as many columns

    Raises FileError where it cannot be read, and TableError with all that is wrong in it.
    """
    wanted = (*required, *optional, *text)
    with _reading(path):
        source = _source(path, [*wanted, *(each.lower() for each in (columns or {}).values())])
    if unnamed and source.header is None and len(source.rows) == 1 and len(source.columns) > 3:
        source = _upright(source)
    places, mistakes = _places(source, wanted, dict(columns or {}), unnamed)
    missing = [name for name in required if name not in places]
    mistakes += [f"columns: found {_named(source)}, expected a column {each!r}" for each in missing]
    mistakes += _lookalikes(source, places, [*missing, *optional])
    if not source.rows and not mistakes:
        mistakes = ["rows: found none below the header, expected at least one"]
    if missing or not source.rows:
        raise TableError(str(path), few([*mistakes, *source.mistakes]))
    read: dict[str, NDArray[Any]] = {}
    for name, place in places.items():
        cells = source.columns[place]
        if name in text:
            read[name] = np.array([str(cell) for cell in cells])
        else:
            read[name] = _numbers(name, cells, source, mistakes)
    if mistakes := [*mistakes, *source.mistakes]:
        raise TableError(str(path), few(mistakes))
    names = source.header or [""] * len(source.columns)
    units = {name: unit(names[place]) for name, place in places.items()}
    units = {name: each for name, each in units.items() if each}
    return Table(read, source.rows, source.lines, units, source.style)


def read_summits(path: Path, *, tip_radius: ArrayLike | None) -> Asperities:
    """Asperities from columns x, y and, where there, height and tip_radius.

    tip_radius : of all, or of each, where the file has no such column; else None
    """
    table = read_table(path, required=("x", "y"), optional=("height", "tip_radius"))
    columns = table.columns
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
        raise error.within(f"{path} ({table.rows[0]} holds asperity 0)") from error


def _source(path: Path, known: Sequence[str]) -> _Source:
    """Everything in a file, by its kind."""
    if path.suffix.lower() in ARRAYS:
        arrays = read_arrays(path, known)
        count = len(next(iter(arrays.values()), []))
        return _Source(
            header=None if "1" in arrays else list(arrays),
            columns=list(arrays.values()),
            rows=[f"entry {i}" for i in range(count)],
            lines=[""] * count,
            style="",
            number=_as_number,
            mistakes=[],
        )
    table = read_text_table(path, known)
    width = len(table.header) if table.header else max(len(row.cells) for row in table.rows)
    mistakes = []
    for row in table.rows:
        if row.wrong or len(row.cells) != width:
            expected = f"{width}, as in {'the header' if table.header else 'most rows'}"
            what = row.wrong or f"found {len(row.cells)} cells, expected {expected}"
            mistakes.append(_shown(f"row {row.number}: {what}", row.text))
    whole = [row for row in table.rows if len(row.cells) == width]
    return _Source(
        header=table.header,
        columns=[[row.cells[i] for row in whole] for i in range(width)],
        rows=[f"row {row.number}" for row in whole],
        lines=[row.text for row in whole],
        style=str(table.style) if width > 1 or table.style.decimal == "," else "",
        number=table.style.number,
        mistakes=mistakes,
    )


def _upright(source: _Source) -> _Source:
    """A single line of numbers as a single column."""
    cells = [column[0] for column in source.columns]
    rows = [f"{source.rows[0]}, cell {i + 1}" for i in range(len(cells))]
    return source._replace(columns=[cells], rows=rows, lines=[str(cell) for cell in cells])


def _places(
    source: _Source,
    wanted: Sequence[str],
    columns: Mapping[str, str],
    unnamed: Sequence[Sequence[str]],
) -> tuple[dict[str, int], list[str]]:
    """The column of each name that is there, and what is wrong with the names."""
    names = source.header
    if names is None:
        nameless = [""] * len(source.columns)
        names = next((list(each) for each in unnamed if len(each) == len(nameless)), nameless)
        names = nameless if columns else names
    bared = [bare(name) for name in names]
    places: dict[str, int] = {}
    mistakes: list[str] = []
    for name in wanted:
        called = columns.get(name, name)
        for known in (names, bared, [each.lower() for each in bared]):
            if count := known.count(called):
                places[name] = known.index(called)
                if count > 1:
                    mistakes.append(f"columns: found {called!r} twice, expected once")
                break
        else:
            if name not in columns:
                continue
            if called.isdecimal() and 1 <= int(called[:9]) <= len(names):
                places[name] = int(called) - 1
            else:
                mistakes.append(f"columns: found {_named(source)}, expected a column {called!r}")
    return places, mistakes


def _lookalikes(source: _Source, places: Mapping[str, int], wanted: Sequence[str]) -> list[str]:
    """Columns that are not read, and look like one that is wanted and is not there."""
    from difflib import SequenceMatcher  # only when a column is not there

    mistakes = []
    for i, name in enumerate(source.header or []):
        for each in (each for each in wanted if each not in places and i not in places.values()):
            if SequenceMatcher(None, bare(name).lower(), each).ratio() > LOOKS_LIKE:
                expected = f'a known column; did you mean "{each}"?'
                mistakes.append(f"columns: found {bare(name)!r}, expected {expected}")
    return mistakes


def _named(source: _Source) -> str:
    if source.header is None:
        return f"no header and {len(source.columns)} columns"
    return _cut(", ".join(source.header))


def _numbers(name: str, cells: Sequence[Any], source: _Source, mistakes: list[str]) -> Array:
    """The cells of a column; what is wrong with them goes to the mistakes."""
    check, numbers = CHECKS.get(name, checks.finite), np.zeros(len(cells))
    for i, cell in enumerate(cells):
        number = source.number(cell)
        place = f"{source.rows[i]}, column {name}"
        try:
            if number is None:
                raise InputError(place, found=_cut(repr(cell)), expected="a finite number")
            numbers[i] = check(place, number)
        except InputError as error:
            mistakes.append(_shown(str(error), source.lines[i]))
    return numbers


def _as_number(cell: Any) -> float | None:
    return float(cell) if isinstance(cell, (int, float)) and not isinstance(cell, bool) else None


def _shown(mistake: str, line: str) -> str:
    return f"{mistake}: {_cut(line)}" if line else mistake


def _cut(text: str) -> str:
    text = "".join(each if each.isprintable() else " " for each in text[: MOST_SHOWN + 1])
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}..."


def few(mistakes: list[str], most: int = MOST_MISTAKES) -> list[str]:
    """The first mistakes, and how many there are besides."""
    if (more := len(mistakes) - most) > 0:
        return [*mistakes[:most], f"and {more:,} more mistakes"]
    return mistakes


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Everything that keeps a file from being read, as a FileError."""
    try:
        yield
    except (InputError, FileError):
        raise
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: not UTF-8 text, at byte {error.start}") from error
    except UnicodeError as error:
        raise FileError(f"{path}: not text: {error}") from error
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (*SPOILED, MemoryError) as error:
        raise FileError(f"{path}: not an {path.suffix} file: {error}") from error
