"""Sums on a lattice by slices, and on a mesh: against long integers, fractions, ball arithmetic."""

from fractions import Fraction
from math import ceil, floor, log2, prod

import numpy as np
import pytest
from flint import arb, ctx
from multiprecision import assert_sums, exact, fractions, quotient
from numpy.typing import NDArray
from scenes import LATTICES, disc, lattice_operator, lattice_patch, loadings

from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array
from convexrough.influence import sharp_sums as sharp
from convexrough.influence.convolution import SiteBox, through_waves
from convexrough.influence.pair_sums import Product
from convexrough.influence.sliced import Distances, Sliced, cut
from convexrough.influence.softened import Softened, exact_series
from convexrough.influence.splitting import Splitting

BASES = LATTICES | {"long": [[1.0, 0.02], [0.3, 37.0]]}


def sliced_on(
    basis: Array, unit: float, shape: tuple[int, int], count: int
) -> tuple[SiteBox, NDArray[np.intp], Distances, Sliced]:
    """A box of sites, where they are in it, their distances over `unit`, and slices of those."""
    length = np.hypot(*basis[0])
    box = SiteBox(shape, basis / length)
    exactly = [[Fraction(x) / Fraction(unit) for x in row] for row in basis.tolist()]
    distances, norm = Distances.of(exactly, max(shape)), box.kernel(1, np.float64).norm
    places = np.add.outer(np.arange(shape[0]) * box.stride, np.arange(shape[1])).ravel()
    return box, places, distances, Sliced.of(box, distances, norm * unit / length, unit, count)


