"""`read_table`: columns of numbers from a file, in a scene's units; errors quote the line."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array
from convexrough.errors import InputError, TableError
from convexrough.tabular import roles
from convexrough.tabular.arrays import ARRAYS, read_arrays, reading
from convexrough.tabular.roles import AS_IT_IS, COLUMNS, Reading, is_index, shortened
from convexrough.tabular.text import HOLES, PERHAPS_GROUPED, Style, TextTable, read_text_table
from convexrough.tabular.units import bare, unit

#: Number of mistakes of one file that are shown; number of cells such as 1.013 with which one whole
#: number below 100 in their column is enough to show that the mark separates thousands; and number
#: of columns above which a file without names of columns may be a map.
MOST_MISTAKES, SURELY_GROUPED, MOST_NUMBERED = 10, 10, 10

_WHOLE, _HUNDREDS = re.compile(r"[+-]?\d{1,3}"), re.compile(r"[+-]?(?!999)[1-9]\d\d")


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

    def mistake(self, row: int, what: str) -> str:
        """The message of a mistake in a row: name of the row, `what`, text of the line."""
        return _shown(f"{self.rows[row]}{what}", self.lines[row])


class _Source(NamedTuple):
    """Cells of a file by column, with `rows` and `lines` as in `ReadTable`."""

    header: list[str] | None
    columns: list[Sequence[Any]]
    rows: list[str]
    lines: list[str]
    style: Style
    mistakes: Sequence[str] = ()  # messages on rows that are left out
    said: Sequence[tuple[str, str]] = ()  # place and text of all that may name units, as comments

    def named(self) -> str:
        """The headers, or the numbers of columns and rows, for a message."""
        if self.header is not None:
            return shortened(", ".join(self.header)) + in_sheet(str(self.style))
        columns, rows = len(self.columns), len(self.rows)
        turned = f" and {rows} rows: transposed?" if columns > rows > 1 else ""
        return f"no header, {columns} columns{turned}"

    def numbers_or_text(self, place: int) -> NDArray[Any]:
        """A column as numbers if all of its cells are, else as text."""
        numbers = self.style.numbers(self.columns[place])
        return np.array([str(cell) for cell in self.columns[place]]) if numbers is None else numbers


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
    table: TextTable | None = None,
) -> ReadTable:
    """Columns of a file by known names; TableError has every mistake of the file.

    required, optional : names of columns in `COLUMNS`
    instead : columns that replace the only required one if the file has the first of these, only
    holes : columns in which `HOLES` are read as nan
    unnamed : lists of names for files without a header; the one of matching length is used
    line : a single line without a header and with this many cells, or more than 3, is one column
    table : the cells of the file, if they are already read
    """
    wanted = [*required, *optional, *instead, *(["index"] if "index" in how.columns else [])]
    called = [each.lower() for each in how.columns.values()]
    with reading(path):
        sheet, known = [*required, *instead[:1], *called], [*wanted, *roles.INDEX[:-1], *called]
        source = _source(path, known, sheet) if table is None else _text_source(table)
    alone = source.header is None and len(source.rows) == 1 and not how.columns
    if unnamed and alone and (len(source.columns) > 3 or len(source.columns) == line):
        line_cells = [column[0] for column in source.columns]
        rows = [f"{source.rows[0]}, cell {i}" for i in range(1, len(line_cells) + 1)]
        source = source._replace(columns=[line_cells], rows=rows, lines=[*map(str, line_cells)])
    headers = source.header or [""] * len(source.columns)
    if source.header is None and not how.columns:
        headers = next((each for each in unnamed if len(each) == len(headers)), headers)
    places, mistakes = roles.places_of(wanted, headers, how, source.named())
    index = places.pop("index", None)
    if instead and instead[0] in places and required[0] not in places:
        required = ()
    else:
        places = {name: place for name, place in places.items() if name not in instead}
    missing = [name for name in required if name not in places]
    left = [bare(name) for i, name in enumerate(source.header or []) if i not in places.values()]
    others = [name for name in left if not is_index(name) and len(name) < 40]
    other = "NAME" if source.header else "NUMBER"
    if len(others) == 1 == len(missing):
        other = quote(others[0])
    pixels = instead and {"x", "y"} <= places.keys()
    arrays = path.suffix.lower() in ARRAYS
    naming = "save vectors with these names" if arrays else "add a first row with names"
    advice = ": rename one" if source.header else f": {naming}"
    advice = "" if how.scalable else advice
    measured = (name for name in optional if COLUMNS[name].kind and name not in places)
    similar = [*roles.lookalikes(left, [*missing, *measured])]
    key = roles.columns_key({**how.columns, **dict(similar)}, missing, others)
    key = f", or {key}" if how.keyed and source.header else ""
    if instead and source.header is None and len(source.columns) > MOST_NUMBERED:
        kind = "arrays of an .npz file" if arrays else "columns"
        advice = f"; a map of pressures also needs coordinates: x, y and pressure as {kind}"
    mistakes += [
        f"columns: found {source.named()}, expected a column {each!r}"
        + advice
        + key
        + (f"; --column {each}={other} names another" if how.scalable else "")
        + (f", --column {instead[0]}={other} that of pixels" if how.scalable and pixels else "")
        for each in missing
        if each not in how.columns
    ]
    slip = 'columns: found {!r}, expected a known column; did you mean "{}"{}?'
    mistakes += [slip.format(name, each, key) for each, name in similar]
    if not source.rows and not mistakes and not source.mistakes:
        mistakes = ["rows: found none below the header, expected at least one"]
    if missing or not source.rows:
        refuse(path, [*mistakes, *source.mistakes])
    names = source.header or [str(i + 1) for i in range(len(source.columns))]
    units = {name: found for name, place in places.items() if (found := unit(names[place]))}
    factors, wrong = roles.factors_of([name for name in places if COLUMNS[name].kind], units, how)
    rest = [i for i in range(len(names)) if i not in (index, *places.values())]
    texts = [*(source.said if table is None else ())]
    for i in (i for i in rest if "unit" in names[i].lower()):
        said = dict.fromkeys(map(str, source.columns[i]))
        texts += [(f"column {names[i]}", each) for each in said]
    without = [name for name in places if name not in (*units, *how.scales)]
    mistakes += [*wrong, *roles.units_in(texts, without, how)]
    for where, text in texts:
        if "height" in places and roles.CHANGED.search(text):
            expected = f"heights that grow towards the sphere, or no such {where.split()[0]}"
            mistakes.append(f"{where}: found {shortened(text)!r}, expected {expected}")
    read: dict[str, NDArray[Any]] = {}
    for name, place in places.items():
        cells = source.columns[place]
        if not COLUMNS[name].kind:
            read[name] = np.array([str(cell) for cell in cells])
        else:
            numbers = _numbers(name, cells, source, mistakes, name in holes)
            mistakes += _thousands([cells], source)
            read[name] = numbers * factors.get(name, 1.0)
    refuse(path, [*mistakes, *source.mistakes])
    unread = {names[i]: source.numbers_or_text(i) for i in rest}
    if index is not None:
        places["index"], unread["index"] = index, source.numbers_or_text(index)
    titles = {name: names[place] or str(place + 1) for name, place in places.items()}
    style = str(source.style)
    return ReadTable(read, source.rows, source.lines, units, style, titles, unread, factors)


def matrix(path: Path, table: TextTable) -> Array:
    """The numbers of a table without a header; `HOLES` are nan. Raises TableError."""
    source, mistakes = _text_source(table, is_matrix=True), list[str]()
    columns = [
        _numbers(str(i), cells, source, mistakes, True) for i, cells in enumerate(source.columns, 1)
    ]
    mistakes += _thousands(source.columns, source)
    refuse(path, [*mistakes, *source.mistakes])
    return np.column_stack(columns)


def _thousands(columns: Sequence[Sequence[Any]], source: _Source) -> Iterator[str]:
    """A mistake if cells such as 1.013 seem to have thousands separators: if all others, except
    holes, are whole numbers up to 998, and one is above 99 (or `SURELY_GROUPED` cells are such)."""
    mark = source.style.decimal
    if not mark or not any(mark in "\n".join(cells) for cells in columns):
        return
    grouped, whole = list[tuple[str, str]](), list[tuple[str, str]]()
    for cells in columns:
        for cell, row in zip(cells, source.rows, strict=True):
            if PERHAPS_GROUPED.fullmatch(cell):
                grouped.append((cell, row))
            elif _WHOLE.fullmatch(cell):
                whole.append((cell, row))
            elif cell.lower() not in HOLES:
                return
    sign = _WHOLE if len(grouped) >= SURELY_GROUPED else _HUNDREDS
    if grouped and (shown := next((each for each in whole if sign.fullmatch(each[0])), None)):
        found = f"found {grouped[0][0]}, and {shown[0]} in {shown[1]}"
        expected = "numbers without thousands separators, or with the same number of decimals"
        yield f"{grouped[0][1]}: {found}, expected {expected}"


def _source(path: Path, known: Sequence[str], sheet: Sequence[str]) -> _Source:
    if path.suffix.lower() not in ARRAYS:
        return _text_source(read_text_table(path, known, required=sheet))
    arrays, said = read_arrays(path, known)
    count = len(next(iter(arrays.values()), []))
    rows, header = [f"entry {i}" for i in range(count)], None if "1" in arrays else list(arrays)
    return _Source(header, list(arrays.values()), rows, [""] * count, Style("", ""), said=said)


def _text_source(table: TextTable, *, is_matrix: bool = False) -> _Source:
    header, style = table.header.cells if table.header else None, table.style
    counts = [len(row.cells) for row in table.rows]
    width = len(header) if header else Counter(counts).most_common(1)[0][0]
    mistakes, whole = [], []
    for row in table.rows:
        if what := row.wrong or _misfit(row.cells, width, header):
            mistakes.append(_shown(f"row {row.number}: {what}", row.text))
        else:
            whole.append(row)
    columns: list[Sequence[Any]] = [[row.cells[i] for row in whole] for i in range(width)]
    text = "\n".join(row.text for row in table.rows) if style.separator == "," else "."
    doubled = counts and width <= min(counts) and max(counts) == 2 * width
    halved = re.search(r",0\d", text) or (is_matrix and _are_halves(columns))
    if "." not in text and (doubled or (header is None and halved)):
        found = f"rows: found up to {max(counts)} parts between commas, expected numbers"
        mistakes = [f"{found}: write decimal points, or semicolons between columns"]
    return _Source(
        header,
        columns,
        [f"row {row.number}" for row in whole],
        [row.text for row in whole],
        style if width > 1 or style.decimal == "," else style._replace(separator=""),
        mistakes,
        [("comments", text) for text in table.comments],
    )


def _are_halves(columns: list[Sequence[str]]) -> bool:
    """True if each second column, unlike the others, seems to hold the decimals of the one before:
    digits, always as many."""
    whole, parts = ({*chain(*columns[i::2])} for i in (0, 1))
    many = {len(part) if part.isdecimal() else 0 for part in parts}
    return len(columns) % 2 == 0 and len(many) == 1 and many not in ({0}, {*map(len, whole)})


def _misfit(cells: Sequence[str], width: int, header: list[str] | None) -> str:
    """The reason why the cells are not a row of the table; "" if they are one."""
    if len(cells) != width:
        expected = f"{width}, as in {'the header' if header else 'most rows'}"
        return f"found {len(cells)} cells, expected {expected}"
    if name := roles.totals(cells):
        return f'found a row of "{name}", expected none: remove it'
    return ""


def in_sheet(style: str) -> str:
    """The end of a message: the sheet of a workbook, and others with as many wanted columns."""
    return f" in {style}" if style.startswith("sheet ") else ""


def _numbers(
    name: str, cells: Sequence[Any], source: _Source, mistakes: list[str], holes: bool
) -> Array:
    """The numbers of a column; wrong cells are added to `mistakes`."""
    if holes:
        cells = ["nan" if str(cell).lower() in HOLES else cell for cell in cells]
    style, column = source.style, COLUMNS.get(name, roles.Column())
    check = checks.positive if column.positive else checks.finite
    numbers = style.numbers(cells)
    if numbers is None and not any(map(str, cells)):
        saved = "formulas are empty until a spreadsheet program saves their values"
        mistakes.append(f"column {name}: found only empty cells, expected numbers; {saved}")
        return np.full(len(cells), np.nan)
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
            comma = style.number(str(cell).replace(",", ".", 1)) is not None
            expected = "a decimal point, not a comma" if comma else "a finite number"
            if PERHAPS_GROUPED.fullmatch(str(cell)):
                expected += ", and no thousands separators"
            raise InputError(place, found=shortened(repr(cell)), expected=expected)
        except InputError as error:
            mistakes.append(_shown(str(error), source.lines[i]))
    return numbers


def _shown(mistake: str, line: str) -> str:
    return f"{mistake}: {shortened(line)}" if line else mistake


def refuse(path: Path, mistakes: list[str]) -> None:
    """Raise TableError with the first mistakes of a file, if there are any."""
    if mistakes:
        raise TableError(str(path), few(mistakes))


def few(mistakes: list[str], most: int = MOST_MISTAKES) -> list[str]:
    """The first `most` mistakes, and the number of the others."""
    if (more := len(mistakes) - most) > 0:
        return [*mistakes[:most], f"and {more:,} more mistakes"]
    return mistakes
