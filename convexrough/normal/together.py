"""Many normal problems, one in each row of an array, solved and proved together.

Only the cheapest proof is tried. The caller solves the rows without a proof one by one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, Indices, summed
from convexrough.normal.boxes import Box
from convexrough.normal.load_control import approach_bound, shifted_to_load
from convexrough.normal.problem import NormalProblem
from convexrough.normal.proved import Proved, solution_in
from convexrough.normal.refine import Trial, defect_of, refined_loads, rounding_of
from convexrough.normal.stack import Stack
from convexrough.roundoff import ROUNDOFF, SAFETY

#: Largest number of Newton steps.
STEPS = 30

#: Estimated squared radius of a rough contact, divided by that of the smooth one. A heuristic.
WIDER = 1.1

#: Newton's method ends if the expected residual is below this fraction of the norm of the
#: indentations. A heuristic.
NEGLIGIBLE = 88 * ROUNDOFF

#: Largest size of an array (rows, asperities), because dozens of them are in use at once.
NUMBERS = 2**17

quietly = np.errstate(all="ignore")


class Rows(NamedTuple):
    """The fields of `level.Level` for k levels of one scene: (k,) or (k, n), in scaled units."""

    load: Ball
    approach: Ball
    loads: Ball
    indentation: Ball
    touching: NDArray[np.bool_]
    open: NDArray[np.bool_]

    def at(self, which: Indices) -> Rows:
        """The levels with these indices."""
        return Rows._make(each[which] for each in self)


@dataclass(frozen=True, eq=False)
class Solved:
    """The fields of `proved.Proved` for m problems, one per row.

    good : (m,) True for rows that are proved; the others have no meaning
    """

    trial: Trial
    box: Box
    good: NDArray[np.bool_]
    distance: Array
    compliance: Array
    loads: Ball
    indentation: Ball
    approach: Ball

    @cached_property
    def rows(self) -> Rows:
        """The solutions of all rows, with the proved statuses."""
        touching = self.indentation.positive | self.loads.positive
        known = self.approach[:, 0], self.loads, self.indentation
        return Rows(self.total, *known, touching, self.indentation.negative)

    @cached_property
    def total(self) -> Ball:
        """(m,) the total load of each row."""
        trial = Ball.exact(self.trial.loads).sum()
        with np.errstate(invalid="ignore"):  # nan only in rows that are not good
            spread = self.distance * np.sqrt(summed(1.0 / self.compliance)) * (1 + SAFETY)
        return Ball.around(trial.mid, trial.radius + (spread + self.trial.missing.size)[:, 0])

    def row(self, k: int, problem: NormalProblem) -> Proved:
        """The solution in row k, for the problem of this row, in the box that all rows share."""
        it, of = self.trial, problem
        own = it.loads.at(k), it.product[k], it.local[k], it.gap[k]
        return Proved(
            problem,
            Trial(of, *own, it.approach[k, 0], it.missing[k, 0]),
            self.box,
            float(self.distance[k, 0]),
            self.compliance[k],
            self.loads[k],
            self.indentation[k],
            self.approach[k, 0],
        )


class _Pressed(NamedTuple):
    """A point of Newton's method, with the same quantities as in `solvers.pressing`."""

    own: Array  # (m, n) k P^(2/3)
    loads: Array  # (m, n) P
    gap: Array  # (m, n) k P^(2/3) + A P - D

    @property
    def defect(self) -> Array:
        return np.where(self.loads > 0, self.gap, np.minimum(self.gap, 0.0))

    @property
    def unknown(self) -> Array:
        return np.where(self.loads > 0, self.own, np.minimum(-self.gap, 0.0))

    @property
    def slopes(self) -> Array:
        return np.where(self.loads > 0, 1.5 * self.loads / np.where(self.own > 0, self.own, 1), 0)


@quietly
def pressed(stack: Stack, guess: Array) -> Array:
    """(m, n) loads by full steps of Newton's method; nan in rows that do not converge.

    guess : (m, n) indentations, at least one positive in each row
    """
    state, before = _pressed(stack, guess), np.full(len(stack), np.inf)
    for _ in range(STEPS):
        size = np.linalg.norm(state.defect, axis=1)
        expected = np.where(np.isinf(before), size, (size / before) ** 2 * size)
        todo = expected > NEGLIGIBLE * np.linalg.norm(state.own, axis=1)
        if not todo.any():
            break
        step = stack.correct(state.slopes, state.defect, 0.0, todo)
        state, before = _pressed(stack, state.unknown + step), size
    return np.where(np.isfinite(size)[:, None], state.loads, np.nan)


