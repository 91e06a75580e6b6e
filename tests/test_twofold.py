"""Twofold numbers against exact fractions."""

from fractions import Fraction

import numpy as np

from convexrough.twofold import TWOFOLD_ROUNDOFF, Twofold, exact_sum


def value(number: Twofold, i: int) -> Fraction:
    return Fraction(float(number.high[i])) + Fraction(float(number.low[i]))


def test_roots_and_sums() -> None:
    random = np.random.default_rng(0)
    high = random.uniform(0.1, 9.0, 301)
    a = Twofold(*exact_sum(high, 1e-17 * random.normal(size=301) * high))
    square, cube = a.root(), a.cube_root()
    for i in range(301):
        # Twice, or three times, the relative error of the root.
        assert abs(value(square, i) ** 2 / value(a, i) - 1) < 2 * TWOFOLD_ROUNDOFF
        assert abs(value(cube, i) ** 3 / value(a, i) - 1) < 3 * TWOFOLD_ROUNDOFF
    total = a.total()
    exact = sum(value(a, i) for i in range(301))
    found = Fraction(float(total.high)) + Fraction(float(total.low))
    assert abs(found / exact - 1) < 9 * TWOFOLD_ROUNDOFF
    assert a.total() == total
    rows = Twofold(*(np.stack((part, part[::-1])) for part in a)).total()
    np.testing.assert_array_equal(rows.high, [total.high] * 2)
