"""The contact law on balls, and Newton's corrections that bring any loads to thirty digits.

With loads P known as pairs, the residual  k P^(2/3) + A P - d - D0  is a ball: its radius counts
all that the data, the product and the arithmetic lose. A correction is one Newton step on the
normal map (docs/theory/newton.md) in float64 from a residual in pairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.convex.newton_step import correct
from convexrough.convex.theorem import excess
from convexrough.errors import SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.numbers.balls import TINY, Ball
from convexrough.numbers.kernels import residual
from convexrough.numbers.pairs import PAIR_ROUNDOFF, Pair, two_sum
from convexrough.sphere import hertz

#: Corrections at most: each squares the error, or takes what conjugate gradients leave of it.
CORRECTIONS = 12

#: Up to so many candidates coupled by a matrix, refinement costs no more than the press.
FEW = 700

#: Loads whose sum is wrong by less than this are not scaled: only the largest changes. Heuristic.
FITS = 1e-6

#: A correction by conjugate gradients reduces the residual by this; a factor leaves rounding.
REDUCTION = 1e-7


@dataclass(frozen=True, eq=False)
class Trial:
    """Loads of the candidates, and how well they fit the contact law. In own units.

    loads   : (n,) P;  product : (n,) A P
    local   : (n,) k P^(2/3), to float64
    gap     : (n,) k P^(2/3) + A P - d - D0
    approach : D0, prescribed, or under a prescribed load the one that fits best
    missing : what the loads miss the prescribed total by; 0 where none is prescribed
    """

    problem: NormalProblem
    loads: Pair
    product: Ball
    local: Array
    gap: Ball
    approach: Ball
    missing: Ball

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """(n,) where a load is not 0."""
        return np.asarray(self.loads.high > 0)

    @cached_property
    def excess(self) -> Array:
        """(n,) how far the contact law is from holding."""
        return excess(self.gap, self.inside)

    def frozen(self) -> Trial:
        """The same with read-only arrays, because proofs rest on it."""
        for ball in (self.product, self.gap):
            for part in (*ball.mid, ball.radius):
                part.flags.writeable = False
        for part in (*self.loads, self.local):
            part.flags.writeable = False
        return self

    @property
    def indentation(self) -> Ball:
        """(n,) D0 + d - A P: indentations of these loads, minus gaps where negative."""
        problem = self.problem
        depths = problem.exact.offsets + self.approach if problem.load else problem.exact_depths
        return depths - self.product


def trial(problem: NormalProblem, loads: Pair, missing: Ball, product: Ball) -> Trial:
    """The contact law evaluated at loads of which A P, and what they miss a total by, is known."""
    data, exact = problem.exact, Ball.exact(loads)
    local = hertz.indentation(loads.high, problem.coefficients)
    if problem.load is None:
        gap = residual(data.coefficients, exact, product, problem.exact_depths)
        return Trial(problem, loads, product, local, gap, problem.depth, missing)
    above = residual(data.coefficients, exact, product, data.offsets)  # D0 where touching
    weights = np.cbrt(loads.high)
    total = weights.sum()
    shift = float(weights @ above.value / total)
    rest = float(weights @ ((above.value - shift) + above.mid.low) / total)
    approach = Ball.exact(Pair(*(np.asarray(part) for part in two_sum(shift, rest))))
    return Trial(problem, loads, product, local, above - approach, approach, missing)


def refines(problem: NormalProblem) -> bool:
    """Whether thirty digits cost no more than a press does."""
    return not problem.influence.stored or len(problem) <= FEW


def refined(problem: NormalProblem, start: Trial) -> Trial:
    """The trial whose residual further corrections do not halve."""
    best, size = start, _size(start)
    for _ in range(CORRECTIONS):
        if size <= float(np.linalg.norm(best.gap.radius)):
            break
        try:
            following = corrected(problem, best)
        except SolverError:  # the energy is not known to be convex there
            break
        left = _size(following)
        if left < size:
            best = following
        if not left < 0.5 * size:
            break
        size = left
    return best


def refined_loads(problem: NormalProblem, loads: Array) -> Trial:
    """`refined` from loads (n,) of any solver, not negative."""
    pair, missing = completed(problem, Pair.exact(loads))
    return refined(problem, trial(problem, pair, missing, problem.product(pair)))


def corrected(problem: NormalProblem, state: Trial) -> Trial:
    """One Newton step on the normal map."""
    loads, inside = state.loads, state.inside
    gap = state.gap.value
    local, change = state.local, np.zeros(len(gap))
    slopes = np.divide(1.5 * loads.high, local, out=np.zeros(len(gap)), where=inside)
    defect = np.where(inside, gap, np.minimum(gap, 0.0))
    size = float(np.abs(defect).max())
    step = size * correct(
        problem.influence,
        problem.shells,
        np.sqrt(slopes),
        defect / size,
        balanced=problem.load is not None,
        tolerance=REDUCTION,
    )
    # P ((1 + step / n)^(3/2) - 1) of those that touch, and all of those that begin to
    ratio = np.divide(step, local, out=np.zeros(len(gap)), where=inside)
    change[inside] = loads.high[inside] * np.expm1(1.5 * np.log1p(np.maximum(ratio[inside], -0.5)))
    left = inside & (ratio <= -0.5)
    new = np.where(inside, 0.0, np.minimum(-gap, 0.0)) + np.where(left, local, 0.0) + step
    entering = (left | ~inside) & (new > 0)
    change[left] = -loads.high[left]
    share = new[entering] / problem.coefficients[entering]
    change[entering] += share * np.sqrt(share)
    following = loads + Pair.exact(change)
    gone = left & ~entering
    if gone.any():
        following = Pair(np.where(gone, 0.0, following.high), np.where(gone, 0.0, following.low))
    following, missing = completed(problem, following)
    product = problem.moved(state.loads, state.product, following)
    return trial(problem, following, missing, product)


def completed(problem: NormalProblem, loads: Pair) -> tuple[Pair, Ball]:
    """Loads in proportion to these that add up to the prescribed total, and what they still miss.

    The largest makes up for what the others leave, to its rounding.
    """
    if problem.load is None:
        return loads, Ball.exact(0.0)
    if not loads.high.any():
        return loads, problem.total
    total = problem.total.mid
    if abs(float(loads.high.sum()) - problem.load) > FITS * problem.load:
        power = -np.frexp(loads.high.max())[1]  # of two: no factor overflows
        loads = Pair(np.ldexp(loads.high, power), np.ldexp(loads.low, power))
        loads = loads * (total / loads.total())
    j = int(np.argmax(loads.high))
    with_total = Pair(*(np.append(-x, y) for x, y in zip(loads, total, strict=True)))
    missing = with_total.total()
    high, low = loads.high.copy(), loads.low.copy()
    high[j], low[j] = loads.at(j) + missing
    rounding = 8 * PAIR_ROUNDOFF * problem.load + (len(high) + 2) * TINY
    return Pair(high, low), Ball.around(0.0, problem.total.radius + rounding)


def _size(state: Trial) -> float:
    defect = np.where(state.inside, state.gap.value, np.minimum(state.gap.value, 0.0))
    return float(np.linalg.norm(defect))
