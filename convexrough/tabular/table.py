"""`read_table`: columns of numbers from a file, in a scene's units; errors quote the line."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array
from convexrough.errors import InputError, MistakesError
from convexrough.tabular import roles
from convexrough.tabular.arrays import ARRAYS, read_arrays, reading
from convexrough.tabular.roles import AS_IT_IS, COLUMNS, Reading, is_index, shortened
from convexrough.tabular.text import HOLES, Cells, Style, read_cells
from convexrough.tabular.units import bare, in_unit, parsed, unit

#: Number of mistakes of one file that are shown; and largest difference of a last row from the
#: means or sums of the other rows, over the range of each column, if it contains those.
MOST_MISTAKES, ROUNDED = 10, 1e-3

#: A number such as 1.013 or 1,013, whose mark may separate thousands; and a whole number beside it
#: that suggests so. 999 and more can mark holes.
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
_WHOLE = re.compile(r"[+-]?(?!999)[1-9]\d{0,2}")


class ReadTable(NamedTuple):
    """Columns of a file by known names, and how the file was read."""

    columns: dict[str, NDArray[Any]]  # numbers, or text for the columns read as text
    rows: list[str]  # the name of each row in messages
    lines: list[str]  # the text of each row, "" in files of arrays
    units: dict[str, str]  # those that headers name
    style: str  # how text was split, "" for files of arrays
    called: dict[str, str]  # the headers; also that of the index, if `Reading.columns` names it
    #: Columns that were not asked for, by header or number from 1, as numbers if all cells are. The
    #: one that `Reading.columns` names as index has the key "index".
    others: dict[str, NDArray[Any]]
    factors: dict[str, float]  # factors other than 1 by which columns were multiplied
    comments: Sequence[str]

    def mistake(self, row: int, what: str) -> str:
        """The message of a mistake in a row: name of the row, `what`, text of the line."""
        return _shown(f"{self.rows[row]}{what}", self.lines[row])


def read_table(
    path: Path,
    *,
    required: Sequence[str],
    optional: Sequence[str] = (),
    instead: Sequence[str] = (),
    holes: Sequence[str] = (),
    unnamed: Sequence[list[str]] = (),
    line: int = 0,
    how: Reading = AS_IT_IS,
    cells: Cells | None = None,
) -> ReadTable:
    """Columns of a file by known names; MistakesError has every mistake of the file.

    required, optional : names of columns in `COLUMNS`
    instead : columns that replace the only required one if the file has the first of these, only
    holes : columns in which `HOLES` are read as nan
    unnamed : lists of names for files without a header; the one of matching length is used
    line : a single line without a header and with this many cells, or more than 3, is one column
    cells : those of the file, if they are already read
    """
    wanted = [*required, *optional, *instead, *(["index"] if "index" in how.columns else [])]
    called = [each.lower() for each in how.columns.values()]
    with reading(path):
        known = [*wanted, *roles.INDEX[:-1], *called]
        source = cells or _cells(path, known)
    alone = source.header is None and len(source.rows) == 1 and not how.columns
    if unnamed and alone and (len(source.columns) > 3 or len(source.columns) == line):
        line_cells = [column[0] for column in source.columns]
        rows = [f"{source.rows[0]}, cell {i}" for i in range(1, len(line_cells) + 1)]
        source = source._replace(columns=[line_cells], rows=rows, lines=[*map(str, line_cells)])
    headers = source.header or [""] * len(source.columns)
    if source.header is None and not how.columns:
        headers = next((each for each in unnamed if len(each) == len(headers)), headers)
    places, mistakes = roles.places_of(wanted, headers, how, _named(source))
    index = places.pop("index", None)
    if instead and instead[0] in places and required[0] not in places:
        required = ()
    else:
        places = {name: place for name, place in places.items() if name not in instead}
    missing = [name for name in required if name not in places]
    measured = (name for name in optional if COLUMNS[name].kind and name not in places)
    mistakes += _unnamed(source, places, missing, [*missing, *measured], instead, how)
    if not source.rows and not mistakes and not source.mistakes:
        mistakes = ["rows: found none below the header, expected at least one"]
    if missing or not source.rows:
        several = len(source.mistakes) > len(source.rows) and mistakes
        refuse(path, [*mistakes, *source.mistakes[: 1 if several else None]])
    names = source.header or [str(i + 1) for i in range(len(source.columns))]
    units = {name: found for name, place in places.items() if (found := unit(names[place]))}
    factors, wrong = roles.factors_of([name for name in places if COLUMNS[name].kind], units, how)
    rest = [i for i in range(len(names)) if i not in (index, *places.values())]
    said = [(f"column {names[i]}", str(source.columns[i][0])) for i in rest
            if "unit" in names[i].lower()]  # fmt: skip
    stated = {name for name in units if parsed(units[name])} | how.scales.keys()
    unknown = [name for name in places if COLUMNS[name].kind and name not in stated]
    if not said and cells is None and source.style.decimal:  # `surface.read` judges those of maps
        said = [("comments", text) for text in source.comments]
        unknown = [name for name in unknown if how.units.unit(COLUMNS[name].kind)]
    if said and unknown:  # what is said could name other units, or a factor
        name = in_unit(unknown[0], how.units.name(COLUMNS[unknown[0]].kind) or "UNIT")
        where, text = said[0]
        expected = f"units in the header, as {name}, or no such {where.split()[0]}"
        mistakes.append(f"{where}: found {shortened(text)!r}, expected {expected}")
    mistakes += wrong
    read: dict[str, NDArray[Any]] = {}
    for name, place in places.items():
        column = source.columns[place]
        if not COLUMNS[name].kind:
            read[name] = np.array([str(cell) for cell in column])
        else:
            numbers = _numbers(name, column, source, mistakes, name in holes)
            mistakes += _thousands([column], source)
            read[name] = numbers * factors.get(name, 1.0)
    refuse(path, [*mistakes, *source.mistakes])
    unread = {names[i]: source.column(i) for i in rest}
    if index is not None:
        places["index"], unread["index"] = index, source.column(index)
    titles = {name: names[place] or str(place + 1) for name, place in places.items()}
    style = str(source.style)
    return ReadTable(
        read, source.rows, source.lines, units, style, titles, unread, factors, source.comments
    )


def _unnamed(
    source: Cells,
    places: Mapping[str, int],
    missing: Sequence[str],
    wanted: Sequence[str],
    instead: Sequence[str],
    how: Reading,
) -> Iterator[str]:
    """A mistake for each missing column, and for each unread one whose name is like a wanted."""
    left = [bare(name) for i, name in enumerate(source.header or []) if i not in places.values()]
    others = [name for name in left if not is_index(name) and len(name) < 40]
    similar = roles.lookalikes(left, wanted)
    key = roles.columns_key({**how.columns, **similar}, missing)
    titled = len(source.mistakes) > len(source.rows)  # a line above the names counts as header
    key = f", or {key}" if how.keyed and source.header and not titled else ""
    for name in (name for name in missing if name not in how.columns):
        advice = ": rename one" if source.header else ": add a first row with names"
        if not source.style.decimal:
            advice = ": save vectors with these names"
        if how.scalable:
            other = quote(others[0]) if len(others) == 1 == len(missing) else "NAME"
            other = other if source.header else "NUMBER"
            advice = f"; --column {name}={other} names another"
            if instead and {"x", "y"} <= places.keys():
                advice += f", --column {instead[0]}={other} that of pixels"
        if source.header and titled:
            advice = "; remove the lines above the names of columns, or begin them with #"
        yield f"columns: found {_named(source)}, expected a column {name!r}{advice}{key}"
    for each, name in similar.items():
        meant = f'did you mean "{each}"{key}?'
        yield f"columns: found {name!r}, expected a known column; {meant}"


def matrix(path: Path, cells: Cells) -> Array:
    """The numbers of a table without a header; `HOLES` are nan. Raises MistakesError."""
    columns, mistakes = cells.columns, list[str]()
    if cells.style.separator == "," and not any("." in row for row in cells.lines):
        whole, parts = ({*chain(*columns[i::2])} for i in (0, 1))
        many = {len(part) if part.isdecimal() else 0 for part in parts}
        if len(columns) % 2 == 0 and len(many) == 1 and many not in ({0}, {*map(len, whole)}):
            expected = "decimal points, or semicolons between columns"
            mistakes = [f"rows: found decimals between commas, expected {expected}"]
    numbers = [_numbers(str(i), each, cells, mistakes, True) for i, each in enumerate(columns, 1)]
    mistakes += _thousands(columns, cells)
    refuse(path, [*mistakes, *cells.mistakes])
    return np.column_stack(numbers)


def _thousands(columns: Sequence[Sequence[Any]], cells: Cells) -> Iterator[str]:
    """A mistake if all cells with a decimal mark could have thousands separators instead, as 1.013
    beside 827."""
    mark, grouped, whole = cells.style.decimal, "", ""
    for column in columns if mark and any(mark in "\n".join(each) for each in columns) else ():
        for cell, row in zip(column, cells.rows, strict=True):
            if _GROUPED.fullmatch(cell):
                grouped = grouped or f"{row}: found {cell}"
            elif _WHOLE.fullmatch(cell):
                whole = whole or f"{cell} in {row}"
            elif cell.lower().lstrip("+-") not in (*HOLES, "0", "999"):
                return
    if grouped and whole:
        expected = "numbers without thousands separators, or with the same number of decimals"
        yield f"{grouped}, and {whole}, expected {expected}"


def _cells(path: Path, known: Sequence[str]) -> Cells:
    if path.suffix.lower() not in ARRAYS:
        return read_cells(path, known)
    arrays, comments = read_arrays(path, known)
    count = len(next(iter(arrays.values()), []))
    rows, header = [f"entry {i}" for i in range(count)], None if "1" in arrays else list(arrays)
    return Cells(header, [*arrays.values()], rows, [""] * count, Style("", ""), comments)


def _named(cells: Cells) -> str:
    """The headers, or the numbers of columns and rows, for a message."""
    if cells.header is not None:
        return shortened(", ".join(cells.header)) + in_sheet(str(cells.style))
    columns, rows = len(cells.columns), len(cells.rows)
    turned = f" and {rows} rows: transposed?" if columns > rows > 1 else ""
    return f"no header, {columns} columns{turned}"


def summary_in_last(rows: Array) -> str:
    """ "means" or "sums" if the last row holds those of the rows above, rounded; else ""."""
    others, allowed = rows[:-1], ROUNDED * np.ptp(rows[:-1], axis=0)
    for what, of in (("means", np.mean), ("sums", np.sum)):
        if allowed.any() and (np.abs(rows[-1] - of(others, axis=0)) <= allowed).all():
            return what
    return ""


def in_sheet(style: str) -> str:
    """The end of a message: the sheet that is read, and the number of sheets with cells."""
    return f" in {style}" if style.startswith("sheet ") else ""


def _numbers(
    name: str, cells: Sequence[Any], source: Cells, mistakes: list[str], holes: bool
) -> Array:
    """The numbers of a column; wrong cells are added to `mistakes`."""
    if holes:
        cells = ["nan" if str(cell).lower() in HOLES else cell for cell in cells]
    style, column = source.style, COLUMNS.get(name, roles.Column())
    check = checks.positive if column.positive else checks.finite
    numbers = style.numbers(cells)
    if numbers is None:
        found = map(style.number, cells)
        numbers = np.array([np.inf if number is None else number for number in found])
    sizes = np.abs(numbers)
    # However small a load is, it claims contact unless a floor counts it as 0.
    least = 0.0 if column.kind in ("force", "pressure") else checks.SMALLEST
    fine = (sizes >= least) & (sizes <= checks.LARGEST) | (sizes == 0)
    fine &= (numbers > 0) | (check is checks.finite)
    fine |= np.isnan(numbers) & holes
    for i in np.flatnonzero(~fine).tolist():
        cell, place = cells[i], f"{source.rows[i]}, column {name}"
        try:
            if (number := style.number(cell)) is not None:
                check(place, number)  # raises the error
            mark = "comma" if style.decimal == "," else "point"
            expected = f"a decimal {mark} and no thousands separators"
            expected = expected if style.marked(str(cell)) else "a finite number"
            if parsed(said := str(cell).strip("[]()")):
                expected += f"; units belong into the header, as {name} [{said}]"
            raise InputError(place, found=shortened(repr(cell)), expected=expected)
        except InputError as error:
            mistakes.append(_shown(str(error), source.lines[i]))
    return numbers


def _shown(mistake: str, line: str) -> str:
    return f"{mistake}: {shortened(line)}" if line else mistake


def refuse(path: Path, mistakes: list[str]) -> None:
    """Raise MistakesError with the first mistakes of a file, if there are any."""
    if mistakes:
        raise MistakesError(path, few(mistakes))


def few(mistakes: list[str], most: int = MOST_MISTAKES) -> list[str]:
    """The first `most` mistakes, and the number of the others."""
    if (more := len(mistakes) - most) > 0:
        return [*mistakes[:most], f"and {more:,} more mistakes"]
    return mistakes
