"""Sharp sums on a mesh against exact fractions and ball arithmetic: each step, and all together."""

from fractions import Fraction
from itertools import product as product_of
from math import ceil, floor, log2

import numpy as np
import pytest
from flint import arb, ctx
from multiprecision import quotient
from point_layouts import disc

from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array
from convexrough.influence import sharp_sums as sharp
from convexrough.influence.pair_sums import Product
from convexrough.influence.softened import Softened, exact_series
from convexrough.influence.splitting import Splitting

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


def weight(place: float, node: int, order: int) -> Fraction:
    result = Fraction(1)
    for other in range(1 - order // 2, order // 2 + 1):
        if other != node:
            result *= (Fraction(place) - other) / (node - other)
    return result


@pytest.mark.sample(1)
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
    assert near.any()
    assert not near.all()
    assert float(np.abs(head).max()) < 1


@pytest.mark.sample(1)
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
            places = zip(
                placed.shares[k].tolist(), (nodes[k] + 1 - order // 2).tolist(), strict=True
            )
            x, y = (weight(place, node, order) for place, node in places)
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


@pytest.mark.sample(1)
@pytest.mark.parametrize("order", [4, 12, 26])
def test_values_at_points(order: int) -> None:
    rng = np.random.default_rng(order)
    product = assembled(order, disc(rng, 200))
    placed = product.mesh
    whole = np.rint(rng.uniform(-1, 1, placed.box.shape) * 2.0**43)
    rest = rng.uniform(-1, 1, placed.box.shape) * 2.0**20
    nodes = Pair((whole * 2.0**-40).ravel(), (rest * 2.0**-40).ravel())
    on_mesh = Ball.exact(nodes)
    exactly, left, unit, rounding = sharp._from_nodes(product, on_mesh)
    assert (exactly == np.rint(exactly)).all()
    plain = placed.from_nodes(whole + rest) * 2.0**-40
    missed = 0
    for k in range(0, 200, 20):
        true = Fraction(0)
        stencil = range(1 - order // 2, order // 2 + 1)
        factors = (
            [weight(place, n, order) for n in stencil] for place in placed.shares[k].tolist()
        )
        i, j = placed.cells[k].tolist()
        for (m, x), (n, y) in product_of(*map(enumerate, factors)):
            true += x * y * (Fraction(whole[i + m, j + n]) + Fraction(rest[i + m, j + n]))
        true /= 2**40
        found = (Fraction(float(exactly[k])) + Fraction(float(left[k]))) * Fraction(unit)
        assert abs(found - true) <= Fraction(rounding) * Fraction(unit)
        missed += abs(Fraction(float(plain[k])) - true) > Fraction(rounding) * Fraction(unit)
    assert missed > 2
