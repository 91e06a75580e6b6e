"""Proof of order: no indentation falls as the load rises, which theorems on friction require.

docs/theory/states.md, "The proof of order", defines the symbols and proves three theorems. The
first two need distances only (`friction.spacing`); this file has theorem 3, the corollary and
a bisection. C~ is a diagonal matrix. For few asperities the weights of theorem 3 come from an
inverse; for more, from `friction.sweeping`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, Indices
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.friction.spacing import order_holds, settled_by_rings
from convexrough.friction.sweeping import swept_rates
from convexrough.influence.coupling import Influence, inverse_distances
from convexrough.influence.lattice import LatticeInfluence
from convexrough.normal.boxes import Box
from convexrough.normal.level import Level, Rows, rows_of
from convexrough.normal.stack import Stack
from convexrough.roundoff import ROUNDOFF, SAFETY

#: "proved": order holds at all loads between the levels in use. "proved for one step": no load P_i
#: falls from a level in use to the next higher one, and no rate at the tested levels is negative;
#: each friction state solves one step of `general_step`. "fails": one of these conditions
#: is not met. The strongest comes first.
Order = Literal["proved", "proved for one step", "fails"]

#: A computed rate below -RATE_ROUNDING counts as negative. Rates are solved for to the relative
#: residual SOLVED.
RATE_ROUNDING, SOLVED = 1e-9, 1e-10

#: Largest number of touching asperities for which an inverse is computed, and largest number of
#: asperities for which weights are computed at all. `cr.prove_order` has a limit of its own.
INVERTED, MOST = 600, 20_000

#: Largest number of intermediate levels of the bisection, with an inverse and without one; largest
#: number of asperities of which an inverse bounds rates.
BETWEEN, FEW_BETWEEN, MOST_BOUNDED = 7, 1, 4 * INVERTED

#: Number of entries of matrices with which rates are computed together: they fit in a cache.
TOGETHER = 2**16


def order_between(
    at: Callable[[Fraction], Level], loads: Iterable[Fraction], most: int = MOST
) -> Order:
    """What is proved about order, by bisection, between the ends of `loads`, whose levels are in
    use.

    at   : function that returns the level at a load
    most : largest number of asperities for which weights are computed
    """
    used = sorted(set(loads), reverse=True)
    top = at(used[0])
    rising = ~top.open
    if len(used) == 1 or proved_between(top, at(used[-1]), rising, most):
        return "proved"
    if _falls(map(at, used), map(at, used), rising):  # levels are computed as they are needed
        return "fails"
    unproved = [(used[0], used[-1])]
    left = BETWEEN if rising.sum() <= INVERTED else FEW_BETWEEN
    while len(unproved) <= left:  # each interval needs at least one level
        left -= 1
        high, low = unproved.pop(0)
        middle = (high + low) / 2
        try:
            level = at(middle)
        except SolverError:  # the intermediate level could not be computed
            return "proved for one step"
        if _falls([at(high), level, at(low)], [level], rising):
            return "fails"
        for a, b in ((high, middle), (middle, low)):
            if rising.sum() > INVERTED or not proved_between(at(a), at(b), rising):
                unproved.append((a, b))
        if not unproved:
            return "proved"
    return "proved for one step"


def proved_between(upper: Level, lower: Level, rising: NDArray[np.bool_], most: int = MOST) -> bool:
    """True if the upper level proves order down to the lower level.

    rising : (n,) true for asperities that may touch at the highest load of the path
    """
    box, problem = upper.box, upper.problem
    if box is None or (box.fixed_open & ~upper.open).any():
        return False
    influence = problem.influence
    span = _Span.of(rows_of([upper]), rows_of([lower]), problem.exact.coefficients, box)
    (c,), support = span.c, np.flatnonzero(~upper.open)
    if order_holds(problem.scene, influence, influence.scale * c):
        return True
    coupled = influence.apply(c)
    coupled = coupled + influence.rounding(c).of(coupled)
    rates = 1.0 - coupled * (1 + SAFETY) - SAFETY
    left = np.flatnonzero(span.unsettled(rates[None], rising)[0])
    if len(left) == 0:
        return True
    both = np.concatenate((support, np.setdiff1d(left, support)))
    if not span.regular.all():
        return False
    if isinstance(influence, LatticeInfluence):  # few need weights; then no rate may be negative
        rings = settled_by_rings(problem.scene, influence, influence.scale * c)
        known = np.where(rings, np.maximum(rates, SAFETY), rates)  # any positive number will do
        few = np.count_nonzero(~(known > 0)) <= most
        if few and (swept_rates(influence, c, known, np.zeros(len(c))) > 0).all():
            return True
    if len(support) > max(INVERTED, most):
        return False
    if len(support) > INVERTED or len(both) > MOST_BOUNDED:
        swept = swept_rates(influence, c, rates, np.where(rising, 0.0, span.spare[0]))
        return not span.unsettled(swept[None], rising).any()
    entries = influence.scale * inverse_distances(influence.points[both], influence.points[support])
    error = np.full((1, 1), influence.entry_error)
    return bool(span.settled(rates[None], rising, both[None], entries[None], error)[0])


@np.errstate(all="ignore")
def proved_in_rows(rows: Stack, box: Box, high: Rows, low: Rows) -> NDArray[np.bool_]:
    """(m,) `proved_between` for the levels in each row; `high` must have the path's top load."""
    span = _Span.of(high, low, rows.exact.coefficients, box)
    alike = [it for some, it in rows.coupled for _ in range(some.start, some.stop)]
    shells = [it.influence.scale * c for it, c in zip(alike, span.c, strict=True)]
    each = zip(alike, shells, strict=True)
    proved = np.array([order_holds(it.scene, it.influence, own) for it, own in each])
    rest = np.flatnonzero(~proved & span.regular[:, 0])
    if len(rest):
        left = [alike[k].influence for k in rest]
        proved[rest] = _proved_by_inverses(rows.only(rest), span.only(rest), left)
    return proved


