"""Text files and Excel workbooks as tables: comments, one row of names, rows of as many cells.

A comment is a line above the rows that begins with # or %; the last one may hold the names, as
`numpy.savetxt` writes them. One separator (comma, semicolon, tab or spaces) is used in the whole
file, and one decimal mark. csv.Sniffer and numpy.loadtxt support no decimal commas and no D
exponents; pandas and polars stop at the first mistake without showing the line.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from gzip import GzipFile
from io import BufferedReader, TextIOWrapper
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.errors import FileError, InputError, needed
from convexrough.tabular.arrays import foreign
from convexrough.tabular.roles import TOTALS, shortened
from convexrough.tabular.units import bare

#: Largest number of characters of a line, and of a number.
LONGEST, LONGEST_NUMBER = 2**24, 400

#: Extensions of Excel workbooks.
WORKBOOKS = (".xlsx", ".xlsm")

#: The separator and the decimal mark are chosen by means of the first and the last SAMPLE lines,
#: and of at most LATER others that contain a comma or a point.
SAMPLE, LATER = 100, 20

#: Cells that mean an unknown number, in lower case.
HOLES = ("", "bad", "nan", "na", "n/a", "#n/a", "#nv", "none", "null", "---", "***")

#: The beginning of a comment; #N/A and other errors of spreadsheets are cells.
_COMMENT = re.compile(r"%|#(?!N/A|NV\b|\S*[!?]|##+[,;\t])", re.I)

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[eEdD]([+-]?\d+)|([+-]\d{3}))?")
#: Marks between digits that may separate thousands.
_MARKS = re.compile(r"(?<=\d)[.,'\u2019\xa0\u202f](?=\d)")
#: What instruments write for a hole. Spaces may separate columns, so this is replaced.
_NO_DATA = re.compile(r"\bno data\b", re.I)
_SURROGATE = re.compile("[\udc80-\udcff]")
#: The separators in a comment that may be a header.
_APART = re.compile(r"\s*[,;\s]\s*")
_UNIT_APART = re.compile(r"(?<!\s)\s+(?=[\[(])")
_BINARY = {
    b"PK\x03\x04": "an archive or an Excel workbook; name it .xlsx",
    b"MATLAB": "a MAT-file; name it .mat",
    b"\x89HDF": "an HDF5 or MAT-file; save it as CSV",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook; save it as .xlsx",
    b"\x93NUMPY": "a NumPy array; name it .npy",
    b"PAR1": "a Parquet file; name it .parquet",
    b"<html": "a page in HTML; save the table itself",
    b"<!doctype html": "a page in HTML; save the table itself",
    b"<?xml": "XML; save it as CSV or .xlsx",
}


class Style(NamedTuple):
    """How the cells of a file are separated and written."""

    separator: str  # "" for a single column
    decimal: str  # "" for a file of arrays, whose cells are numbers
    sheet: str = ""  # of a workbook

    def __str__(self) -> str:
        if self.sheet:
            return f"sheet {self.sheet}"
        if not self.separator:
            return ""
        names = {",": "commas", ";": "semicolons", "\t": "tabs", " ": "spaces"}
        comma = ", decimal comma" if self.decimal == "," else ""
        return f"separated by {names.get(self.separator, repr(self.separator))}{comma}"

    def split(self, line: str) -> list[str]:
        """The cells of a line. Raises csv.Error for unclosed quotes."""
        if '"' not in line and self.separator == " ":
            return line.split()
        if '"' not in line:  # three times as fast as csv
            return [cell.strip() for cell in line.split(self.separator)] if line else []
        if self.separator == " ":
            line = " ".join(line.split())
        reader = csv.reader([line], delimiter=self.separator, skipinitialspace=True, strict=True)
        return [cell.strip() for cell in next(reader, [])]

    def number(self, cell: Any) -> float | None:
        """The number in a cell, perhaps with E or Fortran's D exponent; None if it is none."""
        if not self.decimal:
            is_number = isinstance(cell, (int, float)) and not isinstance(cell, bool)
            return float(cell) if is_number else None
        if len(cell) > LONGEST_NUMBER:
            return None
        text = cell.replace("\N{MINUS SIGN}", "-")
        if self.decimal == ",":
            text = text.replace(",", ".") if "." not in text else ""
        if found := _NUMBER.fullmatch(text):
            mantissa, exponent, bare = found.groups()  # Fortran writes 1.0-105 for 1.0D-105
            return float(f"{mantissa}e{exponent or bare or 0}")
        return float(text) if text.lower().lstrip("+-") in ("nan", "inf", "infinity") else None

    def marked(self, cell: str) -> bool:
        """True for a number that may have thousands separators or another decimal mark."""
        return len(cell) < LONGEST_NUMBER and self.number(_MARKS.sub("", cell)) is not None

    def numbers(self, cells: Sequence[Any]) -> Array | None:
        """The numbers in cells; None if any cell is not a number."""
        if not self.decimal:
            are_numbers = {*map(type, cells)} <= {int, float}
            return np.array(cells, dtype=np.float64) if are_numbers else None
        joined = "\n".join(cells)
        if "_" not in joined and (self.decimal == "." or "." not in joined):
            with suppress(ValueError):
                return np.array(joined.replace(self.decimal, ".").split("\n"), dtype=np.float64)
        found = [self.number(cell) for cell in cells]
        return None if None in found else np.array(found, dtype=np.float64)


