"""Sliced products against long integers, ball arithmetic and exact fractions."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx
from multiprecision import exact, inverse_sum, middle
from numpy.typing import NDArray
from point_layouts import lattice_patch, loadings, on_lattice

from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array
from convexrough.influence.convolution import SiteBox, through_waves
from convexrough.influence.sliced import Distances, Sliced, cut

BASES = {
    "hexagonal": [[1.0, 0.0], [0.5, 0.8660254037844386]],
    "turned": [[0.9, 0.31], [-0.4, 1.1]],
    "long": [[1.0, 0.02], [0.3, 37.0]],
}


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


def among(ball: Ball, m: int) -> arb:
    """A component of a ball, as a ball of another library."""
    return middle(ball[m]) + arb(0, float(ball.radius[m]))


@pytest.mark.sample(5)
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
            for s in range(level + 1):
                rows, columns = np.indices(shape)
                kernel = values[level - s][m - rows + shape[0] - 1, n - columns + shape[1] - 1]
                true += (kernel.astype(int).astype(object) * fields[s]).sum()
            assert abs(Fraction(float(levels[level][m, n])) - true) < 0.1


@pytest.mark.sample(6)
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
    with ctx.workprec(300):
        points = exact(np.stack(np.indices(shape), axis=-1).reshape(-1, 2)) @ exact(basis)
        for row in (0, 16 * 23 + 22, 8 * 23 + 3):
            true = inverse_sum(points, exact(loads.high) + exact(loads.low), points[row])
            assert among(found, row).contains(true)
    assert found.radius.max() < good * float(np.abs(loads.high).sum()) / unit


def perturbed(seed: int, count: int) -> Array:
    """Points of a lattice, off their sites by rounding and as much as is allowed."""
    rng = np.random.default_rng(seed)
    basis = np.array([[1.0, 0.1], [0.45, 0.8]]) * 1e-3
    points = lattice_patch(basis, count) + rng.uniform(-1, 1, 2)
    return np.asarray(points * (1 + rng.choice([-1, 0, 1], points.shape) * 2.0**-53))


@pytest.mark.sample(3)
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("slices", [2, 3, 4])
def test_points_are_where_they_are(seed: int, slices: int) -> None:
    """What points are off their sites is taken into account."""
    points = perturbed(seed, 120)
    A = on_lattice(points, 1.0)
    loads = np.random.default_rng(seed).random(120)
    found = A.sums(Pair.exact(loads), slices)
    worst = 0.0
    with ctx.workprec(200):
        for m in (0, 17, 119):
            true = inverse_sum(exact(points), exact(loads), exact(points[m]))
            assert among(found, m).contains(true)
            worst = max(worst, float(abs(middle(found[m]) - true).mid()))
    bound = float(found.radius.max())
    assert bound < {2: 1e-4, 3: 1e-9, 4: 1e-10}[slices] * A.rounding(loads).each
    assert worst < 0.1 * bound
