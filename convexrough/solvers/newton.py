"""Newton's method on the normal map, safeguarded by the energy.

The unknown is delta: the indentation of a touching asperity, minus the gap of an open one. With
P_i = (max(delta_i, 0) / k_i)^(3/2) the whole contact law is the square system

    F(delta) = delta + A P(delta) - D = 0,

once differentiable, and no active set is guessed: it is the sign of the answer. A step is that of
`convexrough.convex.newton_step`; in the convex range it descends the energy Phi(P(delta)).

Of many asperities only those near the contact take part in the iteration. What the others feel is
looked at once it has ended; where one of them would touch, it goes on with more.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.normal.load_control import shifted_to_load
from convexrough.normal.problem import NormalProblem
from convexrough.progress import Announce
from convexrough.roundoff import SAFETY
from convexrough.solvers.mean_field import mean_field_indentation
from convexrough.solvers.solution import Solution
from convexrough.sphere import hertz

#: Of more candidates than this, only those near the contact are iterated on.
FEW = 1000

#: The residual, over |D0| + max |d_i|, that an answer must reach unless it is asked for less.
ACCURATE = 1e-12

#: Near the contact: with a gap of at most this part of the largest prescribed approach.
MARGIN = 0.1

#: Most of the residual that the linear solver may leave in a step.
MOST_LEFT = 0.1


class _State(NamedTuple):
    indentation: Array  # delta
    loads: Array  # P(delta)
    displacement: Array  # A P
    defect: Array  # F
    approach: float  # D0, under load control its latest estimate
    energy: float
    residual: float  # max |F|


@dataclass(frozen=True)
class Newton:
    """Settings of Newton's method on the normal map.

    tolerance : it stops where  max_i |delta_i + (A P)_i - D_i| <= tolerance (|D0| + max_i |d_i|);
        0 asks for all that float64 can do

    In any case it stops where that residual is small beside what rounding can make of A P, which
    the certificate has to allow for anyway, or where it is below 1e-12 and a further step does not
    halve it. Raises SolverError if `max_iterations` steps do not get there.
    """

    tolerance: float = 0.0
    max_iterations: int = 100
    name: str = field(default="newton", init=False)

    def solve(
        self,
        problem: NormalProblem,
        start: Array | None = None,
        announce: Announce | None = None,
    ) -> Solution:
        """Loads of the candidates, from any start that is not negative (own units)."""
        indentation = _start(problem, start)
        highest = float(np.maximum(problem.ceiling + problem.offsets, 0.0).max())
        near = np.arange(len(problem))
        if len(problem) > FEW and start is None:
            near = np.flatnonzero(indentation > -MARGIN * highest)
        iterations = 0
        while True:
            part = problem if len(near) == len(problem) else problem.among(near)
            state, steps = self._iterate(problem, part, indentation[near], announce)
            iterations += steps
            # What do the others feel?
            loads = np.zeros(len(problem))
            loads[near] = state.loads
            displacement = problem.influence.apply(loads)
            gap = displacement - problem.offsets - state.approach
            touched = gap < 0
            touched[near] = False
            if not touched.any():
                residual = problem.residual(loads, state.approach, displacement)
                return Solution(loads, state.approach, iterations, residual)
            indentation = -gap
            indentation[near] = state.indentation
            touched[near] = True  # none leaves, so that this ends
            near = np.flatnonzero(touched | (indentation > -MARGIN * highest))

    def _iterate(
        self,
        whole: NormalProblem,
        problem: NormalProblem,
        indentation: Array,
        announce: Announce | None,
    ) -> tuple[_State, int]:
        """Steps on (part of) a problem until the solution is as good as it gets."""
        state = _evaluate(problem, _on_constraint(problem, indentation))
        farthest = float(np.abs(whole.offsets).max())
        before = np.inf
        for iteration in range(1, self.max_iterations + 1):
            scale = abs(state.approach) + farthest
            if announce is not None:
                touching = int(np.count_nonzero(state.loads))
                announce(
                    f"step {iteration}, residual {state.residual / scale:.1e}, "
                    f"{touching:,} touching"
                )
            accurate = state.residual <= ACCURATE * scale
            size = float(np.linalg.norm(state.defect))
            target = problem.influence.rounding(state.loads).negligible(state.displacement)
            if state.residual <= self.tolerance * scale or (accurate and size <= target):
                return state, iteration - 1
            forcing = min(MOST_LEFT, (size / before) ** 2) if before < np.inf else MOST_LEFT
            enough = max(target / size, self.tolerance * scale / state.residual)
            following = _step(problem, state, max(forcing, 0.3 * enough))
            if accurate and following.residual >= 0.5 * state.residual:
                return min(state, following, key=lambda s: s.residual), iteration
            state, before = following, size
        raise SolverError(
            f"residual {state.residual:.3g} in units of the approach after "
            f"{self.max_iterations} steps, {max(self.tolerance, ACCURATE) * scale:.3g} needed",
            solver="newton",
        )


def newton_step(problem: NormalProblem, loads: Array) -> Solution:
    """One step from loads that another solver found (own units, not negative).

    From an error e it leaves about e^2, and it tells open asperities from lightly loaded ones.
    """
    state = _step(problem, _evaluate(problem, _start(problem, loads)), 0.0)
    residual = problem.residual(state.loads, state.approach, state.displacement)
    return Solution(state.loads, state.approach, 1, residual)


def _start(problem: NormalProblem, loads: Array | None) -> Array:
    """An indentation to start from: of the given loads, or of heights riding on a smooth sphere."""
    if loads is None:
        few = len(problem) <= FEW
        indentation = problem.smooth_indentation() if few else mean_field_indentation(problem)
    else:
        indentation = np.where(loads > 0, hertz.indentation(loads, problem.coefficients), -1.0)
    return _on_constraint(problem, indentation)


def _on_constraint(problem: NormalProblem, indentation: Array) -> Array:
    """Cut to the a priori box (approach control), or shifted to the prescribed total load."""
    if problem.load is not None:
        return shifted_to_load(indentation, problem.coefficients, problem.load)
    return np.minimum(indentation, problem.ceiling + problem.offsets)


def _evaluate(problem: NormalProblem, indentation: Array) -> _State:
    loads = hertz.load(indentation, problem.coefficients)
    displacement = problem.influence.apply(loads)
    level = indentation + displacement - problem.offsets  # D0 at every touching asperity
    if problem.approach is not None:
        approach = problem.approach
    else:
        weights = np.cbrt(loads)
        approach = float(weights @ level / weights.sum())
    # What delta is at an open asperity does not matter: take its gap, or 0 where that is negative.
    gap = displacement - problem.offsets - approach
    indentation = np.where(loads > 0, indentation, np.minimum(-gap, 0.0))
    defect = indentation + gap
    energy = problem.energy(loads, displacement)
    residual = float(np.abs(defect).max())
    return _State(indentation, loads, displacement, defect, approach, energy, residual)


def _step(problem: NormalProblem, state: _State, forcing: float) -> _State:
    """One Newton step, halved until the energy falls (Armijo's rule along the arc P(delta))."""
    root = np.sqrt(1.0 / problem.stiffness(state.loads))  # W
    correction = correct(
        problem.influence,
        problem.shells,
        root,
        state.defect,
        balanced=problem.load is not None,
        tolerance=forcing,
    )
    gap = problem.gap(state.loads, state.displacement, state.approach)
    rounding = SAFETY * float(state.loads @ (np.abs(problem.offsets) + abs(state.approach)))
    length = 1.0
    while length > 1e-12:
        moved = state.indentation + length * correction
        trial = _evaluate(problem, _on_constraint(problem, moved))
        slope = float(gap @ (trial.loads - state.loads))
        if trial.energy - state.energy <= 1e-4 * min(slope, 0.0) + rounding:
            return trial
        length /= 2.0
    raise SolverError("no step along its direction lowers the energy", solver="newton")
