"""What the seeds of each point of the grid make of what was measured."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from convexrough.arrays import Array
from convexrough.sweeps.batch import Columns
from convexrough.sweeps.table import USUAL, SweepTable


def quantiles(
    table: SweepTable, measured: Sequence[str] | None = None, at: Sequence[float] = USUAL
) -> Columns:
    """A row for each point of the grid and each quantity, from the rows that are there.

    Columns: the swept keys that are not drawn; `quantity`; `scenes`, those computed, and `failed`
    of them, which do not count; a column for each quantile. Where all failed it is nan.
    """
    names = table.measured if measured is None else list(measured)
    keys = table.points
    rows: list[tuple[Any, ...]] = []
    for point in points(table, [*keys, "status", *names]):
        values = tuple(point[key][0] for key in keys)
        good = point["status"] != "failed"
        count, failed = len(good), int(np.count_nonzero(~good))
        for name in names:
            rows.append((*values, name, count, failed, *_quantiles(point[name][good], at)))
    heads = (*keys, "quantity", "scenes", "failed", *(f"{part:g}" for part in at))
    return {head: np.array([row[i] for row in rows]) for i, head in enumerate(heads)}


def points(table: SweepTable, names: Sequence[str]) -> Iterator[Columns]:
    """Some columns of the rows of each point of the grid; no more than one point is held."""
    held: list[Columns] = []
    for block in table.blocks(["scene", *names]):
        indices = block["scene"] // int(table.manifest["each"])
        for rows in np.split(np.arange(len(indices)), np.flatnonzero(np.diff(indices)) + 1):
            some = {name: values[rows] for name, values in block.items()}
            if held and not _same(table, held[0], some):
                yield _joined(held)
                held = []
            held.append(some)
    if held:
        yield _joined(held)


def _same(table: SweepTable, one: Columns, other: Columns) -> bool:
    each = int(table.manifest["each"])
    return bool(one["scene"][0] // each == other["scene"][0] // each)


def _joined(blocks: Sequence[Columns]) -> Columns:
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


def _quantiles(values: Array, at: Sequence[float]) -> list[float]:
    known = values[~np.isnan(values)]
    if len(known) == 0:
        return [np.nan] * len(at)
    return [float(each) for each in np.quantile(known, at)]
