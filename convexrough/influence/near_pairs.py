"""Near pairs of points, with the part of 1 / r^q that is not smooth."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arithmetic.pairs import Pair, two_sum
from convexrough.arrays import Array, Indices
from convexrough.influence.coupling import squared_distances
from convexrough.influence.splitting import Splitting

#: Number of pairs processed together, and number of such groups in memory at once.
PIECE, BATCH = 2**17, 32


@dataclass(frozen=True, eq=False)
class Order:
    """Points sorted by the block of the mesh that contains them.

    places : (n,) original indices of the sorted points
    points : (n, 2) [length] the sorted points
    tails  : (n, 2) [length] low parts of the sorted points, or None
    cells  : (n, 2) mesh cell of each point
    shares : (n, 2) position of each point in its cell, from 0 to 1
    keys   : numbers of the blocks with points, sorted
    starts : (blocks + 1,) first point of each block
    shape  : rows and columns of blocks
    """

    places: Indices
    points: Array
    tails: Array | None
    cells: Indices
    shares: Array
    keys: Indices
    starts: Indices
    shape: tuple[int, int]

    @classmethod
    def of(cls, points: Array, splitting: Splitting, tails: Array | None = None) -> Order:
        low = points.min(axis=0) if len(points) else np.zeros(2)
        cells, shares = np.zeros(points.shape, dtype=np.intp), np.zeros_like(points)
        if splitting.meshed:
            cells, shares = _placed(points, low, splitting.spacing, tails)
        blocks = cells // splitting.block
        rows, columns = (blocks.max(axis=0, initial=0) + 1).tolist()
        key = blocks[:, 0] * columns + blocks[:, 1]
        places = np.argsort(key, kind="stable")
        keys, starts = np.unique(key[places], return_index=True)
        return cls(
            places,
            points[places],
            None if tails is None else tails[places],
            cells[places],
            shares[places],
            keys,
            np.append(starts, len(points)).astype(np.intp),
            (rows, columns),
        )


def _placed(
    points: Array, low: Array, spacing: float, tails: Array | None
) -> tuple[Indices, Array]:
    """The cell of each point, and the position of the point in the cell, rounded once."""
    away = Pair(*two_sum(points, -low))
    if tails is not None:
        away += Pair.exact(tails)
    away /= Pair.exact(spacing)
    cells = np.floor(away.high)
    cells -= (away.high == cells) & (away.low < 0)
    cells = np.maximum(cells, 0.0)
    return cells.astype(np.intp), (away.high - cells) + away.low


#: A slice of the sorted points, and the first and last neighbours in each row of blocks.
Piece: TypeAlias = tuple[slice, Indices, Indices]


@dataclass(frozen=True, eq=False)
class NearPairs:
    """The matrix S of docs/theory/operators-mesh.md: 1 / r^q minus L, for pairs within the cut.

    upper   : (n, n) sparse, pairs i < j
    own     : the diagonal, -L(0)
    terms   : largest number of terms in a sum
    nearest : [length] least distance that is not 0
    """

    upper: Any
    own: float
    terms: int
    nearest: float

    @classmethod
    def assemble(cls, order: Order, splitting: Splitting, dtype: Any) -> NearPairs:
        from scipy.sparse import csr_array

        n = len(order.points)
        pieces = list(_neighbourhoods(order, splitting))
        most = sum((rows.stop - rows.start) * int((b - a).sum()) for rows, a, b in pieces)
        # About half of these pairs are near; memory is allocated only when it is written to.
        checks.fits_in_memory("asperities that could touch", n, 6.0 * most / max(n, 1))
        index: Any = np.int32 if most < 2**31 else np.int64
        where, values = np.empty(most, dtype=index), np.empty(most, dtype=dtype)
        counts = np.zeros(n, dtype=np.int64)
        nearest, done = splitting.cut, 0
        pairs_of = partial(_pairs, order, splitting)
        with ThreadPoolExecutor(2) as threads:
            for batch in range(0, len(pieces), BATCH):
                for found in threads.map(pairs_of, pieces[batch : batch + BATCH]):
                    taken = slice(done, done + len(found.others))
                    counts[found.rows] = found.counts
                    where[taken], values[taken] = found.others, found.values
                    done, nearest = taken.stop, min(nearest, found.closest)
        starts = np.concatenate(([0], np.cumsum(counts)))
        both = counts
        for start in range(0, done, 2**24):  # bincount copies its argument
            both = both + np.bincount(where[start : min(start + 2**24, done)], minlength=n)
        upper = csr_array((values[:done], where[:done], starts.astype(index)), shape=(n, n))
        return cls(upper, -splitting.kernel.centre, int(both.max(initial=0)), nearest)

    def apply(self, loads: NDArray[Any]) -> NDArray[Any]:
        result: NDArray[Any] = self.upper @ loads
        result += self.upper.T @ loads
        result += loads.dtype.type(self.own) * loads
        return result


class _Pairs(NamedTuple):
    """Near pairs of some points with later points, sorted by point."""

    rows: slice  # the points
    counts: Indices  # how many pairs each has
    others: NDArray[np.int32]
    values: Array  # S
    closest: float  # [length] the least distance that is not 0


def _pairs(order: Order, splitting: Splitting, piece: Piece) -> _Pairs:
    rows, firsts, lasts = piece
    others = np.concatenate(
        [np.arange(a, b, dtype=np.int32) for a, b in zip(firsts, lasts, strict=True)]
    )
    tails = None if order.tails is None else (order.tails[rows], order.tails[others])
    squares = squared_distances(order.points[rows], order.points[others], tails)
    wanted = squares < splitting.cut**2
    own = lasts[0] - firsts[0]  # each pair once
    wanted[:, :own] &= others[:own] > np.arange(rows.start, rows.stop)[:, None]
    row, column = np.nonzero(wanted)
    counts = np.bincount(row, minlength=len(squares))
    squares = squares[wanted]
    closest = float(np.sqrt(squares[squares > 0].min(initial=np.inf)))
    return _Pairs(rows, counts, others[column], splitting.kernel.local(squares), closest)


def _neighbourhoods(order: Order, splitting: Splitting) -> Iterator[Piece]:
    """Slices of points, each with the later points that can be nearer than the cut."""
    rows, columns = order.shape
    away = 0
    if splitting.meshed:
        side = splitting.block * splitting.spacing
        away = min(int(np.ceil(splitting.cut / side)), max(rows, columns))
    i, j = order.keys // columns, order.keys % columns
    ahead = np.arange(min(away, rows - 1) + 1)
    left = np.where(ahead > 0, np.maximum(j[:, None] - away, 0), j[:, None])
    right = np.minimum(j + away, columns - 1)[:, None]
    line = (i[:, None] + ahead) * columns
    first = order.starts[np.searchsorted(order.keys, line + left, side="left")]
    last = order.starts[np.searchsorted(order.keys, line + right, side="right")]
    for block, sizes in enumerate((last - first).sum(axis=1).tolist()):
        top, bottom = order.starts[block : block + 2].tolist()
        step = max(1, PIECE // sizes)
        for start in range(top, bottom, step):
            yield slice(start, min(start + step, bottom)), first[block], last[block]
