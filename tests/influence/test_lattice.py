"""Lattices found from points, and the coupling on them against exact sums over all pairs."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from extended import inverse_sums
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from point_layouts import on_lattice

from convexrough.influence.coupling import inverse_distances
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.lattice import LatticeInfluence
from convexrough.influence.scattered import ScatteredInfluence
from convexrough.influence.shells import fitted_shells
from convexrough.roundoff import ROUNDOFF
from convexrough.scene.lattice import SITE_ERROR, Lattice

Array = NDArray[np.float64]

SCALE = 0.37
BASES = {
    "hexagonal": [[1.0, 0.0], [0.5, np.sqrt(0.75)]],
    "square": [[1.0, 0.0], [0.0, 1.0]],
    "rectangular": [[1.0, 0.0], [0.0, 2.6]],
    "sheared": [[1.0, 0.0], [7.3, 1.4]],
}


def turned(basis: Any, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array(basis) @ np.array([[c, s], [-s, c]])


def patch(basis: Array, count: int) -> Array:
    """The sites nearest to the origin, of a lattice given by any basis."""
    steps = np.arange(-120, 121) if count > 300 else np.arange(-40, 41)
    points = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) @ basis
    order = np.argsort((points**2).sum(axis=1), kind="stable")
    return points[order[:count]]


def operator(points: Array) -> LatticeInfluence:
    return on_lattice(points, SCALE)


def assert_spans(lattice: Lattice, basis: Array) -> None:
    """Two bases of one lattice differ by a whole matrix of determinant +-1."""
    change = basis @ np.linalg.inv(lattice.basis)
    assert_allclose(change, np.rint(change), atol=1e-9)
    assert abs(np.linalg.det(change)) == pytest.approx(1.0)


# Finding a lattice.


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(sorted(BASES)),
    st.integers(3, 200),
    st.floats(0, 6.3),
    st.floats(-3, 6),
    st.floats(-9, 9),
)
def test_a_lattice_is_found(name: str, count: int, angle: float, shift: float, size: float) -> None:
    """Turned, shifted by up to a million spacings, of any size; in a reduced basis.

    The distance of each coordinate from its site is within the bound, in exact arithmetic.
    """
    basis = 10**size * turned(BASES[name], angle)
    points = patch(basis, max(count, 30 if name == "rectangular" else 9))
    points = points + 10**size * np.array([10**shift, -(10**shift)])
    lattice = Lattice.through(points)
    assert lattice is not None
    assert_spans(lattice, basis)
    a, b = lattice.basis
    assert lattice.spacing == pytest.approx(np.hypot(*a))
    assert a @ a <= (b @ b) * (1 + 1e-8)
    assert abs(a @ b) <= 0.5 * (a @ a) * (1 + 1e-8)
    apart = inverse_distances(points, points).max()
    assert lattice.spacing == pytest.approx(1 / apart, rel=1e-9)
    assert lattice.site_error <= 2 * SITE_ERROR * np.abs(points).max()
    sites = lattice.sites(points)
    assert sites is not None
    assert len(np.unique(sites, axis=0)) == len(points)
    origin, vectors, exact = map(np.vectorize(Fraction), (lattice.origin, lattice.basis, points))
    off = np.abs(exact - origin - sites.astype(int).astype(object) @ vectors)
    assert off.max() <= Fraction(lattice.site_error)


@pytest.mark.parametrize("name", BASES)
def test_what_is_nearly_a_lattice_is_refused(name: str) -> None:
    points = patch(np.array(BASES[name]), 500)
    rng = np.random.default_rng(2)
    assert Lattice.through(points) is not None
    assert Lattice.through(points + 1e-9 * rng.standard_normal(points.shape)) is None
    for moved in (0, 100, 499):
        jittered = points.copy()
        jittered[moved, 1] += 1e-9
        assert Lattice.through(jittered) is None
    doubled = np.concatenate((points, points[77:78]))
    assert Lattice.through(doubled) is None


# Products.


def loadings(count: int, seed: int = 0) -> dict[str, Array]:
    rng = np.random.default_rng(seed)
    return {
        "even": np.ones(count),
        "many decades": 10 ** rng.uniform(-30, 0, count),
        "one": np.eye(count)[count // 3],
        "signs": rng.choice([-1.0, 1.0], count),
        "mostly none": rng.random(count) * (rng.random(count) < 0.05),
    }


@pytest.mark.sample(2)
@pytest.mark.parametrize("shift", [0.0, 300.0, 1e6])
@pytest.mark.parametrize("name", BASES)
@pytest.mark.parametrize("count", [40, 500, 1000])
def test_products(name: str, count: int, shift: float) -> None:
    """To 1e-13 of the largest displacement, and within the bounds, which are not absurd.

    Measured against extended precision: 8e-15 of the largest at most about the axis. Off it, points
    in float64 are themselves off a lattice: 6e-14 at 300 spacings. The bound is 100 to 3000 times
    what is lost.
    """
    points = patch(turned(BASES[name], 0.3), count) + shift
    A, dense = operator(points), DenseInfluence.assemble(points, SCALE)
    cases = loadings(count)
    products = inverse_sums(points, points, np.column_stack(list(cases.values())), SCALE)
    least = 1e-9 * max(1.0, 1e-3 * shift)
    for (kind, loads), exact, rest in zip(
        cases.items(), *(each.T for each in products), strict=True
    ):
        product, top = A.apply(loads), float(np.abs(exact).max())
        error = np.abs(product - exact - rest)
        assert error.max() <= max(1e-14, 3e-16 * shift) * top, kind
        assert_allclose(product, dense.apply(loads), rtol=0, atol=max(1e-13, 3e-16 * shift) * top)
        rounding, magnitude = A.rounding(loads), A.apply(np.abs(loads))
        assert (error <= rounding.of(magnitude)).all()
        beyond = np.maximum(error - rounding.relative * np.maximum(magnitude, 0), 0)
        assert beyond.max() <= rounding.each
        assert rounding.of(magnitude).max() <= least * magnitude.max()
        single = A.apply(loads.astype(np.float32))
        assert single.dtype == np.float32
        assert_allclose(single, exact, rtol=0, atol=1e-6 * top)


@settings(max_examples=3, deadline=None)
@given(st.sampled_from(sorted(BASES)), st.integers(0, 2**32 - 1), st.integers(1, 60))
def test_random_sublattices(name: str, seed: int, count: int) -> None:
    """`among` some, in any order, and `onto` others on the lattice and off it."""
    rng = np.random.default_rng(seed)
    points = patch(turned(BASES[name], 1.1), 300)
    A = operator(points)
    which = rng.permutation(300)[:count]
    others = np.setdiff1d(np.arange(300), which)
    part, loads = A.restricted(which), rng.random(count) ** 9
    assert len(part) == count
    assert (part.points == points[which]).all()
    exact, rest = inverse_sums(points[which], points[which], loads, SCALE)
    error = np.abs(part.apply(loads) - exact - rest)
    assert (error <= part.rounding(loads).of(part.apply(loads))).all()
    assert_allclose(part.apply(loads), exact, atol=1e-13 * loads.max(), rtol=0)
    mixed = points[np.concatenate((others, which[:1]))]
    for targets in (mixed, mixed + 1e-3, np.concatenate((mixed, [[0.3, 0.4]])), mixed[:0]):
        coupling = part.onto(targets)
        exact, rest = inverse_sums(targets, points[which], loads, SCALE)
        product = coupling.apply(loads)
        assert (np.abs(product - exact - rest) <= coupling.rounding(loads).of(product)).all()
        assert_allclose(product, exact, atol=1e-12 * loads.max(), rtol=1e-13)
        inverse = inverse_distances(targets, points[which])
        for power in (2, 3):
            assert (coupling.falloff(loads, power) >= inverse**power @ loads).all()


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(sorted(BASES)),
    st.integers(0, 2**32 - 1),
    st.floats(0.01, 1),
    st.sampled_from([0.0, 0.3, 3.0]),
    st.floats(0, 1),
)
def test_fitted_shells_do_not_overlap(
    name: str, seed: int, coverage: float, width: float, share: float
) -> None:
    """The premise of the shell lemma: s_i + s_j <= r_ij for all pairs, touching or not."""
    rng = np.random.default_rng(seed)
    points = patch(turned(BASES[name], 0.2), 120) + rng.choice([0.0, 1e6])
    radii = rng.lognormal(0, width, 120) * (rng.random(120) < coverage)
    inverse = inverse_distances(points, points)
    dense, scattered = DenseInfluence.assemble(points, SCALE), ScatteredInfluence(points, SCALE)
    assert scattered.crowding(radii) == pytest.approx(dense.crowding(radii), rel=1e-12)
    for A in (operator(points), scattered, dense):
        with np.errstate(divide="ignore"):
            s = SCALE / fitted_shells(A, radii, share)
        assert ((s[:, None] + s) * inverse).max() <= 1 + 4 * ROUNDOFF, A.name
