"""The kernel 1 / r^q, made smooth within a reach, and bounds on its interpolation errors.

L denotes the smooth kernel. Beyond the reach a, L is 1 / r^q. Within the reach, L is a polynomial:
the series of 1 / r^q in t = 1 - (r/a)^2 up to the term with t^p. So L has p continuous derivatives
at r = a. All terms of the series are positive, so nothing cancels. docs/theory/operators-mesh.md
derives the bounds, in "The smooth part", "Derivatives of L", "Interpolation", "Rounding" and
"Rounding errors of L".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property

import numpy as np

from convexrough.arithmetic.pairs import Pair, two_sum
from convexrough.arrays import Array

#: Near pairs are omitted if 1 / r^q - L is below this fraction of the interpolation error. The
#: number is a heuristic: the error bound includes the omitted pairs.
CUT_SHARE = 0.1


@dataclass(frozen=True)
class Softened:
    """The smooth kernel L of 1 / r^q, with power q, even order p and reach a [length]."""

    power: int
    order: int
    reach: float

    def smooth(self, squares: Array) -> Array:
        """L as a function of squared distances."""
        ratio = squares / self.reach**2
        within = ratio < 1.0
        values: Array = 1.0 / np.sqrt(np.maximum(ratio, 1.0))
        if self.power > 1:
            values **= self.power
        values[within] = self._series(1.0 - ratio[within])
        values /= self.reach**self.power
        return values

    def local(self, squares: Array) -> Array:
        """1 / r^q - L at squared distances within the reach; -L(0) at the distance 0."""
        with np.errstate(divide="ignore"):
            values: Array = 1.0 / np.sqrt(squares)
        values[squares == 0.0] = 0.0
        if self.power > 1:
            values **= self.power
        ratio = squares / -(self.reach**2)
        ratio += 1.0
        values -= self._series(ratio) / self.reach**self.power
        return values

    @cached_property
    def centre(self) -> float:
        """The value L(0)."""
        return float(_series(self.order, self.power).sum()) / self.reach**self.power

    @property
    def roundoffs(self) -> float:
        """Bound on the relative error of one computed value of L, in roundoffs."""
        mean = self._slope / float(_series(self.order, self.power).sum())
        return 3.0 * mean + 4.0 + 4.5 * self.power

    @property
    def beyond_roundoffs(self) -> float:
        """Bound on the relative error of one computed 1 / r^q beyond the reach, in roundoffs."""
        return 8.0 * self.power + 2.0

    def moved(self, shift: float) -> float:
        """Bound on (error of L) r^q for distances with errors of at most `shift` [length]."""
        q = self.power
        return shift * q * float((2.0 * self._slope / q) ** (1.0 / (q + 2))) / self.reach

    def pair_error(self, spacing: float) -> float:
        """Bound on the error of any pair by interpolation of L and by omission of 1 / r^q - L."""
        return (1.0 + CUT_SHARE) * self._interpolation_error(spacing)

    def cut(self, spacing: float) -> float:
        """[length] the distance beyond which 1 / r^q - L may be omitted.

        1 / r^q - L is the rest of the series. For t <= 1/2, this rest is at most 2.3 times its
        first term, because each coefficient is less than a tenth larger than the one before.
        """
        first = 2.3 * float(_series(self.order + 1, self.power)[-1])
        error = CUT_SHARE * self._interpolation_error(spacing) * self.reach**self.power
        t = min(0.5, (error / first) ** (1.0 / (self.order + 1)))
        return self.reach * math.sqrt(1.0 - t)

    def _interpolation_error(self, spacing: float) -> float:
        worst = _steepest(self.order, self.power)
        ratio = (spacing / self.reach) ** self.order
        return _interpolated(self.order) * worst * ratio / self.reach**self.power

    def far_error(self, spacing: float) -> float:
        """Bound on the relative interpolation error for pairs beyond the reach plus the `sway`."""
        worst = float(math.comb(self.order + self.power - 1, self.order))
        nearer = (self.reach + self.sway(spacing)) / self.reach
        ratio = (spacing / self.reach) ** self.order
        return float(_interpolated(self.order) * worst * ratio * nearer**self.power)

    def sway(self, spacing: float) -> float:
        """[length] bound on |d - r| for nodes at a distance d that serve points at a distance r."""
        return math.sqrt(2.0) * self.order * spacing

    @property
    def _slope(self) -> float:
        terms = _series(self.order, self.power)
        return float(np.arange(len(terms)) @ terms)

    def _series(self, t: Array) -> Array:
        terms = _series(self.order, self.power)
        values = np.full_like(t, terms[-1])
        for term in terms[-2::-1]:
            values *= t
            values += term
        return values


def lebesgue(order: int) -> float:
    """The largest sum of the absolute values of Lagrange's polynomials between the middle nodes.

    Between these two nodes the sum equals a polynomial that is even about the middle. All roots of
    the polynomial lie outside, so it is largest in the middle.
    """
    return float(np.abs(twofold_lagrange(np.array([0.5]), order).high).sum())


def twofold_lagrange(places: Array, order: int) -> Pair:
    """(n, p) Lagrange's polynomials for the nodes 1 - p/2, ..., p/2, at places from 0 to 1."""
    nodes = range(1 - order // 2, order // 2 + 1)
    away = [Pair(*two_sum(places, -float(node))) for node in nodes]
    left, right = [Pair.exact(np.ones(len(places)))], [Pair.exact(np.ones(len(places)))]
    for k in range(order - 1):
        left.append(left[-1] * away[k])
        right.append(right[-1] * away[-1 - k])
    weights = Pair(np.empty((len(places), order)), np.empty((len(places), order)))
    for k in range(order):
        size = (-1) ** (order - 1 - k) * math.factorial(k) * math.factorial(order - 1 - k)
        scale = Pair.nearest(Fraction(1, size))
        weights.high[:, k], weights.low[:, k] = left[k] * right[-1 - k] * scale
    return weights


#: Bounds on the relative error of an interpolation weight. The first is for a double-double weight,
#: with at most 60 operations and its low part in single precision. The second is for a weight in
#: float64, in roundoffs.
TWOFOLD_WEIGHT = 2.0**-76
WEIGHT_ROUNDOFFS = 1.0 + 2.0**-40


@cache
def _series(order: int, power: int) -> Array:
    """(p + 1,) coefficients c_k of (1 - t)^(-q/2) = sum c_k t^k, each rounded once."""
    return np.array([float(term) for term in exact_series(order, power)])


def exact_series(order: int, power: int) -> list[Fraction]:
    """The coefficients of `_series` as fractions."""
    terms = [Fraction(1)]
    for k in range(1, order + 1):
        terms.append(terms[-1] * (2 * k - 2 + power) / (2 * k))
    return terms


@cache
def _interpolated(order: int) -> float:
    """The factor c in |error| <= c h^p max |d^p L| / p!, for interpolation in four variables."""
    growth = lebesgue(order)
    remainder = math.prod(range(1, order, 2)) ** 2 / 2.0**order
    return 1.01 * remainder * (1.0 + growth + growth**2 + growth**3)


@cache
def _steepest(order: int, power: int) -> float:
    """Bound on |d^p L / dx^p| / p! anywhere in the plane, for a reach of 1.

    Beyond the reach it is binom(p + q - 1, p), the largest value of Gegenbauer's polynomial.
    Inside, the derivative is a polynomial in r and in the cosine of the direction. The absolute
    value of a polynomial of degree d is at most 1 / cos(pi d / 2N) times the largest one at N
    Chebyshev nodes (Ehlich and Zeller).
    """
    terms = _series(order, power)
    # The degree is p in r (2 p minus p derivatives) and p in the cosine; each has N = 6 p nodes.
    radii = np.cos((np.arange(3 * order) + 0.5) * np.pi / (6 * order))
    cosines = np.cos(np.arange(3 * order + 1) * np.pi / (6 * order))
    total = np.zeros((len(radii), len(cosines)))
    # d^p f(s) / p! = sum_j (2 x)^(p - 2 j) f^(p - j)(s) / (j! (p - 2 j)!),  s = x^2 + y^2
    for j in range(order // 2 + 1):
        q = order - j
        rising = [terms[k] * math.perm(k, q) for k in range(q, order + 1)]
        slope = (-1.0) ** q * np.polynomial.polynomial.polyval(1.0 - radii**2, rising)
        weight = 2.0 ** (order - 2 * j) / (math.factorial(j) * math.factorial(order - 2 * j))
        total += weight * np.outer(slope * radii ** (order - 2 * j), cosines ** (order - 2 * j))
    within = float(np.abs(total).max()) / math.cos(math.pi / 12) ** 2
    return 1.01 * max(within, float(math.comb(order + power - 1, order)))
