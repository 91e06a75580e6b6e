"""The sums of `pair_sums` to more digits, for the one product of a certificate.

docs/theory/sharp-mesh.md. What goes to the mesh, through it and back is multiplied in slices: first
ones of so few bits that their products are exact, and small rests. What is left is interpolation,
and the rounding of near pairs beside their own sum.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.influence.coupling import Sums
from convexrough.influence.mesh import PLACES, twofold_weights
from convexrough.influence.pair_sums import Product, within
from convexrough.influence.sliced import Distances, sliced_sums
from convexrough.influence.softened import TWOFOLD_WEIGHT, Softened, exact_series, lebesgue
from convexrough.roundoff import ROUNDOFF
from convexrough.twofold import Twofold, exact_product, exact_sum

#: Bits of a float64 number, and of first slices where at most 16 units are added up.
DIGITS, BITS = 53, 24

#: Patches looked at together: what a cache holds.
PATCHES = 64

#: Rings that near pairs are counted in. A heuristic: with one, too, what is said of them holds.
RINGS = 4

#: Bits after the point of the integers that L is computed with within the reach.
FIXED = 160

LowWeights: TypeAlias = tuple[NDArray[np.float32], NDArray[np.float32]]


class Slices(NamedTuple):
    """Numbers as sums of two: first ones of few bits, and all of the rest."""

    first: Array
    second: Array

    @classmethod
    def of(cls, values: Twofold, bits: int) -> Slices:
        unit = 2.0**bits
        first = np.rint(values.high * unit) / unit
        return cls(first, (values.high - first) + values.low)

    def some(self, rows: slice) -> Slices:
        return Slices(self.first[rows], self.second[rows])


def in_slices(
    product: Callable[[Array, Array], Array], a: Slices, b: Slices
) -> tuple[Array, Array]:
    """A bilinear product: of the first slices, which is exact, and of what else there is."""
    left = product(a.first, b.second)
    left += product(a.second, b.first + b.second)
    return product(a.first, b.first), left


@dataclass(frozen=True)
class SoftValues:
    """unit L between nodes of a mesh.

    heads, rests : by i^2 + j^2 within the reach;  distances : beyond;  size : the 2-norm of all
    """

    heads: Array
    rests: Array
    distances: Distances
    size: float

    @classmethod
    def of(cls, product: Product, unit: float) -> SoftValues:
        mesh, kernel, spacing = product.mesh, product.splitting.kernel, product.splitting.spacing
        heads, rests = _within_reach(kernel, spacing, unit)
        distances = Distances.of(mesh.basis, unit, max(mesh.shape))
        return cls(heads, rests, distances, unit * product.kernel.norm)

    def sliced(self, i: Indices, j: Indices) -> tuple[Array, Array]:
        head, rest = self.distances.sliced(i, j)
        squares = np.add.outer(i * i, j * j)
        near = squares < len(self.heads)
        head[near], rest[near] = self.heads[squares[near]], self.rests[squares[near]]
        return head, rest

    def norm(self, shape: tuple[int, int]) -> float:
        return self.size


def _within_reach(kernel: Softened, spacing: float, unit: float) -> tuple[Array, Array]:
    """unit L(spacing sqrt(s)), s = 0, 1, ... below the reach, as float32 numbers and rests."""
    one = 1 << FIXED
    steps = (Fraction(spacing) / Fraction(kernel.reach)) ** 2
    scale = Fraction(unit) / Fraction(kernel.reach)
    terms = [int(term * one) for term in reversed(exact_series(kernel.order, 1))]
    heads, rests = [], []
    for s in range(math.ceil(1 / steps)):
        t = int((1 - s * steps) * one)
        value = 0
        for term in terms:
            value = (value * t >> FIXED) + term
        value = value * scale.numerator // scale.denominator
        head = float(np.float32(value / one))
        heads.append(head)
        rests.append((value - int(Fraction(head) * one)) / one)
    return np.array(heads), np.array(rests)


def sharp_sums(product: Product, loads: Array) -> Sums | None:
    """sum_j P_j / r_ij for exact points; None where there is no mesh, or no slices small enough."""
    top = float(np.abs(loads).max(initial=0.0))
    if not product.splitting.meshed or top == 0.0:
        return None
    size = 2.0 ** np.ceil(np.log2(top))
    shares = loads / size  # exact
    ordered = shares[product.order.places]
    lows = _low_weights(product)
    field, node_error = _to_nodes(product, lows, ordered)
    spacing = 2.0 ** np.floor(np.log2(product.splitting.spacing))
    on_mesh = sliced_sums(product.mesh, SoftValues.of(product, spacing), spacing, *field)
    if on_mesh is None:
        return None
    exact, left, unit, rounding = _from_nodes(product, lows, on_mesh)
    left += product.near.apply(ordered) / unit
    back = np.argsort(product.order.places)
    whole, rest = exact[back], left[back]

    field_error = node_error * math.sqrt(field.high.size)
    error = on_mesh.error * on_mesh.unit + product.kernel.norm * field_error
    error *= lebesgue(product.splitting.kernel.order) ** 2
    sizes = (whole + rest) * unit if loads.min() >= 0 else product.apply(np.abs(shares))
    error += _nearby(product, np.abs(shares)) + _relative(product) * float(sizes.max())
    error = 1.01 * (error / unit + rounding)
    return Sums(whole, rest, unit * size, error, error * math.sqrt(len(loads)))


def _low_weights(product: Product) -> LowWeights:
    """What weights in x and y are more than float64 holds of them."""
    shape = len(product.order.places), product.splitting.width
    x, y = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.float32)
    for start in range(0, len(x), PLACES):
        some = slice(start, start + PLACES)
        weights = twofold_weights(product.order, product.splitting, some)
        x[some], y[some] = (factor.low for factor in weights)
    return x, y


def _to_nodes(product: Product, lows: LowWeights, ordered: Array) -> tuple[Twofold, float]:
    """W^T P for loads of at most 1, and a bound on the error at each node."""
    assert product.weights is not None
    met = _met(product)
    bits = (DIGITS - met.bit_length()) // 2
    exact, left = np.zeros(product.weights.shape), np.zeros(product.weights.shape)
    for some, patches, x, y in _weighed(product, lows):
        mine = ordered[some, None]
        high, low = exact_product(mine, y.high)
        charges = Slices.of(Twofold(high, low + mine * y.low), bits)
        factors = Slices.of(x, bits)
        for rows, i, j in patches:
            first, second = in_slices(_transposed, factors.some(rows), charges.some(rows))
            exact[i, j] += first
            left[i, j] += second
    error = met * ((2 * met + 8) * ROUNDOFF * 2.0**-bits + 4 * TWOFOLD_WEIGHT)
    return Twofold(*exact_sum(exact, left)), error


def _from_nodes(
    product: Product, lows: LowWeights, on_mesh: Sums
) -> tuple[Array, Array, float, float]:
    """W of values on the mesh: whole numbers, what is left, their unit, and the rounding in it."""
    high, low = exact_sum(on_mesh.whole, on_mesh.rest)
    scale = 2.0 ** -np.ceil(np.log2(np.abs(high).max() + 1.0))
    values = Slices.of(Twofold(high * scale, low * scale), BITS)
    unit = 2.0 ** (-2 * BITS)
    exact, left = np.empty(len(product.order.places)), np.empty(len(product.order.places))
    for some, patches, x, y in _weighed(product, lows):
        across, along = Slices.of(x, BITS), Slices.of(y, BITS)
        for rows, i, j in patches:
            nodes = Slices(values.first[i, j], values.second[i, j])
            lines = Slices.of(Twofold(*in_slices(np.matmul, across.some(rows), nodes)), BITS)
            here = slice(some.start + rows.start, some.start + rows.stop)
            exact[here], left[here] = in_slices(_row_by_row, lines, along.some(rows))
    # Sums of weights are below 4 in size; those of second slices, p of them, below p 2^-BITS.
    kernel, width = product.splitting.kernel, product.splitting.width
    rounding = 12 * kernel.order * (width + 8) * ROUNDOFF * 2.0**-BITS + 32 * TWOFOLD_WEIGHT
    return exact / unit, left / unit, unit / scale * on_mesh.unit, rounding / unit


def _weighed(
    product: Product, lows: LowWeights
) -> Iterator[tuple[slice, list[tuple[slice, slice, slice]], Twofold, Twofold]]:
    """The points of some patches; of each its rows among these, and nodes; and the weights."""
    assert product.weights is not None
    weights, width = product.weights, product.splitting.width
    for k in range(0, len(weights.patches), PATCHES):
        patches = weights.patches[k : k + PATCHES]
        start, some = patches[0][0], slice(patches[0][0], patches[-1][1])
        places = [
            (slice(a - start, b - start), slice(i, i + width), slice(j, j + width))
            for a, b, i, j in patches
        ]
        x, y = Twofold(weights.x[some], lows[0][some]), Twofold(weights.y[some], lows[1][some])
        yield some, places, x, y


def _met(product: Product) -> int:
    """The most points that a node has in its reach."""
    overlaps = (-(-product.splitting.width // product.splitting.block)) ** 2
    return overlaps * int(np.diff(product.order.starts).max())


def _nearby(product: Product, strengths: Array) -> float:
    """The largest error of interpolation, and of near pairs beside their own sums."""
    near, kernel = product.near, product.splitting.kernel
    ordered = strengths[product.order.places]
    own = near.apply(ordered) + kernel.centre * ordered
    entries = kernel.beyond_roundoffs + kernel.roundoffs + 8
    rounding = (near.terms + 4) * own + entries * (own + _smooth_nearby(product, ordered))
    return ROUNDOFF * float(rounding.max()) + float(product.interpolation(strengths).max())


def _smooth_nearby(product: Product, ordered: Array) -> Array:
    """(n,) upper bounds on the sum of L |P| over near pairs: L falls from ring to ring."""
    edges = product.splitting.cut * np.arange(RINGS + 1) / RINGS
    levels = np.append(product.splitting.kernel.smooth(edges[:-1] ** 2), 0.0)
    total = np.zeros(len(ordered))
    for edge, fall in zip(edges[1:], -np.diff(levels), strict=True):
        total += fall * within(product.order.points, ordered, float(edge))
    return total


def _relative(product: Product) -> float:
    """Of pairs far apart, and of places in cells that are rounded once."""
    kernel, spacing = product.splitting.kernel, product.splitting.spacing
    return kernel.far_error(spacing) + kernel.moved(2.0 * ROUNDOFF * spacing)


def _transposed(a: Array, b: Array) -> Array:
    return np.asarray(a.T @ b)


def _row_by_row(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", a, b))