#: Styles in order of preference, for files that allow several.
STYLES = [Style(*pair) for pair in (",.", ";.", ";,", "\t.", "\t,", " .", " ,")]


class _Row(NamedTuple):
    """A line of a file: its number, text and cells; `wrong` is the error if splitting failed."""

    number: int
    text: str
    cells: list[str]
    wrong: str = ""


class Cells(NamedTuple):
    """The cells of a file by column."""

    header: list[str] | None
    columns: list[Sequence[Any]]
    rows: list[str]  # the name of each row in messages
    lines: list[str]  # the text of each row, "" in files of arrays
    style: Style
    comments: Sequence[str] = ()
    mistakes: Sequence[str] = ()  # messages on rows that are left out

    def column(self, place: int) -> NDArray[Any]:
        """A column as numbers if all of its cells are, else as text."""
        numbers = self.style.numbers(self.columns[place])
        return np.array([str(cell) for cell in self.columns[place]]) if numbers is None else numbers


def read_cells(path: Path, known: Sequence[str] = (), *, is_map: bool = False) -> Cells:
    """The cells of a text file or workbook. Raises FileError if the file is empty or not text.

    known : names of columns, in lower case; if half of a last comment are these, it is the header
    is_map : True for a map of heights: text above the numbers is a comment, unless it has as many
        cells as they, and empty cells may be holes
    """
    lines, comments = list[tuple[int, str]](), list[str]()
    separator, sheet, numbered = "", "", _lines(path)
    if path.suffix.lower() in WORKBOOKS:
        separator = "\t"
        sheet, numbered = _sheet(path, is_map)
    for number, line in numbered:
        text = line.strip("\r\n")
        inner = text.strip()
        if not lines and not separator and re.fullmatch(r"sep=.", inner):  # written by Excel
            separator = inner[-1]
        elif not lines and _COMMENT.match(inner):
            comments.append(inner)
        elif inner or "\t" in text:
            text = _NO_DATA.sub("nan", text) if is_map else text
            lines.append((number, text if separator or "\t" in text else text.strip()))
    styles = [Style(separator, mark, sheet) for mark in ".,"] if separator else STYLES
    style = _sniffed([text for _, text in lines] or [""], styles[:1] if sheet else styles)
    rows = [_row(number, text, style) for number, text in lines]
    filled = [i for i, row in enumerate(rows) if any(row.cells) or row.wrong]
    if not filled:
        raise FileError(f"{path}: empty")
    rows = rows[filled[0] : filled[-1] + 1] if is_map else [rows[i] for i in filled]
    if is_map:
        heights = next((row for row in rows if _numeric(row.cells, style)), rows[-1])
        widths = (_width(_names(row.text, style)) for row in rows)
        start = [*widths].index(_width(_names(heights.text, style)))
        for row in rows[:start]:
            if row.wrong or (row.cells and style.number(row.cells[0]) is not None):
                expected = "heights, as in the rows below, or text that begins with no number"
                raise InputError(f"row {row.number}", found=shortened(row.text), expected=expected)
        comments += [row.text for row in rows[:start] if any(row.cells)]
        rows = rows[start:]
    is_header = not _numeric(rows[0].cells, style) and not all(map(style.marked, rows[0].cells))
    header = _names(rows[0].text, style) if is_header else None
    rows = rows[1:] if header else rows
    if comments and not header:
        last = comments[-1].lstrip("#% ").rstrip(",;\t ")
        for names in (_names(last, style), _APART.split(_UNIT_APART.sub("", last))):
            wanted = sum(bare(name).lower() in known for name in names)
            if 2 * wanted >= min(len(names), 4) and len(names) == _width(rows[0].cells):
                header = [name.strip(",;") for name in names]
        comments = comments[:-1] if header else comments
    if is_map and not header and _width(rows[0].cells) != 3:  # else a list
        _refuse_gaps([row.number for row in rows])
    return _by_column(header, rows, style, comments)


