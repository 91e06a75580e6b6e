"""Newton's method for the loads under normal pressure: docs/theory/newton.md.

The unknown delta is the indentation of a touching asperity, and minus the gap of an open one. With
P_i = (max(delta_i, 0) / k_i)^(3/2) the contact law is  F = delta + A P - D = 0,  with k, A and
D = D0 + d of `NormalProblem`. For many asperities the iteration includes only those near the
contact, until the others are found to be open.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.convex import newton
from convexrough.errors import SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.normal.refine import Trial, refined, trial_of
from convexrough.solvers.pressing import Pressing, PressingState, negligible, on_constraint
from convexrough.solvers.solution import Solution
from convexrough.solvers.start import start_indentation
from convexrough.sphere import hertz

#: If at most so many asperities could touch, the iteration includes all. It affects speed only.
ALL_ITERATED = 1000

#: Largest residual of a solution, divided by |D0| + max |d_i|, unless `tolerance` is larger.
ACCURATE = 1e-12

#: Asperities are near the contact if their gap is at most this part of the largest D_i. It affects
#: speed only.
MARGIN = 0.03


@dataclass(frozen=True)
class Newton:
    """A solver with Newton's method.

    tolerance : stop at  max_i |delta_i + (A P)_i - D_i| <= tolerance (|D0| + max_i |d_i|),  with
        the symbols of docs/theory/newton.md;  0 for the accuracy of float64
    max_iterations : largest number of steps; SolverError is raised if they are not enough

    Once the left side is below 1e-12 (|D0| + max_i |d_i|), the method also stops if the residual is
    small compared with the rounding of A P, or if a step does not halve the left side.
    """

    tolerance: float = 0.0
    max_iterations: int = 100
    name: str = field(default="newton", init=False)

    def __post_init__(self) -> None:
        checks.non_negative("tolerance", self.tolerance)
        checks.whole("max_iterations", self.max_iterations)

    def solve(
        self,
        problem: NormalProblem,
        start: Array | None = None,
    ) -> Solution:
        """The solution in scaled units; `start` (n,) are initial loads >= 0, or None."""
        loads, approach, iterations, trial = self._found(problem, start)
        if trial is not None:  # the iteration has stopped early
            trial = refined(problem, trial).frozen()
            approach, residual = float(trial.approach.value), float(trial.excess.max())
            return Solution(trial.loads.high, approach, iterations, residual, True, trial)
        answer = Solution.of(problem, loads, approach, iterations)
        return replace(answer, refine=not self.tolerance > 0)

    def _found(
        self, problem: NormalProblem, start: Array | None
    ) -> tuple[Array, float, int, Trial | None]:
        """Loads, approach, number of steps, and the trial of the loads if it is to be refined."""
        indentation = _start(problem, start)
        highest = float(np.maximum(problem.approach_bound + problem.offsets, 0.0).max())
        near = np.arange(len(problem))
        if len(problem) > ALL_ITERATED and start is None:
            indentation = on_constraint(problem, indentation)
            near = np.flatnonzero(indentation > -MARGIN * highest)
        iterations = 0
        while True:
            begin = indentation[near]
            del indentation  # saves memory
            state, steps = self._iterate(problem, near, begin)
            iterations += steps
            loads = among_zeros(state.forces, near, len(problem))
            unknown, approach = state.unknown, state.approach
            del state  # saves memory
            trial = trial_of(problem, loads) if self._refines(problem) else None
            if len(near) == len(problem):
                return loads, approach, iterations, trial
            # The iteration left out some asperities: compute the gaps of all.
            gap = trial.gap.value if trial else _gaps(problem, loads, approach)
            touched = gap < 0
            touched[near] = False
            if not touched.any():
                return loads, approach, iterations, trial
            indentation = -gap
            indentation[near] = unknown
            touched[near] = True  # `near` only grows, so the loop ends
            near = np.flatnonzero(touched | (indentation > -MARGIN * highest))

    def _refines(self, problem: NormalProblem) -> bool:
        return problem.influence.cheap_sums and not self.tolerance > 0

    def _iterate(
        self,
        problem: NormalProblem,
        near: Indices,
        indentation: Array,
    ) -> tuple[PressingState, int]:
        """The solution in which only the asperities `near` carry loads, and the number of steps."""
        part = problem if len(near) == len(problem) else problem.restricted(near)
        law = Pressing(part, float(np.abs(problem.offsets).max()))

        stopping = newton.Stopping(ACCURATE, self.tolerance, self.max_iterations)
        try:
            state = law.evaluate(indentation)
            if self._refines(problem):  # refinement makes the remaining linear correction
                stopping = replace(stopping, linear=negligible(indentation))
            return newton.solve(law, state, stopping)
        except SolverError as error:
            if error.iterate is not None:
                error.iterate = among_zeros(error.iterate, near, len(problem))
            raise


def newton_step(problem: NormalProblem, loads: Array) -> Solution:
    """The result of one Newton step from the loads (n,) >= 0 of another solver, in scaled units.

    A small relative error e of the loads becomes about e^2, and open asperities get the load 0.
    """
    law = Pressing(problem, float(np.abs(problem.offsets).max()))
    before = law.evaluate(_start(problem, loads))
    state = newton.descend(law, before, law.direction(before, 0.0))
    residual = problem.residual(state.forces, state.approach, state.displacement)
    return Solution(state.forces, state.approach, 1, residual)


def _start(problem: NormalProblem, loads: Array | None) -> Array:
    """(n,) initial indentations: by Hertz's law where `loads` are positive, and -1 elsewhere.

    If `loads` is None, `start_indentation` estimates them.
    """
    if loads is None:
        return start_indentation(problem)
    return np.where(loads > 0, hertz.indentation(loads, problem.coefficients), -1.0)


def _gaps(problem: NormalProblem, loads: Array, approach: float) -> Array:
    return problem.gap(loads, problem.influence.apply(loads), approach)
