"""Newton's method on a normal map, safeguarded by its energy: one loop for every law of contact.

Pressing, shear and vector friction are problems of one kind. Forces p(eta) are a monotone function
of an unknown eta, what each asperity takes up itself, and with the coupling A the law is

    F(eta) = eta + A p(eta) - X = 0,

once differentiable: no active set is guessed. It is the condition of the least of an energy
Phi(p), convex in the convex range. A step d solves F + F' d = 0, as well as it is asked to, and is
halved until Phi falls enough (docs/theory/newton.md). What is different from law to law is in a
`Law`; when to stop, how well to solve and how to search along a step is here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import SolverError
from convexrough.progress import log_step

#: Most of the defect that a linear solver may leave in a step; less as steps succeed, by the square
#: of what the last one left (Eisenstat and Walker, SIAM J. Sci. Comput. 17 (1996) 16, choice 2).
MOST_LEFT = 0.1

#: No need to solve for less than this part of the defect with which the method may stop. Heuristic.
OVERSOLVED = 0.3

#: Armijo's constant: part of the fall that the slope promises which a step must bring.
PROMISED = 1e-4

#: The shortest part of a step that is tried.
SHORTEST = 1e-12


class Iterate(Protocol):
    """A point of the iteration.

    unknown  : eta;  forces : p(eta), as far as the constraints let them;  defect : F
    energy   : Phi(p);  residual : the largest |F|;  scale : what residuals are relative to
    """

    @property
    def unknown(self) -> Array: ...
    @property
    def forces(self) -> Array: ...
    @property
    def defect(self) -> Array: ...
    @property
    def energy(self) -> float: ...
    @property
    def residual(self) -> float: ...
    @property
    def scale(self) -> float: ...


Point = TypeVar("Point", bound=Iterate)


class Law(Protocol[Point]):
    """What Newton's method asks of a law of contact.

    solver : whose error it is if it stops;  unit : what residuals are relative to, in a word
    """

    @property
    def solver(self) -> str: ...
    @property
    def unit(self) -> str: ...

    def evaluate(self, unknown: Array) -> Point | None:
        """The state at eta, moved onto the constraints; None where that fails."""
        ...

    def direction(self, state: Point, left: float) -> Array:
        """The step d. `left` : part of the defect that it may leave, in the 2-norm."""
        ...

    def gradient(self, state: Point) -> Array:
        """dPhi/dp, but for multipliers of the constraints."""
        ...

    def energy_rounding(self, state: Point) -> float:
        """By how much rounding can make the energy seem to rise."""
        ...

    def noise(self, state: Point) -> float:
        """2-norm of a defect that is small beside what rounding can make of A p."""
        ...

    def advice(self, state: Point) -> str:
        """What a user might try where the method stopped here."""
        ...


@dataclass(frozen=True)
class Stopping:
    """When Newton's method ends.

    accurate  : residual, over its scale, that every answer must reach unless it is asked for less
    tolerance : residual, over its scale, at which it ends at once; 0 asks for all float64 can do
    most      : steps, at most
    linear    : 2-norm of a defect that is as good as none: it also ends where another step is
        expected to leave no more, because what is left of the law is linear; 0 for not
    """

    accurate: float
    tolerance: float
    most: int
    linear: float = 0.0


def solve(
    law: Law[Point],
    state: Point,
    stopping: Stopping,
    *,
    before: float = np.inf,
) -> tuple[Point, int]:
    """The state that is as good as it gets, and how many steps it took.

    before : 2-norm of the defect that the start can be said to come from, for the first step

    It ends where  residual <= tolerance * scale;  or, once  residual <= accurate * scale,  where
    the defect is small beside rounding, which a certificate has to allow for anyway, or where a
    step does not halve the residual (the better of the two states is the answer). Else SolverError.
    """
    for step in range(1, stopping.most + 1):
        log_step(law.solver, step, state.energy, _relative(state))
        accurate = state.residual <= stopping.accurate * state.scale
        size, noise = math.sqrt(np.vdot(state.defect, state.defect)), law.noise(state)
        done = state.residual <= max(stopping.tolerance * state.scale, 0.0)
        if done or (accurate and size <= noise):
            return state, step - 1
        expected = (size / before) ** 2 if 0 < before < np.inf else 1.0
        if expected * size <= stopping.linear:
            return state, step - 1
        forcing = min(MOST_LEFT, expected)
        enough = max(noise / size, stopping.tolerance * state.scale / state.residual)
        direction = law.direction(state, max(forcing, OVERSOLVED * enough))
        following = descend(law, state, direction)
        if accurate and following.residual >= 0.5 * state.residual:
            return min(state, following, key=lambda each: each.residual), step
        state, before = following, size
    needed = max(stopping.tolerance, stopping.accurate)
    raise SolverError(
        f"residual {_relative(state):.3g} of {law.unit} after {stopping.most} steps, "
        f"{needed:.3g} needed",
        solver=law.solver,
        advice=law.advice(state),
        iterate=state.forces,
    )


def _relative(state: Iterate) -> float:
    """The residual over its scale."""
    return state.residual / state.scale if state.scale != 0 else np.inf


def descend(law: Law[Point], state: Point, direction: Array) -> Point:
    """The state along the step, halved until the energy falls: Armijo's rule along p(eta)."""
    gradient, rounding = law.gradient(state).ravel(), law.energy_rounding(state)
    length = 1.0
    while length > SHORTEST:
        trial = law.evaluate(state.unknown + length * direction)
        if trial is not None:
            slope = float(gradient @ (trial.forces - state.forces).ravel())
            if falls(trial.energy - state.energy, slope, rounding):
                return trial
        length /= 2.0
    raise SolverError(
        "no step along its direction lowers the energy",
        solver=law.solver,
        advice=law.advice(state),
        iterate=state.forces,
    )


def falls(change: Any, slope: Any, rounding: Any) -> Any:
    """Whether energies change by as much as Armijo's rule asks, but for rounding."""
    return change <= PROMISED * np.minimum(slope, 0.0) + rounding