def _refuse_gaps(rows: Sequence[int]) -> None:
    """Raise InputError for empty lines between the rows of a matrix, as between two maps."""
    apart = np.diff(rows)
    if len(gaps := np.flatnonzero(apart > min(apart, default=1))):
        found = f"lines without numbers between rows {rows[gaps[0]]} and {rows[gaps[0] + 1]}"
        expected = "one map in a file: remove empty lines between its rows"
        raise InputError("rows", found=found, expected=expected)


def _by_column(
    header: list[str] | None, rows: Sequence[_Row], style: Style, comments: Sequence[str]
) -> Cells:
    """The cells, without empty ones at the ends of rows, and a mistake for each row that has not as
    many as the header or most rows."""
    widths = [_width(row.cells) for row in rows]
    width = _width(header) if header else max(widths)
    counts = [min(len(row.cells), max(width, each)) for row, each in zip(rows, widths, strict=True)]
    width = width if header else Counter(counts).most_common(1)[0][0]
    mistakes, whole = list[str](), list[_Row]()
    for row, count in zip(rows, counts, strict=True):
        wrong, name = row.wrong, next(filter(None, row.cells), "")
        if not wrong and count != width:
            wrong = f"found {count} cells, expected {width}, as in "
            wrong += "the header" if header else "most rows"
        elif name.rstrip(" :=").lower() in TOTALS:
            wrong = f'found a row of "{name}", expected none: remove it'
        if wrong:
            mistakes.append(f"row {row.number}: {wrong}: {shortened(row.text)}")
        else:
            whole.append(row)
    return Cells(
        header[:width] if header else None,
        [[row.cells[i] for row in whole] for i in range(width)],
        [f"row {row.number}" for row in whole],
        [row.text for row in whole],
        style if width > 1 or style.decimal == "," else style._replace(separator=""),
        comments,
        mistakes,
    )


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """The numbered lines of a file, gzipped or not; bytes that are not UTF-8 are Latin-1."""
    with path.open("rb") as packed:
        is_packed = packed.peek(2)[:2] == b"\x1f\x8b"
        raw: Any = BufferedReader(GzipFile(fileobj=packed)) if is_packed else packed
        encoding = _encoding(path, raw)
        with TextIOWrapper(raw, encoding=encoding, errors="surrogateescape") as file:
            for number, line in enumerate(iter(partial(file.readline, LONGEST + 1), ""), 1):
                if len(line) > LONGEST:
                    raise FileError(f"{path}: row {number}: longer than {LONGEST:,} characters")
                if "\0" in line:
                    raise FileError(f"{path}: row {number}: not text")
                if _SURROGATE.search(line):
                    line = line.encode("utf-8", "surrogateescape").decode("latin-1")
                yield number, line


