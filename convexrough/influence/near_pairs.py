"""The matrix S of 1 / r^q - L for near pairs of points, with the smooth L of module `softened`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import checks, threads
from convexrough.arithmetic.pairs import CHUNK, Pair, two_sum
from convexrough.arrays import Array, Indices
from convexrough.influence.splitting import Splitting

#: Memory [bytes] per near neighbour of a point while the matrix is assembled; and the number of
#: points from whose near neighbours the number of all near pairs is estimated first.
BYTES, SAMPLE = 24, 1000


@dataclass(frozen=True, eq=False)
class Order:
    """Points sorted by the block of the mesh that contains them.

    places : (n,) original indices of the sorted points
    points : (n, 2) [length] the sorted points
    tails  : (n, 2) [length] low parts of the sorted points, or None
    cells  : (n, 2) mesh cell of each sorted point
    shares : (n, 2) position of each sorted point in its cell, from 0 to 1
    keys   : (b,) numbers of the blocks that contain points, sorted
    starts : (b + 1,) first point of each of these blocks, and the number of all points
    shape  : numbers of rows and of columns of blocks
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

    def squares(self, i: Indices, j: Indices) -> Array:
        """(m,) [length^2] squared distances of the sorted points i (m,) from sorted points j."""
        apart = self.points[i] - self.points[j]
        if self.tails is not None:
            apart += self.tails[i] - self.tails[j]
        apart *= apart
        return np.asarray(apart[:, 0] + apart[:, 1])


def _placed(
    points: Array, low: Array, spacing: float, tails: Array | None
) -> tuple[Indices, Array]:
    """(n, 2) the mesh cell of each point, and (n, 2) its position in the cell, rounded once.

    low : (2,) [length] the origin of the mesh
    """
    away = Pair(*two_sum(points, -low))
    if tails is not None:
        away += Pair.exact(tails)
    away /= Pair.exact(spacing)
    cells = np.floor(away.high)
    cells -= (away.high == cells) & (away.low < 0)
    cells = np.maximum(cells, 0.0)
    return cells.astype(np.intp), (away.high - cells) + away.low


@dataclass(frozen=True, eq=False)
class NearPairs:
    """The matrix S of docs/theory/operators-mesh.md, for pairs within the distance `Splitting.cut`.

    upper   : (n, n) sparse, the entries for pairs of sorted points i < j
    own     : the number on the diagonal, -L(0), as a point does not displace itself
    terms   : largest number of near neighbours of a point
    nearest : [length] least distance of a near pair that is not 0
    """

    upper: Any
    own: float
    terms: int
    nearest: float

    @classmethod
    def assemble(cls, order: Order, splitting: Splitting, dtype: Any) -> NearPairs:
        from scipy.sparse import csr_array
        from scipy.spatial import cKDTree

        n, tree = len(order.points), cKDTree(order.points)
        some = order.points[:: max(1, n // SAMPLE)]
        near = np.sum(tree.query_ball_point(some, splitting.cut, return_length=True))
        checks.fits_in_memory("asperities that could touch", n, BYTES * near / max(len(some), 1))
        i, j = tree.query_pairs(splitting.cut, output_type="ndarray").T.astype(np.int32)
        values, nearest = np.empty(len(i), dtype=dtype), [splitting.cut]

        def compute(some: slice) -> None:
            squares = order.squares(i[some], j[some])
            values[some] = splitting.kernel.local(squares)
            nearest.append(float(np.sqrt(squares[squares > 0].min(initial=np.inf))))

        threads.each(compute, threads.chunks(len(i), CHUNK), threads.worthwhile(len(i)))
        terms = np.bincount(i, minlength=n) + np.bincount(j, minlength=n)
        upper = csr_array((values, (i, j)), shape=(n, n))
        most = int(terms.max(initial=0))
        return cls(upper, -splitting.kernel.centre, most, min(nearest))

    def apply(self, loads: NDArray[Any]) -> NDArray[Any]:
        result: NDArray[Any] = self.upper @ loads
        result += self.upper.T @ loads
        result += loads.dtype.type(self.own) * loads
        return result
