"""Sums over near pairs with more digits than float64 has.

docs/theory/operators-mesh.md, "Near pairs to more digits", derives the method. 1 / r is the sum of
a smooth part L and a part S that is 0 for distances above the "reach" (module `pair_sums`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from convexrough import threads
from convexrough.arithmetic.pairs import CHUNK, Pair, rounded, two_sum
from convexrough.arrays import Array
from convexrough.influence.pair_sums import Product, within
from convexrough.influence.sliced_matrix import squared_distances
from convexrough.influence.softened import Softened, exact_series
from convexrough.roundoff import ROUNDOFF

#: L is computed with whole numbers, in units of 2^-FIXED.
FIXED = 160

#: Least number of nodes of the table of L, and number of terms of Taylor's series at each node.
NODES, TERMS = 1024, 8


def soft_terms(kernel: Softened, step: Fraction, nodes: int, count: int) -> list[Any]:
    """The first `count` coefficients of Taylor's series of reach times L, each (nodes,).

    The variable is (r / reach)^2, and the series are about the nodes r^2 = 0, step, 2 step, ... The
    coefficients are whole numbers, in units of 2^-FIXED.
    """
    one, apart = 1 << FIXED, step / Fraction(kernel.reach) ** 2
    t = one - np.arange(nodes, dtype=object) * one * apart.numerator // apart.denominator
    found = [0 * t for _ in range(count)]
    for term in reversed(exact_series(kernel.order, 1)):
        for k in range(count - 1, 0, -1):
            found[k] = (found[k] * t >> FIXED) - found[k - 1]
        found[0] = (found[0] * t >> FIXED) + int(term * one)
    return found


def soft_values(values: Any, scale: Fraction) -> Pair:
    """Whole numbers in units of 2^-FIXED, multiplied by `scale`, as double-double numbers."""
    unit = scale / (1 << FIXED)
    return Pair(*np.array([Pair.nearest(value * unit) for value in values]).T)


@dataclass(frozen=True, eq=False)
class SoftTable:
    """L as a function of r^2 within the reach, by Taylor's series at the nearest node.

    step   : [length^2] distance of nodes, a power of two
    values : (m,) L at the nodes
    terms  : (TERMS - 1, m) further terms of the series in r^2 / step, in float64
    error  : bound on the error of each L
    """

    step: float
    values: Pair
    terms: Array
    error: float

    @classmethod
    def of(cls, kernel: Softened) -> SoftTable:
        step = 2.0 ** math.floor(math.log2(kernel.reach**2 / NODES))
        nodes = math.ceil(kernel.reach**2 / step) + 1
        values, *others = soft_terms(kernel, Fraction(step), nodes, TERMS)
        scales = (step / kernel.reach**2) ** np.arange(1, TERMS)[:, None] / kernel.reach
        slopes = np.array(others).astype(np.float64) * 2.0**-FIXED * scales
        # The errors by rounding and by truncation of the series are both largest at r = 0.
        ends = [
            abs(float(term[0])) for term in soft_terms(kernel, Fraction(1), 1, kernel.order + 1)
        ]
        away = step / (2.0 * kernel.reach**2)
        sizes = [end * 2.0**-FIXED * away**k / kernel.reach for k, end in enumerate(ends)]
        error = 16.0 * ROUNDOFF * sum(sizes[1:]) + 1.01 * sum(sizes[TERMS:])
        return cls(step, soft_values(values, 1 / Fraction(kernel.reach)), slopes, error)

    def at(self, squares: Pair) -> Pair:
        """L at squared distances [length^2]; low parts are at most a hundredth of high parts."""
        node = np.rint(squares.high / self.step).astype(np.intp)
        away = ((squares.high - node * self.step) + squares.low) / self.step
        value = self.terms[-1][node]
        for terms in self.terms[-2::-1]:
            value *= away
            value += terms[node]
        return Pair(self.values.high[node], self.values.low[node] + value * away)


@dataclass(frozen=True, eq=False)
class SharpPairs:
    """S = first + second. Entries of `first` are multiples of a unit, so that their sums are exact.

    first, second : (n, n) sparse, the entries for pairs of sorted points i < j
    unit   : unit of the entries of `first`, a power of two
    loads  : unit of the first parts of loads of at most 1, a power of two
    sums   : (n,) bounds on the row sums of |S|
    centre : L(0)
    error  : bound on the part of the error of an entry that is not due to 1 / r
    """

    product: Product
    first: Any
    second: Any
    unit: float
    loads: float
    sums: Array
    centre: Pair
    error: float

    @classmethod
    def of(cls, product: Product) -> SharpPairs:
        from scipy.sparse import csr_array

        upper, order, kernel = product.near.upper, product.order, product.splitting.kernel
        ones, terms = np.ones(len(order.points)), max(product.near.terms, 1)
        sums = _sizes(product, ones)
        # Sums of first parts up to 16 times the median of `sums` must be exact.
        bits = (49 - terms.bit_length()) // 2
        unit = 2.0 ** (math.floor(math.log2(float(np.median(sums)) / terms)) - bits)
        table = SoftTable.of(kernel)
        points = Pair.exact(order.points)
        if order.tails is not None:
            points = Pair(order.points, order.tails)
        first, second = np.empty_like(upper.data), np.empty_like(upper.data)

        def cut(rows: slice) -> None:
            starts = upper.indptr[rows.start : rows.stop + 1]
            some = slice(int(starts[0]), int(starts[-1]))
            here = np.repeat(np.arange(rows.start, rows.stop), np.diff(starts))
            squares = squared_distances(points.at(here), points.at(upper.indices[some]))
            inverse, soft = squares.inverse_root(), table.at(squares)
            high, low = two_sum(inverse.high, -soft.high)
            low += inverse.low - soft.low
            first[some] = rounded(high + low, np.asarray(unit))
            second[some] = (high - first[some]) + low

        rows = max(1, CHUNK * len(ones) // max(len(first), 1))
        parts = threads.chunks(len(ones), rows)
        threads.each(cut, parts, threads.worthwhile(len(first)))
        low, high = (
            csr_array((part, upper.indices, upper.indptr), shape=upper.shape)
            for part in (second, first)
        )
        centre = Pair(*(part[0] for part in table.values))
        error = table.error + 4.0 * ROUNDOFF * unit
        return cls(product, high, low, unit, 2.0**-bits, sums, centre, error)

    def __call__(self, ordered: Pair) -> tuple[Pair, Array]:
        """(n,) the products of S with sorted loads of at most 1, and bounds on their errors."""
        product, kernel = self.product, self.product.splitting.kernel
        first = rounded(np.asarray(ordered.high), np.asarray(self.loads))
        second = np.asarray((ordered.high - first) + ordered.low)
        exact, left = _applied(self.first, np.stack((first, second), axis=1)).T
        left = left + _applied(self.second, first + second)
        own = ordered * Pair(-self.centre.high, -self.centre.low)
        sizes = np.abs(ordered.high)
        every = _sizes(product, sizes)
        terms = product.near.terms
        rest = self.loads * self.sums + self.unit * terms
        inexact = np.where(every + rest < 2.0**52 * self.unit * self.loads, 0.0, every + rest)
        around = within(product.order.points, sizes, product.splitting.cut)
        errors = (terms + 4) * ROUNDOFF * (rest + inexact) + self.error * around
        errors += 2.0**-88 * (every + kernel.centre * around)
        return Pair(*two_sum(exact, left)) + own, 1.01 * errors


def _applied(upper: Any, loads: Array) -> Array:
    result: Array = upper @ loads
    result += upper.T @ loads
    return result


def _sizes(product: Product, strengths: Array) -> Array:
    """(n,) bounds on the sums over near pairs of |S_ij| times the strength of j."""
    near, kernel = product.near, product.splitting.kernel
    ordered = near.apply(strengths) + kernel.centre * strengths
    around = within(product.order.points, strengths, product.splitting.cut)
    return np.asarray(1.01 * (ordered + 2.0 * kernel.centre * around))
