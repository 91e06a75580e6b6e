"""The sums over pairs of `pair_sums`, with more digits than float64 has, for certificates.

With the symbols of `pair_sums`, the smooth part L of the kernel adds W G W^T P to the sums for
loads P. These are three products: from points to the mesh, on the mesh, and back to the points. For
each, numbers are split into a first slice, with so few bits that sums of products of first slices
are exact, and a small rest. The table at the end of docs/theory/operators-mesh.md shows which
errors remain.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts are imported when they are used

from convexrough import threads
from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import CHUNK, Pair, rounded, two_product, two_sum
from convexrough.arrays import Array, Indices
from convexrough.influence.pair_sums import Product, both_ways, entries, row_parts, within
from convexrough.influence.sliced import SLICES, Distances, Sliced
from convexrough.influence.sliced_matrix import squared_distances
from convexrough.influence.softened import TWOFOLD_WEIGHT, Softened, exact_series, lebesgue
from convexrough.roundoff import ROUNDOFF

#: Numbers of bits of a float64 number and of a first slice.
DIGITS, BITS = 53, 24

#: Number of patches (`pair_sums.Mesh`) processed together; their data fit in the cache.
PATCHES = 64

#: Whole numbers in units of 2^-FIXED are used to compute L.
FIXED = 160

#: Least number of nodes in the table of L, and number of terms of Taylor's series at each node.
NODES, TERMS = 1024, 8


def soft_terms(kernel: Softened, step: Fraction, nodes: int, count: int) -> list[Any]:
    """The first `count` coefficients of Taylor's series of reach times L, each (nodes,).

    The variable of the series is (r / reach)^2. There is a series about each of the nodes r^2 = 0,
    step, 2 step, ... The coefficients are whole numbers, in units of 2^-FIXED.
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
    """The numbers 2^-FIXED `values`, multiplied by `scale`, as double-double numbers."""
    unit = scale / (1 << FIXED)
    return Pair(*np.array([Pair.nearest(value * unit) for value in values]).T)


def soft_table(kernel: Softened) -> tuple[Callable[[Pair], Pair], Pair, float]:
    """L as a function of r^2 within the reach, L(0), and a bound on the error of each L.

    The function is Taylor's series at the nearest of many nodes. Low parts of its values are at
    most a hundredth of high parts.
    """
    step = 2.0 ** math.floor(math.log2(kernel.reach**2 / NODES))
    count = math.ceil(kernel.reach**2 / step) + 1
    values, *others = soft_terms(kernel, Fraction(step), count, TERMS)
    scales = (step / kernel.reach**2) ** np.arange(1, TERMS)[:, None] / kernel.reach
    slopes = np.array(others).astype(np.float64) * 2.0**-FIXED * scales
    nodes = soft_values(values, 1 / Fraction(kernel.reach))

    def soft(squares: Pair) -> Pair:
        node = np.rint(squares.high / step).astype(np.intp)
        away = ((squares.high - node * step) + squares.low) / step
        value = slopes[-1][node]
        for terms in slopes[-2::-1]:
            value *= away
            value += terms[node]
        return Pair(nodes.high[node], nodes.low[node] + value * away)

    # The errors by rounding and by truncation of the series are both largest at r = 0.
    ends = (abs(float(term[0])) for term in soft_terms(kernel, Fraction(1), 1, kernel.order + 1))
    away = step / (2.0 * kernel.reach**2)
    sizes = [end * 2.0**-FIXED * away**k / kernel.reach for k, end in enumerate(ends)]
    error = 16.0 * ROUNDOFF * sum(sizes[1:]) + 1.01 * sum(sizes[TERMS:])
    return soft, nodes.at(0), error


