"""The proof of docs/theory/exact-cones.md, step by step; and Cholesky as a proof.

The cones are those that the package sends; definite matrices are judged by exact determinants.
"""

from typing import Any

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat
from hypothesis import given, settings
from hypothesis import strategies as st

from convexrough.arrays import Array
from convexrough.convex.cones import FIVE_CONES, FIVE_CONES_LIMIT, FOUR_CONES, FOUR_CONES_LIMIT
from convexrough.convex.definite import is_definite, proved_margin
from convexrough.roundoff import ROUNDOFF

S, s, t = sp.symbols("S s t", nonnegative=True)
LIFT = sp.symbols("y1 y2 y3 y4 y5 z")
Y1, Y2, Y3, Y4, Y5, Z = LIFT
CURVE = dict(zip(LIFT, (t, t**2, t**3, t**4, t**5, t**5 - t**6), strict=True))
LIMIT_FOUR = sp.Rational(21, 25)

# The tangent of (3/5) t^5 - (S/3) t^6 in t^3 at t = s:  lam t^3 - mu.
ENERGY = sp.Rational(3, 5) * t**5 - S / 3 * t**6
LIFTED_ENERGY = (sp.Rational(3, 5) - S / 3) * Y5 + S / 3 * Z
LAM = s**2 - 2 * S / 3 * s**3
MU = sp.Rational(2, 5) * s**5 - S / 3 * s**6

# Weights of the cones, in the order of FOUR_CONES and FIVE_CONES.
C = 4 * s / 5 - 2 * S / 3 * s**2
D = 2 * s / 5 - S / 3 * s**2
E = sp.Rational(3, 5) - S / 3 - 2 * S / 3 * s + C
FOUR_WEIGHTS = (D, C, E, S / 3)

A0 = sp.Rational(2, 5) * s**3 - S / 3 * s**4
B1 = s**2 * (s + 2) * (sp.Rational(2, 5) - S / 3 * s)
C2 = s * (s**2 + 2 * s + 3) * (sp.Rational(2, 5) - S / 3 * s)
E3 = sp.Rational(3, 5) - S / 3 - 2 * S / 3 * s + C2
FIVE_WEIGHTS = (A0, B1, C2, E3, S / 3)


def forms(cones: Any) -> list[tuple[Any, Any, Any]]:
    """x, y, w of every cone as expressions in the lift."""
    columns = sp.Matrix([1, *LIFT])
    return [tuple(sp.Matrix(cone).applyfunc(sp.nsimplify) * columns) for cone in cones]


def tangents(cones: Any) -> list[Any]:
    """x s^2 - 2 w s + y of every cone: not negative where x y >= w^2 and x, y >= 0."""
    slopes = ((cone, s**2 if cone[0] == 1 else s) for cone in forms(cones))
    return [x * slope**2 - 2 * w * slope + y for (x, y, w), slope in slopes]


def never_negative(polynomial: Any, limit: Any) -> bool:
    """On 0 <= s <= 1, 0 <= S <= limit: as s = 1 / (1 + a), S = limit / (1 + b) for a, b >= 0."""
    a, b = sp.symbols("a b", nonnegative=True)
    inside = polynomial.subs({s: 1 / (1 + a), S: limit / (1 + b)}, simultaneous=True)
    return sp.cancel(inside).is_nonnegative is True  # by the signs of its coefficients


FOUR_AS_PRINTED = (t - s) ** 2 * (S / 3 * t**3 * (1 - t) + C * t**2 * (1 - t) + E * t**3)
FOUR_AS_PRINTED += D * (t**2 - s**2) ** 2
FIVE_AS_PRINTED = S / 3 * t**3 * (1 - t) + C2 * t**2 * (1 - t) + E3 * t**3
FIVE_AS_PRINTED = (t - s) ** 2 * (FIVE_AS_PRINTED + B1 * t * (1 - t) + A0 * (1 - t))

#: The cones, the limit of S, the weights, and what their sum is where the lift is the powers of t.
PROGRAMS = [
    (FOUR_CONES, (FOUR_CONES_LIMIT, LIMIT_FOUR), FOUR_WEIGHTS, FOUR_AS_PRINTED),
    (FIVE_CONES, (FIVE_CONES_LIMIT, sp.Integer(1)), FIVE_WEIGHTS, FIVE_AS_PRINTED),
]


@pytest.mark.parametrize(("cones", "limits", "weights", "printed"), PROGRAMS)
def test_the_lifted_energy_less_a_tangent_is_a_sum_of_cones(
    cones: Any, limits: Any, weights: Any, printed: Any
) -> None:
    """With weights that are not negative up to the limit; powers of t satisfy the cones with
    equality, and the page prints the identity for them.
    """
    for x, y, w in forms(cones):
        on_curve = [sp.expand(form.subs(CURVE)) for form in (x, y, w)]
        assert sp.expand(on_curve[0] * on_curve[1] - on_curve[2] ** 2) == 0
        assert all(never_negative(form.subs(t, s), 1) for form in on_curve[:2])
    assert sp.expand(LIFTED_ENERGY.subs(CURVE) - ENERGY) == 0
    combination = sum(w * cone for w, cone in zip(weights, tangents(cones), strict=True))
    assert sp.expand(LIFTED_ENERGY - LAM * Y3 + MU - combination) == 0
    assert sp.expand(combination.subs(CURVE) - printed) == 0
    package, limit = limits
    assert package == float(limit)
    assert all(never_negative(weight, limit) for weight in weights)


def test_the_limits_are_sharp() -> None:
    """At t = s = 1 the weight of y3 y5 >= y4^2 passes through 0 at the limit, downwards in S."""
    assert sp.expand(E.subs(s, 1) - sp.Rational(5, 3) * (LIMIT_FOUR - S)) == 0
    assert sp.expand(E3.subs(s, 1) - 3 * (1 - S)) == 0
    # Beyond S = 1 there is nothing left to answer: the energy itself is not convex in the load.
    slope = sp.diff(LAM, s)
    assert sp.expand(slope.subs(s, 1) - 2 * (1 - S)) == 0
    factored = (1 - s) * (5 * s**3 + 9 * s**2 + 12 * s + 4) / 15
    assert sp.expand(E3.subs(S, 1) - factored) == 0


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
