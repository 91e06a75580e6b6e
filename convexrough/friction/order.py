r"""Order: no indentation falls as the load rises. Where it holds, levels are all of friction.

Let n_i(L) be the indentation at the load L, minus the gap where open, and C = diag(dP_i / dn_i),
0 where open. As n = D0 + d - A P, the rates y = dn / dD0 solve (I + A C) y = 1. A path down to the
load L0 from that of P has order where y_i >= 0 on it for every i that may touch at P, and all
others stay open. One level with the load L1 proves this from L1 down to L0, as follows.

Let C~ >= C(L1) be diagonal, W = C~^(1/2) on its support, the asperities not proved open at L1, and
B = I + W A W >= mu I > 0 there; so I + A C is regular for all 0 <= C <= C~. Let y = (I + A C~)^-1 1
and G = (I + A C~)^-1 A. For C = C~ - D with 0 <= D <= delta <= C~ we have
(I + A C~) y(C) = 1 + A D y(C), that is

    y_i(C) (1 - G_ii D_i) = y_i + sum over k != i of G_ik D_k y_k(C).                          (1)

On the support G = W^-1 (I - B^-1) W^-1 and G_ii <= 0, as (B^-1)_ii >= 1 / B_ii = 1.

(a) Let m be 1, or improved: m <- min(m, y + G+ (delta m)), G+ the positive entries of G off its
diagonal. If on the support

    y_i > sum over k != i of max(-G_ik, 0) delta_k m_k,   or   m = 1 and 1 > sum over k of A_ik C~_k

for all i, then 0 < y_i(C) <= m_i there for all C from C~ - delta to C~. In the first case follow
y(C~ - s D) from s = 0, where it is positive: as long as it is not negative, y(C) = 1 - A C y(C) is
at most 1, hence at most m by (1), and at least a positive constant by (1), as 1 - G_ii D_i is
bounded; by continuity it stays so. In the second case follow y(s C) from y(0) = 1 up to s = 1.

(b) Let delta_k >= C~_k - c_k(n_k(L1) - m_k (D0(L1) - D0(L0))), c_k(n) = dP_k / dn_k. Let the others
be open at L1, with y_i >= -s_i by (1) with D_i = 0, and gaps g_i > s_i (D0(L1) - D0(L0)) there.
Then y > 0 on the support all the way down to L0, and the others stay open. For the solution is
continued downwards by dn / dD0 = y(C(n)) (the implicit function theorem), and C stays between
C~ - delta and C~: n falls, so that C <= C~, by less than m_k (D0(L1) - D0(L0)) before L0 is
reached; and the gaps stay open by the same count. The load falls strictly with D0, and the
solution stays in the box where it is the only one. For L0 = 0 all this holds down to every L > 0.

Of those that touch at P but are open at L1, where a path is proved in pieces, s_i <= 0 is asked.
The second case of (a) needs no inverse. For the first B^-1 is computed, and bounded: with
R = I - B X, column k of B^-1 - X is at most || R_k || / mu in the 2-norm.
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
from convexrough.normal.level import Level
from convexrough.normal.proved import Proved
from convexrough.normal.stack import Boxes, Rows, Stack
from convexrough.roundoff import ROUNDOFF, SAFETY

#: "proved" for all loads between the levels in use; "proved for one step", where no load falls
#: between them, and no rate is seen to be negative at them and at some levels between: a state is
#: then the solution of the program with one step; "fails" where an indentation is seen to fall, or
#: nothing is proved.
Order = Literal["proved", "proved for one step", "fails"]

#: A rate dn_i / dD0 below minus this is no rounding; what a linear solve may leave.
RATE_ROUNDING, SOLVED = 1e-9, 1e-10

#: Up to so many that touch the inverse costs no more than the levels themselves.
MOST = 300

#: Levels between that are tried: where an inverse is made, and where none is.
BETWEEN, FEW_BETWEEN = 7, 1

#: Improvements of the bounds m; and the least c of the largest that is counted. Heuristics.
IMPROVEMENTS, LEAST = 4, 2.0**-30


def order_between(
    at: Callable[[Fraction], Level], loads: Iterable[Fraction], most: int = MOST
) -> Order:
    """Whether order holds between the highest and the lowest of some loads, by bisection.

    at   : the level of a load
    most : that touch, up to which an inverse is made
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
    left = BETWEEN if rising.sum() <= most else FEW_BETWEEN
    while len(unproved) <= left:  # each takes one level at least
        left -= 1
        high, low = unproved.pop(0)
        middle = (high + low) / 2
        try:
            level = at(middle)
        except SolverError:  # too crowded to be solved: nothing is proved between
            return "proved for one step"
        if _falls(at(high), level, rising) or _falls(level, at(low), rising):
            return "fails"
        if _least_rate(level, rising) < -RATE_ROUNDING:
            return "fails"
        for a, b in ((high, middle), (middle, low)):
            if not proved_between(at(a), at(b), rising, most):
                unproved.append((a, b))
        if not unproved:
            return "proved"
    return "proved for one step"