class SharpPairs:
    """The matrix S = first + second, with entries 1 / r - L for near pairs.

    Entries of `first` are multiples of `unit`, and first slices of loads, for loads of at most 1,
    of `loads`. Both are powers of two, so that sums of their products are exact.
    """

    def __init__(self, product: Product) -> None:
        upper, mesh, terms = product.near.upper, product.mesh, max(product.near.terms, 1)
        self.product = product
        self.sums, _ = _sizes(product, np.ones(len(mesh.points)))  # bounds on row sums of |S|
        # Sums of first slices must be exact up to 16 times the median of `sums`.
        bits = (49 - terms.bit_length()) // 2
        most = math.floor(math.log2(float(np.median(self.sums)) / terms))
        self.unit, self.loads = 2.0 ** (most - bits), 2.0**-bits
        soft, self.centre, error = soft_table(product.splitting.kernel)
        self.error = error + 4.0 * ROUNDOFF * self.unit  # of an entry, without that of 1 / r
        points = Pair.exact(mesh.points)
        if mesh.tails is not None:
            points = Pair(mesh.points, mesh.tails)
        first, second = np.empty_like(upper.data), np.empty_like(upper.data)

        def cut(rows: slice) -> None:
            some, here = entries(upper, rows)
            # `take` is several times faster than an index.
            one, other = (
                Pair(*(part.take(end, axis=0) for part in points))
                for end in (here, upper.indices[some])
            )
            squares = squared_distances(one, other)
            inverse, smooth = squares.inverse_root(), soft(squares)
            high, low = two_sum(inverse.high, -smooth.high)
            low += inverse.low - smooth.low
            first[some] = rounded(high + low, np.asarray(self.unit))
            second[some] = (high - first[some]) + low

        threads.each(cut, row_parts(upper, CHUNK), threads.worthwhile(len(first)))
        self.first, self.second = (
            scipy.sparse.csr_array((part, upper.indices, upper.indptr), shape=upper.shape)
            for part in (first, second)
        )

    def __call__(self, ordered: Pair) -> tuple[Pair, Array]:
        """(n,) the product of S and sorted loads of at most 1, and bounds on its errors."""
        product, kernel = self.product, self.product.splitting.kernel
        first = rounded(np.asarray(ordered.high), np.asarray(self.loads))
        second = np.asarray((ordered.high - first) + ordered.low)
        exact, left = both_ways(self.first, np.stack((first, second), axis=1)).T
        left = left + both_ways(self.second, first + second)
        own = ordered * Pair(-self.centre.high, -self.centre.low)
        every, around = _sizes(product, np.abs(ordered.high))
        terms = product.near.terms
        rest = self.loads * self.sums + self.unit * terms
        inexact = np.where(every + rest < 2.0**52 * self.unit * self.loads, 0.0, every + rest)
        errors = (terms + 4) * ROUNDOFF * (rest + inexact) + self.error * around
        errors += 2.0**-88 * (every + kernel.centre * around)
        return Pair(*two_sum(exact, left)) + own, 1.01 * errors


def _sizes(product: Product, strengths: Array) -> tuple[Array, Array]:
    """(n,) bounds on the sums of |S_ij| s_j over j, and of s_j over near j, for strengths s."""
    near, kernel = product.near, product.splitting.kernel
    ordered = near.apply(strengths) + kernel.centre * strengths
    around = within(product.mesh.points, strengths, product.splitting.cut)
    return 1.01 * (ordered + 2.0 * kernel.centre * around), around


class Slices(NamedTuple):
    """Numbers as sums of a first slice of few bits and a rest."""

    first: Array
    second: Array

    @classmethod
    def of(cls, values: Pair, bits: int) -> Slices:
        unit = 2.0**bits
        first = np.rint(values.high * unit) / unit
        return cls(first, (values.high - first) + values.low)

    def at(self, index: Any) -> Slices:
        return Slices(self.first[index], self.second[index])


def in_slices(
    product: Callable[[Array, Array], Array], a: Slices, b: Slices
) -> tuple[Array, Array]:
    """A bilinear `product` of a and b in two parts: that of the first slices, and the rest."""
    left = product(a.first, b.second)
    left += product(a.second, b.first + b.second)
    return product(a.first, b.first), left


@dataclass(frozen=True)
class SoftValues(Distances):
    """The values of the smooth kernel L between nodes of a mesh, times the unit of length."""

    near: Pair  # within the reach, at the index i^2 + j^2 for nodes that differ by (i, j)

    @classmethod
    def between(cls, product: Product, unit: float) -> SoftValues:
        mesh, splitting = product.mesh.box, product.splitting
        kernel, spacing = splitting.kernel, splitting.spacing
        basis = [[Fraction(x) / Fraction(unit) for x in row] for row in mesh.basis.tolist()]
        beyond = Distances.of(basis, max(mesh.shape))
        step, reach = Fraction(spacing) ** 2, Fraction(kernel.reach)
        (near,) = soft_terms(kernel, step, math.ceil(reach**2 / step), 1)
        return cls(beyond.gram, beyond.error, soft_values(near, Fraction(unit) / reach))

    def at(self, i: Indices, j: Indices) -> Pair:
        found = super().at(i, j)
        squares = np.add.outer(i * i, j * j)
        near = squares < len(self.near.high)
        found.high[near], found.low[near] = self.near.at(squares[near])
        return found


