"""Tables in text files, with any separator, decimal commas, comments, titles and encodings.

csv.Sniffer and numpy.loadtxt support no decimal commas and no D exponents; pandas and polars stop
at the first mistake without showing the line. So this module chooses the separator and the decimal
mark itself.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from gzip import GzipFile
from io import BufferedReader, TextIOWrapper
from itertools import islice, zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import FileError, InputError, needed
from convexrough.tabular.arrays import foreign
from convexrough.tabular.roles import is_index, shortened, totals
from convexrough.tabular.units import bare, parsed, unit

#: Largest number of characters of a line, and of a number.
LONGEST, LONGEST_NUMBER = 2**24, 400

#: Extensions of Excel workbooks.
WORKBOOKS = (".xlsx", ".xlsm")

#: The separator and the decimal mark are chosen by means of the first SAMPLE lines, and of at most
#: LATER other lines that contain a comma or a point.
SAMPLE, LATER = 200, 20

#: Cells that mean an unknown number, in lower case.
HOLES = ("", "bad", "nan", "na", "n/a", "#n/a", "#nv", "none", "null", "---", "***")

#: The sign # that starts a comment, but not the # in #N/A and other errors of spreadsheets in any
#: language, such as #NV and #¡VALOR!; nor ####, for a narrow column, if another cell follows.
_SIGN = r"#(?!(?-i:[¡¿]?[^\W\d_a-zß-ÿ]+[/!?]|NV(?![^\s,;]))|#{3,} *[,;\t]|##[# ]{0,99}\s[-+.,\d])"

#: The beginning of a line that is a comment, and of a comment that follows cells on a line.
COMMENT, _BEHIND = re.compile(f"{_SIGN}|%"), re.compile(rf"(?<![^\s,;]){_SIGN}")

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[eEdD]([+-]?\d+)|([+-]\d{3}))?")
#: `_GROUPED`: a number whose digits are certainly in groups of three, such as 1,234,567.
#: `PERHAPS_GROUPED`: a number such as 3,134, whose mark can also precede three decimals.
_GROUPED = re.compile(
    r"[+-]?[1-9]\d{0,2}(?:,(?:\d{3},)*\d{3}(?:\.\d*|,\d{3})|\.(?:\d{3}\.)*\d{3}(?:,\d*|\.\d{3})"
    r"|(?:['\u2019\xa0\u202f ]\d{3})+(?:[.,]\d*)?)"
)
PERHAPS_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
#: What instruments write for a hole. Spaces may separate columns, so this is replaced.
_NO_DATA = re.compile(r"\bno data\b", re.I)
_SURROGATE = re.compile("[\udc80-\udcff]")
#: The separators in a comment that may be a header.
_APART = re.compile(r"\s*[,;\s]\s*")
_UNIT_APART = re.compile(r"(?<!\s)\s+(?=[\[(])")
#: A line of only dashes, equals signs, asterisks or underscores, which separates parts of a file.
_RULE = re.compile(r"[-=*_]{3,}(\s+[-=*_]{3,})*")
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


class TextRow(NamedTuple):
    """A line of a file: its number, text and cells; `wrong` is the error if splitting failed."""

    number: int
    text: str
    cells: list[str]
    wrong: str = ""


#: Headers of columns with the row and column numbers of a matrix.
PLACES = ("row", "col", "column", "i", "j", "zeile", "spalte")


class TextTable(NamedTuple):
    """The header of a file (a row of names) or None; the other rows; the style; the comments."""

    header: TextRow | None
    rows: list[TextRow]
    style: Style
    comments: list[str]


def read_text_table(
    path: Path,
    known: Sequence[str] = (),
    comment: re.Pattern[str] = COMMENT,
    required: Sequence[str] = (),
    *,
    is_map: bool = False,
) -> TextTable:
    """The cells of a text file or workbook. Raises FileError if the file is empty or not text.

    known : names of columns, in lower case; the line with most of them is the header
    required : names of columns; the sheet of a workbook with most of them, then of `known`, is read
    is_map : True for a map of heights; exactly one sheet of a workbook must hold a map. Lines
        of text above the numbers that are not a header are comments
    """
    lines: list[tuple[int, str]] = []
    comments: list[str] = []
    titles, separator, sheet = list[tuple[int, str]](), "", ""
    units: list[str] = []
    numbered = _lines(path)
    if path.suffix.lower() in WORKBOOKS:
        separator = "\t"
        sheet, numbered, comments = _sheet_lines(path, known, required, is_map)
    for number, line in numbered:
        text = line.strip("\r\n")
        text = _NO_DATA.sub("nan", text) if is_map else text
        inner = text.strip()
        if not lines and not separator and re.fullmatch(r"sep=.", inner):  # written by Excel
            separator = inner[-1]
        elif comment.match(inner):
            comments.append(inner)
            said = inner.lstrip("#% ")
            if not units and _are_units(cells := _APART.split(said)):
                units = cells
            else:
                titles.append((number, said))
        elif ("\t" in text or inner) and not _is_rule(inner):
            text, *behind = [text] if '"' in text else _BEHIND.split(text, maxsplit=1)
            comments += behind if not lines else ()
            lines.append((number, text if separator or "\t" in text else text.strip()))
    if not lines:
        raise FileError(f"{path}: empty")
    styles = [Style(separator, mark, sheet) for mark in ".,"] if separator else STYLES
    style = _sniffed([text for _, text in lines], styles)
    _check_ungrouped(path, lines[:: 1 + len(lines) // SAMPLE], style)
    every = [_row(number, text, style) for number, text in lines]
    filled = [row for row in every if any(row.cells) or row.wrong]  # Excel writes empty rows as ;;
    rows = [row for row in filled if not _RULE.fullmatch(row.text.strip())]
    if not rows:
        raise FileError(f"{path}: empty")
    above, (header, rows) = rows, _headed(rows, titles, style, known, is_map)
    found = {bare(cell).lower() for cell in header.cells} if header else set()
    wanted = {it for it in known if not is_index(it)} if {*required[:1]} <= found else None
    if header and not is_map and (also := _also_heading(header, above, style, wanted)):
        both = f"rows {min(header.number, also)} and {max(header.number, also)}"
        expected = "the names of all columns in one row: unmerge cells and delete the other row"
        raise FileError(f"{path}: {both}: found a heading over two rows, expected {expected}")
    top = header.number if header and header.number else rows[0].number
    comments += [row.text for row in above if row.number < top]
    if header:
        below = rows[0].cells if rows else []
        if _are_units(below) and len(below) <= len(header.cells):
            units, rows = below, rows[1:]
        elif len(units) != len(header.cells) or any(map(unit, header.cells)):
            units = []
        named = zip_longest(header.cells, (each.strip("[]() -") for each in units), fillvalue="")
        names = [f"{name} [{each}]" if each else name for name, each in named]
        header = header._replace(cells=names)
    elif len(rows[0].cells) > 3:  # a matrix, whose rows can be without numbers
        top = top if above[0].number < top else filled[0].number
        rows = [row for row in every if top <= row.number <= filled[-1].number]
    return TextTable(*_trimmed(header, rows, style), style, comments)


def _headed(
    rows: list[TextRow],
    titles: Sequence[tuple[int, str]],
    style: Style,
    known: Sequence[str],
    is_map: bool,
) -> tuple[TextRow | None, list[TextRow]]:
    """The header, from the rows or the last of the numbered titles, or None; and the rows below."""

    def wanted(names: list[str]) -> int:
        return sum(bare(name).lower() in known for name in names)

    first = next((i for i, row in enumerate(rows) if _numeric(row.cells, style)), len(rows))
    width = len(rows[first].cells) if first < len(rows) else 0
    if first == 0:
        title = next((said for number, said in titles[::-1] if number < rows[0].number), "")
        for named in (_header(title, style), _APART.split(title.strip())):
            count = wanted(named) + sum(name.lower() in PLACES for name in named)
            if len(named) == width and (count >= 2 or 2 * count >= width):
                return TextRow(0, title, named), rows
        return None, rows
    headers = [_header(row.text, style) for row in rows[: min(first, SAMPLE)]]
    place = max(
        range(len(headers)), key=lambda i: (wanted(headers[i]), len(headers[i]) == width, -i)
    )
    filled = sum(map(bool, map(str.strip, headers[place])))  # rows of a sheet have empty cells, too
    if is_map and 0 < width != filled and wanted(headers[place]) < 2:
        for row in rows[:first]:
            if 2 * sum(style.number(cell) is not None for cell in row.cells) >= len(row.cells):
                there = f"row {rows[first].number}"
                expected = f"{width} heights, as in {there}, or text; or delete the lines above "
                expected += f"{there} (if y falls from row to row, reverse the rows) and give "
                expected += "--pixel, --unit and --height-unit"
                raise InputError(f"row {row.number}", found=shortened(row.text), expected=expected)
        return _headed(rows[first:], titles, style, known, is_map)
    line, names, rows = rows[place], headers[place], rows[place + 1 :]
    if style.separator == " " and rows:
        first = first - place - 1 if width else 0
        width = len(rows[first].cells)
        apart = re.split(r"\s{2,}", line.text.strip())
        names = apart if len(apart) == width < len(names) else names
        rows = _unlisted(line, rows, first, style)
    return line._replace(cells=names), rows


def _also_heading(
    header: TextRow, rows: list[TextRow], style: Style, wanted: Container[str] | None
) -> int:
    """The number of a row above or below the header that names columns which the header does not
    name, as under merged cells of a sheet; 0 if there is none. If names are `wanted`, others do not
    count: they may be titles."""
    for row in rows[: SAMPLE + 1] if style.separator != " " else ():
        if abs(row.number - header.number) != 1 or _are_units(row.cells):
            continue
        columns = zip_longest(header.cells, row.cells, rows[-1].cells, fillvalue="")
        names = [cell for name, cell, last in columns if cell and last and not name]
        names = [it for it in names if wanted is None or bare(it).lower() in wanted]
        if names and all(style.number(cell) is None for cell in row.cells):
            return row.number
    return 0


def _are_units(cells: Sequence[str]) -> bool:
    """True for a line of units, perhaps in brackets; a cell may be a dash or empty."""
    bared = [cell.strip("[]() ") for cell in cells]
    return any(bared) and all(cell in ("", "-") or parsed(cell) is not None for cell in bared)


def _unlisted(header: TextRow, rows: list[TextRow], first: int, style: Style) -> list[TextRow]:
    """The rows of a finite-element listing, of which `rows[first]` is the first with numbers,
    without titles, repeated headers and closing lines."""
    width = len(rows[first].cells)

    def numbers(row: TextRow) -> list[bool]:
        return [style.number(cell) is not None for cell in row.cells]

    def title(row: TextRow) -> bool:
        are = numbers(row)
        most = all(are[-2:]) or 2 * sum(are) > len(are)  # are numbers, so it is a row with a slip
        return len(are) not in (0, width) and not (are[0] or most)

    kept = [row for row in rows[:first] if not title(row)]
    for row in rows[first:]:
        if row.cells != header.cells:
            kept.append(row)
        else:
            while kept and title(kept[-1]):
                kept.pop()
    led = [any(numbers(row)[:1]) for row in kept]
    count = [*led, False].index(False)
    if not count or any(led[count:]):  # words in front are labels or slips
        return kept
    closing = (i for i, row in enumerate(kept) if not led[i] and (title(row) or totals(row.cells)))
    return kept[: next(closing, None)]


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


def _sheet_lines(
    path: Path, known: Sequence[str], required: Sequence[str], is_map: bool
) -> tuple[str, Iterator[tuple[int, str]], list[str]]:
    """The sheet that `read_text_table` reads: its name, the number of sheets, and others that
    fit equally well; its numbered rows, separated by tabs; and, for a map, rows of other sheets."""
    openpyxl = needed("openpyxl")
    with path.open("rb") as raw, foreign():
        book = openpyxl.load_workbook(raw, read_only=True, data_only=True)
        pages = {
            page.title: [*map(_plain, page.iter_rows(values_only=True))] for page in book.worksheets
        }

    def value(rows: list[list[str]]) -> tuple[int, int]:
        names = {bare(cell).lower() for row in rows[:SAMPLE] for cell in row}
        wanted, others = (len(names & {*each}) for each in (required, known))
        return wanted, min(others, 1) if wanted else others

    values = {name: value(rows) for name, rows in pages.items()}
    best, *others = [name for name in pages if values[name] == max(values.values())]
    if values[best] == (0, 0):
        others = []
    aside: list[str] = []
    if is_map and len(pages) > 1:
        best, *others = [name for name, rows in pages.items() if _holds_map(rows)] or ["", *pages]
        if others:
            named = " and ".join(f'"{name}"' for name in (best, *others) if name)
            found = f"{'maps' if best else 'no map'} in the sheets {named}"
            expected = "one sheet with three or more rows of numbers; delete other such sheets"
            raise FileError(f"{path}: found {found}, expected {expected}")
        aside = [" ".join(row) for name in pages if name != best for row in pages[name]]
    also = " or ".join(f'"{name}"' for name in others)
    count = f" of {len(pages)}" * (len(pages) > 1)
    name = f'"{best}"{count}' + (f", not {also}" if also else "")
    return name, enumerate(map("\t".join, pages[best]), 1), aside


def _holds_map(rows: Iterable[Sequence[str]]) -> bool:
    """True if at least three rows hold at least three numbers, True or False each."""
    style = Style("\t", ".")

    def numbers(row: Sequence[str]) -> int:
        return sum(cell in ("True", "False") or style.number(cell) is not None for cell in row)

    return len([*islice((row for row in rows if numbers(row) >= 3), 3)]) == 3


def _plain(row: Sequence[Any]) -> list[str]:
    """The texts of cells, each on one line, without quotes and with a decimal point. Beside numbers
    a text such as 1,257 is left as it is, since its comma may separate thousands."""
    texts = [" ".join(str("" if cell is None else cell).replace('"', "").split()) for cell in row]
    number, doubtful = Style("\t", ",").number, any(isinstance(cell, float) for cell in row)
    return [
        text if number(text) is None or (doubtful and PERHAPS_GROUPED.fullmatch(text))
        else text.replace(",", ".") for text in texts
    ]  # fmt: skip


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
    marked = (line for line in islice(lines, SAMPLE, None) if "," in line or "." in line)
    sample = [*lines[:SAMPLE], *islice(marked, LATER)]

    def score(style: Style) -> float:
        rows = [_row(0, line, style) for line in sample]
        body = rows[1:] or rows
        widths = [_width(row.cells) for row in rows]
        width, _ = Counter(widths[1:] or widths).most_common(1)[0]
        cells = [cell for row in body for cell in row.cells if cell]
        numbers = sum(style.number(cell) is not None for cell in cells)
        doubtful = style.decimal == "," in lines[0] and not _numeric(rows[0].cells, style)
        equal = widths.count(width) / len(rows)
        return equal * numbers / max(1, len(cells)) * (0.5 if doubtful else 1.0)

    return max(styles, key=score)


def _is_rule(line: str) -> bool:
    """True for a rule between parts of a file, but not for several marks of holes such as ---."""
    cells = line.split()
    holes = len(cells) > 1 and all(cell.lower() in HOLES for cell in cells)
    return not holes and _RULE.fullmatch(line) is not None


def _check_ungrouped(path: Path, lines: Sequence[tuple[int, str]], style: Style) -> None:
    """Raise FileError for numbers that certainly have thousands separators."""
    for number, line in lines:
        separator = next((each for each in ";\t" if each in line), style.separator)
        if separator == "," and '"' not in line:
            continue  # a comma separates
        row = _row(number, line, Style(separator, "."))
        for cell in line.split() if separator == " " else row.cells:
            if _GROUPED.fullmatch(cell):
                expected = "numbers without thousands separators"
                raise FileError(f"{path}: row {number}: found {cell}, expected {expected}")


def _row(number: int, text: str, style: Style) -> TextRow:
    try:
        return TextRow(number, text, style.split(text))
    except csv.Error:
        return TextRow(number, text, [], "found quotes that do not end on this line")


def _header(text: str, style: Style) -> list[str]:
    """The cells of a header line: names of columns, each perhaps followed by a unit in brackets."""
    row = _row(0, _UNIT_APART.sub("", text) if style.separator == " " else text, style)
    return row.cells or [text]


def _numeric(cells: Sequence[str], style: Style) -> bool:
    return any(cells) and all(
        cell.lower() in HOLES or style.number(cell) is not None for cell in cells
    )


def _width(cells: Sequence[str]) -> int:
    """The number of cells without empty ones at the end, which trailing separators cause."""
    width = len(cells)
    while width and not cells[width - 1]:
        width -= 1
    return width


def _trimmed(
    header: TextRow | None, rows: list[TextRow], style: Style
) -> tuple[TextRow | None, list[TextRow]]:
    """Header and rows without empty cells at the end; the name of R's row numbers is ""."""
    widths = [_width(row.cells) for row in rows]
    width = max(widths, default=0)
    if header:
        names = header.cells[: _width(header.cells)]
        if style.separator in " \t" and {*widths} == {len(names) + 1}:
            count = {style.number(row.cells[0]) for row in rows}
            if count in ({*range(len(rows))}, {*range(1, len(rows) + 1)}):
                names = ["", *names]
        header, width = header._replace(cells=names), len(names)
    return header, [
        row if len(row.cells) <= width else row._replace(cells=row.cells[: max(width, own)])
        for row, own in zip(rows, widths, strict=True)
    ]
