"""Balls: numbers with error bounds. A formula evaluated on balls bounds the error of its result.

The midpoint of a ball is a pair (the sum of two float64 numbers), the radius is a float64 number.
Every operation returns a ball that contains the result for every choice of numbers in the operands.
The radius is infinite where nothing is known: after an overflow, or if a divisor may be 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arithmetic.pairs import CHUNK, PAIR_ROUNDOFF, Pair, two_product, two_sum
from convexrough.arrays import Array

#: Factor that covers the rounding errors of a few float64 operations on radii.
UP = 1.0 + 2.0**-40

#: Upper bound on the underflow error of one operation on pairs.
TINY = 2.0**-1000

#: Numbers known exactly. They become balls of radius 0, except that a Fraction is rounded to a
#: pair, and the radius covers the rounding.
Exact: TypeAlias = "float | int | Fraction | Array | Pair"

#: Elementwise function of midpoints and radii that returns a midpoint and a radius.
Elementwise: TypeAlias = "Callable[..., tuple[Pair, Array]]"

#: Arrays, pairs or balls.
Stacked = TypeVar("Stacked")

quietly = np.errstate(all="ignore")


@dataclass(frozen=True, eq=False, slots=True)
class Ball:
    """Arrays `mid` and `radius` of one shape; an element stands for all numbers within the radius.

    >>> third = Ball.exact(1.0) / 3.0
    >>> float(third.mid.high), bool(third.radius < 1e-28)
    (0.3333333333333333, True)
    """

    mid: Pair
    radius: Array

    # Makes numpy use the ball's own operators in `array * ball`.
    __array_ufunc__ = None

    @classmethod
    def exact(cls, value: Ball | Exact) -> Ball:
        """Balls of numbers known exactly; the radius of a Fraction covers its rounding error. Balls
        are returned unchanged."""
        if isinstance(value, Ball):
            return value
        if isinstance(value, Fraction):
            pair = Pair.nearest(value)
            return cls.around(pair, PAIR_ROUNDOFF * abs(pair.high) + TINY)
        pair = value if isinstance(value, Pair) else Pair.exact(value)
        high = np.asarray(pair.high, dtype=np.float64)
        return cls(Pair(high, np.asarray(pair.low)), np.zeros(high.shape))

    @classmethod
    @quietly
    def around(cls, value: float | Array | Pair, radius: Any) -> Ball:
        """Balls of numbers known to within this radius."""
        pair = value if isinstance(value, Pair) else Pair.exact(value)
        return cls(*_finished(pair, radius * UP + 0.0 * pair.high))

    @classmethod
    @quietly
    def between(cls, low: Array, high: Array) -> Ball:
        """Balls that contain all numbers from `low` to `high`."""
        middle = low / 2.0 + high / 2.0
        return cls.around(middle, np.maximum(high - middle, middle - low) * UP + TINY)

    @property
    def shape(self) -> tuple[int, ...]:
        return self.radius.shape

    def __len__(self) -> int:
        return len(self.radius)

    def __getitem__(self, index: Any) -> Ball:
        return Ball(
            Pair(np.asarray(self.mid.high[index]), np.asarray(self.mid.low[index])),
            np.asarray(self.radius[index]),
        )

    @property
    def value(self) -> Array:
        """The midpoints, rounded to float64."""
        high: Array = self.mid.high
        return high

    @property
    def error(self) -> Array:
        """Bounds on the distance of the numbers of each ball from `value`."""
        return np.asarray((self.radius + np.abs(self.mid.low)) * UP)

    @property
    @quietly
    def lower(self) -> Array:
        """Lower bounds on the numbers of each ball."""
        return np.asarray(self.mid.high - (self.radius - self.mid.low) - self._margin)

    @property
    @quietly
    def upper(self) -> Array:
        """Upper bounds on the numbers of each ball."""
        return np.asarray(self.mid.high + (self.radius + self.mid.low) + self._margin)

    @property
    def _margin(self) -> Array:
        """Bounds on the rounding errors of `lower` and `upper`."""
        return np.asarray(2.0**-51 * (np.abs(self.mid.high) + self.radius) + TINY)

    @property
    def size(self) -> Array:
        """Upper bounds on the absolute values of the numbers of each ball."""
        return np.asarray((np.abs(self.mid.high) * UP + self.radius) * UP)

    @property
    def positive(self) -> NDArray[np.bool_]:
        """True for balls in which every number is above 0."""
        return np.asarray(self.lower > 0)

    @property
    def negative(self) -> NDArray[np.bool_]:
        """True for balls in which every number is below 0."""
        return np.asarray(self.upper < 0)

    def __add__(self, other: Ball | Exact) -> Ball:
        return elementwise(_sum, self, Ball.exact(other))

    __radd__ = __add__

    def __neg__(self) -> Ball:
        return Ball(-self.mid, self.radius)

    def __sub__(self, other: Ball | Exact) -> Ball:
        return elementwise(_sum, self, -Ball.exact(other))

    def __rsub__(self, other: Exact) -> Ball:
        return Ball.exact(other) - self

    def __mul__(self, other: Ball | Exact) -> Ball:
        return elementwise(_product, self, Ball.exact(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Ball | Exact) -> Ball:
        return elementwise(_quotient, self, Ball.exact(other))

    def __rtruediv__(self, other: Exact) -> Ball:
        return Ball.exact(other) / self

    def scaled(self, unit: float) -> Ball:
        """The balls times a power of two, which is exact unless numbers underflow or overflow."""
        return Ball(Pair(self.mid.high * unit, self.mid.low * unit), self.radius * unit)

    def positive_part(self) -> Ball:
        """Balls that contain max(x, 0) for each number x; their radii are not larger."""
        above = self.mid.high > 0
        high, low = (np.where(above, part, 0.0) for part in self.mid)
        return Ball(Pair(high, low), np.where(self.upper <= 0, 0.0, self.radius))

    def sqrt(self) -> Ball:
        """Square roots of the positive parts."""
        return elementwise(_root(Pair.sqrt, np.sqrt), self)

    def cbrt(self) -> Ball:
        """Cube roots of the positive parts."""
        return elementwise(_root(Pair.cbrt, np.cbrt), self)

    def two_thirds(self) -> Ball:
        """x^(2/3) for the positive parts x."""
        return elementwise(_root(Pair.two_thirds, lambda x: np.cbrt(x) ** 2), self)

    @quietly
    def sum(self) -> Ball:
        """The sum along the last axis."""
        n = self.radius.shape[-1]
        lost = 2.0 * PAIR_ROUNDOFF * np.abs(self.mid.high).sum(axis=-1)
        radius = (self.radius.sum(axis=-1) + lost + (n + 1) * TINY) * (UP + n * 2.0**-52)
        return Ball(*_finished(self.mid.total(), radius))

    def dot(self, other: Ball | Exact) -> Ball:
        """The sum of products along the last axis."""
        return (self * other).sum()


def where(condition: NDArray[np.bool_], yes: Ball, no: Ball) -> Ball:
    """Elements of `yes` where the condition is True, else of `no`, as in numpy.where."""
    chosen: Ball = of_rows(partial(np.where, condition), yes, no)
    return chosen


def replaced(balls: Ball, which: Any, others: Ball) -> Ball:
    """The balls, with those at the index `which` replaced, in the same memory."""
    for each, new in zip((*balls.mid, balls.radius), (*others.mid, others.radius), strict=True):
        each[which] = new
    return balls


def of_rows(function: Callable[..., Any], *values: Any) -> Any:
    """The result of `function` on arrays, or on each of the arrays of pairs and balls."""
    first = values[0]
    if isinstance(first, Ball):
        mid = of_rows(function, *[each.mid for each in values])
        return Ball(mid, function(*[each.radius for each in values]))
    if isinstance(first, tuple):
        return type(first)(*[of_rows(function, *parts) for parts in zip(*values, strict=True)])
    return function(*values)


def added(*balls: Ball) -> Ball:
    """The sum of balls, computed faster than by `+`."""
    return elementwise(_sum, *balls)


def joined(balls: Sequence[Ball]) -> Ball:
    """The balls concatenated along the first axis."""
    joint: Ball = of_rows(lambda *each: np.concatenate(each), *balls)
    return joint


def stacked(values: Sequence[Stacked]) -> Stacked:
    """Arrays, pairs or balls of one shape, stacked along a new first axis."""
    joint: Stacked = of_rows(lambda *each: np.stack(each), *values)
    return joint


@quietly
def elementwise(operation: Elementwise, *balls: Ball) -> Ball:
    """The result of operation(mid, radius, mid, radius, ...), in several threads if it is large.

    Operands of unequal size, except single numbers, are broadcast in one call, not in parallel.
    """
    sizes = [ball.radius.size for ball in balls]
    count = max(sizes)
    if count <= CHUNK or any(size not in (1, count) for size in sizes):
        operands = [part for ball in balls for part in (ball.mid, ball.radius)]
        return Ball(*_finished(*operation(*operands)))
    shape = np.broadcast_shapes(*(ball.shape for ball in balls))
    flat = [ball if ball.radius.size == 1 else of_rows(np.ravel, ball) for ball in balls]
    high, low, radius = np.empty((3, count))

    def compute(some: slice) -> None:
        parts = (ball if ball.radius.size == 1 else ball[some] for ball in flat)
        with np.errstate(all="ignore"):
            found = _finished(*operation(*(x for ball in parts for x in (ball.mid, ball.radius))))
        (high[some], low[some]), radius[some] = found

    threads.each(compute, threads.chunks(count, CHUNK), threads.worthwhile(count))
    return Ball(Pair(high.reshape(shape), low.reshape(shape)), radius.reshape(shape))


def _finished(mid: Pair, radius: Array) -> tuple[Pair, Array]:
    """The midpoint and radius; where the midpoint is not finite, 0 and an infinite radius."""
    high, low, radius = np.asarray(mid.high), np.asarray(mid.low), np.asarray(radius)
    if math.isfinite(np.add.reduce(radius, axis=None)):
        return Pair(high, low), radius
    bad = ~np.isfinite(high + low)
    high, low = np.where(bad, 0.0, high), np.where(bad, 0.0, low)
    return Pair(high, low), np.where(bad | np.isnan(radius), np.inf, radius)


def _sum(x: Pair, dx: Array, *others: Any) -> tuple[Pair, Array]:
    for y, dy in zip(others[::2], others[1::2], strict=True):
        x = x + y
        dx = (dx + dy + _lost(x)) * UP
    return x, dx


def _product(x: Pair, dx: Array, y: Pair, dy: Array) -> tuple[Pair, Array]:
    """The product; |X Y - x y| <= (|x| + dx) dy + dx |y| for X, Y within dx, dy of x, y."""
    product = x * y
    radius = np.fmax((np.abs(x.high) + dx) * dy, 0.0) + np.fmax(dx * np.abs(y.high), 0.0)
    return product, (radius * UP + _lost(product)) * UP


def _quotient(x: Pair, dx: Array, y: Pair, dy: Array) -> tuple[Pair, Array]:
    """The quotient; X/Y - x/y = ((X - x) - (x/y) (Y - y)) / Y for X, Y within dx, dy of x, y."""
    quotient = x / y
    least = np.abs(y.high) * (2.0 - UP) - dy
    radius = (dx + np.fmax(np.abs(quotient.high) * UP * dy, 0.0) + TINY) / least
    return quotient, np.where(least > 0, (radius * UP + _lost(quotient)) * UP, np.inf)


def _root(power: Callable[[Pair], Pair], plain: Callable[[Array], Array]) -> Elementwise:
    """The function that computes a concave power f of balls, from f of pairs and of floats.

    |f(x) - f(m)| <= min(r f(m) / m, f(r)) if |x - m| <= r.
    """

    def root(x: Pair, dx: Array) -> tuple[Pair, Array]:
        safe, above = positive(x)
        found = power(safe)
        slope = found.high / safe.high
        if safe is not x:
            found = Pair(*(np.where(above, part, 0.0) for part in found))
        return found, (
            power_error(x, dx, dx * slope, plain) + TINY * slope + 2.0 * _lost(found)
        ) * UP

    return root


def positive(x: Pair) -> tuple[Pair, NDArray[np.bool_]]:
    """The numbers with 1 in place of each number <= 0, and True where they were positive."""
    above = x.high > 0
    if above.all():
        return x, above
    return Pair(np.where(above, x.high, 1.0), np.where(above, x.low, 0.0)), above


def power_error(x: Pair, dx: Array, steep: Array, power: Callable[[Array], Array]) -> Array:
    """Error bounds of a concave power f of the balls x +- dx; `steep` is dx f(x) / x."""
    wide = dx > x.high
    if not wide.any():
        return steep
    flat = power(np.where(x.high + dx * UP > 0, dx, 0.0)) * UP
    return np.where(wide, np.where(x.high > 0, np.fmin(steep, flat), flat), steep)


def _lost(result: Pair) -> Array:
    """Bounds on the rounding error of one operation on pairs."""
    return np.asarray(PAIR_ROUNDOFF * np.abs(result.high) + TINY)


def residual(k: Ball, loads: Ball, displacement: Ball, offsets: Ball, approach: Ball) -> Ball:
    """k P^(2/3) + v - d - D for loads P (0 if negative)."""
    return elementwise(_residual, k, loads, displacement, offsets, approach)


def _residual(
    k: Pair, dk: Array, P: Pair, dP: Array, v: Pair, dv: Array,
    d: Pair, dd: Array, D: Pair, dD: Array,
) -> tuple[Pair, Array]:  # fmt: skip
    """The residual. Its rounding error is below 64 squared roundoffs times `sizes`."""
    safe, loaded = positive(P)
    power = safe.two_thirds()
    slope = power.high / safe.high
    local, rest = two_product(k.high, power.high)
    rest = rest + (k.high * power.low + k.low * power.high)
    if safe is not P:
        local, rest = local * loaded, rest * loaded
    total, first = two_sum(local, v.high)
    total, second = two_sum(total, -d.high)
    total, third = two_sum(total, -D.high)
    low = (first + second + third) + (((rest + v.low) - d.low) - D.low)
    mid = Pair(*two_sum(total, low))
    sizes = np.abs(local) + (np.abs(v.high) + np.abs(d.high) + np.abs(D.high))
    radius = dk * power.high
    if dP.any():
        off = power_error(P, dP, dP * slope, lambda x: np.cbrt(x) ** 2)
        radius = radius + (np.abs(k.high) + dk) * off
    lost = PAIR_ROUNDOFF * sizes + TINY * (1.0 + np.abs(k.high) * slope)
    return mid, (radius * UP + (dv + dd + dD) + lost) * UP
