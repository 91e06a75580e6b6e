"""Tables of text, for a terminal and for Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence

#: A table: a heading, and rows of as many cells.
TextTable = Sequence[Sequence[str]]


def aligned(table: TextTable, *, left: int = 0) -> list[str]:
    """Lines of a table, the first `left` columns aligned to the left."""
    return ["  ".join(row).rstrip() for row in _padded(table, left)]


def markdown(table: TextTable, *, left: int) -> list[str]:
    """The same as a table in Markdown."""
    rows = _padded(table, left)
    rule = ["-" * max(3, len(cell)) for cell in rows[0]]
    rule = [each if column < left else f"{each[:-1]}:" for column, each in enumerate(rule)]
    return [f"| {' | '.join(row)} |" for row in [rows[0], rule, *rows[1:]]]


def bound(value: float) -> str:
    """Two digits, never below the value."""
    return f"{1.05 * value:.2g}" if math.isfinite(value) else "unknown"


def _padded(table: TextTable, left: int) -> list[list[str]]:
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        [
            f"{cell:{'<' if column < left else '>'}{width}}"
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        for row in table
    ]