@pytest.mark.parametrize("name", BASES)
@pytest.mark.parametrize("count", [2, 3, 4, 5])
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (7, 1), (9, 11), (24, 31)])
def test_levels_are_exact(name: str, count: int, shape: tuple[int, int]) -> None:
    """Against long integers, bit for bit, with so much to spare that rounding is sure."""
    box, places, distances, sliced = sliced_on(np.array(BASES[name]), 0.5, shape, count)
    loads = Pair.exact(np.random.default_rng(1).random(shape[0] * shape[1]) ** 3)
    slices, _ = sliced._cut(loads)
    fields = [each.reshape(shape).astype(int).astype(object) for each in slices]
    laid_out = [box.laid_out(each, places) for each in slices]
    levels = through_waves(laid_out, box.padded, 1, sliced._levels)
    # The slices of the kernel, from its values: K(-d) = K(d).
    i, j = np.arange(-shape[0] + 1, shape[0]), np.arange(-shape[1] + 1, shape[1])
    values = cut(distances.at(i, j), sliced.bits, sliced.more, count)
    for kernel, each in zip(sliced.kernels, values, strict=True):
        assert kernel.norm == pytest.approx(float(np.linalg.norm(each)), rel=1e-12)
    for level in range(count - 1):
        for m, n in [(0, 0), (shape[0] - 1, 0), (shape[0] // 2, shape[1] // 2)]:
            true = 0
            for kernel, field in zip(values[level::-1], fields, strict=False):
                seen = kernel[m : m + shape[0], n : n + shape[1]][::-1, ::-1]
                true += (seen.astype(int).astype(object) * field).sum()
            assert abs(Fraction(float(levels[level][m, n])) - true) < 0.1


@pytest.mark.parametrize(("length", "unit"), [(1.0, 0.5), (1.3e-5, 2.0**-17)])
@pytest.mark.parametrize("name", BASES)
@pytest.mark.parametrize("loading", range(5))
@pytest.mark.parametrize("count", [2, 3, 4])
def test_sums_against_ball_arithmetic(
    name: str, length: float, unit: float, loading: int, count: int
) -> None:
    basis, shape = np.array(BASES[name]) * length, (17, 23)
    _, places, _, sliced = sliced_on(basis, unit, shape, count)
    rng = np.random.default_rng(2)
    high = loadings(shape[0] * shape[1], rng)[loading]
    loads = Pair(high, high * rng.uniform(-1, 1, len(high)) * 2.0**-54)
    found, good = sliced.sums(loads, places), {2: 1e-18, 3: 1e-22, 4: 1e-26}[count]
    with ctx.workprec(400):
        points = exact(np.stack(np.indices(shape), axis=-1).reshape(-1, 2)) @ exact(basis)
    assert_sums(found, points, loads, (0, 16 * 23 + 22, 8 * 23 + 3))
    assert found.radius.max() < good * float(np.abs(loads.high).sum()) / unit


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("slices", [2, 3, 4])
def test_points_are_where_they_are(seed: int, slices: int) -> None:
    """What points are off their sites, by rounding and what is allowed, is taken into account."""
    rng, basis = np.random.default_rng(seed), np.array([[1.0, 0.1], [0.45, 0.8]]) * 1e-3
    points = lattice_patch(basis, 120) + rng.uniform(-1, 1, 2)
    points *= 1 + rng.choice([-1, 0, 1], points.shape) * 2.0**-53
    A, loads = lattice_operator(points, 1.0), Pair.exact(rng.random(120))
    found = A.sums(loads, slices)
    bound = float(found.radius.max())
    assert bound < {2: 1e-4, 3: 1e-9, 4: 1e-10}[slices] * A.rounding(loads.high).each
    assert assert_sums(found, exact(points), loads, (0, 17, 119)) < 0.1 * bound


SPACING = 0.0371
KERNELS = {order: Softened(1, order, 0.43) for order in (4, 12, 26)}


def assembled(order: int, points: Array) -> Product:
    return Product.assemble(points, Splitting(KERNELS[order], SPACING, 5), np.float64)


def soft(kernel: Softened, squares: Fraction) -> arb:
    """L, at working precision."""
    t = 1 - squares / Fraction(kernel.reach) ** 2
    a = arb(kernel.reach)
    if t <= 0:
        return 1 / quotient(squares).sqrt() ** kernel.power
    terms = exact_series(kernel.order, kernel.power)
    return quotient(sum((c * t**k for k, c in enumerate(terms)), Fraction(0))) / a**kernel.power


def weight(place: float, which: int, order: int) -> Fraction:
    """Of the node so many after the first of a stencil, which are counted from 1 - p/2."""
    stencil = range(1 - order // 2, order // 2 + 1)
    node = stencil[which]
    return prod((Fraction(place) - other) / (node - other) for other in stencil if other != node)


@pytest.mark.parametrize("order", [4, 12, 26])
def test_values_within_the_reach_and_beyond(order: int) -> None:
    product = assembled(order, disc(np.random.default_rng(1), 60))
    unit = 2.0 ** floor(log2(SPACING))
    values = sharp.SoftValues.between(product, unit)
    assert len(values.near.high) == ceil((0.43 / SPACING) ** 2)
    i, j = np.arange(0, 20), np.arange(-14, 15)
    head, rest = values.at(i, j)
    with ctx.workprec(300):
        for m, n in np.ndindex(head.shape):
            squares = Fraction(SPACING) ** 2 * int(i[m] ** 2 + j[n] ** 2)
            true = soft(KERNELS[order], squares) * arb(unit)
            off = abs(arb(head[m, n]) + arb(rest[m, n]) - true)
            assert off <= arb(values.error) * true
    near = (i[:, None] * SPACING) ** 2 + (j * SPACING) ** 2 < 0.43**2
    assert 0 < near.sum() < near.size
    assert float(np.abs(head).max()) < 1


@pytest.mark.parametrize("order", [4, 12, 26])
@pytest.mark.parametrize("crowded", [False, True])
def test_loads_on_nodes(order: int, crowded: bool) -> None:
    """Against exact weights: so well that a weight known to a roundoff alone would not do."""
    rng = np.random.default_rng(order)
    points = disc(rng, 300) * (0.05 if crowded else 0.4)
    points[0] = 0.7, 0.6
    product, loads = assembled(order, points), rng.uniform(-1, 1, 300) ** 3
    placed = product.mesh
    field, error = sharp._to_nodes(product, Pair.exact(loads[placed.places]))
    plain = placed.to_nodes(loads[placed.places])[:, : placed.box.shape[1]]
    assert field.high.shape == placed.box.shape
    missed = 0
    heavy = np.stack(np.unravel_index(np.argsort(-np.abs(plain), axis=None)[:200], plain.shape))
    for a, b in rng.permutation(heavy.T)[:8].tolist():
        true = total = Fraction(0)
        # A stencil begins at its cell, as nodes are counted from 1 - p/2.
        nodes = np.stack((a - placed.cells[:, 0], b - placed.cells[:, 1]), axis=1)
        for k in np.flatnonzero(((nodes >= 0) & (nodes < order)).all(axis=1)):
            x, y = map(weight, placed.shares[k].tolist(), nodes[k].tolist(), 2 * [order])
            part = Fraction(float(loads[placed.places[k]])) * x * y
            true, total = true + part, total + abs(part)
        found = Fraction(float(field.high[a, b])) + Fraction(float(field.low[a, b]))
        assert abs(found - true) <= min(error, 1e-19 * total + 1e-20)
        missed += abs(Fraction(float(plain[a, b])) - true) > 1e-19 * total + 1e-20
    assert missed > 1
    met = np.zeros(placed.box.shape)
    for i, j in placed.cells.tolist():
        met[i : i + order, j : j + order] += 1
    assert sharp._met(product) == met.max()


@pytest.mark.parametrize("order", [4, 12, 26])
def test_values_at_points(order: int) -> None:
    rng = np.random.default_rng(order)
    product = assembled(order, disc(rng, 200))
    placed = product.mesh
    whole = np.rint(rng.uniform(-1, 1, placed.box.shape) * 2.0**43)
    rest = rng.uniform(-1, 1, placed.box.shape) * 2.0**20
    nodes = Pair((whole * 2.0**-40).ravel(), (rest * 2.0**-40).ravel())
    exactly, left, unit, rounding = sharp._from_nodes(product, Ball.exact(nodes))
    assert (exactly == np.rint(exactly)).all()
    plain = placed.from_nodes(whole + rest) * 2.0**-40
    loads, missed = fractions(whole) + fractions(rest), 0
    for k in range(0, 200, 20):
        (i, j), places = placed.cells[k], placed.shares[k].tolist()
        x, y = (np.array([weight(each, n, order) for n in range(order)]) for each in places)
        true = x @ loads[i : i + order, j : j + order] @ y / 2**40
        found = (Fraction(float(exactly[k])) + Fraction(float(left[k]))) * Fraction(unit)
        assert abs(found - true) <= Fraction(rounding) * Fraction(unit)
        missed += abs(Fraction(float(plain[k])) - true) > Fraction(rounding) * Fraction(unit)
    assert missed > 2
