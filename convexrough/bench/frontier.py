"""What the measurements say: who is on the frontier, and how cost grows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from convexrough.bench.measure import Row

#: A point has to be this much faster before it counts as faster: what timing can tell.
NOISE = 0.1


def mark_frontier(rows: Sequence[Row]) -> tuple[Row, ...]:
    """Mark the points than which no other is at least as fast and as accurate, and better in one.

    Points that are no answer, or without a known error, are never on it.
    """
    points = [row for row in rows if row.known]

    def dominated(row: Row) -> bool:
        return any(
            other.seconds <= row.seconds
            and other.error <= row.error
            and (other.seconds < row.seconds or other.error < row.error)
            for other in points
        )

    return tuple(replace(row, frontier=row.known and not dominated(row)) for row in rows)


def better_than_default(rows: Sequence[Row]) -> tuple[Row, ...]:
    """The points that are faster than the default by more than noise, and at least as accurate.

    Where the default has no answer: every point.
    """
    points = [row for row in rows if row.known]
    default = next((row for row in points if row.default), None)
    if default is None:
        return tuple(points)
    limit = default.seconds / (1.0 + NOISE)
    return tuple(row for row in points if row.seconds < limit and row.error <= default.error)


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """b of the least-squares fit  log cost = a + b log size; nan for fewer than two sizes."""
    if len(set(sizes)) < 2:
        return np.nan
    slope, _ = np.polyfit(np.log(sizes), np.log(costs), 1)
    return float(slope)
