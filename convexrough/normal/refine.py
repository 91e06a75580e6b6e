"""The contact law with error bounds, and loads refined to more digits than float64 has.

Functions take one problem or a stack (`normal.stack`) of m problems, with arrays (n,) or (m, n).
The loads P are pairs; their residual  k P^(2/3) + A P - d - D0  (symbols of `normal.problem`) is a
ball. A correction is one step of docs/theory/newton.md in float64.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import (
    TINY,
    Ball,
    added,
    of_rows,
    quietly,
    replaced,
    residual,
)
from convexrough.arithmetic.pairs import PAIR_ROUNDOFF, Pair, in_parts, two_sum
from convexrough.arrays import Array, Indices, among_zeros, frozen, largest, summed
from convexrough.convex.theorem import excess
from convexrough.errors import SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.roundoff import SAFETY
from convexrough.sphere import hertz

#: Largest number of corrections. Each aims at a residual of ENOUGH times its rounding error.
CORRECTIONS, ENOUGH = 12, 0.1

#: A correction leaves about a tenth of the squared residual, in scaled units, because the contact
#: law is not linear. Where this is above the rounding error, it aims at ROUGHLY.
ROUGHLY = 1e-6

#: Loads to be refined are not scaled to the total, to save time, if their sum differs from it by
#: less than this part of the largest load.
FITS = 1e-6

#: Number of loads up to which `math.fsum`, which rounds once, is fastest.
FEW_TERMS = 128


@dataclass(frozen=True, eq=False)
class Trial:
    """Loads of the asperities that can touch, and residuals in the contact law, in scaled units."""

    problem: NormalProblem
    loads: Pair  # (n,) P
    product: Ball  # (n,) A P
    gap: Ball  # (n,) k P^(2/3) + A P - d - D0
    approach: Ball  # D0: prescribed, or a weighted mean of k P^(2/3) + A P - d where loaded
    missing: Ball  # prescribed total minus the sum of the loads; 0 if no total is prescribed

    @property
    def local(self) -> Array:
        """(n,) k P^(2/3), to float64."""
        return np.asarray(hertz.indentation(self.loads.high, self.problem.coefficients))

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """(n,) True where the load is not 0."""
        return np.asarray(self.loads.high > 0)

    @cached_property
    def excess(self) -> Array:
        """(n,) bounds on violations of the law: |gap| where loaded, max(-gap, 0) elsewhere."""
        return frozen(excess(self.gap, self.inside))

    @property
    def defect(self) -> Array:
        """(n,) the residual of the contact law: gap where loaded; elsewhere min(gap, 0)."""
        gap = self.gap.value
        return np.where(self.inside, gap, np.minimum(gap, 0.0))

    def frozen(self) -> Trial:
        """This trial, with its arrays made read-only, because proofs use them."""
        for each in (self.loads, self.product, self.gap):
            of_rows(frozen, each)
        return self

    @property
    def indentation(self) -> Ball:
        """(n,) indentations D0 + d - A P under these loads; a negative one is minus the gap."""
        return added(self.problem.exact.offsets, self.approach, -self.product)

    def among(self, problem: NormalProblem, which: Indices) -> Trial:
        """This trial as one of `problem`, in which its asperities have the indices `which`. The
        others have no loads; their displacements are computed in float64."""
        spread = partial(among_zeros, places=which, count=len(problem))
        loads = of_rows(spread, self.loads)
        product = problem.plain_product(loads)
        gap = added(product, -problem.exact.offsets, -self.approach)
        product, gap = replaced(product, which, self.product), replaced(gap, which, self.gap)
        return Trial(problem, loads, product, gap, self.approach, self.missing)

    def improved(self, other: Trial, where: NDArray[np.bool_]) -> Trial:
        """This trial of a stack, with the rows chosen by `where` replaced by those of `other`."""
        if where.all():
            return other
        names = "loads", "product", "gap", "approach", "missing"
        both = ((getattr(other, name), getattr(self, name)) for name in names)
        select = partial(np.where, where[:, None])
        return Trial(self.problem, *(of_rows(select, yes, no) for yes, no in both))


def trial(problem: NormalProblem, loads: Pair, missing: Ball, product: Ball) -> Trial:
    """The trial of these loads; `product` is A P, `missing` is the given total minus their sum."""
    data, exact = problem.exact, Ball.exact(loads)
    if problem.load is None:
        gap = residual(data.coefficients, exact, product, data.offsets, problem.control)
        return Trial(problem, loads, product, gap, problem.control, missing)
    above = residual(data.coefficients, exact, product, data.offsets, Ball.exact(0.0))
    approach = mean(np.sqrt(loads.high), above)
    return Trial(problem, loads, product, above - approach, approach, missing)


def mean(weights: Array, values: Ball) -> Ball:
    """About the weighted mean of the midpoints, as an exact number: (), or (m, 1) for a stack."""
    high, total = values.value, summed(weights)
    first = summed(weights * high) / total
    rest = summed(weights * ((high - first) + values.mid.low)) / total
    return Ball.exact(Pair(*map(np.asarray, two_sum(first, rest))))


def refined(problem: NormalProblem, best: Trial) -> Trial:
    """The trial `best`, corrected until its residual is at most rounding or no longer halves."""
    size, rounding = defect_of(best), rounding_of(best)
    todo = size > rounding
    for _ in range(CORRECTIONS):
        if not todo.any():
            break
        try:
            enough = np.where(size**2 < 10 * rounding, ENOUGH * rounding / size, ROUGHLY)
            following = corrected(problem, best, enough, todo)
        except SolverError:  # the energy may not be convex there
            break
        left = defect_of(following)
        better = todo & (left < size)
        if not better.any():
            break
        todo = better & (left < 0.5 * size)
        best, size = best.improved(following, better), np.where(better, left, size)
        rounding = rounding_of(best)
        todo &= size > rounding
    return best


def refined_loads(problem: NormalProblem, loads: Array | Pair) -> Trial:
    """The refined trial that starts from loads (n,) >= 0 of any solver, or of another trial."""
    return refined(problem, trial_of(problem, loads, roughly=True))


def is_of(state: Trial | None, problem: NormalProblem, loads: Array) -> TypeGuard[Trial]:
    """True for a trial of this problem, whose loads are `loads` (n,) to more digits."""
    return (
        state is not None and state.problem is problem and np.array_equal(state.loads.high, loads)
    )


def trial_of(problem: NormalProblem, loads: Array | Pair, *, roughly: bool = False) -> Trial:
    """The trial of loads (n,) >= 0, which `completed` changes to have the prescribed total."""
    pair = loads if isinstance(loads, Pair) else Pair.exact(loads)
    pair, missing = completed(problem, pair, roughly=roughly)
    return trial(problem, pair, missing, problem.pressed_product(pair))


@quietly
def corrected(problem: NormalProblem, state: Trial, enough: Any, todo: NDArray[np.bool_]) -> Trial:
    """The trial after one Newton step in the rows for which `todo` is True.

    enough : fraction of the residual that the step may leave: a number, or (m,) for a stack
    """
    loads, inside, defect = state.loads, state.inside, state.defect
    slopes = np.divide(1.5 * loads.high, state.local, out=np.zeros(defect.shape), where=inside)
    size = largest(np.abs(defect))
    defect /= np.where(size > 0, size, 1.0)
    step = problem.correct(slopes, defect, enough, todo)
    step *= size
    k, gap = np.broadcast_to(problem.coefficients, step.shape), state.gap.value

    def stepped(some: slice) -> Pair:
        """The loads after the step, not yet changed to have the prescribed total."""
        before = loads.at(some)
        local = hertz.indentation(before.high, k[some])
        own = np.where(inside[some], local, np.minimum(-gap[some], 0.0))
        ratio = np.divide(step[some], own, out=np.zeros(own.shape), where=inside[some])
        near = inside[some] & (ratio > -0.5)
        ends = hertz.load(own + step[some], k[some])
        x = np.where(near, ratio, 0.0)
        root = np.sqrt(1.0 + x)
        grown = before.high * (x * (1.0 + x + root + 1.0) / (1.0 + root))  # P ((1 + x)^(3/2) - 1)
        after = before + Pair.exact(np.where(near, grown, ends - before.high))
        return Pair(*(part * (near | (ends > 0)) for part in after))

    following = stepped(slice(None)) if step.ndim > 1 else in_parts(len(step), stepped)
    following, missing = completed(problem, following, roughly=True)
    product = problem.moved(state.loads, state.product, following)
    return trial(problem, following, missing, product)


def completed(problem: NormalProblem, loads: Pair, *, roughly: bool = False) -> tuple[Pair, Ball]:
    """The loads, scaled to the prescribed total, and a ball of the difference that is left after it
    is added, up to rounding, to the largest load.

    roughly : True to skip the scaling if the difference is less than FITS times the largest load
    """
    if problem.load is None:
        return loads, Ball.exact(np.zeros(problem.control.shape))
    if not loads.high.any():
        return loads, problem.control
    completed = Pair(*(part.copy() for part in loads))
    missed = np.abs(summed(loads.high) - problem.load)
    if not roughly or (missed > FITS * largest(loads.high)).any():
        power = -np.frexp(largest(loads.high))[1]  # a power of two that avoids overflow
        loads = Pair(*(np.ldexp(part, power) for part in loads))
        total = loads.total()
        if loads.high.ndim > 1:
            total = Pair(*(part[:, None] for part in total))
        completed = loads * (problem.control.mid / total)
    at: Any = completed.high.argmax(axis=-1)  # the largest load; in a stack, that of each row
    if completed.high.ndim > 1:
        at = np.arange(len(at)), at
    missing = _missing(completed, problem.control.mid)
    completed.high[at], completed.low[at] = completed.at(at) + missing
    radius = problem.control.radius + 8 * PAIR_ROUNDOFF * problem.load
    radius = np.asarray((radius + (loads.high.shape[-1] + 2) * TINY) * (1 + SAFETY))
    return completed, Ball(Pair.exact(0.0 * radius), radius)


def _missing(loads: Pair, total: Pair) -> Pair:
    """The prescribed totals minus the sums of loads: () for loads (n,), (m,) for (m, n)."""
    if loads.high.ndim == 1 and loads.high.size <= FEW_TERMS and np.isfinite(loads.high).all():
        terms = (*total, *(-loads.high).tolist(), *(-loads.low).tolist())
        return Pair(math.fsum(terms), 0.0)
    return Pair(*(np.reshape(part, loads.high.shape[:-1]) for part in total)) - loads.total()


def defect_of(state: Trial) -> Any:
    """The 2-norm of the residual of the contact law: a number, or (m,) for a stack."""
    defect = state.defect
    return np.sqrt(np.einsum("...i,...i->...", defect, defect))


def rounding_of(state: Trial) -> Any:
    """The 2-norm of the residual's rounding errors, without those of positive gaps, which do not
    change the residual: a number, or (m,) for a stack."""
    counts = state.inside | (state.gap.value <= state.gap.radius)
    errors = np.where(counts, state.gap.radius, 0.0)
    return np.sqrt(np.einsum("...i,...i->...", errors, errors))