def proved_between(upper: Level, lower: Level, rising: NDArray[np.bool_], most: int = MOST) -> bool:
    """Whether no indentation falls from one level to a lower one, as above, from the upper alone.

    rising : (n,) all that may touch at the highest load of the path
    """
    found = upper.solution
    if found is None or (found.box.held & ~upper.open).any():
        return False
    span = _Span.of(upper, lower, found)
    rates = span.rates(np.ones(len(span.c)))
    if (rates[span.support] > 0).all() and not len(span.unsettled(rates, rising)):
        return True
    if len(span.support) > most or not span.mu > 0:
        return False
    inverse = _Inverse.of(span)
    below, m = inverse.bounds(span)
    if not (below > 0).all():
        return False
    rates = span.rates(m)
    rates[span.support] = below
    left = span.unsettled(rates, rising)
    if len(left) > most:
        return False
    rates[left] = np.maximum(rates[left], inverse.elsewhere(span, left, m))
    return not len(span.unsettled(rates, rising))


@np.errstate(all="ignore")
def proved_in_rows(rows: Stack, boxes: Boxes, high: Rows, low: Rows) -> NDArray[np.bool_]:
    """(m,) `proved_between` of rows of levels, all of whose upper ones are the highest of a path.

    False, too, where more has to be known of open asperities than row sums say.
    """
    n, k = high.loads.shape[1], rows.coefficients
    support = ~high.open
    c = np.where(support, 1.5 * np.cbrt(high.loads.upper) / k.lower * (1 + SAFETY), 0.0)
    least = np.minimum(LEAST * c.max(axis=1, keepdims=True), 1.0 / boxes.stiffness)
    c = np.where(support, np.maximum(c, least) * (1 + SAFETY), 0.0)
    stiffest = np.where(support, c * boxes.stiffness, 0.0).max(axis=1, keepdims=True)
    beyond = np.maximum(stiffest - 1.0, 0.0)
    mu = 1.0 - boxes.number - beyond * (1 + SAFETY) - SAFETY
    drop = (high.approach - low.approach).upper[:, None]
    count = max(1, int(support.sum(axis=1).max()))
    order = np.argsort(~support, axis=1, kind="stable")[:, :count]
    inside, c_in, depth = (
        np.take_along_axis(values, order, axis=1) for values in (support, c, high.indentation.lower)
    )
    steep = np.broadcast_to(k.upper, c.shape)
    steep = np.take_along_axis(steep, order, axis=1) ** 1.5
    w, entry_error, matrix = np.sqrt(c_in), np.zeros((len(c), 1)), np.empty((len(c), count, count))
    for some, problem in rows.coupled:
        entry_error[some] = problem.influence.entry_error
        which = order[some]
        matrix[some] = problem.influence.matrix[which[:, :, None], which[:, None, :]]
    matrix *= w[:, :, None] * w[:, None, :]
    diagonal = np.arange(count)
    matrix[:, diagonal, diagonal] = 1.0
    X = np.linalg.inv(matrix)
    v = (X @ w[:, :, None])[:, :, 0]
    lost = 1.01 * (entry_error + (count + 8) * ROUNDOFF)
    lost = lost * np.abs(matrix).sum(axis=2).max(axis=1)[:, None]
    left, rest = np.eye(count) - matrix @ X, w - (matrix @ v[:, :, None])[:, :, 0]
    errors = (_norms(left) + lost * _norms(X)) / mu * (1 + SAFETY)
    error = (_norms(rest[:, :, None]) + lost * _norms(v[:, :, None])) / mu * (1 + SAFETY)
    up, down = np.maximum(X + errors[:, None, :], 0.0), np.maximum(errors[:, None, :] - X, 0.0)
    up[:, diagonal, diagonal] = down[:, diagonal, diagonal] = 0.0
    root = np.where(w > 0, w, 1.0)

    def change(m: Array) -> Array:
        low_end = np.maximum(depth - m * drop * (1 + SAFETY), 0.0)
        slopes = 1.5 * np.sqrt(low_end) / steep * (1 - SAFETY)
        delta = np.clip(c_in - slopes + SAFETY * c_in, 0.0, c_in)
        return np.asarray(delta * m / root)

    m = np.ones(w.shape)
    for _ in range(IMPROVEMENTS):
        above = (v + error + (down @ change(m)[:, :, None])[:, :, 0]) / root * (1 + SAFETY)
        m = np.minimum(m, np.maximum(above, 0.0))
    falls = (error + (up @ change(m)[:, :, None])[:, :, 0]) * (1 + SAFETY)
    below = (v - falls) / root - SAFETY * np.abs(v / root)
    most, felt = np.ones(c.shape), np.zeros(c.shape)
    np.put_along_axis(most, order, np.where(inside, m, 1.0), axis=1)
    felt = rows.apply(c * most) * (1.0 + 1.01 * (entry_error + (n + 2) * ROUNDOFF))
    rates = 1.0 - felt * (1 + SAFETY) - SAFETY
    stays = (rates > 0) | (-high.indentation.upper > drop * -rates * (1 + SAFETY))
    rising = np.where(inside, below > 0, True).all(axis=1) & (support | stays).all(axis=1)
    return np.asarray(rising & (mu[:, 0] > 0))


