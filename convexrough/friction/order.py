"""Proof of order: no indentation falls as the load rises, which theorems on friction require.

docs/theory/states.md, "The proof of order", defines the symbols and proves three theorems. The
first two need distances only (`friction.spacing`); this file has theorem 3, the corollary and
a bisection. C~ is a diagonal matrix. For few asperities the weights of theorem 3 come from an
inverse; for more, from `friction.sweeping`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.friction.spacing import order_holds, settled_by_rings
from convexrough.friction.sweeping import swept_rates
from convexrough.influence.coupling import inverse_distances
from convexrough.influence.lattice import LatticeInfluence
from convexrough.normal.boxes import Box
from convexrough.normal.level import Level, Rows
from convexrough.normal.problem import NormalProblem
from convexrough.normal.stack import Stack
from convexrough.roundoff import ROUNDOFF, SAFETY

#: "proved": order holds at all loads between the levels in use. "proved for one step": no load P_i
#: falls from a level in use to the next higher one, and no rate at the tested levels is negative;
#: each friction state solves one step of `general_step`. "fails": one of these conditions
#: is not met.
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


def order_between(
    at: Callable[[Fraction], Level], loads: Iterable[Fraction], most: int = MOST
) -> Order:
    """What is proved about order, by bisection, between the ends of `loads`, whose levels are in
    use.

    at   : function that returns the level at a load
    most : largest number of asperities for which weights are computed
    """
    used = sorted(set(loads), reverse=True)
    rising = ~at(used[0]).open

    def proved(high: Fraction, low: Fraction, most: int = 0) -> bool:
        upper, lower = at(high), at(low)
        problem, box = upper.problem, upper.box
        if box is None or (box.fixed_open & ~upper.open).any():
            return False
        c = stiffnesses(upper, problem.exact.coefficients)
        if order_holds(problem.scene, problem.influence, problem.influence.scale * c):
            return True
        return proved_between(upper, lower, problem, c, box, rising, most)

    if len(used) == 1 or proved(used[0], used[-1], most):
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
            if not proved(a, b):
                unproved.append((a, b))
        if not unproved:
            return "proved"
    return "proved for one step"


def stiffnesses(level: Level | Rows, k: Ball) -> Array:
    """(n,) or (m, n) the diagonal of C~, with Hertz's coefficients k."""
    c = 1.5 * np.cbrt(level.loads.upper) / k.lower * (1 + SAFETY)
    return np.where(level.open, 0.0, c)


def proved_between(
    upper: Level | Rows,
    lower: Level | Rows,
    problem: NormalProblem,
    c: Array,
    box: Box,
    rising: NDArray[np.bool_],
    most: int = MOST,
) -> bool:
    """True if weights prove order between two solutions of `problem`, from the upper one.

    c      : (n,) `stiffnesses` of the upper solution
    box    : the box in which the upper solution was proved
    rising : (n,) true for asperities that may touch at the highest load of the path
    """
    influence, support = problem.influence, np.flatnonzero(~upper.open)
    coupled = influence.apply(c)
    coupled = coupled + influence.rounding(c).of(coupled)
    rates = 1.0 - coupled * (1 + SAFETY) - SAFETY
    drop, gaps = float((upper.approach - lower.approach).upper), -upper.indentation.upper
    with np.errstate(divide="ignore", invalid="ignore"):  # (rates > -spare) keeps a gap open
        spare = np.nan_to_num(np.maximum(gaps, 0.0) / drop, posinf=np.inf) * (1 - SAFETY)
    spare = np.where(rising, 0.0, spare)
    left = np.flatnonzero(~(rates > -spare))
    if len(left) == 0:
        return True
    # theta = `box.convexity_number`, H^-1 = diag(`box.compliance`): as H + A >= (1 - theta) H,
    # C~^-1 + A >= (1 - theta e) C~^-1 where C~ <= e H^-1. So I + A C is regular for C <= C~.
    e = float((c * np.where(c > 0, box.compliance, 0.0)).max())
    if not float(np.ravel(box.convexity_number)[0]) * e < 1 - SAFETY:
        return False
    if isinstance(influence, LatticeInfluence):  # few need weights; then no rate may be negative
        rings = settled_by_rings(problem.scene, influence, influence.scale * c)
        known = np.where(rings, np.maximum(rates, SAFETY), rates)  # any positive number will do
        few = np.count_nonzero(~(known > 0)) <= most
        if few and (swept_rates(influence, c, known, np.zeros(len(c))) > 0).all():
            return True
    both = np.concatenate((support, left[upper.open[left]]))
    if len(support) > max(INVERTED, most):
        return False
    if len(support) > INVERTED or len(both) > MOST_BOUNDED:
        rates = swept_rates(influence, c, rates, spare)
    else:
        entries = influence.scale * inverse_distances(
            influence.points[both], influence.points[support]
        )
        found = rates_from(c[support], entries, influence.entry_error)
        rates[both] = np.maximum(rates[both], found)
    return bool((rates > -spare).all())


@np.errstate(all="ignore")
def proved_in_rows(rows: Stack, box: Box, high: Rows, low: Rows) -> NDArray[np.bool_]:
    """(m,) `proved_between` for the levels in each row; `high` must have the path's top load."""
    c, proved = stiffnesses(high, rows.exact.coefficients), np.zeros(len(high.open), dtype=bool)
    for some, it in rows.coupled:
        for k in range(some.start, some.stop):
            proved[k] = order_holds(it.scene, it.influence, it.influence.scale * c[k])
            if not proved[k]:
                one, other = (level.at(np.array(k)) for level in (high, low))
                proved[k] = proved_between(one, other, it, c[k], box.at(np.array(k)), ~one.open)
    return proved


@np.errstate(all="ignore")
def rates_from(c: Array, entries: Array, entry_error: float) -> Array:
    """(r,) lower bounds (6) on rates, with weights from an inverse.

    c           : (s,) diagonal of C~
    entries     : (r, s) of A; columns are the s asperities, rows the same and r - s more
    entry_error : bound on the relative error of the entries
    """
    count = len(c)
    own = np.arange(count)
    matrix = entries[:count] * c[:, None]  # I + C~ A
    matrix[own, own] = 1.0
    X = np.linalg.inv(matrix)
    v = entries @ X
    v[:count] -= (v[own, own] / X[own, own])[:, None] * X
    v[own, own] = 0.0
    np.maximum(v, 0.0, out=v)
    missing = np.maximum(entries - v @ matrix, 0.0)
    missing[own, own] = 0.0
    lost = 2.02 * (entry_error + (count + 16) * ROUNDOFF)
    rounding = v @ (matrix @ c) + entries @ c
    return np.asarray(1.0 - (v + missing) @ c - lost * rounding - SAFETY)


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
