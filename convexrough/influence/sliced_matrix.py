"""Sums over j of P_j / r_ij by a matrix, to about 27 digits, with the products of BLAS.

Each entry and each load is the sum of a first slice, a second slice and a rest. In a row and a
block of columns, first slices are multiples of one unit. They have so few bits that sums of their
products stay below 2^53 units, and so are exact in any order. For the same reason, sums of products
of first and second slices are exact. All other products are about 2^-48 of the sum, and their
rounding errors about 2^-101.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from convexrough import threads
from convexrough.arithmetic.balls import TINY, UP, Ball, of_rows, quietly
from convexrough.arithmetic.pairs import PAIR_ROUNDOFF, Pair, rounded, two_square, two_sum
from convexrough.arrays import Array, Indices
from convexrough.roundoff import ROUNDOFF

#: Number of columns in a block, and numbers of bits of the first and the second slice of an entry.
BLOCK, FIRST, SECOND = 128, 24, 23

#: Largest number of bits of a first slice of loads; more bits would not reduce the error.
MOST_BITS = 30

#: Largest number of rows of a cached matrix. The slices of such a matrix take 0.4 GB.
KEPT = 4096

#: The matrix of a part of the asperities is cut from that of all asperities, which other parts may
#: use later, if all are at most SMALL or at most twice as many as the part.
SMALL = 128

#: Number of entries that are computed together: arrays of 64 KB, which fit in the cache.
PIECE = 2**13

#: Least number of rows that are computed together; with fewer, calls take most of the time.
ROWS = 32

#: Limit on 1 / r for points with an extent of 1; if 1 / r is larger, r^2 may underflow.
LARGEST = 2.0**300


@dataclass(frozen=True, eq=False)
class SlicedMatrix:
    """Some rows of the matrix 1 / r_ij, as first + second + rest; 0 where two points coincide."""

    slices: tuple[Array, Array, Array]  # (m, n) the three parts
    blocks: list[tuple[slice, int]]  # columns, and the number of bits of first slices of loads
    exponent: int  # the matrix is that of points divided by 2^exponent; their extent is about 1
    #: (3 blocks, m) three factors for each block, to be multiplied by its largest rest of a load
    #: after two slices, its largest rest after one slice, and its largest load. The sum of these
    #: products over all blocks bounds the error of a product with loads.
    losses: Array

    @classmethod
    def of(cls, points: Pair, rows: slice, point_error: float = 0.0) -> SlicedMatrix:
        """The rows `rows` for points (n, 2), with coordinate errors up to `point_error`."""
        exponent = math.frexp(np.ptp(points.high, axis=0).max())[1]
        points = Pair(*(np.ldexp(part, -exponent) for part in points))
        point_error = math.sqrt(2.0) * math.ldexp(point_error, -exponent) * UP
        here, n = points.at(rows), len(points.high)
        m, starts = len(here.high), range(0, n, BLOCK)
        slices = (np.empty((m, n)), np.empty((m, n)), np.empty((m, n)))
        largest, sizes = np.empty((len(starts), m)), np.empty((3, len(starts), m))
        inverse = Pair(slices[0], slices[2])  # first these arrays hold 1 / r

        def fill(some: slice) -> None:
            columns = slice(some.start if m == n else 0, n)
            found = inverse_distances(here.at(some), points.at(columns))
            for whole, part in zip(inverse, found, strict=True):
                whole[some, columns] = part
                if m == n:  # the matrix is symmetric
                    whole[some.stop :, some] = part[:, len(part) :].T

        def cut(some: slice) -> None:
            for block, start in enumerate(starts):
                columns = np.s_[:, start : start + BLOCK]
                high, low = (part[some][columns].copy() for part in inverse)
                most = largest[block, some] = high.max(axis=1)
                unit = _unit(most)[:, None]
                first = rounded(high, unit)
                rest = high - first
                second = rounded(rest, unit * 2.0**-SECOND)
                rest = (rest - second) + low
                for k, each in enumerate((first, second, rest)):
                    slices[k][some][columns] = each
                    sizes[k, block, some] = np.abs(each).sum(axis=1)

        for work in (fill, cut):
            threads.each(work, threads.chunks(m, max(ROWS, PIECE // n)), threads.worthwhile(m * n))
        sizes *= UP
        most = (np.maximum(sizes[0], sizes[1] * 2.0**SECOND) / _unit(largest)).max(axis=1)
        bits = np.minimum(53 - np.frexp(most)[1], MOST_BITS).tolist()
        nearest = largest.max(axis=0)
        moved = 2.0 * point_error * nearest * UP
        with np.errstate(divide="ignore"):
            moved = np.where((moved < 1) & (nearest < LARGEST), moved / (1.0 - moved), np.inf)
        few = 4 * len(bits) + 12  # number of operations besides the sums in a block
        losses = (min(BLOCK, n) + few) * ROUNDOFF * sizes
        losses[2] += ((few * ROUNDOFF) ** 2 + PAIR_ROUNDOFF + moved) * sizes.sum(axis=0)
        blocks = [(slice(s, s + BLOCK), b) for s, b in zip(starts, bits, strict=True)]
        return cls(slices, blocks, exponent, losses.swapaxes(0, 1).reshape(-1, m) * UP)

    def restricted(self, which: Indices) -> SlicedMatrix:
        """The matrix of the points with the increasing indices `which`; errors are not larger."""
        first, second, rest = (part.take(which, 0).take(which, 1) for part in self.slices)
        stops = np.searchsorted(which, [columns.stop for columns, _ in self.blocks]).tolist()
        columns = (slice(*edges) for edges in pairwise([0, *stops]))
        blocks = [(some, bits) for some, (_, bits) in zip(columns, self.blocks, strict=True)]
        losses = self.losses.take(which, 1)
        return SlicedMatrix((first, second, rest), blocks, self.exponent, losses)

    @quietly
    def __matmul__(self, loads: Pair) -> Ball:
        """The sums over j of P_j / r_ij in these rows, (..., m), for loads P (..., n)."""
        scale = np.frexp(_most(loads.high))[1]
        loads = Pair(*(np.ldexp(part, -scale) for part in loads))
        sums, rests, left_over = [], [], []
        for columns, bits in self.blocks:
            a, b, c = (part[:, columns].T for part in self.slices)
            x, tail = loads.at(np.s_[..., columns])
            most = _most(x)
            unit = np.ldexp(2.0**-bits, np.frexp(most)[1])
            first = rounded(x, unit)
            left = x - first
            second = rounded(left, unit * 2.0 ** -(bits + 1))
            rest = (left - second) + tail
            left = left + tail
            sums += [first @ a, second @ a, first @ b]
            rests.append(left @ b + rest @ a + x @ c)
            left_over += [_most(rest) + TINY, _most(left) + TINY, most]
        high, low = sums[0], sum(rests)
        for exact in sums[1:]:
            high, error = two_sum(high, exact)
            low = low + error
        radius = np.concatenate(left_over, axis=-1) @ self.losses + TINY
        parts = (*two_sum(high, low), radius)
        high, low, radius = (np.ldexp(part, scale - self.exponent) for part in parts)
        return Ball.around(Pair(high, low), radius * UP + TINY)


@dataclass(frozen=True, eq=False)
class MatrixSums:
    """The sums over j of P_j / r_ij of points (n, 2).

    A matrix of up to `KEPT` rows is cached. A larger matrix is computed again for each product.
    """

    points: Pair
    point_error: float = 0.0  # [length] bound on the error of each coordinate
    #: The sums of more points, and the increasing indices of these points among them.
    part_of: tuple[MatrixSums, Indices] | None = None
    shared: bool = False  # True if other scenes use this object: no bit may depend on them

    def restricted(self, which: Indices) -> MatrixSums:
        """The same sums of some of the points only."""
        increasing = bool((which[1:] > which[:-1]).all())
        part_of = (self, which) if increasing and len(which) else None
        return MatrixSums(self.points.at(which), self.point_error, part_of)

    def __call__(self, loads: Pair) -> Ball:
        """The sums (..., n) for loads (..., n)."""
        if loads.high.size == 0:
            return Ball.exact(loads)
        n = len(self.points.high)
        if n <= KEPT:
            return self._matrix @ loads
        chunks = threads.chunks(n, KEPT**2 // n)
        parts = (SlicedMatrix.of(self.points, some, self.point_error) @ loads for some in chunks)
        found: Ball = of_rows(lambda *each: np.concatenate(each, axis=-1), *parts)
        return found

    @cached_property
    def _matrix(self) -> SlicedMatrix:
        """The matrix, cut from that of `part_of` if this is small, or cached and not shared."""
        if self.part_of is not None:
            whole, which = self.part_of
            few = len(whole.points.high) <= min(KEPT, max(SMALL, 2 * len(which)))
            if few or ("_matrix" in vars(whole) and not whole.shared):
                return whole._matrix.restricted(which)
        return SlicedMatrix.of(self.points, slice(0, None), self.point_error)


def _unit(largest: Array) -> Array:
    """The unit of the first slices of entries of at most `largest`."""
    return np.asarray(np.ldexp(2.0**-FIRST, np.frexp(largest)[1]))


def _most(values: Array) -> Array:
    """(..., 1) the largest absolute value along the last axis."""
    return np.asarray(np.abs(values).max(axis=-1, initial=0.0, keepdims=True))


def inverse_distances(points: Pair, others: Pair) -> Pair:
    """(m, n) 1 / r_ij with a relative error below about 2^-98; 0 where two points coincide."""
    return squared_distances(points.at(np.s_[:, None]), others).inverse_root()


def squared_distances(points: Pair, others: Pair) -> Pair:
    """Squared distances of points from others; the last axis of both arrays is x, y."""
    squares = []
    for k in (0, 1):
        here, there = points.at(np.s_[..., k]), others.at(np.s_[..., k])
        if here.low.any() or there.low.any():
            apart = here - there
        else:  # with fewer terms
            apart = Pair(*two_sum(here.high, -there.high))
        high, rest = two_square(apart.high)
        squares.append(Pair(high, rest + (apart.high + apart.high) * apart.low))
    x, y = squares
    square, rest = two_sum(x.high, y.high)
    return Pair(square, rest + (x.low + y.low))