def _norms(columns: NDArray[Any]) -> Array:
    return np.asarray(np.sqrt((columns * columns).sum(axis=1)))


class _Span(NamedTuple):
    """An upper level, and how far down from it.

    support : those not proved open;  c : (n,) C~, 0 elsewhere;  drop : D0(L1) - D0(L0)
    mu      : B >= mu I
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
        felt = influence.apply(most)
        return np.asarray(1.0 - (felt + influence.rounding(most).of(felt)) * (1 + SAFETY) - SAFETY)

    def delta(self, m: Array) -> Array:
        """Of the support."""
        k = self.upper.problem.exact.coefficients.upper
        least = self.upper.indentation.lower[self.support] - m * self.drop * (1 + SAFETY)
        steep = (k if len(k) == 1 else k[self.support]) ** 1.5
        slopes = 1.5 * np.sqrt(np.maximum(least, 0.0)) / steep * (1 - SAFETY)
        c = self.c[self.support]
        return np.asarray(np.clip(c - slopes + SAFETY * c, 0.0, c))

    def unsettled(self, rates: Array, rising: NDArray[np.bool_]) -> Indices:
        """Those with a rate that may be negative, and that must rise or might not stay open."""
        gaps = -self.upper.indentation.upper
        with np.errstate(invalid="ignore"):
            stays = ~rising & (gaps > self.drop * -rates * (1 + SAFETY))
        return np.flatnonzero(~((rates > 0) | stays))


class _Inverse(NamedTuple):
    """B^-1 of the support, and v = B^-1 w, as computed, with bounds on their errors.

    errors : (m,) of the columns, in the 2-norm;  error : of v, in the 2-norm
    lost   : what a product with A loses, relative to the sizes of its rows
    """

    w: Array
    matrix: Array
    errors: Array
    v: Array
    error: float
    lost: float

    @classmethod
    def of(cls, span: _Span) -> _Inverse:
        influence = span.upper.problem.influence
        w = np.sqrt(span.c[span.support])
        B = influence.submatrix(span.support) * w * w[:, None]
        np.fill_diagonal(B, 1.0)
        X = np.asarray(np.linalg.inv(B), dtype=np.float64)
        lost = 1.01 * (influence.entry_error + (len(w) + 8) * ROUNDOFF)
        largest = float(np.abs(B).sum(axis=1).max())  # at least the 2-norm of |B|
        v = X @ w

        def error(left: Array, of: Array) -> Array:
            rounding = lost * largest * np.linalg.norm(of, axis=0)
            sizes = np.asarray(np.linalg.norm(left, axis=0) + rounding, dtype=np.float64)
            return np.asarray(sizes / span.mu * (1 + SAFETY))

        errors = error(np.eye(len(w)) - B @ X, X)
        return cls(w, X, errors, v, float(error(w - B @ v, v)), lost)

    def bounds(self, span: _Span) -> tuple[Array, Array]:
        """(m,) lower bounds on the rates of the support, and (n,) m, upper ones; by (1)."""
        high = np.maximum(self.matrix + self.errors, 0.0)
        low = np.maximum(self.errors - self.matrix, 0.0)
        np.fill_diagonal(high, 0.0)
        np.fill_diagonal(low, 0.0)
        m = np.ones(len(self.w))
        for _ in range(IMPROVEMENTS):
            change = span.delta(m) * m / self.w
            above = (self.v + self.error + low @ change) / self.w * (1 + SAFETY)
            m = np.minimum(m, np.maximum(above, 0.0))
        change = span.delta(m) * m / self.w
        falls = (self.error + high @ change) * (1 + SAFETY)
        below = (self.v - falls) / self.w
        every = np.ones(len(span.c))
        every[span.support] = m
        return below - SAFETY * np.abs(self.v / self.w), every

    def elsewhere(self, span: _Span, which: Indices, m: Array) -> Array:
        """Lower bounds on the rates of others, that are open; by (1)."""
        if len(which) == 0:
            return np.zeros(0)
        both = np.concatenate((span.support, which))
        rows = span.upper.problem.influence.submatrix(both)[len(span.support) :]
        weighted = rows[:, : len(span.support)] * self.w
        sizes = np.linalg.norm(weighted, axis=1)
        lost = self.errors + self.lost * np.linalg.norm(self.matrix, axis=0)
        falls = np.maximum(np.outer(sizes, lost) - weighted @ self.matrix, 0.0)
        m = m[span.support]
        by_change = falls @ (span.delta(m) * m / self.w)
        off = sizes * (self.error + self.lost * float(np.linalg.norm(self.v)))
        felt = weighted @ self.v
        return np.asarray(1.0 - felt - (by_change + off) * (1 + SAFETY) - SAFETY * (1 + felt))


def _falls(upper: Level, lower: Level, rising: NDArray[np.bool_]) -> bool:
    """Whether a load may be less than at a lower level, or what is open at the top may touch."""
    if upper.solution is None:
        return True
    if lower.solution is None:
        return float(lower.load.size) > 0
    grows = (upper.indentation - lower.indentation).positive
    return not (lower.open | (rising & grows)).all()


def _least_rate(level: Level, rising: NDArray[np.bool_]) -> float:
    """The least of y = (I + A C)^-1 1 of some: how fast each indentation grows."""
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
