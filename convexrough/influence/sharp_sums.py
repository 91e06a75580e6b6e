"""The sums of `pair_sums` with more digits than float64 has, for the products of a certificate.

For loads P, the smooth part of the sums is W G W^T P: W interpolates from the nodes of a mesh to
the points, and G is the smooth kernel L between nodes. The product goes from points to the mesh, on
the mesh, and back to the points. Each step is computed with slices of numbers. First slices have so
few bits that their products are exact, and the rests are small. The remaining error is mostly due
to interpolation (docs/theory/operators-mesh.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair, two_product, two_sum
from convexrough.arrays import Array, Indices
from convexrough.influence.mesh import PLACES, twofold_weights
from convexrough.influence.pair_sums import Product
from convexrough.influence.sharp_pairs import SharpPairs, soft_terms, soft_values
from convexrough.influence.sliced import SLICES, Distances, Sliced
from convexrough.influence.softened import TWOFOLD_WEIGHT, Softened, lebesgue
from convexrough.roundoff import ROUNDOFF

#: Numbers of bits of a float64 number and of a first slice.
DIGITS, BITS = 53, 24

#: Number of patches (`mesh.Interpolation`) that are processed together and fit in the cache.
PATCHES = 64

LowWeights: TypeAlias = tuple[NDArray[np.float32], NDArray[np.float32]]


class Slices(NamedTuple):
    """Numbers as sums of a first slice of few bits and a rest."""

    first: Array
    second: Array

    @classmethod
    def of(cls, values: Pair, bits: int) -> Slices:
        unit = 2.0**bits
        first = np.rint(values.high * unit) / unit
        return cls(first, (values.high - first) + values.low)

    def some(self, rows: slice) -> Slices:
        return Slices(self.first[rows], self.second[rows])


def in_slices(
    product: Callable[[Array, Array], Array], a: Slices, b: Slices
) -> tuple[Array, Array]:
    """A bilinear `product` of a and b as two parts: that of the first slices, and all the rest."""
    left = product(a.first, b.second)
    left += product(a.second, b.first + b.second)
    return product(a.first, b.first), left


@dataclass(frozen=True)
class SoftValues:
    """The softened kernel L between nodes of a mesh, multiplied by the unit of length.

    near      : the values within the reach; index i^2 + j^2 for nodes that differ by (i, j)
    distances : the values 1 / r beyond the reach
    """

    near: Pair
    distances: Distances

    @classmethod
    def of(cls, product: Product, unit: float) -> SoftValues:
        mesh, kernel, spacing = product.mesh, product.splitting.kernel, product.splitting.spacing
        basis = [[Fraction(x) / Fraction(unit) for x in row] for row in mesh.basis.tolist()]
        distances = Distances.of(basis, max(mesh.shape))
        return cls(_within_reach(kernel, spacing, unit), distances)

    @property
    def error(self) -> float:
        return self.distances.error

    def at(self, i: Indices, j: Indices) -> Pair:
        found = self.distances.at(i, j)
        squares = np.add.outer(i * i, j * j)
        near = squares < len(self.near.high)
        found.high[near], found.low[near] = self.near.at(squares[near])
        return found


def _within_reach(kernel: Softened, spacing: float, unit: float) -> Pair:
    """`unit` times L at the distances spacing sqrt(s) within the reach, for s = 0, 1, ..."""
    step = Fraction(spacing) ** 2
    nodes = math.ceil(Fraction(kernel.reach) ** 2 / step)
    return soft_values(
        soft_terms(kernel, step, nodes, 1)[0], Fraction(unit) / Fraction(kernel.reach)
    )


class MeshSums:
    """The sums over j of P_j / r_ij for exact points, on the mesh and near pairs of a product."""

    def __init__(self, product: Product) -> None:
        mesh, unit = product.mesh, 2.0 ** math.floor(math.log2(product.splitting.spacing))
        self.product, self.lows = product, _low_weights(product)
        self.pairs = SharpPairs.of(product)
        values, norm = SoftValues.of(product, unit), unit * product.kernel.norm
        self.sliced = Sliced.of(mesh, values, norm, unit, SLICES)
        self.places = np.add.outer(np.arange(mesh.shape[0]) * mesh.padded[1], range(mesh.shape[1]))

    def __call__(self, loads: Pair) -> Ball:
        product = self.product
        top = float(np.abs(loads.high).max(initial=0.0))
        if top == 0.0:
            return Ball.exact(loads)
        size = 2.0 ** np.ceil(np.log2(top))
        shares = Pair(np.asarray(loads.high / size), np.asarray(loads.low / size))  # exact
        ordered = shares.at(product.order.places)
        field, node_error = _to_nodes(product, self.lows, ordered)
        nodes = Pair(field.high.ravel(), field.low.ravel())
        on_mesh = self.sliced.sums(nodes, self.places.ravel(), np.zeros(self.places.size), 0.0)
        exact, left, unit, rounding = _from_nodes(product, self.lows, on_mesh)
        near, errors = self.pairs(ordered)
        back = np.argsort(product.order.places)
        total = (Pair(*two_sum(exact * unit, left * unit)) + near).at(back)

        field_error = node_error * math.sqrt(field.high.size)
        error = float(on_mesh.radius.max()) + product.kernel.norm * field_error
        error *= lebesgue(product.splitting.kernel.order) ** 2
        sizes = np.abs(shares.high)
        whole = total.high if shares.high.min() >= 0 else product.apply(sizes)
        error += _relative(product) * float(whole.max()) + rounding * unit
        radius = errors[back] + product.interpolation(sizes) + error
        return Ball.around(Pair(total.high * size, total.low * size), 1.01 * radius * size)


def _low_weights(product: Product) -> LowWeights:
    """(n, width) the low parts of the interpolation weights in x and in y, in single precision."""
    shape = len(product.order.places), product.splitting.width
    x, y = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.float32)
    for start in range(0, len(x), PLACES):
        some = slice(start, start + PLACES)
        weights = twofold_weights(product.order, product.splitting, some)
        x[some], y[some] = (factor.low for factor in weights)
    return x, y


def _to_nodes(product: Product, lows: LowWeights, ordered: Pair) -> tuple[Pair, float]:
    """W^T P for sorted loads P of at most 1, and a bound on the error at every node."""
    assert product.weights is not None
    met = _met(product)
    bits = (DIGITS - met.bit_length()) // 2
    exact, left = np.zeros(product.weights.shape), np.zeros(product.weights.shape)
    for some, patches, x, y in _weighed(product, lows):
        mine = ordered.at(np.s_[some, None])
        high, low = two_product(mine.high, y.high)
        low = low + (mine.high * y.low + mine.low * y.high)
        charges = Slices.of(Pair(high, low), bits)
        factors = Slices.of(x, bits)
        for rows, i, j in patches:
            first, second = in_slices(lambda a, b: a.T @ b, factors.some(rows), charges.some(rows))
            exact[i, j] += first
            left[i, j] += second
    error = met * ((2 * met + 8) * ROUNDOFF * 2.0**-bits + 4 * TWOFOLD_WEIGHT)
    return Pair(*two_sum(exact, left)), error


def _from_nodes(
    product: Product, lows: LowWeights, on_mesh: Ball
) -> tuple[Array, Array, float, float]:
    """W times values on the mesh, as whole numbers (n,) plus rests (n,), in a unit.

    Also returned are this unit and a bound on the error, in this unit.
    """
    high, low = (np.asarray(each).reshape(product.mesh.shape) for each in on_mesh.mid)
    scale = 2.0 ** -np.ceil(np.log2(np.abs(high).max() + 1e-300))
    values = Slices.of(Pair(high * scale, low * scale), BITS)
    unit = 2.0 ** (-2 * BITS)
    exact, left = np.empty(len(product.order.places)), np.empty(len(product.order.places))
    for some, patches, x, y in _weighed(product, lows):
        across, along = Slices.of(x, BITS), Slices.of(y, BITS)
        for rows, i, j in patches:
            nodes = Slices(values.first[i, j], values.second[i, j])
            lines = Slices.of(Pair(*in_slices(np.matmul, across.some(rows), nodes)), BITS)
            here = slice(some.start + rows.start, some.start + rows.stop)
            exact[here], left[here] = in_slices(
                partial(np.einsum, "ij,ij->i"), lines, along.some(rows)
            )
    # Sums of |weights| are below 4; sums of the second slices of p weights are below p 2^-BITS.
    kernel, width = product.splitting.kernel, product.splitting.width
    rounding = 12 * kernel.order * (width + 8) * ROUNDOFF * 2.0**-BITS + 32 * TWOFOLD_WEIGHT
    return exact / unit, left / unit, unit / scale, rounding / unit


def _weighed(
    product: Product, lows: LowWeights
) -> Iterator[tuple[slice, list[tuple[slice, slice, slice]], Pair, Pair]]:
    """For each group of patches: its points, the slices of each patch, and the weights in x and y.

    The slices of a patch are those of its points within the group, and of its nodes in x and y.
    """
    assert product.weights is not None
    weights, width = product.weights, product.splitting.width
    for k in range(0, len(weights.patches), PATCHES):
        patches = weights.patches[k : k + PATCHES]
        start, some = patches[0][0], slice(patches[0][0], patches[-1][1])
        places = [
            (slice(a - start, b - start), slice(i, i + width), slice(j, j + width))
            for a, b, i, j in patches
        ]
        x, y = Pair(weights.x[some], lows[0][some]), Pair(weights.y[some], lows[1][some])
        yield some, places, x, y


def _met(product: Product) -> int:
    """The largest number of points whose stencils contain the same node."""
    assert product.weights is not None
    order, counts = product.splitting.kernel.order, np.zeros(product.weights.shape, dtype=np.intp)
    np.add.at(counts, tuple(product.order.cells.T), 1)
    for rows in (counts, counts.T):
        rows[:] = rows.cumsum(axis=0)
        rows[order:] -= rows[:-order].copy()
    return int(counts.max())


def _relative(product: Product) -> float:
    """Relative error of distant pairs due to interpolation and to rounded positions in cells."""
    kernel, spacing = product.splitting.kernel, product.splitting.spacing
    return kernel.far_error(spacing) + kernel.moved(2.0 * ROUNDOFF * spacing)
