"""Sliced products against long integers, ball arithmetic and exact fractions."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import convexrough as cr
from convexrough.influence import sliced
from convexrough.influence.convolution import Box
from convexrough.influence.lattice import LatticeInfluence
from convexrough.influence.sliced import REST_ERROR, VALUE_ERROR, Distances, sliced_sums
from convexrough.normal.problem import NormalProblem
from convexrough.normal.residual import fit
from convexrough.scene.lattice import Lattice
from convexrough.twofold import TWOFOLD_ROUNDOFF, Twofold, exact_product, exact_sum

Array = NDArray[np.float64]

BASES = {
    "hexagonal": [[1.0, 0.0], [0.5, 0.8660254037844386]],
    "turned": [[0.9, 0.31], [-0.4, 1.1]],
    "long": [[1.0, 0.02], [0.3, 37.0]],
}
#: [length] units of basis vectors, and the power of two below their length.
SIZES = {"one": (1.0, 0.5), "small": (1.3e-5, 2.0**-17)}


def taken(name: str, size: str) -> tuple[Array, float]:
    length, unit = SIZES[size]
    return np.array(BASES[name]) * length, unit


def distance(basis: Array, unit: float, i: int, j: int) -> arb:
    a, b = ([arb(x) / arb(unit) for x in row] for row in basis.tolist())
    return ((i * a[0] + j * b[0]) ** 2 + (i * a[1] + j * b[1]) ** 2).sqrt()


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", BASES)
@pytest.mark.parametrize("largest", [8, 300, 4000])
def test_values_of_the_kernel(name: str, size: str, largest: int) -> None:
    basis, unit = taken(name, size)
    distances = Distances.of(basis, unit, largest)
    rng = np.random.default_rng(largest)
    i, j = rng.integers(0, largest, 12), rng.integers(-largest + 1, largest, 12)
    i[0] = j[0] = 0
    head, rest = distances.sliced(i, j)
    with ctx.workprec(200):
        for m, n in np.ndindex(head.shape):
            value = arb(head[m, n]) + arb(rest[m, n])
            if i[m] == j[n] == 0:
                assert value == 0
                continue
            exact = 1 / distance(basis, unit, int(i[m]), int(j[n]))
            assert abs(value - exact) <= arb(2.0**-70) * exact
    assert (head == head.astype(np.float32)).all()


@pytest.mark.parametrize("name", BASES)
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (7, 1), (9, 11), (24, 31)])
def test_the_whole_part_is_exact(
    name: str, shape: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against long integers, bit for bit; the rest against them and the bound."""
    basis, unit = taken(name, "one")
    box = Box(shape, basis / np.hypot(*basis[0]))
    distances = Distances.of(basis, unit, max(shape))
    loads = np.random.default_rng(1).random(shape) ** 3
    kept: list[Any] = []
    convolve = sliced._convolve

    def watched(box: Box, fields: Any, kernels: Any) -> Any:
        found = convolve(box, fields, kernels)
        kept.append((*fields, found[0].copy(), kernels[0].norm))
        return found

    monkeypatch.setattr(sliced, "_convolve", watched)
    found = sliced_sums(box, distances, unit, loads)
    assert found is not None
    first, second, computed, norm = kept[0]
    kernel_bits, _ = sliced._bits(box, distances, loads / 2.0 ** np.ceil(np.log2(loads.max())))
    i, j = np.arange(-shape[0] + 1, shape[0]), np.arange(-shape[1] + 1, shape[1])
    head, _ = distances.sliced(np.abs(i), j)  # the kernel is even
    head = np.where(i[:, None] < 0, head[:, ::-1], head)
    whole = np.rint(head * 2.0**kernel_bits)
    assert norm == pytest.approx(float(np.linalg.norm(whole)), rel=1e-12)
    integers = [[int(x) for x in row] for row in first]
    kernel = [[int(x) for x in row] for row in whole]
    for m, n in [(0, 0), (shape[0] - 1, 0), (shape[0] // 2, shape[1] // 2)]:
        exact = sum(
            kernel[m - row + shape[0] - 1][n - column + shape[1] - 1] * integers[row][column]
            for row in range(shape[0])
            for column in range(shape[1])
        )
        assert int(found.whole[m, n]) == exact
        assert abs(Fraction(float(computed[m, n])) - exact) < 0.5
    assert (np.abs(second) <= 0.5).all()


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", BASES)
@pytest.mark.parametrize("kind", ["even", "steep", "few", "negative"])
def test_sums_against_ball_arithmetic(name: str, size: str, kind: str) -> None:
    basis, unit = taken(name, size)
    shape, rng = (17, 23), np.random.default_rng(2)
    loads = rng.random(shape)
    if kind == "steep":
        loads = 10.0 ** rng.uniform(-30, 6, shape)
    elif kind == "few":
        loads *= rng.random(shape) < 0.03
    elif kind == "negative":
        loads -= 0.5
    box = Box(shape, basis / np.hypot(*basis[0]))
    found = sliced_sums(box, Distances.of(basis, unit, max(shape)), unit, loads)
    assert found is not None
    with ctx.workprec(200):
        for m, n in [(0, 0), (16, 22), (8, 3)]:
            exact = arb(0)
            for (row, column), load in np.ndenumerate(loads):
                if (row, column) != (m, n):
                    exact += arb(load) / (distance(basis, unit, m - row, n - column) * arb(unit))
            value = arb(float(found.whole[m, n])) + arb(float(found.rest[m, n]))
            off = abs(value * arb(found.unit) - exact)
            assert off <= arb(found.error) * arb(found.unit)
            largest = float(np.abs(loads).sum()) / unit
            assert found.error * found.unit < 1e-17 * largest
    assert found.norm >= found.error


def test_nothing_to_add_up() -> None:
    basis, unit = taken("turned", "one")
    found = sliced_sums(Box((3, 4), basis), Distances.of(basis, unit, 4), unit, np.zeros((3, 4)))
    assert found is not None
    assert not found.whole.any()
    assert found.error == 0


def test_slices_that_are_not_sure_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """The proof of exactness is asked for again once the slices are made."""
    basis, unit = taken("turned", "one")
    box, distances = Box((9, 9), basis), Distances.of(basis, unit, 9)
    monkeypatch.setattr(sliced, "_bits", lambda *_: (22, 30))
    assert sliced_sums(box, distances, unit, np.ones((9, 9))) is None
    monkeypatch.setattr(sliced, "_bits", lambda *_: (0, 5))
    assert sliced_sums(box, distances, unit, np.ones((9, 9))) is None
    assert 2**22 * VALUE_ERROR + REST_ERROR < 1e-13


def blurred(seed: int, count: int) -> Array:
    """Points of a lattice, off their sites by rounding and as much as is allowed."""
    rng = np.random.default_rng(seed)
    basis = np.array([[1.0, 0.1], [0.45, 0.8]]) * 1e-3
    steps = np.arange(-9, 10)
    sites = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    sites = sites[np.argsort((sites**2).sum(axis=1))][:count]
    points = sites @ basis + rng.uniform(-1, 1, 2)
    return np.asarray(points * (1 + rng.choice([-1, 0, 1], points.shape) * 2.0**-53))


@pytest.mark.parametrize("seed", range(5))
def test_points_are_where_they_are(seed: int) -> None:
    """What points are off their sites is taken into account, and has to be."""
    points = blurred(seed, 120)
    lattice = Lattice.through(points)
    assert lattice is not None
    A = LatticeInfluence.assemble(points, lattice, 1.0)
    loads = np.random.default_rng(seed).random(120)
    found = A.sums(loads)
    assert found is not None
    on_sites = worst = 0.0
    with ctx.workprec(200):
        basis = [[arb(x) for x in row] for row in lattice.basis.tolist()]
        for m in (0, 17, 119):
            exact, there = arb(0), arb(0)
            for k, load in enumerate(loads):
                if k != m:
                    x, y = (arb(float(points[m, c])) - arb(float(points[k, c])) for c in (0, 1))
                    exact += arb(float(load)) / (x * x + y * y).sqrt()
                    i, j = (int(n) for n in A.places[m] - A.places[k])
                    x, y = (i * basis[0][c] + j * basis[1][c] for c in (0, 1))
                    there += arb(float(load)) / (x * x + y * y).sqrt()
            value = arb(float(found.whole[m])) + arb(float(found.rest[m]))
            off = abs(value * arb(found.unit) - exact)
            assert off <= arb(found.error) * arb(found.unit)
            worst = max(worst, float(off.mid()))
            on_sites = max(on_sites, float(abs(there - exact).mid()))
    bound = found.error * found.unit
    assert bound < 1e-4 * A.rounding(loads).each
    assert worst < 0.1 * bound
    assert on_sites > 10 * bound  # sites alone would break it


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_twofold_numbers(seed: int) -> None:
    rng = np.random.default_rng(seed)

    def number() -> tuple[Twofold, Fraction]:
        high = float(rng.choice([-1, 1]) * 10.0 ** rng.uniform(-12, 12))
        high, low = exact_sum(high, high * float(rng.uniform(-1, 1)) * 2.0**-54)
        return Twofold(high, low), Fraction(high) + Fraction(low)

    (a, exact_a), (b, exact_b) = number(), number()
    for got, exact, size in (
        (a + b, exact_a + exact_b, abs(exact_a) + abs(exact_b)),
        (a + -b, exact_a - exact_b, abs(exact_a) + abs(exact_b)),
        (a * b, exact_a * exact_b, abs(exact_a * exact_b)),
        (a.over(b), exact_a / exact_b, abs(exact_a / exact_b)),
    ):
        off = abs(Fraction(float(got.high)) + Fraction(float(got.low)) - exact)
        assert off <= Fraction(TWOFOLD_ROUNDOFF) * size
        assert abs(got.low) <= 2.0**-52 * abs(got.high)
    total, off = exact_sum(a.high, b.high)
    assert Fraction(total) + Fraction(off) == Fraction(a.high) + Fraction(b.high)
    product, off = exact_product(a.high, b.high)
    assert Fraction(product) + Fraction(off) == Fraction(a.high) * Fraction(b.high)


@pytest.mark.parametrize("geometry", ["summit", "closest"])
@pytest.mark.parametrize("shift", [0.0, 0.3e-3, None])
def test_the_sharp_residual(geometry: Any, shift: float | None) -> None:
    """Gaps of loads, whatever these are, in ball arithmetic: within what is said of them."""
    rng = np.random.default_rng(4)
    if shift is None:  # exactly on their sites
        lattice, shift = cr.Asperities.square(spacing=2.0**-9, tip_radius=0.02, within=0.01), 0.0
    else:
        lattice = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    heights = 1e-6 * rng.standard_normal(len(lattice))
    asperities = cr.Asperities(lattice.positions + shift, 0.02, heights)
    scene = cr.Scene(1.0, asperities, cr.Material(0.7, 0.3), geometry=geometry)
    contact = cr.press(scene, approach=5e-5)
    for control in ({"approach": 5e-5}, {"load": contact.load}):
        problem = NormalProblem.assemble(scene, influence="lattice", **control)
        loads = contact.loads[problem.candidates] / problem.units.force
        weights = np.cbrt(loads)
        found = fit(problem, loads, weights if "load" in control else None)
        force, length = arb(problem.units.force), arb(problem.units.length)
        with ctx.workprec(200):
            R, rho, modulus = arb(1.0), arb(0.02), arb(0.7)
            factor = R / (R + rho) if geometry == "closest" else arb(1)
            further = rho if geometry == "closest" else arb(0)
            k = (9 * (1 / R + 1 / rho) / (16 * modulus**2)).root(3)
            gaps = []
            for m in range(len(problem)):
                i = int(problem.candidates[m])
                x, y = (arb(float(c)) for c in asperities.positions[i])
                gap = (x * x + y * y) / (2 * (R + further)) - arb(float(heights[i]))
                if loads[m] > 0:
                    gap += k * (arb(float(loads[m])) * force).root(3) ** 2
                for n in range(len(problem)):
                    if n != m and loads[n] > 0:
                        u, v = asperities.positions[int(problem.candidates[n])].tolist()
                        r = factor * ((x - arb(u)) ** 2 + (y - arb(v)) ** 2).sqrt()
                        gap += arb(float(loads[n])) * force / (arb.pi() * modulus * r)
                gaps.append(gap / length)
            if "load" in control:  # the approach is that of this mean, to twice as many digits
                total = sum((arb(float(w)) for w in weights), arb(0))
                mean = sum((arb(float(w)) * g for w, g in zip(weights, gaps, strict=True)), arb(0))
                level = mean / total
                assert abs(level - arb(found.approach)) <= arb(1e-15)
                return
            for m, gap in enumerate(gaps):
                off = abs(gap - arb(5e-5) / length - arb(float(found.gap[m])))
                assert off <= arb(float(found.rounding[m])) + arb(found.component)
        tight = found.rounding + found.component
        assert tight.max() < (3e-15 if geometry == "summit" else 1e-13)
