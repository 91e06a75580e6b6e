"""Double-double numbers: unevaluated sums of two float64 numbers, with about 31 decimal digits.

The errors of float64 sums and products are computed by the methods of Knuth and Dekker (Numer.
Math. 18 (1971) 224), without fused operations or longer numbers. Error bounds are relative. They
hold if nothing underflows or overflows (Joldes, Muller and Popescu, ACM TOMS 44 (2017) 15).
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from convexrough import threads
from convexrough.arrays import Array, Number, frozen

#: Bound on the relative error of one operation on pairs. In units of the squared roundoff, the
#: error is at most 3 for a sum, 5 for a product, and 64 for a quotient or root (one Newton step
#: from float64).
PAIR_ROUNDOFF = 2.0**-98

#: Number of elements that are processed together, so that they fit in a cache.
CHUNK = 2**14

#: Mask of the sign, the exponent and the first 26 significant bits of a float64 number.
_FIRST_BITS = np.int64(-(1 << 27))


class Pair(NamedTuple):
    """Numbers high + low with |low| <= ROUNDOFF |high|; two arrays of one shape, or two floats."""

    high: Number
    low: Number

    @classmethod
    def exact(cls, values: Number) -> Pair:
        """Pairs that are equal to float64 numbers; the low parts are 0."""
        high = np.asarray(values, dtype=np.float64)
        return cls(high, np.zeros(high.shape))

    @classmethod
    def nearest(cls, value: Fraction) -> Pair:
        """The pair nearest to a rational number."""
        high = float(value)
        return cls(high, float(value - Fraction(high)))

    def at(self, index: Any) -> Pair:
        """The numbers at this index."""
        return Pair(self.high[index], self.low[index])

    def __add__(self, other: object) -> Pair:
        assert isinstance(other, Pair)
        if np.ndim(self.high) == 1 and len(self.high) > CHUNK and np.size(other.high) > CHUNK:
            return in_parts(len(self.high), lambda some: self.at(some) + other.at(some))
        first, high_rest = two_sum(self.high, other.high)
        low, low_rest = two_sum(self.low, other.low)
        low = high_rest + low
        high = first + low
        return Pair(*_settled(high, (low - (high - first)) + low_rest))

    def __neg__(self) -> Pair:
        return Pair(-self.high, -self.low)

    def __sub__(self, other: Pair) -> Pair:
        return self + -other

    def __mul__(self, other: object) -> Pair:
        assert isinstance(other, Pair)
        high, rest = two_product(self.high, other.high)
        return Pair(*_settled(high, rest + (self.high * other.low + self.low * other.high)))

    def __truediv__(self, divisor: Pair) -> Pair:
        first = self.high / divisor.high
        near, rest = two_product(first, divisor.high)
        left = ((self.high - near) - rest) + (self.low - first * divisor.low)
        return Pair(*_settled(first, left / divisor.high))

    def sqrt(self) -> Pair:
        """Square roots of positive numbers."""
        first = np.sqrt(self.high)
        near, rest = two_square(first)
        left = ((self.high - near) - rest) + self.low
        return Pair(*_settled(first, left / (2.0 * first)))

    def inverse_root(self) -> Pair:
        """1 / sqrt(x) with a relative error below 2^-98; 0 where x is 0.

        Let y be 1 / sqrt(x) in float64, and e = 1 - x y^2. Then |e| < 2^-51, and e is computed to
        within 2^-104. The result y (1 + e / 2) has a relative error of about 3 e^2 / 8.
        """
        with np.errstate(divide="ignore"):
            first = 1.0 / np.sqrt(self.high)
        first[self.high == 0] = 0.0
        square, rest = two_square(first)
        near, less = two_product(self.high, square)
        left = (1.0 - near) - (less + (self.high * rest + self.low * square))
        return Pair(first, first * (0.5 * left))

    def cbrt(self) -> Pair:
        """Cube roots of positive numbers."""
        root, square, _, left = self._cube_root()
        return Pair(*_settled(root, left / (3.0 * square)))

    def two_thirds(self) -> Pair:
        """x^(2/3) of positive numbers x: c^2 + 2 c d, where c + d is the cube root, d tiny."""
        root, square, rest, left = self._cube_root()
        return Pair(*_settled(square, rest + left / (1.5 * root)))

    def _cube_root(self) -> tuple[Number, Number, Number, Number]:
        """Four numbers: c near x^(1/3), the high and low parts of c^2, and x - c^3."""
        root = np.cbrt(self.high)
        square, rest = two_square(root)
        near, less = two_product(square, root)
        return root, square, rest, ((self.high - near) - less) + (self.low - rest * root)

    def total(self) -> Pair:
        """The sum along the last axis; the error is at most 2^-97 times the sum of absolute values.

        Numbers are divided into parts with so few bits that float64 sums of these parts are exact,
        except for a last part, which is so small that the rounding of its sum does not matter.
        """
        high, low = np.asarray(self.high), np.asarray(self.low)
        n = high.shape[-1]
        if n > CHUNK:
            starts = range(0, n, CHUNK)
            parts = [Pair(high, low).at(np.s_[..., s : s + CHUNK]).total() for s in starts]
            return Pair(*(np.stack(part, axis=-1) for part in zip(*parts, strict=True))).total()
        bits = min(51, 53 - n.bit_length())
        most = np.abs(high).max(axis=-1, initial=0.0, keepdims=True)
        unit = np.ldexp(1.0, np.frexp(most)[1] - bits)
        first = rounded(high, unit)
        left = high - first
        second = rounded(left, unit * 2.0**-bits)
        left = (left - second) + low
        third = rounded(left, unit * 2.0**-50)
        sums = [part.sum(axis=-1) for part in (first, second, third, left - third)]
        whole, rest = two_sum(sums[0], sums[1])
        return Pair(*two_sum(whole, rest + (sums[2] + sums[3])))


def in_parts(length: int, part: Callable[[slice], Pair]) -> Pair:
    """(length,) read-only pairs; `part` computes slices of them, in several threads."""
    if length <= CHUNK:
        return Pair(*map(frozen, part(slice(0, length))))
    found = Pair(np.empty(length), np.empty(length))

    def compute(some: slice) -> None:
        found.high[some], found.low[some] = part(some)

    threads.each(compute, threads.chunks(length, CHUNK), threads.worthwhile(length))
    return Pair(frozen(found.high), frozen(found.low))


def two_sum(a: Number, b: Number) -> tuple[Number, Number]:
    """The rounded sum and its error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Number, b: Number) -> tuple[Number, Number]:
    """The rounded product, and its error to within one roundoff of this error."""
    total = a * b
    (a1, a2), (b1, b2) = _halves(a), _halves(b)
    return total, ((a1 * b1 - total) + a1 * b2 + a2 * b1) + a2 * b2


def two_square(a: Number) -> tuple[Number, Number]:
    """The rounded square, and its error to within one roundoff of this error."""
    total = a * a
    first, second = _halves(a)
    return total, ((first * first - total) + (first + first) * second) + second * second


def rounded(values: Array, unit: Array) -> Array:
    """The multiples of `unit`, a power of two, that are nearest to values below 2^51 `unit`."""
    shift = 1.5 * 2.0**52 * unit
    return np.asarray((values + shift) - shift)


def square_sum(x: Array, *others: Array) -> Pair:
    """x^2 + y^2 for two arrays of coordinates, or x^2 for one array."""
    total = Pair(*two_square(x))
    for y in others:
        total = total + Pair(*two_square(y))
    return total


def _settled(high: Number, low: Number) -> tuple[Number, Number]:
    total = high + low
    return total, low - (total - high)


def _halves(a: Number) -> tuple[Number, Number]:
    """Two parts of numbers: the first 26 significant bits, and the other 27."""
    bits = np.asarray(a, dtype=np.float64)
    first = (bits.view(np.int64) & _FIRST_BITS).view(np.float64)
    return first, bits - first
