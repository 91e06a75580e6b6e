"""Newton's method for pressing, on the normal map.

The unknown is delta: the indentation of a touching asperity, minus the gap of an open one. With
P_i = (max(delta_i, 0) / k_i)^(3/2) the whole contact law is the square system

    F(delta) = delta + A P(delta) - D = 0,

which `convex.newton` solves: the active set is the sign of the answer (docs/theory/newton.md). In
the convex range a step descends the energy Phi(P(delta)).

Of many asperities only those near the contact take part in the iteration. What the others feel is
looked at once it has ended; where one of them would touch, it goes on with more.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from convexrough.arrays import Array, Indices, among_zeros
from convexrough.convex import newton
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.normal.load_control import shifted_to_load
from convexrough.normal.problem import NormalProblem
from convexrough.progress import Announce
from convexrough.roundoff import SAFETY
from convexrough.solvers.solution import Solution
from convexrough.solvers.start import start_indentation
from convexrough.sphere import hertz

#: Of more candidates than this, only those near the contact are iterated on. Heuristic: any number
#: leads to the same answer.
ALL_ITERATED = 1000

#: The residual, over |D0| + max |d_i|, that an answer must reach unless it is asked for less.
ACCURATE = 1e-12

#: Near the contact: with a gap of at most this part of the largest prescribed approach. Heuristic,
#: as who is left out is looked at in the end.
MARGIN = 0.1


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
        indentation = _on_constraint(problem, _start(problem, start))
        highest = float(np.maximum(problem.ceiling + problem.offsets, 0.0).max())
        near = np.arange(len(problem))
        if len(problem) > ALL_ITERATED and start is None:
            near = np.flatnonzero(indentation > -MARGIN * highest)
        iterations = 0
        while True:
            begin = indentation[near]
            del indentation  # half of the memory of a large scene is vectors
            state, steps = self._iterate(problem, near, begin, announce)
            iterations += steps
            if len(near) == len(problem):
                residual = problem.residual(state.forces, state.approach, state.displacement)
                return Solution(state.forces, state.approach, iterations, residual)
            # What do the others feel?
            loads = among_zeros(state.forces, near, len(problem))
            displacement = problem.influence.apply(loads)
            gap = displacement - problem.offsets - state.approach
            touched = gap < 0
            touched[near] = False
            if not touched.any():
                residual = problem.residual(loads, state.approach, displacement)
                return Solution(loads, state.approach, iterations, residual)
            indentation = -gap
            indentation[near] = state.unknown
            touched[near] = True  # none leaves, so that this ends
            near = np.flatnonzero(touched | (indentation > -MARGIN * highest))

    def _iterate(
        self,
        problem: NormalProblem,
        near: Indices,
        indentation: Array,
        announce: Announce | None,
    ) -> tuple[_State, int]:
        """The solution of some of the candidates: all others carry nothing."""
        part = problem if len(near) == len(problem) else problem.among(near)
        law = _Pressing(part, float(np.abs(problem.offsets).max()))

        def tell(step: int, state: _State) -> None:
            if announce is not None:
                residual, touching = state.residual / state.scale, np.count_nonzero(state.forces)
                announce(f"step {step}, residual {residual:.1e}, {touching:,} touching")

        stopping = newton.Stopping(ACCURATE, self.tolerance, self.max_iterations)
        try:
            return newton.solve(law, law.evaluate(indentation), stopping, tell=tell)
        except SolverError as error:
            if error.iterate is not None:
                error.iterate = among_zeros(error.iterate, near, len(problem))
            raise


def newton_step(problem: NormalProblem, loads: Array) -> Solution:
    """One step from loads that another solver found (own units, not negative).

    From an error e it leaves about e^2, and it tells open asperities from lightly loaded ones.
    """
    law = _Pressing(problem, float(np.abs(problem.offsets).max()))
    before = law.evaluate(_start(problem, loads))
    state = newton.descend(law, before, law.direction(before, 0.0))
    residual = problem.residual(state.forces, state.approach, state.displacement)
    return Solution(state.forces, state.approach, 1, residual)


class _State(NamedTuple):
    unknown: Array  # delta
    forces: Array  # P(delta)
    displacement: Array  # A P
    gap: Array  # k P^(2/3) + A P - D, the gradient of Phi
    defect: Array  # F
    approach: float  # D0, under load control its latest estimate
    energy: float
    residual: float  # max |F|
    scale: float  # |D0| + max |d_i|


@dataclass(frozen=True)
class _Pressing:
    """The law of contact, for `convex.newton`.

    farthest : max |d_i| over all candidates, of which these may be some
    """

    problem: NormalProblem
    farthest: float

    solver: ClassVar[str] = "newton"
    unit: ClassVar[str] = "the approach"

    def evaluate(self, unknown: Array) -> _State:
        problem = self.problem
        indentation = np.maximum(_on_constraint(problem, unknown), 0.0)
        ratio = indentation / problem.coefficients
        root = np.sqrt(ratio)
        loads = ratio * root
        displacement = problem.influence.apply(loads)
        gap = indentation + displacement - problem.offsets  # less D0; as Phi has it under a load
        approach = problem.approach
        if approach is None:
            approach = float(root @ gap / root.sum())
            energy = float(loads @ (gap - 0.4 * indentation - 0.5 * displacement))
            gap -= approach
        else:
            gap -= approach
            energy = float(loads @ (gap - 0.4 * indentation - 0.5 * displacement))
        # What delta is at an open asperity does not matter: its gap, or 0 where that is negative.
        touching = loads > 0
        unknown = np.where(touching, indentation, np.minimum(-gap, 0.0))
        defect = np.where(touching, gap, np.minimum(gap, 0.0))
        residual, scale = float(np.abs(defect).max()), abs(approach) + self.farthest
        return _State(unknown, loads, displacement, gap, defect, approach, energy, residual, scale)

    def direction(self, state: _State, left: float) -> Array:
        loaded = state.forces > 0
        slopes = np.divide(1.5 * state.forces, state.unknown, out=state.forces * 0.0, where=loaded)
        return correct(
            self.problem.influence,
            self.problem.shells,
            np.sqrt(slopes),  # W
            state.defect,
            balanced=self.problem.load is not None,
            tolerance=left,
        )

    def gradient(self, state: _State) -> Array:
        """The gap."""
        return state.gap

    def energy_rounding(self, state: _State) -> float:
        return SAFETY * float(state.forces.sum()) * state.scale

    def noise(self, state: _State) -> float:
        return self.problem.influence.rounding(state.forces).negligible(state.displacement)

    def advice(self, state: _State) -> str:
        """By how crowded the contact is where it stopped."""
        number = self.problem.convexity_number(state.forces)
        if number < 1:
            return (
                f"the energy is convex there (convexity number {number:.3g}): allow more steps, or "
                "start from loads of a neighbouring problem"
            )
        return (
            f"contacts are so crowded there that the energy need not be convex (convexity number "
            f"{number:.3g}, convex below 1): use a smaller approach or load, sharper tips, or "
            "asperities further apart"
        )


def _start(problem: NormalProblem, loads: Array | None) -> Array:
    """An indentation to start from: of the given loads, or the best guess there is."""
    if loads is None:
        return start_indentation(problem)
    return np.where(loads > 0, hertz.indentation(loads, problem.coefficients), -1.0)


def _on_constraint(problem: NormalProblem, indentation: Array) -> Array:
    """Cut to the a priori box (approach control), or shifted to the prescribed total load."""
    if problem.load is not None:
        return shifted_to_load(indentation, problem.coefficients, problem.load)
    return np.minimum(indentation, problem.ceiling + problem.offsets)