def _proved_by_inverses(
    rows: Stack, span: _Span, operators: Sequence[Influence]
) -> NDArray[np.bool_]:
    """(m,) `proved_in_rows` by theorem 3."""
    entry_error = np.array([[each.entry_error] for each in operators])
    lost = 1.01 * (entry_error + (span.c.shape[1] + 2) * ROUNDOFF)
    rates = 1.0 - rows.apply(span.c) * (1 + lost + SAFETY) - SAFETY
    left = span.support | span.unsettled(rates, span.support)
    order = np.argsort(~span.support * 1 + ~left, axis=1, kind="stable")
    known, count = (max(1, int(each.sum(axis=1).max())) for each in (left, span.support))
    order, proved = order[:, :known], np.empty(len(order), dtype=bool)
    entries = np.empty((*order.shape, count))
    for own, A, it in zip(entries, operators, order, strict=True):
        own[...] = A.matrix.take(it, 0).take(it[:count], 1)
    for some in threads.chunks(len(order), max(1, TOGETHER // (known * count))):
        part = span.only(some)
        given = rates[some], part.support, order[some], entries[some], entry_error[some]
        proved[some] = part.settled(*given)
    return proved


class _Span(NamedTuple):
    """The quantities of the proof between the levels in m rows, as arrays (m, n) or (m, 1)."""

    support: NDArray[np.bool_]
    c: Array  # diagonal of C~
    spare: Array  # largest u of the corollary: open asperities with rates above -u stay open
    regular: NDArray[np.bool_]  # true if I + A C is regular for 0 <= C <= C~

    @classmethod
    @np.errstate(divide="ignore", invalid="ignore")
    def of(cls, high: Rows, low: Rows, k: Ball, box: Box) -> _Span:
        support = ~high.open
        c = np.where(support, 1.5 * np.cbrt(high.loads.upper) / k.lower * (1 + SAFETY), 0.0)
        # theta = `box.convexity_number`, H^-1 = diag(`box.compliance`): as H + A >= (1 - theta) H,
        # C~^-1 + A >= (1 - theta e) C~^-1 where C~ <= e H^-1.
        e = np.where(support, c * box.compliance, 0.0).max(axis=1, keepdims=True)
        drop, gaps = (high.approach - low.approach).upper[:, None], -high.indentation.upper
        spare = np.nan_to_num(np.maximum(gaps, 0.0) / drop, posinf=np.inf) * (1 - SAFETY)
        return cls(support, c, spare, np.asarray(box.convexity_number * e < 1 - SAFETY))

    def only(self, rows: slice | Indices) -> _Span:
        return _Span._make(each[rows] for each in self)

    def settled(
        self,
        rates: Array,
        rising: NDArray[np.bool_],
        order: Indices,
        entries: Array,
        entry_error: Array,
    ) -> NDArray[np.bool_]:
        """(m,) true where (6) proves order, with entries (m, r, s) of A for the asperities `order`.

        The first s of the r asperities include the support. `rates` (m, n) are known from row sums.
        """
        c = np.take_along_axis(self.c, order[:, : entries.shape[2]], axis=1)
        found = rates_from(c, entries, entry_error)
        found = np.maximum(found, np.take_along_axis(rates, order, axis=1))
        np.put_along_axis(rates, order, found, axis=1)
        return np.asarray(self.regular[:, 0] & ~self.unsettled(rates, rising).any(axis=1))

    def unsettled(self, rates: Array, rising: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(m, n) true where order is not proved: the rate may be negative, or the gap may close."""
        return np.asarray(~((rates > 0) | (~rising & (rates > -self.spare))))


@np.errstate(all="ignore")
def rates_from(stiffness: Array, entries: Array, entry_error: Array) -> Array:
    """(m, r) lower bounds (6) on rates, with weights from an inverse.

    stiffness   : (m, s) diagonal of C~
    entries     : (m, r, s) of A; columns are the s asperities, rows the same and r - s more
    entry_error : (m, 1) bound on the relative error of the entries
    """
    c, count = stiffness[:, :, None], stiffness.shape[1]
    some = np.s_[:, :count]  # the s asperities
    matrix = entries[some] * c  # I + C~ A
    diagonals(matrix)[...] = 1.0
    X = np.linalg.inv(matrix)
    v = entries @ X
    v[some] -= (diagonals(v) / diagonals(X))[:, :, None] * X
    diagonals(v)[...] = 0.0
    np.maximum(v, 0.0, out=v)
    missing = np.maximum(entries - v @ matrix, 0.0)
    diagonals(missing)[...] = 0.0
    lost = 2.02 * (entry_error + (count + 16) * ROUNDOFF)
    rounding = (v @ (matrix @ c) + entries @ c)[:, :, 0]
    return np.asarray(1.0 - ((v + missing) @ c)[:, :, 0] - lost * rounding - SAFETY)


def diagonals(matrices: NDArray[Any]) -> NDArray[Any]:
    """(m, s) the first s entries on the diagonals of matrices (m, r, s), as a view."""
    return np.asarray(np.einsum("kii->ki", matrices[:, : matrices.shape[2]]))


def _falls(steps: Iterable[Level], rated: Iterable[Level], rising: NDArray[np.bool_]) -> bool:
    """True if a rate at the levels `rated` is negative, or if, from one of `steps` to the next
    lower one, an asperity is neither proved open there nor rising and proved to fall.
    """
    for upper, lower in pairwise(steps):
        if upper.box is None or (lower.box is None and float(lower.load.size) > 0):
            return True
        grows = (upper.indentation - lower.indentation).positive
        if lower.box is not None and not (lower.open | (rising & grows)).all():
            return True
    return any(_falling_rate(level, rising) for level in rated)


def _falling_rate(level: Level, rising: NDArray[np.bool_]) -> bool:
    """True if a rate y = (I + A C)^-1 1 of a rising asperity is negative."""
    problem, touching = level.problem, level.loads.value > 0
    if not touching.any():
        return False
    h = problem.compliance(np.where(touching, level.loads.value, 1.0))
    y: Array = correct(
        problem.influence,
        problem.shells,
        np.where(touching, 1.0 / np.sqrt(h), 0.0),
        -np.ones(len(h)),
        balanced=False,
        tolerance=SOLVED,
    )
    return bool((y[rising] < -RATE_ROUNDING).any())