class MeshSums:
    """The sums over j of P_j / r_ij for exact points, by the mesh and near pairs of `product`."""

    def __init__(self, product: Product) -> None:
        mesh, unit = product.mesh.box, 2.0 ** math.floor(math.log2(product.splitting.spacing))
        self.product = product
        self.pairs = SharpPairs(product)
        values, norm = SoftValues.between(product, unit), unit * product.kernel.norm
        self.sliced = Sliced.of(mesh, values, norm, unit, SLICES)
        self.places = np.add.outer(np.arange(mesh.shape[0]) * mesh.stride, range(mesh.shape[1]))

    def __call__(self, loads: Pair) -> Ball:
        product = self.product
        top = float(np.abs(loads.high).max(initial=0.0))
        if top == 0.0:
            return Ball.exact(loads)
        size = 2.0 ** np.ceil(np.log2(top))
        shares = Pair(np.asarray(loads.high / size), np.asarray(loads.low / size))  # exact
        ordered = shares.at(product.mesh.places)
        field, node_error = _to_nodes(product, ordered)
        nodes = Pair(field.high.ravel(), field.low.ravel())
        on_mesh = self.sliced.sums(nodes, self.places.ravel())
        exact, left, unit, rounding = _from_nodes(product, on_mesh)
        near, errors = self.pairs(ordered)
        back = np.argsort(product.mesh.places)
        total = (Pair(*two_sum(exact * unit, left * unit)) + near).at(back)

        field_error = node_error * math.sqrt(field.high.size)
        error = float(on_mesh.radius.max()) + product.kernel.norm * field_error
        error *= lebesgue(product.splitting.kernel.order) ** 2
        sizes = np.abs(shares.high)
        whole = total.high if shares.high.min() >= 0 else product.apply(sizes)
        # Distant pairs lose by interpolation and by rounded positions.
        kernel, spacing = product.splitting.kernel, product.splitting.spacing
        relative = kernel.far_error(spacing) + kernel.moved(2.0 * ROUNDOFF * spacing)
        error += relative * float(whole.max()) + rounding * unit
        radius = errors[back] + product.interpolation(sizes) + error
        return Ball.around(Pair(total.high * size, total.low * size), 1.01 * radius * size)


def _to_nodes(product: Product, ordered: Pair) -> tuple[Pair, float]:
    """W^T P for sorted loads P of at most 1, and a bound on the error at every node."""
    met = _met(product)
    bits = (DIGITS - met.bit_length()) // 2
    exact, left = np.zeros(product.mesh.box.shape), np.zeros(product.mesh.box.shape)
    for some, patches, x, y in _weighed(product):
        mine = ordered.at(np.s_[some, None])
        high, low = two_product(mine.high, y.high)
        low = low + (mine.high * y.low + mine.low * y.high)
        charges = Slices.of(Pair(high, low), bits)
        factors = Slices.of(x, bits)
        for rows, i, j in patches:
            first, second = in_slices(lambda a, b: a.T @ b, factors.at(rows), charges.at(rows))
            exact[i, j] += first
            left[i, j] += second
    error = met * ((2 * met + 8) * ROUNDOFF * 2.0**-bits + 4 * TWOFOLD_WEIGHT)
    return Pair(*two_sum(exact, left)), error


def _from_nodes(product: Product, on_mesh: Ball) -> tuple[Array, Array, float, float]:
    """W times the values on the mesh, as the sum of whole numbers (n,) and rests (n,) in a unit.

    The other two results are this unit, and a bound on the error in this unit.
    """
    high, low = (np.asarray(each).reshape(product.mesh.box.shape) for each in on_mesh.mid)
    scale = 2.0 ** -np.ceil(np.log2(np.abs(high).max() + 1e-300))
    values = Slices.of(Pair(high * scale, low * scale), BITS)
    unit, dots = 2.0 ** (-2 * BITS), partial(np.einsum, "ij,ij->i")
    exact, left = np.empty(len(product.mesh.places)), np.empty(len(product.mesh.places))
    for some, patches, x, y in _weighed(product):
        across, along = Slices.of(x, BITS), Slices.of(y, BITS)
        for rows, i, j in patches:
            lines = in_slices(np.matmul, across.at(rows), values.at((i, j)))
            here = slice(some.start + rows.start, some.start + rows.stop)
            exact[here], left[here] = in_slices(dots, Slices.of(Pair(*lines), BITS), along.at(rows))
    # The sum of |weights| is below 4; that of the rests of p weights is below p 2^-BITS.
    kernel, width = product.splitting.kernel, product.splitting.width
    rounding = 12 * kernel.order * (width + 8) * ROUNDOFF * 2.0**-BITS + 32 * TWOFOLD_WEIGHT
    return exact / unit, left / unit, unit / scale, rounding / unit


def _weighed(product: Product) -> Iterator[tuple[slice, list[Any], Pair, Pair]]:
    """For each group of patches: its points, the slices of each patch, and the weights in x and y.

    The slices of a patch select its points within the group, and its nodes in x and in y.
    """
    (x, y), width = product.mesh.weights, product.splitting.width
    for k in range(0, len(product.mesh.patches), PATCHES):
        patches = product.mesh.patches[k : k + PATCHES]
        start, some = patches[0][0], slice(patches[0][0], patches[-1][1])
        places = [
            (slice(a - start, b - start), slice(i, i + width), slice(j, j + width))
            for a, b, i, j in patches
        ]
        yield some, places, x.at(some), y.at(some)


def _met(product: Product) -> int:
    """The largest number of points that interpolate from the same node."""
    order, counts = product.splitting.kernel.order, np.zeros(product.mesh.box.shape, dtype=np.intp)
    np.add.at(counts, tuple(product.mesh.cells.T), 1)
    for rows in (counts, counts.T):
        rows[:] = rows.cumsum(axis=0)
        rows[order:] -= rows[:-order].copy()
    return int(counts.max())
