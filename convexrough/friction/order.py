r"""Order: no indentation falls as the load rises, so friction states are sums of normal solutions.

Let n_i(L) be the indentation of asperity i at the load L, or minus its gap where open; D0 the
approach, d the offsets, A the influence matrix, and C = diag(dP_i / dn_i), 0 where open. As
n = D0 + d - A P, the rates y = dn / dD0 solve (I + A C) y = 1. Levels from P down to the load L0
have order if y_i >= 0 for every i that may touch at P, and all others stay open. The level at one
load L1 proves this from L1 down to L0, as follows.

The *support* is the set of asperities not proved open at L1. Let C~ >= C(L1) be diagonal and 0 off
the support, I + A C regular for all 0 <= C <= C~, and C >= C~ - delta. Let v_j be any numbers for
the j on the support but i, of an asperity i, with w_j = v_j C~_j,

    s_k = v_k + sum_j w_j A_jk,                                                                 (1)

and r_k = |A_ik - s_k| for k != i, r_i = max(-s_i, 0). In (2), r_k = max(A_ik - s_k, 0) will do. If
0 <= y(C) <= m <= 1 on the support, then

    y_i >= 1 - sum_k (w_k + max(-v_k, 0) delta_k m_k + r_k C~_k),                               (2)
    y_i (1 - s_i C_i) <= 1 - sum_k (w_k - max(v_k, 0) delta_k m_k - r_k C~_k).                  (3)

For let z = C y. By the rows of y + A z = 1, sum_k s_k z_k = sum_k w_k (z_k / C~_k + (A z)_k) is the
sum of w_k - v_k (C~_k - C_k) y_k, and (A z)_i = 1 - y_i differs from it by s_i z_i and by at most
sum_k r_k z_k over k != i. Without weights (2) is the row sum of A C~.

(a) Let m follow from m = 1 by (3). If the right sides of (2) are positive on the support, so are
the rates, for all C from C~ - delta to C~. For they are at C~: there (2) and (3) hold for |y| <= Y
with Y r in place of r. If |1 - sum_k w_k| is at most twice 1 - s_i C~_i - sum_k r_k C~_k for all i,
(3) gives Y <= 2. From there follow y(C~ - t D): until a rate is 0 they are at most 1, as
y = 1 - A C y, hence at most m by (3), hence more than 0 by (2). With delta = C~, follow
y(t C) from y(0) = 1.

(b) Let delta_k >= C~_k - c_k(n_k(L1) - m_k (D0(L1) - D0(L0))), c_k(n) = dP_k / dn_k. Let each
asperity outside the support have y_i >= -u_i by (2), and a gap g_i > u_i (D0(L1) - D0(L0)) at L1.
Then y > 0 on the support down to L0, and the others stay open.
Proof: dn / dD0 = y(C(n)) continues the solution downwards (implicit function theorem). C stays
between C~ - delta and C~, as n_k falls, by less than m_k (D0(L1) - D0(L0)) before L0 is reached;
and no gap closes, by the bounds on y_i. The load falls strictly with D0, and the solution stays in
the box where it is the only one. For L0 = 0 all this holds down to every L > 0.

If a range of loads is proved in parts, asperities that touch at P but are open at L1 need u_i <= 0.
The best weights, s_k = A_ik, follow from the inverse X of I + C~ A: v is (A X)_i, less so much of
the row X_i that v_i = 0. If too many asperities touch for an inverse, `friction.sweeping` finds
weights of near neighbours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.friction.sweeping import swept_rates
from convexrough.normal.boxes import Box
from convexrough.normal.level import Level, rows_of
from convexrough.normal.stack import Stack
from convexrough.normal.together import Rows
from convexrough.numbers.balls import Ball
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

#: Largest number of asperities of which rates are bounded by an inverse.
MOST_BOUNDED = 4 * INVERTED

#: Number of improvements of m. A heuristic.
IMPROVEMENTS = 4


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
    found, problem = upper.solution, upper.problem
    if found is None or (found.box.fixed_open & ~upper.open).any():
        return False
    influence = problem.influence
    span = _Span.of(rows_of([upper]), rows_of([lower]), problem.exact.coefficients, found.box)
    (c,), support = span.c, np.flatnonzero(~upper.open)
    coupled = influence.apply(c)
    coupled = coupled + influence.rounding(c).of(coupled)
    rates = 1.0 - coupled * (1 + SAFETY) - SAFETY
    left = np.flatnonzero(span.unsettled(rates[None], rising)[0])
    if len(left) == 0:
        return True
    both = np.concatenate((support, np.setdiff1d(left, support)))
    if not span.regular.all() or len(support) > max(INVERTED, TOUCHING * most):
        return False
    if len(support) > INVERTED:
        rates = swept_rates(influence, c, np.where(rising, 0.0, span.spare[0]), most)
    elif len(both) > MOST_BOUNDED:
        return False
    else:
        entries = influence.submatrix(both)[None, :, : len(support)]
        better = span.at(support[None]).rates(entries, np.full((1, 1), influence.entry_error))[0]
        rates[support] = -np.inf
        rates[both] = np.maximum(rates[both], better)
    return not span.unsettled(rates[None], rising).any()


@np.errstate(all="ignore")
def proved_in_rows(rows: Stack, box: Box, high: Rows, low: Rows) -> NDArray[np.bool_]:
    """(m,) `proved_between` for rows of levels, the upper ones at the highest load of a path."""
    span = _Span.of(high, low, rows.exact.coefficients, box)
    entry_error = np.empty((len(span.c), 1))
    for some, problem in rows.coupled:
        entry_error[some] = problem.influence.entry_error
    lost = 1.01 * (entry_error + (span.c.shape[1] + 2) * ROUNDOFF)
    rates = 1.0 - rows.apply(span.c) * (1 + lost + SAFETY) - SAFETY
    left = span.support | span.unsettled(rates, span.support)
    order = np.argsort(~span.support * 1 + ~left, axis=1, kind="stable")
    known, count = (max(1, int(each.sum(axis=1).max())) for each in (left, span.support))
    order = order[:, :known]
    entries = np.empty((*order.shape, count))
    for some, problem in rows.coupled:
        which = order[some]
        entries[some] = problem.influence.matrix[which[:, :, None], which[:, None, :count]]
    rates[span.support] = -np.inf
    found = span.at(order[:, :count]).rates(entries, entry_error)
    found = np.maximum(found, np.take_along_axis(rates, order, axis=1))
    np.put_along_axis(rates, order, found, axis=1)
    return np.asarray(span.regular[:, 0] & ~span.unsettled(rates, span.support).any(axis=1))


class _Span(NamedTuple):
    """The quantities of the proof for m upper levels: (m, n) or (m, 1).

    support : as above;  c : diagonal of C~;  drop : D0(L1) - D0(L0)
    depth   : least indentations at L1;  gaps : least gaps;  steep : k^(3/2)
    regular : I + A C is regular for 0 <= C <= C~
    """

    support: NDArray[np.bool_]
    c: Array
    drop: Array
    depth: Array
    gaps: Array
    steep: Array
    regular: NDArray[np.bool_]

    @classmethod
    @np.errstate(invalid="ignore")
    def of(cls, high: Rows, low: Rows, k: Ball, box: Box) -> _Span:
        support = ~high.open
        c = np.where(support, 1.5 * np.cbrt(high.loads.upper) / k.lower * (1 + SAFETY), 0.0)
        # H + A >= (1 - theta) H gives C~^-1 + A >= (1 - theta e) C~^-1 where C~ <= e H^-1.
        e = np.where(support, c * box.stiffness, 0.0).max(axis=1, keepdims=True)
        drop, depth = (high.approach - low.approach).upper[:, None], high.indentation.lower
        gaps = np.maximum(-high.indentation.upper, 0.0)
        steep = np.broadcast_to(k.upper**1.5, c.shape)
        regular = np.asarray(box.convexity_number * e < 1 - SAFETY)
        return cls(support, c, drop, depth, gaps, steep, regular)

    def at(self, which: Indices) -> _Span:
        """The same at some asperities (m, s) of each row."""
        wide = ("support", "c", "depth", "gaps", "steep")
        return self._replace(
            **{name: np.take_along_axis(getattr(self, name), which, axis=1) for name in wide}
        )

    def unsettled(self, rates: Array, rising: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(m, n) true where a rate may be negative and the asperity is not sure to stay open."""
        return np.asarray(~((rates > 0) | (~rising & (rates > -self.spare))))

    @property
    def spare(self) -> Array:
        """(m, n) u of (b): open asperities with rates above -u stay open."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.nan_to_num(self.gaps / self.drop, posinf=np.inf) * (1 - SAFETY))

    def _delta(self, m: Array) -> Array:
        """(m, s) delta for bounds m on the rates: bounds on C~ - c(n) for n >= depth - m drop."""
        fallen = np.maximum(self.depth - m * self.drop * (1 + SAFETY), 0.0)
        slopes = 1.5 * np.sqrt(fallen) / self.steep
        return np.asarray(np.clip(self.c - slopes * (1 - SAFETY) + SAFETY * self.c, 0.0, self.c))

    @np.errstate(all="ignore")
    def rates(self, entries: Array, entry_error: Array) -> Array:
        """(m, r) lower bounds (2) on rates, by an inverse; -inf without a proof of (a).

        The arrays are those of s asperities that include the support.

        entries : (m, r, s) of A, between r asperities, these s first, and the s
        """
        c, s = self.c[:, :, None], np.arange(self.c.shape[1])
        matrix = entries[:, s] * self.c[:, :, None]
        matrix[:, s, s] = 1.0
        X = np.linalg.inv(matrix)
        v = entries @ X
        v[:, s] -= (v[:, s, s] / X[:, s, s])[:, :, None] * X
        v[:, s, s] = 0.0
        left = v @ matrix  # s of (1)
        own = np.maximum(left[:, s, s], 0.0) * self.c
        left -= entries
        left[:, s, s] = np.minimum(left[:, s, s], 0.0)
        rest = 1.0 - (v @ c)[:, :, 0]
        lost = 1.01 * (entry_error + (len(s) + 16) * ROUNDOFF)
        rounding = np.abs(v) @ (matrix @ c) + entries @ c
        off = (np.abs(left) @ c)[:, :, 0] + 2.0 * lost * rounding[:, :, 0] + SAFETY
        room, m = 1.0 - own - off[:, s], np.ones(self.c.shape)
        positive = np.maximum(v, 0.0)
        for _ in range(IMPROVEMENTS):
            changed = (self._delta(m) * m)[:, :, None]
            above = rest[:, s] + (positive[:, s] @ changed)[:, :, 0] + off[:, s]
            m = np.where(room > 0, np.minimum(m, np.maximum(above, 0.0) / room), m)
        changed = (self._delta(m) * m)[:, :, None]
        known = ~self.support | ((room > 0) & (np.abs(rest[:, s]) <= 2.0 * room))
        below = rest - ((positive - v) @ changed)[:, :, 0] - 2.0 * off
        sure = known & (~self.support | (below[:, s] > 0))
        return np.where(sure.all(axis=1, keepdims=True), below, -np.inf)


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
