"""Printed tables, for a terminal and for Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from decimal import ROUND_CEILING, Context
from typing import Any

#: A table: a row of headings, then rows with the same number of cells.
PrintedTable = Sequence[Sequence[Any]]


def labelled(lines: Iterable[tuple[str, str]], width: int = 18) -> list[str]:
    """One line for each pair of a name and a text; all texts begin in the same column."""
    return [f"{name:<{width}}{text}" for name, text in lines]


def aligned(table: PrintedTable, *, left: int = 0, digits: int = 6) -> list[str]:
    """The lines of a table; the first `left` columns are aligned left, the others right."""
    return ["  ".join(row).rstrip() for row in _padded(table, left, digits)]


def markdown(table: PrintedTable, *, left: int) -> list[str]:
    """The lines of a table in Markdown, aligned as by `aligned`."""
    rows = _padded(table, left, digits=6)
    rule = ["-" * max(3, len(cell)) for cell in rows[0]]
    rule = [each if column < left else f"{each[:-1]}:" for column, each in enumerate(rule)]
    return [f"| {' | '.join(row)} |" for row in [rows[0], rule, *rows[1:]]]


def bound(value: float, digits: int = 3) -> str:
    """An upper bound as text, rounded up to some digits; "unknown" if it is infinite."""
    if not math.isfinite(value):
        return "unknown"
    rounded = Context(prec=digits, rounding=ROUND_CEILING).create_decimal(str(float(value)))
    return f"{float(rounded):g}"


def _padded(table: PrintedTable, left: int, digits: int) -> list[list[str]]:
    cells = [[_cell(value, digits) for value in row] for row in table]
    columns = [*zip(*cells, strict=True)]
    for i, column in enumerate(columns):
        width = max(map(len, column))
        columns[i] = tuple(it.ljust(width) if i < left else it.rjust(width) for it in column)
    return [[*row] for row in zip(*columns, strict=True)]


def _cell(value: Any, digits: int) -> str:
    if value is None:
        return "-"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)
