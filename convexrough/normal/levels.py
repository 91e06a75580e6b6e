"""The normal solutions of one scene at many total loads, solved one by one or together.

Many problems are solved together as the rows of a stack. Then only the cheapest proof is tried; the
caller solves the rows for which it fails one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array
from convexrough.errors import ProofError, SolverError
from convexrough.normal.boxes import Box, widest
from convexrough.normal.law import Pressed, on_hertz_pressure
from convexrough.normal.level import Level
from convexrough.normal.problem import NormalProblem
from convexrough.normal.proved import proved, solution_in
from convexrough.normal.refine import Trial, defect_of, is_of, refined_loads, rounding_of
from convexrough.normal.stack import Stack
from convexrough.progress import LOGGER
from convexrough.roundoff import ROUNDOFF

#: Largest number of asperities for which problems are solved together: for more asperities this
#: saves no time.
MOST = 512

#: Largest number of Newton steps.
STEPS = 30

#: Newton's method ends if the residual is below this fraction of the norm of the indentations. Then
#: one step of refinement leaves little more than rounding errors. A heuristic.
NEGLIGIBLE = 88 * ROUNDOFF

#: Largest number of entries of an array (rows, asperities). Dozens of such arrays are in use at
#: once, so this limits the memory.
NUMBERS = 2**17

#: A function of a sharp problem and initial loads (or None) that returns loads, all in scaled
#: units, and these loads to more digits, or None.
Press = Callable[[NormalProblem, Array | None], tuple[Array, Trial | None]]


class Levels:
    """The normal solutions of one scene up to the load of a pressed contact, the level `top`.

    press    : the function that computes the loads of other levels
    together : True if Newton's method may solve several levels at once, as rows of a stack
    """

    def __init__(self, top: Level, press: Press, *, together: bool = False) -> None:
        self.top, self.problem, self._press, self._together = top, top.problem, press, together
        self._known: dict[tuple[float, float, float], Level] = {}

    @cached_property
    def loads(self) -> Array:
        """(N,) [force] the loads of the solution at `top`, 0 where open. Errors of the loads that a
        solver found, such as small loads on open asperities, do not enter."""
        return self.problem.to_scene(self.top.loads.value * self.problem.units.force)

    @property
    def presses(self) -> int:
        """The number of levels that `at` and `prepare` have computed."""
        return len(self._known)

    def at(self, load: Ball) -> Level:
        """The level at a total load, positive or exactly 0. Raises ProofError for other loads."""
        if (key := _key(load)) not in self._known:
            LOGGER.info(f"normal problem {self.presses + 1:,}")
            if load.positive:
                self._known[key] = self._solved(self.problem.at_load(load))
            elif load.size == 0.0:
                self._known[key] = Level.unloaded(self.problem)
            else:
                raise ProofError(f"the load of a level may be 0 or less: {float(load.value):.3g}")
        return self._known[key]

    def prepare(self, loads: Ball) -> list[Level | None]:
        """The levels at k positive loads, solved together; None where only `at` may find one."""
        problem = self.problem
        able = self._together and problem.influence.stored and len(problem) <= MOST
        if not able or self.top.box is None:
            return [None] * len(loads)
        levels, closed = list[Level | None](), self.top.box.closed(problem)
        for some in threads.chunks(len(loads), max(1, NUMBERS // len(problem))):
            totals = loads[some]
            LOGGER.info(f"normal problems {some.start + 1:,} to {some.stop:,} of {len(loads):,}")
            rows = [(slice(0, len(totals)), problem)]
            stack = Stack.of(rows, problem.exact, totals[:, None], by_load=True)
            level, good = solved(stack, closed)
            for k in range(len(totals)):
                levels.append(level.row(k, problem.at_load(totals[k])) if good[k] else None)
        self._known |= {_key(level.load): level for level in levels if level is not None}
        return levels

    def at_approach(self, approach: Ball) -> Level:
        """The level at an approach above first touch, in scaled units. It is not cached."""
        return self._solved(self.problem.at_approach(approach))

    def _solved(self, problem: NormalProblem) -> Level:
        """The level of `problem`, proved in the box of `top` (`Box.closed`).

        If this box is local and the matrix is stored, the problem is solved from the loads of
        `top`; else without initial loads and, if this proves nothing, from those of `top`.
        """
        box, trial = self.top.box, self.top.trial
        from_top = None if box is None or trial is None else trial.loads.high

        def sought(start: Array | None) -> Level:
            with problem.one_thread():
                loads, trial = self._press(problem, start)
                state = trial if is_of(trial, problem, loads) else refined_loads(problem, loads)
                return proved(problem, state, box and box.closed(problem))

        if box is not None and box.scope == "local" and problem.influence.stored:
            return sought(from_top)
        found = sought(None)
        if found.obstacle and from_top is not None:
            with suppress(SolverError):
                found = sought(from_top)
        return found


def _key(load: Ball) -> tuple[float, float, float]:
    return float(load.mid.high), float(load.mid.low), float(load.radius)


@np.errstate(all="ignore")
def solved(stack: Stack, box: Box | None = None) -> tuple[Level, NDArray[np.bool_]]:
    """The solutions of all rows, and (m,) True where a row is proved in `box` (default: the
    `widest`), with the status of every asperity, and its residual is near its rounding error."""
    loads = pressed(stack)
    finite = np.where(np.isfinite(loads).all(axis=1, keepdims=True), loads, 0.0)
    state = refined_loads(stack, finite)
    if box is None:
        loads = state.loads.high
        box = widest(stack, loads, stack.overhang(loads, state.product))
    inside, _, level = solution_in(stack, box, state)
    good = inside & np.ravel(box.convexity_number < 1)
    good &= np.isfinite(level.loads.radius).all(axis=1) & (level.touching | level.open).all(axis=1)
    good &= (level.open | ~box.fixed_open).all(axis=1)
    good &= defect_of(state) <= 4.0 * rounding_of(state)
    return level, good


def pressed(stack: Stack) -> Array:
    """(m, n) loads by full steps of Newton's method; nan in rows that do not converge."""
    state = Pressed.at(stack, on_hertz_pressure(stack))
    for _ in range(STEPS):
        size = np.linalg.norm(state.defect, axis=1)
        todo = size > NEGLIGIBLE * np.linalg.norm(state.own, axis=1)
        if not todo.any():
            break
        step = stack.correct(state.slopes, state.defect, 0.0, todo)
        state = Pressed.at(stack, state.unknown + step)
    return np.where(np.isfinite(size)[:, None], state.loads, np.nan)
