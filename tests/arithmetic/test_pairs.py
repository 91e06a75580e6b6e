"""Pairs against exact fractions."""

from collections.abc import Callable
from fractions import Fraction
from math import fsum

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from convexrough.arithmetic.pairs import MANY, PAIR_ROUNDOFF, Pair, square_sum, two_sum


def random_pair(seed: int, count: int, scale: float = 1.0) -> Pair:
    rng = np.random.default_rng(seed)
    high = scale * rng.choice([-1, 1], count) * 10.0 ** rng.uniform(-3, 3, count)
    return Pair(*two_sum(high, 2.0**-54 * high * rng.uniform(-1, 1, count)))


def value(number: Pair, i: int) -> Fraction:
    return Fraction(float(number.high[i])) + Fraction(float(number.low[i]))


def off(found: Pair, exact: Callable[[int], Fraction]) -> float:
    """The largest relative error."""
    true = [exact(i) for i in range(len(found.high))]
    errors = (
        abs(value(found, i) - x) / abs(x) if x else value(found, i) for i, x in enumerate(true)
    )
    return float(max(errors))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-100, 1.0, 1e100]))
def test_arithmetic(seed: int, scale: float) -> None:
    """Each operation loses less than a roundoff of pairs; differences of near numbers, too."""
    a, b = random_pair(seed, 20, scale), random_pair(seed + 1, 20, scale)
    near = a + Pair(1e-20 * a.high, 1e-40 * a.low)
    x, y = (lambda i: value(a, i)), (lambda i: value(b, i))
    assert off(a + b, lambda i: x(i) + y(i)) < PAIR_ROUNDOFF
    assert off(a - near, lambda i: x(i) - value(near, i)) < PAIR_ROUNDOFF
    assert off(a * b, lambda i: x(i) * y(i)) < PAIR_ROUNDOFF
    assert off(a / b, lambda i: x(i) / y(i)) < PAIR_ROUNDOFF
    assert off(square_sum(a.high, b.high), lambda i: _square(a, i) + _square(b, i)) < PAIR_ROUNDOFF
    positive = Pair(np.abs(a.high), np.sign(a.high) * a.low)
    size = lambda i: value(positive, i)  # noqa: E731
    # Powers of what was found have as many times its relative error.
    square, cube, both = positive.sqrt(), positive.cbrt(), positive.two_thirds()
    for found, power, exact in ((square, 2, 1), (cube, 3, 1), (both, 3, 2)):
        for i in range(20):
            assert abs(value(found, i) ** power / size(i) ** exact - 1) < power * PAIR_ROUNDOFF
            assert abs(found.low[i]) <= 2.0**-52 * abs(found.high[i])


def _square(a: Pair, i: int) -> Fraction:
    return Fraction(float(a.high[i])) ** 2


@pytest.mark.parametrize("count", [0, 1, 2, 61, 1000, MANY + 3])
def test_total(count: int) -> None:
    """To a few roundoffs of the sum of magnitudes; of rows as of one."""
    a = random_pair(count, count)
    total = a.total()
    off = fsum([*a.high, *a.low, -total.high, -total.low])  # correctly rounded
    assert abs(off) <= 2.0 * PAIR_ROUNDOFF * np.abs(a.high).sum()
    rows = Pair(*(np.stack((part, -part)) for part in a)).total()
    np.testing.assert_array_equal(rows.high, [total.high, -total.high])
    np.testing.assert_array_equal(rows.low, [total.low, -total.low])
