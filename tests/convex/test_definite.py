"""Cholesky as a proof: judged by exact determinants."""

import numpy as np
import pytest
from flint import fmpq, fmpq_mat
from hypothesis import given, settings
from hypothesis import strategies as st

from convexrough.arrays import Array
from convexrough.convex.definite import is_definite, proved_margin
from convexrough.roundoff import ROUNDOFF


def proves_margin(couplings: Array, margin: float, entry_error: float) -> bool:
    return proved_margin(couplings, (margin,), entry_error) == margin


def exact(value: float) -> fmpq:
    return fmpq(*float(value).as_integer_ratio())


def above(couplings: Array, margin: fmpq) -> bool:
    """Whether I + M > margin I, by the signs of all leading minors: no rounding."""
    n = len(couplings)
    shifted = np.vectorize(exact, otypes=[object])(couplings) + (1 - margin) * np.eye(n, dtype=int)
    minors = (fmpq_mat(shifted[:m, :m].tolist()).det() for m in range(1, n + 1))
    return all(minor > 0 for minor in minors)


def couplings(seed: int, count: int, least: float) -> Array:
    """A random M of zero diagonal for which the least eigenvalue of I + M is about `least`."""
    rng = np.random.default_rng(seed)
    matrix = rng.standard_normal((count, count)) * 10.0 ** rng.uniform(-3, 0, count)
    matrix = matrix + matrix.T
    np.fill_diagonal(matrix, 0.0)
    return np.asarray(matrix * ((least - 1.0) / np.linalg.eigvalsh(matrix)[0]))


@pytest.mark.parametrize("count", [2, 10, 40])
@pytest.mark.parametrize("margin", [1e-3, 0.1, 0.6])
def test_just_below_the_margin_is_refused(count: int, margin: float) -> None:
    """Equal couplings of 1 - mu have the least eigenvalue mu: a little more of each is too much."""
    ones = np.ones((count, count)) - np.eye(count)
    near = 4.0 * (count + 2) * count * ROUNDOFF
    assert proves_margin(ones * (1.0 - margin - near), margin, 0.0)
    for beyond in (0.0, ROUNDOFF, near, 1e-6):
        matrix = ones * (1.0 - margin + beyond)
        assert beyond == 0.0 or not above(matrix, exact(margin))
        assert not proves_margin(matrix, margin, 0.0)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 12), st.floats(-12, -2), st.floats(-3, 3))
def test_errors_of_the_entries_are_counted(
    seed: int, count: int, digits: float, room: float
) -> None:
    """Moved by all that they may be, in the worst direction, entries keep the margin."""
    error = 10.0**digits
    matrix = couplings(seed, count, 0.1 + error * 10.0**room)
    if not proves_margin(matrix, 0.1, error):
        return
    worst = np.linalg.eigh(matrix)[1][:, 0]
    moved = matrix - 0.999 * error * np.abs(matrix) * np.sign(np.outer(worst, worst))
    assert above(moved, exact(0.1))


@pytest.mark.parametrize("count", [1, 2, 5, 100])
@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_proves_nothing(count: int, wrong: float) -> None:
    """LAPACK's own word is that all is well."""
    for place in ((0, 0), (count - 1, 0), (count - 1, count - 1)):
        matrix = np.eye(count)
        assert is_definite(matrix)
        matrix[place] = matrix[place[::-1]] = wrong
        assert not is_definite(matrix)
    huge = 1e200 * (np.ones((3, 3)) - np.eye(3))
    assert not proves_margin(huge, 0.1, 0.0)
    assert not proves_margin(np.zeros((2, 2)), 0.1, np.inf)