def _sheet(path: Path, is_map: bool) -> tuple[str, Iterator[tuple[int, str]]]:
    """The name of the first sheet with cells, with the number of such sheets; and its numbered
    rows, separated by tabs."""
    openpyxl = needed("openpyxl")

    def line(row: Sequence[Any]) -> str:
        cells = (str("" if cell is None else cell).replace('"', "") for cell in row)
        return "\t".join(" ".join(cell.split()) for cell in cells)

    with path.open("rb") as raw, foreign():
        book = openpyxl.load_workbook(raw, read_only=True, data_only=True)
        pages = {it.title: [*map(line, it.iter_rows(values_only=True))] for it in book.worksheets}
    filled = [f'"{name}"' for name, rows in pages.items() if any(map(str.strip, rows))]
    if len(filled) != 1 and (is_map or not filled):
        found = f"cells in the sheets {', '.join(filled) or 'none'}"
        raise FileError(f"{path}: found {found}, expected one sheet with cells")
    count = f" of {len(filled)}" * (len(filled) > 1)
    return filled[0] + count, enumerate(pages[filled[0][1:-1]], 1)


def _encoding(path: Path, raw: BufferedReader[Any]) -> str:
    head = raw.peek(64)[:64]
    for magic, what in _BINARY.items():
        if head.startswith(magic) or head.lstrip().lower().startswith(magic):
            raise FileError(f"{path}: not text: {what}")
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    for encoding, low in (("utf-16-le", 0), ("utf-16-be", 1)):
        if len(head) > 3 and all(head[low::2]) and not any(head[1 - low :: 2]):
            return encoding
    return "utf-8-sig"


def _sniffed(lines: Sequence[str], styles: Sequence[Style]) -> Style:
    """The style in which most lines have equally many cells, and most cells are numbers."""
    marked = (line for line in lines[SAMPLE:-SAMPLE] if "," in line or "." in line)
    last = lines[max(SAMPLE, len(lines) - SAMPLE) :]
    sample = [*lines[:SAMPLE], *islice(marked, LATER), *last]

    def score(style: Style) -> float:
        rows = [_row(0, line, style).cells for line in sample]
        widths = [*map(_width, rows)]
        width, _ = Counter(widths[1:] or widths).most_common(1)[0]
        cells = [cell for row in rows[1:] or rows for cell in row if cell]
        numbers = sum(
            0.5 * style.marked(cell) if style.number(cell) is None else 1.0 for cell in cells
        )
        doubtful = style.decimal == "," in lines[0] and not _numeric(rows[0], style)
        equal = widths.count(width) / len(rows)
        return equal * numbers / max(1, len(cells)) * (0.5 if doubtful else 1.0)

    return max(styles, key=score)


def _row(number: int, text: str, style: Style) -> _Row:
    try:
        return _Row(number, text, style.split(text))
    except csv.Error:
        return _Row(number, text, [], "found quotes that do not end on this line")


def _names(text: str, style: Style) -> list[str]:
    """The cells of a header line: names of columns, each perhaps followed by a unit in brackets."""
    row = _row(0, _UNIT_APART.sub("", text) if style.separator == " " else text, style)
    return row.cells or [text]


def _numeric(cells: Sequence[str], style: Style) -> bool:
    return any(cells) and all(
        cell.lower() in HOLES or style.number(cell) is not None for cell in cells
    )


def _width(cells: Sequence[str]) -> int:
    """The number of cells without empty ones at the end, which trailing separators cause."""
    return max((i for i, cell in enumerate(cells, 1) if cell), default=0)