def _pressed(stack: Stack, indentation: Array) -> _Pressed:
    own = np.maximum(indentation, 0.0)
    root = np.sqrt(own / stack.coefficients)
    loads = own / stack.coefficients * root
    if stack.load is not None:
        share = stack.total.value / loads.sum(axis=1, keepdims=True)
        loads, own = loads * share, own * np.cbrt(share) ** 2
    gap = own + stack.apply(loads) - stack.exact.offsets.value
    if stack.exact_approach is not None:
        return _Pressed(own, loads, gap - stack.depth.value)
    mean = (root * gap).sum(axis=1, keepdims=True) / root.sum(axis=1, keepdims=True)
    return _Pressed(own, loads, gap - mean)


@quietly
def solved(
    stack: Stack, prescribed: Array, squares: Array, reach: Array, box: Box | None = None
) -> Solved:
    """The solutions of all rows; a `good` one is accurate, with every asperity's status proved.

    prescribed, squares, reach : arguments of `guessed`;  box : default `widest`
    """
    loads = pressed(stack, guessed(stack, prescribed, squares, reach))
    finite = np.where(np.isfinite(loads).all(axis=1, keepdims=True), loads, 0.0)
    state = refined_loads(stack, finite)
    box = widest(stack, state) if box is None else box
    known = solution_in(stack, box, state)
    good = known.inside & np.ravel(box.convexity_number < 1)
    found = Solved(state, box, good, *known[2:])
    decided = known.loads.positive | known.indentation.positive | known.indentation.negative
    good &= np.isfinite(known.loads.radius).all(axis=1) & decided.all(axis=1)
    good &= (known.indentation.negative | ~box.fixed_open).all(axis=1)
    good &= defect_of(state) <= 4.0 * rounding_of(state)
    return found


@quietly
def guessed(stack: Stack, prescribed: Array, squares: Array, reach: Array) -> Array:
    """(m, n) initial indentations, from loads distributed as Hertz's pressure.

    prescribed : (m, n) or (n,) d at a prescribed load, D at a prescribed approach
    squares : (m, n) or (n,) squared distances from the axis;  reach : (m, 1) squared contact radius
        of the smooth body, or infinite
    """
    s = np.sqrt(np.maximum(1.0 - squares / (WIDER * reach), 0.0)) + 0.0 * prescribed
    alone = s.sum(axis=1) == 0
    s[alone, np.argmax(prescribed + 0.0 * s, axis=1)[alone]] = 1.0
    displacement = stack.apply(s)
    total = s.sum(axis=1, keepdims=True)
    if stack.load is not None:
        ridden = prescribed - stack.total.value / total * displacement
        return shifted_to_load(ridden, stack.coefficients, stack.total.value)
    work = (s * prescribed).sum(axis=1, keepdims=True)
    local = (s * stack.coefficients * np.cbrt(s) ** 2).sum(axis=1, keepdims=True)
    coupled = (s * displacement).sum(axis=1, keepdims=True)
    x = np.sqrt(work / local)
    for _ in range(8):  # Newton's method from the right of the root
        x = x - (x * x * (local + coupled * x) - work) / (x * (2.0 * local + 3.0 * coupled * x))
    return np.asarray(prescribed - x**3 * displacement)


@quietly
def widest(stack: Stack, state: Trial) -> Box:
    """Boxes that contain every solution and these loads; the shells give their convexity."""
    if stack.load is None:
        highest = stack.depth.upper
    else:
        given = stack.coefficients, stack.exact.offsets.lower, stack.total.upper
        highest = approach_bound(state.loads.high, state.product.upper, *given)
    depth = np.maximum(highest + stack.exact.offsets.upper, 0.0)
    alone = (depth / stack.exact.coefficients.lower) ** 1.5 * (1 + SAFETY)
    corner = np.maximum(alone, state.loads.high)
    h = stack.compliance(corner)
    nowhere, none = np.full(h.shape, np.inf), np.zeros(h.shape, dtype=bool)
    return Box("global", stack, corner, h, stack.convexity_at(h), nowhere, none)
