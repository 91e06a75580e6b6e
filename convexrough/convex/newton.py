"""Newton's method on a normal map, with a line search on the energy, for all laws of contact.

Pressing, shear and vector friction lead to the same equation. The forces p(eta) are a monotone
function of the asperities' own displacements eta. With the compliance operator A, which gives the
displacements by forces on other asperities, and the prescribed displacements X, the law is

    F(eta) = eta + A p(eta) - X = 0.

F is continuously differentiable, so no active set is guessed. F = 0 is the first-order condition of
an energy Phi(p). A step d solves F + F' d = 0 to a given tolerance and is halved until Phi
decreases enough (docs/theory/newton.md). A `Law` defines p, A and Phi.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Protocol

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import SolverError
from convexrough.progress import log_step

#: The linear system of a step is solved to this relative residual or, if that is smaller, to the
#: square of the factor by which the last step reduced the defect (Eisenstat and Walker, SIAM J.
#: Sci. Comput. 17 (1996) 16, choice 2).
MOST_LEFT = 0.03

#: Least residual to which the linear system is solved, as a fraction of the defect at which the
#: method stops. A heuristic.
OVERSOLVED = 0.3

#: Armijo's constant: least decrease of the energy, divided by the decrease to first order.
PROMISED = 1e-4

#: The shortest step that is tried, as a fraction of the full step.
SHORTEST = 1e-12


class Iterate(NamedTuple):
    """A point of the iteration, with the symbols of this module; the defect is F(eta)."""

    unknown: Array  # eta
    forces: Array  # p(eta), which satisfy the constraints, such as a prescribed total
    defect: Array  # F(eta)
    gradient: Array  # dPhi/dp, without multipliers of the constraints
    energy: float  # Phi(p)
    rounding: float  # bound on the rounding error of a change of the energy
    residual: float  # the largest |F|
    scale: float  # the unit of residuals
    #: the 2-norm of F below which, because of rounding, further steps do not help; 0 if F is far
    #: larger
    noise: float
    at: Any  # further results of the law at this point


class Law(Protocol):
    """A law of contact. `solver` and `unit` (of residuals) are names for error messages."""

    @property
    def solver(self) -> str: ...
    @property
    def unit(self) -> str: ...

    def evaluate(self, unknown: Array) -> Iterate | None:
        """The state at eta = `unknown`, which is changed where needed to satisfy the constraints,
        such as a prescribed total; None if that is impossible."""

    def direction(self, state: Iterate, left: float) -> Array:
        """The step d of eta; the 2-norm of F + F' d is at most about `left` times that of F."""

    def advice(self, state: Iterate) -> str:
        """What a user can try if the method fails at this state."""


def solve(
    law: Law, state: Iterate, accurate: float, tolerance: float, most: int, linear: float = 0.0
) -> tuple[Iterate, int]:
    """The final state, and the number of steps. Raises SolverError if `most` steps are too few.

    The method ends if  residual <= tolerance * scale.  Once  residual <= accurate * scale,  it also
    ends if the defect is below its `noise`, or if a step does not halve the residual; in this last
    case the better of the states before and after the step is returned. It also ends if the 2-norm
    of the defect is at most `linear`: if the caller corrects the result. After `most` steps the
    larger of `tolerance` and `accurate` suffices.
    """
    before = np.inf  # the 2-norm of the last defect
    for step in range(1, most + 1):
        log_step(law.solver, step, state.energy, _relative(state))
        near = state.residual <= accurate * state.scale
        size = math.sqrt(np.vdot(state.defect, state.defect))
        done = state.residual <= max(tolerance * state.scale, 0.0)
        if done or (near and size <= state.noise) or size <= linear:
            return state, step - 1
        expected = (size / before) ** 2 if before < np.inf else 1.0
        forcing = min(MOST_LEFT, expected)
        enough = max(state.noise / size, tolerance * state.scale / state.residual)
        direction = law.direction(state, max(forcing, OVERSOLVED * enough))
        following = descend(law, state, direction)
        if near and following.residual >= 0.5 * state.residual:
            return min(state, following, key=lambda each: each.residual), step
        state, before = following, size
    if state.residual <= max(tolerance, accurate) * state.scale:
        return state, most
    what = f"residual {_relative(state):.3g} of {law.unit} after {most} steps"
    raise _failed(law, state, f"{what}, at most {max(tolerance, accurate):.3g} needed")


def _failed(law: Law, state: Iterate, what: str) -> SolverError:
    advice = law.advice(state)
    return SolverError(what, solver=law.solver, advice=advice, iterate=state.forces)


def _relative(state: Iterate) -> float:
    return state.residual / state.scale if state.scale != 0 else np.inf


def descend(law: Law, state: Iterate, direction: Array) -> Iterate:
    """The state after the step, halved until the energy decreases enough by Armijo's rule."""
    length = 1.0
    while length > SHORTEST:
        trial = law.evaluate(state.unknown + length * direction)
        if trial is not None:
            slope = float(np.vdot(state.gradient, trial.forces - state.forces))
            if trial.energy - state.energy <= PROMISED * min(slope, 0.0) + state.rounding:
                return trial
        length /= 2.0
    raise _failed(law, state, "no step in the computed direction lowers the energy")
