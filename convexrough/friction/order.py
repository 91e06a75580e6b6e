r"""Order: no indentation falls as the load rises, so friction states are sums of normal solutions.

Let n_i(L) be the indentation of asperity i at the load L, or minus its gap where open; D0 the
approach, d the offsets, A the influence matrix, and C = diag(dP_i / dn_i), 0 where open. As
n = D0 + d - A P, the rates y = dn / dD0 solve (I + A C) y = 1. Levels from P down to the load L0
have order if y_i >= 0 for every i that may touch at P, and all others stay open. The level at one
load L1 proves this from L1 down to L0, as follows.

The *support* is the set of asperities not proved open at L1. Let C~ >= C(L1) be diagonal and 0 off
the support, W = C~^(1/2), B = I + W A W >= mu I > 0 on the support; so I + A C is regular for all
0 <= C <= C~. Let y = (I + A C~)^-1 1 and G = (I + A C~)^-1 A. For C = C~ - D with
0 <= D <= delta <= C~ we have (I + A C~) y(C) = 1 + A D y(C), that is

    y_i(C) (1 - G_ii D_i) = y_i + sum over k != i of G_ik D_k y_k(C).                          (1)

On the support G = W^-1 (I - B^-1) W^-1 and G_ii <= 0, as (B^-1)_ii >= 1 / B_ii = 1.

(a) Start with m = 1; m <- min(m, y + G+ (delta m)) improves m, where G+ are the positive entries
of G off its diagonal. If on the support

    y_i > sum over k != i of max(-G_ik, 0) delta_k m_k,   or   m = 1 and 1 > sum over k of A_ik C~_k

for all i, then 0 < y_i(C) <= m_i on the support for all C from C~ - delta to C~. In the first case
follow y(C~ - s D) from s = 0, where y is positive. While y is not negative, y(C) = 1 - A C y(C)
is at most 1, hence at most m by (1), and at least a positive constant by (1), as 1 - G_ii D_i is
bounded; by continuity y stays positive. In the second case follow y(s C) from y(0) = 1 up to s = 1.

(b) Let delta_k >= C~_k - c_k(n_k(L1) - m_k (D0(L1) - D0(L0))), c_k(n) = dP_k / dn_k. Let each
asperity outside the support have y_i >= -s_i by (1) with D_i = 0, and a gap
g_i > s_i (D0(L1) - D0(L0)) at L1. Then y > 0 on the support down to L0, and the others stay open.
Proof: dn / dD0 = y(C(n)) continues the solution downwards (implicit function theorem). C stays
between C~ - delta and C~, as n_k falls, by less than m_k (D0(L1) - D0(L0)) before L0 is reached;
and no gap closes, by the bounds on y_i. The load falls strictly with D0, and the solution stays in
the box where it is the only one. For L0 = 0 all this holds down to every L > 0.

If a range of loads is proved in parts, asperities that touch at P but are open at L1 need s_i <= 0.
The second case of (a) needs no inverse. The first computes an approximation X of B^-1: with
R = I - B X, column k of B^-1 - X is at most || R_k || / mu in the 2-norm. If too many asperities
touch for an inverse, `friction.sweeping` proves the same without one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.friction.sweeping import swept_rates
from convexrough.normal.boxes import Box
from convexrough.normal.level import Level
from convexrough.normal.proved import Proved
from convexrough.normal.stack import Stack
from convexrough.normal.together import Rows
from convexrough.roundoff import ROUNDOFF, SAFETY

#: "proved": order holds at all loads between the levels used. "proved for one step": no load P_i
#: is lower at a level used than at the next lower level, and no rate is negative at the tested
#: levels; each state solves one general step (`general_step`). "fails": some indentation falls,
#: or nothing is proved.
Order = Literal["proved", "proved for one step", "fails"]

#: Rates dn_i / dD0 below -RATE_ROUNDING are negative; SOLVED is the tolerance of the linear solve.
RATE_ROUNDING, SOLVED = 1e-9, 1e-10

#: Up to INVERTED touching asperities the inverse costs no more than the levels. If more touch,
#: up to TOUCHING times MOST, weights of least total (`sweeping`) are sought for at most MOST.
INVERTED, MOST, TOUCHING = 800, 1000, 10

#: Largest numbers of intermediate levels of the bisection: with an inverse, and without one.
BETWEEN, FEW_BETWEEN = 7, 1

#: Number of improvements of m, and the least entry of C~ relative to the largest. Heuristics.
IMPROVEMENTS, LEAST = 4, 2.0**-30


def order_between(
    at: Callable[[Fraction], Level], loads: Iterable[Fraction], most: int = MOST
) -> Order:
    """The order that is proved between the lowest and the highest of some loads, by bisection.

    at   : returns the level at a load
    most : as in `swept_rates`
    """
    used = sorted(set(loads), reverse=True)
    top = at(used[0])
    rising = ~top.open
    if len(used) == 1 or proved_between(top, at(used[-1]), rising, most):
        return "proved"
    if any(_falls(at(high), at(low), rising) for high, low in pairwise(used)):
        return "fails"
    if min(_least_rate(at(load), rising) for load in used) < -RATE_ROUNDING:
        return "fails"
    unproved = [(used[0], used[-1])]
    left = BETWEEN if rising.sum() <= INVERTED else FEW_BETWEEN
    while len(unproved) <= left:  # each interval needs at least one level
        left -= 1
        high, low = unproved.pop(0)
        middle = (high + low) / 2
        try:
            level = at(middle)
        except SolverError:  # no intermediate level exists to test
            return "proved for one step"
        if _falls(at(high), level, rising) or _falls(level, at(low), rising):
            return "fails"
        if _least_rate(level, rising) < -RATE_ROUNDING:
            return "fails"
        for a, b in ((high, middle), (middle, low)):
            if rising.sum() > INVERTED or not proved_between(at(a), at(b), rising, most):
                unproved.append((a, b))
        if not unproved:
            return "proved"
    return "proved for one step"


def proved_between(upper: Level, lower: Level, rising: NDArray[np.bool_], most: int = MOST) -> bool:
    """Whether the upper level proves order down to the lower one, by (a) and (b) above.

    rising : (n,) true for asperities that may touch at the highest load of the path
    """
    found = upper.solution
    if found is None or (found.box.fixed_open & ~upper.open).any():
        return False
    span = _Span.of(upper, lower, found)
    rates = span.rates(np.ones(len(span.c)))
    if (rates[span.support] > 0).all() and not len(span.unsettled(rates, rising)):
        return True
    if not span.mu > 0 or len(span.support) > max(INVERTED, TOUCHING * most):
        return False
    if len(span.support) > INVERTED:
        spare = np.where(rising, 0.0, span.spare)
        return not len(
            span.unsettled(swept_rates(upper.problem.influence, span.c, spare, most), rising)
        )
    inverse = span.inverse()
    (below,), (upper_ends,) = inverse.bounds(lambda m: span.delta(m[0])[None])
    if not (below > 0).all():
        return False
    m = np.ones(len(span.c))
    m[span.support] = upper_ends
    rates = span.rates(m)
    rates[span.support] = below
    left = span.unsettled(rates, rising)
    if len(left) > INVERTED:
        return False
    both = np.concatenate((span.support, left))
    entries = found.problem.influence.submatrix(both)[
        None, len(span.support) :, : len(span.support)
    ]
    change = span.delta(upper_ends) * upper_ends
    rates[left] = np.maximum(rates[left], inverse.elsewhere(entries, change[None])[0])
    return not len(span.unsettled(rates, rising))


@np.errstate(all="ignore")
def proved_in_rows(rows: Stack, box: Box, high: Rows, low: Rows) -> NDArray[np.bool_]:
    """(m,) `proved_between` for rows of levels, the upper ones at the highest load of a path."""
    k, support = rows.exact.coefficients, ~high.open
    c = np.where(support, 1.5 * np.cbrt(high.loads.upper) / k.lower * (1 + SAFETY), 0.0)
    least = np.minimum(LEAST * c.max(axis=1, keepdims=True), 1.0 / box.stiffness)
    c = np.where(support, np.maximum(c, least) * (1 + SAFETY), 0.0)
    beyond = np.where(support, c * box.stiffness, 0.0).max(axis=1, keepdims=True) - 1.0
    mu = 1.0 - box.convexity_number - np.maximum(beyond, 0.0) * (1 + SAFETY) - SAFETY
    drop = (high.approach - low.approach).upper[:, None]
    count = max(1, int(support.sum(axis=1).max()))
    order = np.argsort(~support, axis=1, kind="stable")[:, :count]  # others have c = 0
    entries, entry_error = np.empty((len(c), count, count)), np.zeros((len(c), 1))
    for some, problem in rows.coupled:
        which = order[some]
        entries[some] = problem.influence.matrix[which[:, :, None], which[:, None, :]]
        entry_error[some] = problem.influence.entry_error
    inside, c_in, depth, steep = (
        np.take_along_axis(np.broadcast_to(values, c.shape), order, axis=1)
        for values in (support, c, high.indentation.lower, k.upper**1.5)
    )
    inverse = _Inverse.of(entries, c_in, mu, entry_error)
    below, m = inverse.bounds(lambda m: _delta(c_in, depth, steep, m * drop))
    positive = (~inside | (below > 0)).all(axis=1) & (mu[:, 0] > 0)
    most = np.zeros(c.shape)
    np.put_along_axis(most, order, c_in * m, axis=1)
    coupled = rows.apply(most) * (1.0 + 1.01 * (entry_error + (c.shape[1] + 2) * ROUNDOFF))
    rates = 1.0 - coupled * (1 + SAFETY) - SAFETY

    def stays(which: Indices) -> NDArray[np.bool_]:
        fallen = drop[which] * -rates[which] * (1 + SAFETY)
        gap = -high.indentation.upper[which]
        return np.asarray(support[which] | (rates[which] > 0) | (gap > fallen))

    left = np.flatnonzero(positive & ~stays(np.arange(len(c))).all(axis=1))
    if len(left):
        change = (_delta(c_in, depth, steep, m * drop) * m)[left]
        better = inverse.at(left).elsewhere(_columns(rows.only(left), order[left]), change)
        rates[left] = np.maximum(rates[left], better)
    return np.asarray(positive & stays(np.arange(len(c))).all(axis=1))


def _columns(rows: Stack, which: Indices) -> Array:
    """(m, n, s) columns, with indices (m, s), of the influence matrices of the m problems."""
    entries = np.empty((*which.shape, len(rows.coupled[0][1])))
    for some, problem in rows.coupled:
        entries[some] = problem.influence.matrix[which[some]]
    return entries.swapaxes(1, 2)


def _delta(c: Array, depth: Array, steep: Array, fallen: Array) -> Array:
    """Upper bounds on C~ - c(n) for indentations n >= depth - fallen."""
    slopes = 1.5 * np.sqrt(np.maximum(depth - fallen * (1 + SAFETY), 0.0)) / steep
    return np.asarray(np.clip(c - slopes * (1 - SAFETY) + SAFETY * c, 0.0, c))


class _Span(NamedTuple):
    """The quantities of the proof for one upper level.

    support : its indices;  c : (n,) diagonal of C~;  drop : D0(L1) - D0(L0);  mu : B >= mu I
    """

    upper: Level
    support: Indices
    c: Array
    drop: float
    mu: float

    @classmethod
    def of(cls, upper: Level, lower: Level, found: Proved) -> _Span:
        problem, box = upper.problem, found.box
        support = np.flatnonzero(~upper.open)
        c = np.zeros(len(problem))
        c[support] = (upper.loads.cbrt() * 1.5 / problem.exact.coefficients).upper[support]
        least = LEAST * c.max(initial=0.0)
        c[support] = np.maximum(c[support], np.minimum(least, 1.0 / box.stiffness[support]))
        c *= 1 + SAFETY
        # H + A >= mu H gives C~^-1 + A >= (mu - e) C~^-1 where C~ <= (1 + e) H^-1.
        stiffest = c[support] * box.stiffness[support]
        beyond = max(float(stiffest.max(initial=0.0)) - 1.0, 0.0)
        mu = 1.0 - box.convexity_number - beyond * (1 + SAFETY) - SAFETY
        drop = float((upper.approach - lower.approach).upper)
        return cls(upper, support, c, drop, mu)

    def rates(self, m: Array) -> Array:
        """(n,) lower bounds on y_i(C) = 1 - (A C y(C))_i for 0 <= y <= m."""
        influence, most = self.upper.problem.influence, self.c * m
        coupled = influence.apply(most)
        return np.asarray(
            1.0 - (coupled + influence.rounding(most).of(coupled)) * (1 + SAFETY) - SAFETY
        )

    def delta(self, m: Array) -> Array:
        """(s,) delta on the support, for bounds m (s,) on the rates there."""
        k = np.broadcast_to(self.upper.problem.exact.coefficients.upper, self.c.shape)
        depth, c = self.upper.indentation.lower[self.support], self.c[self.support]
        return _delta(c, depth, k[self.support] ** 1.5, m * self.drop)

    def inverse(self) -> _Inverse:
        """The inverse for the support, with m = 1."""
        influence = self.upper.problem.influence
        entries, c = influence.submatrix(self.support)[None], self.c[self.support][None]
        return _Inverse.of(
            entries, c, np.full((1, 1), self.mu), np.full((1, 1), influence.entry_error)
        )

    def unsettled(self, rates: Array, rising: NDArray[np.bool_]) -> Indices:
        """Indices with a rate that may be negative, of asperities not sure to stay open."""
        return np.flatnonzero(~((rates > 0) | (~rising & (rates > -self.spare))))

    @property
    def spare(self) -> Array:
        """(n,) s of (b): open asperities with rates above -s stay open."""
        gaps = np.maximum(-self.upper.indentation.upper, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.nan_to_num(gaps / self.drop, posinf=np.inf) * (1 - SAFETY))


class _Inverse(NamedTuple):
    """Computed B^-1 and v = B^-1 w for m supports of s asperities, w the diagonal of W.

    errors : (m, s) bounds on the 2-norm errors of columns of B^-1;  error : (m, 1) the same for v
    lost   : (m, 1) bound on the relative rounding of a product with A
    """

    w: Array
    matrix: Array
    errors: Array
    v: Array
    error: Array
    lost: Array

    @classmethod
    def of(cls, entries: Array, c: Array, mu: Array, entry_error: Array) -> _Inverse:
        """The inverses from the entries (m, s, s) of A, which are overwritten, and C~ (m, s)."""
        w, diagonal = np.sqrt(c), np.arange(c.shape[1])
        B = entries
        B *= w[:, :, None] * w[:, None, :]
        B[:, diagonal, diagonal] = 1.0
        X = np.asarray(np.linalg.inv(B), dtype=np.float64)
        lost = 1.01 * (entry_error + (c.shape[1] + 8) * ROUNDOFF)
        largest = np.abs(B).sum(axis=2).max(axis=1)[:, None]  # at least the 2-norm of |B|
        v = X @ w[:, :, None]

        def error(left: NDArray[Any], of: NDArray[Any]) -> Array:
            rounding = lost * largest * np.linalg.norm(of, axis=1)
            return np.asarray((np.linalg.norm(left, axis=1) + rounding) / mu * (1 + SAFETY))

        errors = error(np.eye(c.shape[1]) - B @ X, X)
        return cls(w, X, errors, v[:, :, 0], error(w[:, :, None] - B @ v, v), lost)

    def at(self, which: Indices) -> _Inverse:
        """The inverses of some of the rows."""
        return _Inverse._make(each[which] for each in self)

    def bounds(self, delta: Callable[[Array], Array]) -> tuple[Array, Array]:
        """(m, s) lower bounds on the rates on the supports, and upper bounds m, by (1).

        delta : returns delta for bounds m
        """
        high = np.maximum(self.matrix + self.errors[:, None, :], 0.0)
        low = np.maximum(self.errors[:, None, :] - self.matrix, 0.0)
        diagonal, w = np.arange(self.w.shape[1]), np.where(self.w > 0, self.w, 1.0)
        high[:, diagonal, diagonal] = low[:, diagonal, diagonal] = 0.0
        m = np.ones(w.shape)
        for _ in range(IMPROVEMENTS):
            change = delta(m) * m / w
            above = (self.v + self.error + (low @ change[:, :, None])[:, :, 0]) / w * (1 + SAFETY)
            m = np.minimum(m, np.maximum(above, 0.0))
        change = delta(m) * m / w
        falls = (self.error + (high @ change[:, :, None])[:, :, 0]) * (1 + SAFETY)
        return (self.v - falls) / w - SAFETY * np.abs(self.v / w), m

    def elsewhere(self, entries: Array, change: Array) -> Array:
        """(m, e) lower bounds on the rates of open asperities outside the supports, by (1).

        entries : (m, e, s) of A, from supports to open asperities;  change : (m, s) delta m
        """
        weighted, change = entries * self.w[:, None, :], change / np.where(self.w > 0, self.w, 1.0)
        sizes = np.linalg.norm(weighted, axis=2)
        lost = self.errors + self.lost * np.linalg.norm(self.matrix, axis=1)
        falls = np.maximum(sizes[:, :, None] * lost[:, None, :] - weighted @ self.matrix, 0.0)
        off = self.error + self.lost * np.linalg.norm(self.v, axis=1, keepdims=True)
        least = (falls @ change[:, :, None])[:, :, 0] + sizes * off
        coupled = (weighted @ self.v[:, :, None])[:, :, 0]
        return np.asarray(1.0 - coupled - least * (1 + SAFETY) - SAFETY * (1 + coupled))


def _falls(upper: Level, lower: Level, rising: NDArray[np.bool_]) -> bool:
    """False if each asperity is proved open at `lower`, or rising and indented more at `upper`."""
    if upper.solution is None:
        return True
    if lower.solution is None:
        return float(lower.load.size) > 0
    grows = (upper.indentation - lower.indentation).positive
    return not (lower.open | (rising & grows)).all()


def _least_rate(level: Level, rising: NDArray[np.bool_]) -> float:
    """The least rate y = (I + A C)^-1 1 of the rising asperities, at most 0."""
    problem, touching = level.problem, level.loads.value > 0
    if not touching.any():
        return 0.0
    c = np.where(touching, 1.0 / problem.stiffness(np.where(touching, level.loads.value, 1.0)), 0.0)
    y: Array = correct(
        problem.influence,
        problem.shells,
        np.sqrt(c),
        -np.ones(len(c)),
        balanced=False,
        tolerance=SOLVED,
    )
    return float(y[rising].min(initial=0.0))
