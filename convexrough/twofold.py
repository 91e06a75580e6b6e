"""Numbers of twice float64's length: unevaluated sums of two, by float64 operations alone.

Exact sums and products (Knuth; Dekker, Numer. Math. 18 (1971) 224) of numbers far from overflow and
underflow. No fused operations are assumed, nor anything longer than float64.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from convexrough import threads
from convexrough.arrays import Array, Number, frozen

#: Relative error of one operation on twofold numbers: above 4 roundoffs squared of sums of one sign
#: (Joldes, Muller and Popescu, ACM Trans. Math. Softw. 44 (2017) 15).
TWOFOLD_ROUNDOFF = 2.0**-100

#: Numbers that are worked on together: what a cache holds.
CHUNK = 2**14

_SPLITTER = 2.0**27 + 1.0


class Twofold(NamedTuple):
    """high + low, |low| at most a roundoff of high."""

    high: Number
    low: Number

    def at(self, some: slice) -> Twofold:
        return Twofold(self.high[some], self.low[some])

    @classmethod
    def nearest(cls, value: Fraction) -> Twofold:
        high = float(value)
        return cls(high, float(value - Fraction(high)))

    def __add__(self, other: object) -> Twofold:
        assert isinstance(other, Twofold)
        high, off = exact_sum(self.high, other.high)
        low, off_low = exact_sum(self.low, other.low)
        high, off = _settled(high, off + low)
        return Twofold(*_settled(high, off + off_low))

    def __neg__(self) -> Twofold:
        return Twofold(-self.high, -self.low)

    def __mul__(self, other: object) -> Twofold:
        assert isinstance(other, Twofold)
        high, off = exact_product(self.high, other.high)
        off = off + (self.high * other.low + self.low * other.high)
        return Twofold(*_settled(high, off))

    def over(self, divisor: Twofold) -> Twofold:
        """The quotient, by one correction of the first."""
        first = self.high / divisor.high
        left = self + -(divisor * Twofold(first, 0.0 * first))
        return Twofold(*_settled(first, (left.high + left.low) / divisor.high))

    def root(self) -> Twofold:
        """The square root of positive numbers, by one step of Newton's from that of the first."""
        first = np.sqrt(self.high)
        left = self + -Twofold(*exact_product(first, first))
        return Twofold(*_settled(first, (left.high + left.low) / (2.0 * first)))

    def cube_root(self) -> Twofold:
        """The same of third roots."""
        first = np.cbrt(self.high)
        square = Twofold(*exact_product(first, first))
        left = self + -(square * whole(first))
        return Twofold(*_settled(first, (left.high + left.low) / (3.0 * square.high)))

    def total(self) -> Twofold:
        """The sum along the last axis, in pairs of pairs."""
        high, low = np.asarray(self.high), np.asarray(self.low)
        while (n := high.shape[-1]) > 1:
            half = n // 2
            pairs = Twofold(high[..., :half], low[..., :half]) + Twofold(
                high[..., half : 2 * half], low[..., half : 2 * half]
            )
            high = np.concatenate((pairs.high, high[..., 2 * half :]), axis=-1)
            low = np.concatenate((pairs.low, low[..., 2 * half :]), axis=-1)
        return Twofold(high[..., 0], low[..., 0])


def in_parts(length: int, part: Callable[[slice], Twofold]) -> Twofold:
    """(length,) numbers of which `part` makes some, on each core; read-only."""
    found = Twofold(np.empty(length), np.empty(length))

    def make(some: slice) -> None:
        found.high[some], found.low[some] = part(some)

    threads.each(make, threads.chunks(length, CHUNK), threads.worthwhile(length))
    return Twofold(frozen(found.high), frozen(found.low))


def exact_sum(a: Number, b: Number) -> tuple[Number, Number]:
    """The rounded sum and what it is off by."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def exact_product(a: Number, b: Number) -> tuple[Number, Number]:
    """The rounded product and what it is off by."""
    total = a * b
    (a1, a2), (b1, b2) = _halves(a), _halves(b)
    return total, ((a1 * b1 - total) + a1 * b2 + a2 * b1) + a2 * b2


def square_sum(x: Array, y: Array) -> Twofold:
    """x^2 + y^2."""
    return Twofold(*exact_product(x, x)) + Twofold(*exact_product(y, y))


def whole(high: Number) -> Twofold:
    """A float64 number as it is."""
    return Twofold(high, np.zeros_like(high) if isinstance(high, np.ndarray) else 0.0)


def _settled(high: Number, low: Number) -> tuple[Number, Number]:
    total = high + low
    return total, low - (total - high)


def _halves(a: Number) -> tuple[Number, Number]:
    """Two of at most 26 bits each."""
    wide = _SPLITTER * a
    first = wide - (wide - a)
    return first, a - first
