"""The contact law in the form of `convex.newton`: docs/theory/newton.md, "The normal map"."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.convex.newton_step import correct
from convexrough.normal.load_control import shifted_to_load
from convexrough.normal.problem import NormalProblem
from convexrough.roundoff import ROUNDOFF, SAFETY

#: Newton's method may end if the next step is expected to leave a defect whose norm is this
#: fraction of that of the indentations. Refinement then makes the next correction. A heuristic.
NEGLIGIBLE = 88 * ROUNDOFF


class PressingState(NamedTuple):
    unknown: Array  # delta, the indentation; minus the gap, or 0, where open
    forces: Array  # the loads P(delta) by Hertz's law
    displacement: Array  # A P
    gap: Array  # k P^(2/3) + A P - D, the gradient of the energy Phi
    defect: Array  # F = delta + A P - D
    approach: float  # D0; under load control the latest estimate
    energy: float  # Phi(P)
    residual: float  # max |F|
    scale: float  # |D0| + max |d_i|


@dataclass(frozen=True)
class Pressing:
    """The contact law, in the form of `convex.newton`.

    farthest : max |d_i| over all candidates, also those that `problem` leaves out
    """

    problem: NormalProblem
    farthest: float

    solver: ClassVar[str] = "newton"
    unit: ClassVar[str] = "the approach"

    def evaluate(self, unknown: Array) -> PressingState:
        problem = self.problem
        indentation = np.maximum(on_constraint(problem, unknown), 0.0)
        ratio = indentation / problem.coefficients
        root = np.sqrt(ratio)
        loads = ratio * root
        displacement = problem.influence.apply(loads)
        gap = indentation + displacement - problem.offsets  # D0 is subtracted below
        approach = problem.approach
        if approach is None:
            approach = float(root @ gap / root.sum())
        gap -= approach
        return self._pressed(indentation, loads, displacement, gap, approach)

    def _pressed(
        self,
        indentation: Array,
        loads: Array,
        displacement: Array,
        gap: Array,
        approach: float,
    ) -> PressingState:
        energy = float(loads @ (gap - 0.4 * indentation - 0.5 * displacement))
        if self.problem.load is not None:  # Phi has D0 = 0 under load control
            energy += approach * float(loads.sum())
        # At an open asperity any delta <= 0 gives the same loads: take minus the gap, or 0.
        touching = loads > 0
        unknown = np.where(touching, indentation, np.minimum(-gap, 0.0))
        defect = np.where(touching, gap, np.minimum(gap, 0.0))
        return PressingState(
            unknown,
            loads,
            displacement,
            gap,
            defect,
            approach,
            energy,
            residual=float(np.abs(defect).max()),
            scale=abs(approach) + self.farthest,
        )

    def direction(self, state: PressingState, left: float) -> Array:
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

    def gradient(self, state: PressingState) -> Array:
        """The gradient of the energy: the gap."""
        return state.gap

    def energy_rounding(self, state: PressingState) -> float:
        return SAFETY * float(state.forces.sum()) * state.scale

    def noise(self, state: PressingState) -> float:
        return self.problem.influence.rounding(state.forces).negligible(state.displacement)

    def advice(self, state: PressingState) -> str:
        """What to try, which depends on the convexity number where the method stopped."""
        number = self.problem.convexity_number(state.forces)
        if number < 1:
            return (
                f"the energy is convex (convexity number {number:.3g}): allow more steps, or "
                "start from loads of a neighbouring problem"
            )
        return (
            f"contacts are so crowded that the energy may not be convex (convexity number "
            f"{number:.3g}, convex below 1): use a smaller approach or load, sharper tips, or "
            "asperities further apart"
        )


def negligible(indentation: Array) -> float:
    """The 2-norm of the defect F that the correction after the last step may leave."""
    return NEGLIGIBLE * float(np.linalg.norm(np.maximum(indentation, 0.0)))


def on_constraint(problem: NormalProblem, indentation: Array) -> Array:
    """(n,) the indentations, shifted by one number so that their loads have the prescribed total.

    If the approach is prescribed, each is instead limited to D_i = approach + offset.
    """
    if problem.load is not None:
        return shifted_to_load(indentation, problem.coefficients, problem.load)
    return np.minimum(indentation, problem.approach_bound + problem.offsets)
