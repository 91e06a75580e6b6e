"""Text files of numbers as people have them: separators, decimal commas, comments, encodings.

Readers that do this exist. Those that are light (csv.Sniffer, numpy.loadtxt) know neither decimal
commas nor D exponents; those that are not (pandas, polars) stop at the first mistake and do not
show its line. So the standard library splits the lines, and what is here chooses how.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from io import BufferedReader, TextIOWrapper
from pathlib import Path
from typing import NamedTuple

from convexrough.errors import FileError

#: Characters of a line; a longer one is no table.
LONGEST = 2**24

#: Characters of a number, and of a column's name with its unit; longer ones are neither.
LONGEST_NUMBER, LONGEST_NAME = 400, 400

#: Lines from which separator and decimal mark are chosen.
SAMPLE = 200

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[eEdD]([+-]?\d+)|([+-]\d{3}))?")
_SURROGATE = re.compile("[\udc80-\udcff]")
_WITH_UNIT = re.compile(r"(?P<name>.*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])]|\s/\s*(?P<per>\S+))")
_UNIT_APART = re.compile(r"(?<!\s)\s+(?=[\[(])")
_BINARY = {
    b"PK\x03\x04": "an archive or an Excel workbook; save it as CSV",
    b"MATLAB": "a MAT-file; writematrix saves CSV",
    b"\x89HDF": "an HDF5 or MAT-file; save it as CSV",
    b"\xd0\xcf\x11\xe0": "an Excel workbook; save it as CSV",
    b"\x93NUMPY": "a NumPy array; name it .npy",
    b"PAR1": "a Parquet file; name it .parquet",
}


class Style(NamedTuple):
    """How the cells of a line are told apart, and how their decimals are."""

    separator: str
    decimal: str

    def __str__(self) -> str:
        names = {",": "commas", ";": "semicolons", "\t": "tabs", " ": "spaces"}
        comma = ", decimal comma" if self.decimal == "," else ""
        return f"separated by {names.get(self.separator, repr(self.separator))}{comma}"

    def split(self, line: str) -> list[str]:
        """The cells of a line. Raises csv.Error for quotes that do not end."""
        if self.separator == " ":
            line = " ".join(line.split())
        reader = csv.reader([line], delimiter=self.separator, skipinitialspace=True, strict=True)
        return [cell.strip() for cell in next(reader, [])]

    def number(self, cell: str) -> float | None:
        """What a cell says, with E or Fortran's D exponent; None where that is no number."""
        if len(cell) > LONGEST_NUMBER:
            return None
        text = cell.replace("\N{MINUS SIGN}", "-")
        if self.decimal == ",":
            text = text.replace(",", ".") if "." not in text else ""
        if found := _NUMBER.fullmatch(text):
            mantissa, exponent, bare = found.groups()  # Fortran writes 1.0-105 for 1.0D-105
            return float(f"{mantissa}e{exponent or bare or 0}")
        return float(text) if text.lower().lstrip("+-") in ("nan", "inf", "infinity") else None


#: In the order in which they are preferred where several would do.
STYLES = [Style(*pair) for pair in (",.", ";.", ";,", "\t.", "\t,", " .", " ,")]


class Row(NamedTuple):
    """A line of a file: its number there, its text, and its cells; `wrong` if it has none."""

    number: int
    text: str
    cells: list[str]
    wrong: str = ""


class TextTable(NamedTuple):
    """The rows of a file below its header, which is None where it has none."""

    header: list[str] | None
    rows: list[Row]
    style: Style


def bare(name: str) -> str:
    """The name of a column without its unit."""
    found = _with_unit(name)
    return found["name"] if found else name


def unit(name: str) -> str:
    """The unit that the name of a column has in brackets or after a slash, or ""."""
    found = _with_unit(name)
    return (found["unit"] or found["per"] or "").strip() if found else ""


def _with_unit(name: str) -> re.Match[str] | None:
    return _WITH_UNIT.fullmatch(name) if len(name) <= LONGEST_NAME else None


