"""The coupling, its rounding bound, and the shell lemma."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scenes import paper, rough, scattered

from convexrough.influence import DenseInfluence, inverse_distances, shell_radii

SCALE = 0.37


def exact_product(points: np.ndarray, scale: float, loads: np.ndarray) -> list[arb]:
    """A P in 60 digits, of points taken as exact."""
    ctx.dps = 60
    x = [[arb(float(c)) for c in point] for point in points]
    rows = []
    for i, (xi, yi) in enumerate(x):
        total = arb(0)
        for j, (xj, yj) in enumerate(x):
            if i != j:
                apart = ((xi - xj) * (xi - xj) + (yi - yj) * (yi - yj)).sqrt()
                total += arb(scale) / apart * arb(float(loads[j]))
        rows.append(total)
    return rows


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 150))
def test_product_error_is_a_bound(seed: int, count: int) -> None:
    """Also where the sum is cut into blocks (beyond 64)."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 2))
    loads = rng.random(count) ** 8
    operator = DenseInfluence.assemble(points, SCALE)
    computed, exact = operator.apply(loads), exact_product(points, SCALE, loads)
    for value, true in zip(computed, exact, strict=True):
        assert abs(float((arb(float(value)) - true) / true)) <= operator.product_error


def test_point_error_is_counted() -> None:
    """Contact points of the closest geometry are rounded: the product bound covers that too."""
    scene = rough("closest")
    blur = 3 * 2.0**-53 * np.abs(scene.contact_points).max()
    operator = DenseInfluence.assemble(scene.contact_points, SCALE, blur)
    exact_points = [
        [Fraction(float(c)) * Fraction(1) / (Fraction(1) + Fraction(float(rho))) for c in position]
        for position, rho in zip(
            scene.asperities.positions, scene.asperities.tip_radii, strict=True
        )
    ]
    ctx.dps = 60
    (xi, yi), (xj, yj) = exact_points[5], exact_points[17]
    square = (xi - xj) ** 2 + (yi - yj) ** 2
    true = arb(SCALE) / (arb(square.numerator) / arb(square.denominator)).sqrt()
    relative = abs(float((arb(float(operator.matrix[5, 17])) - true) / true))
    assert relative <= operator.entry_error


def test_matrix_spread_and_rows_elsewhere() -> None:
    points = paper().contact_points
    operator = DenseInfluence.assemble(points, SCALE)
    rng = np.random.default_rng(1)
    loads = rng.random(len(points))
    assert_allclose(operator.matrix, operator.matrix.T)
    assert (np.diag(operator.matrix) == 0).all()
    assert_allclose(operator.spread(loads), np.sqrt(operator.matrix**2 @ loads))
    others = rng.uniform(-1, 1, (7, 2))
    ((block, rows, error),) = operator.elsewhere(others)
    assert block == slice(0, 7)
    assert 0 < error < 1e-14
    assert_allclose(rows, SCALE * inverse_distances(others, points))


def test_shell_radii() -> None:
    points = np.array([[0, 0], [1, 0], [4, 0]], dtype=float)
    assert_allclose(shell_radii(points), [0.5, 0.5, 1.5])
    assert shell_radii(points[:1]) == np.inf


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 40), st.floats(0.3, 4))
def test_shell_lemma(seed: int, count: int, shape: float) -> None:
    """A + diag(1 / (pi E* s_i)) is positive semidefinite for any layout."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((count, 2)) * np.abs(rng.standard_normal((count, 1))) ** shape
    matrix = inverse_distances(points, points)
    shifted = matrix + np.diag(1 / shell_radii(points))
    eigenvalues = np.linalg.eigvalsh(shifted)
    assert eigenvalues[0] >= -1e-13 * eigenvalues[-1]
    assert np.linalg.eigvalsh(matrix)[0] < 0  # so the shift is needed


def test_shell_lemma_is_sharp_for_a_pair() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0]])
    shifted = inverse_distances(points, points) + np.diag(0.5 / shell_radii(points))
    assert np.linalg.eigvalsh(shifted)[0] == pytest.approx(0.0, abs=1e-15)


def test_shells_do_not_overlap() -> None:
    scene, _ = scattered(3, 30, 0.5, 0.0)
    points = scene.contact_points
    radii = shell_radii(points)
    inverse = inverse_distances(points, points)
    assert ((radii[:, None] + radii) * inverse <= 1 + 1e-14).all()
