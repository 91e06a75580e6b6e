"""Lattices found from points."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from point_layouts import BASES, lattice_patch, turned

from convexrough.influence.coupling import inverse_distances
from convexrough.scene.lattice import SITE_ERROR, Lattice

Array = NDArray[np.float64]


def assert_spans(lattice: Lattice, basis: Array) -> None:
    """Two bases of one lattice differ by a whole matrix of determinant +-1."""
    change = basis @ np.linalg.inv(lattice.basis)
    assert_allclose(change, np.rint(change), atol=1e-9)
    assert abs(np.linalg.det(change)) == pytest.approx(1.0)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(sorted(BASES)),
    st.integers(3, 200),
    st.floats(0, 6.3),
    st.floats(-3, 6),
    st.floats(-9, 9),
)
def test_a_lattice_is_found(name: str, count: int, angle: float, shift: float, size: float) -> None:
    """Turned, shifted by up to a million spacings, of any size; in a reduced basis."""
    basis = 10**size * turned(BASES[name], angle)
    points = lattice_patch(basis, max(count, 30 if name == "rectangular" else 9))
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
    points = lattice_patch(np.array(BASES[name]), 500)
    rng = np.random.default_rng(2)
    assert Lattice.through(points) is not None
    assert Lattice.through(points + 1e-9 * rng.standard_normal(points.shape)) is None
    for moved in (0, 100, 499):
        jittered = points.copy()
        jittered[moved, 1] += 1e-9
        assert Lattice.through(jittered) is None
    doubled = np.concatenate((points, points[77:78]))
    assert Lattice.through(doubled) is None