def read_text_table(path: Path, known: Sequence[str] = ()) -> TextTable:
    """The cells of a text file. Raises FileError where it is empty, too long or no text.

    known : names of columns by which a comment is known for a header, as numpy.savetxt writes it
    """
    lines: list[tuple[int, str]] = []
    comment, style = "", None
    for number, line in lines_of(path):
        text = line.strip("\r\n")
        inner = text.strip()
        if not lines and style is None and re.fullmatch(r"sep=.", inner):  # Excel
            style = Style(inner[-1], ".")
        elif inner.startswith(("#", "%")):
            comment = comment if lines else inner.lstrip("#%")
        elif inner:
            text = text if '"' in text else text.partition("#")[0]
            lines.append((number, text if style or "\t" in text else text.strip()))
    if not lines:
        raise FileError(f"{path}: empty")
    texts = [text for _, text in lines]
    style = sniff(
        texts[:SAMPLE], [Style(style.separator, mark) for mark in ".,"] if style else STYLES
    )
    rows = [_row(number, text, style) for number, text in lines]
    header = None
    if not _numeric(rows[0].cells, style):
        header, rows = _header(rows[0].text, style), rows[1:]
    elif len(named := _header(comment, style)) == len(rows[0].cells):
        header = named if any(bare(name).lower() in known for name in named) else None
    return TextTable(*_trimmed(header, rows, style), style)


def lines_of(path: Path) -> Iterator[tuple[int, str]]:
    """Lines with their numbers. Bytes that are not UTF-8 are taken for Latin-1."""
    with path.open("rb") as raw:
        encoding = _encoding(path, raw)
        number = 0
        with TextIOWrapper(raw, encoding=encoding, errors="surrogateescape") as file:
            while line := file.readline(LONGEST + 1):
                number += 1
                if len(line) > LONGEST:
                    raise FileError(f"{path}: row {number}: longer than {LONGEST:,} characters")
                if "\0" in line:
                    raise FileError(f"{path}: row {number}: not text")
                if _SURROGATE.search(line):
                    line = line.encode("utf-8", "surrogateescape").decode("latin-1")
                yield number, line


def _encoding(path: Path, raw: BufferedReader) -> str:
    head = raw.peek(64)[:64]
    for magic, what in _BINARY.items():
        if head.startswith(magic):
            raise FileError(f"{path}: not text: {what}")
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if len(head) > 3 and not any(head[1::2]) and all(head[0::2]):
        return "utf-16-le"
    if len(head) > 3 and not any(head[0::2]) and all(head[1::2]):
        return "utf-16-be"
    return "utf-8-sig"


def sniff(lines: Sequence[str], styles: Sequence[Style]) -> Style:
    """The style in which most lines have equally many cells, and most of these are numbers."""

    def score(style: Style) -> float:
        rows = [_row(0, line, style) for line in lines]
        body = rows[1:] or rows
        width, _ = Counter(len(_stripped(row.cells)) for row in body).most_common(1)[0]
        equal = sum(len(_stripped(row.cells)) == width for row in rows) / len(rows)
        cells = [cell for row in body for cell in row.cells if cell]
        numbers = sum(style.number(cell) is not None for cell in cells)
        doubtful = style.decimal == "," in lines[0] and not _numeric(rows[0].cells, style)
        return equal * numbers / max(1, len(cells)) * (0.5 if doubtful else 1.0)

    return max(styles, key=score)


def _row(number: int, text: str, style: Style) -> Row:
    try:
        return Row(number, text, style.split(text))
    except csv.Error as error:
        return Row(number, text, [], str(error))


def _header(text: str, style: Style) -> list[str]:
    """Names of columns; a unit after a space stays with its name."""
    row = _row(0, _UNIT_APART.sub("", text) if style.separator == " " else text, style)
    return row.cells or [text]


def _numeric(cells: Sequence[str], style: Style) -> bool:
    return all(style.number(cell) is not None for cell in cells if cell)


def _stripped(cells: list[str]) -> list[str]:
    """Without the empty cells that separators at the end of a line make."""
    end = len(cells)
    while end and not cells[end - 1]:
        end -= 1
    return cells[:end]


def _trimmed(
    header: list[str] | None, rows: list[Row], style: Style
) -> tuple[list[str] | None, list[Row]]:
    """Without separators at the ends of lines, and with a name for the row names that R writes."""
    if header is None:
        width = max((len(_stripped(row.cells)) for row in rows), default=0)
    else:
        header = _stripped(header)
        width = len(header)
        longer = [row.cells for row in rows if len(_stripped(row.cells)) == width + 1]
        if style.separator in " \t" and longer and len(longer) == len(rows):
            count = [style.number(cells[0]) for cells in longer]
            if count in ([*range(len(rows))], [*range(1, len(rows) + 1)]):
                header, width = ["", *header], width + 1
    return header, [
        row._replace(cells=[*row.cells[:width], *_stripped(row.cells[width:])]) for row in rows
    ]
