"""Newton's method on the normal map, safeguarded by the energy.

The unknown is delta: the indentation of a touching asperity, minus the gap of an open one. With
P_i = (max(delta_i, 0) / k_i)^(3/2) the whole contact law is the square system

    F(delta) = delta + A P(delta) - D = 0,

once differentiable, and no active set is guessed: it is the sign of the answer. With
c = dP/ddelta (0 where open) and W = diag(c)^(1/2) a step solves

    (I + W A W) y = -W F  on the touching set,     d(delta) = -F - A W y.

The matrix is the Hessian of the energy scaled by its local part: positive definite in the convex
range, and then the step descends the energy Phi(P(delta)). Where it is not positive definite the
shells are added to its diagonal, which makes it so for any layout.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from convexrough import hertz
from convexrough.checks import Array, Indices
from convexrough.errors import SolverError
from convexrough.normal import SAFETY, NormalProblem, shifted_to_load
from convexrough.solvers.solution import Solution


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
    """Settings of Newton's method on the normal map, with dense Cholesky factors.

    Stops when  max_i |delta_i + (A P)_i - D_i| <= tolerance (|D0| + max_i |d_i|)  and a further
    step no longer halves that residual, so that the answer is as good as float64 allows. Raises
    SolverError if `max_iterations` steps do not get there.
    """

    tolerance: float = 1e-12
    max_iterations: int = 100
    name: str = field(default="newton", init=False)

    def solve(self, problem: NormalProblem, start: Array | None = None) -> Solution:
        """Loads of the candidates, from any start that is not negative (own units)."""
        state = _evaluate(problem, _start(problem, start))
        farthest = float(np.abs(problem.offsets).max())
        for iteration in range(1, self.max_iterations + 1):
            following = _step(problem, state)
            best = min(state, following, key=lambda s: s.residual)
            accurate = state.residual <= self.tolerance * (abs(state.approach) + farthest)
            if accurate and following.residual >= 0.5 * state.residual:
                residual = problem.residual(best.loads, best.approach)
                return Solution(best.loads, best.approach, iteration, residual)
            state = following
        raise SolverError(
            f"newton: residual {state.residual:.3g} in units of the approach after "
            f"{self.max_iterations} steps, tolerance {self.tolerance:g}"
        )


def newton_step(problem: NormalProblem, loads: Array) -> Solution:
    """One step from loads that another solver found (own units, not negative).

    From an error e it leaves about e^2, and it tells open asperities from lightly loaded ones.
    """
    state = _step(problem, _evaluate(problem, _start(problem, loads)))
    residual = problem.residual(state.loads, state.approach)
    return Solution(state.loads, state.approach, 1, residual)


def _start(problem: NormalProblem, loads: Array | None) -> Array:
    """An indentation to start from: of the given loads, or of heights riding on a smooth sphere."""
    if loads is None:
        indentation = problem.smooth_indentation()
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


def _step(problem: NormalProblem, state: _State) -> _State:
    """One Newton step, halved until the energy falls (Armijo's rule along the arc P(delta))."""
    direction = _direction(problem, state)
    gap = problem.gap(state.loads, state.displacement, state.approach)
    rounding = SAFETY * float(state.loads @ (np.abs(problem.offsets) + abs(state.approach)))
    length = 1.0
    while length > 1e-12:
        trial = _evaluate(problem, _on_constraint(problem, state.indentation + length * direction))
        slope = float(gap @ (trial.loads - state.loads))
        if trial.energy - state.energy <= 1e-4 * min(slope, 0.0) + rounding:
            return trial
        length /= 2.0
    raise SolverError("newton: no step along its direction lowers the energy")


def _direction(problem: NormalProblem, state: _State) -> Array:
    """-F - A W y + beta: beta, the change of D0, is 0 unless the total load is prescribed."""
    touching = np.flatnonzero(state.loads)
    if len(touching) == 0:
        return -state.defect
    loads = state.loads[touching]
    root = np.sqrt(1.0 / problem.stiffness(loads, touching))  # W
    right = np.column_stack((-root * state.defect[touching], root))
    y, border = _solve_scaled(problem, touching, root, right).T
    beta = 0.0
    if problem.load is not None:
        beta = -float(root @ y) / float(root @ border)  # so that the total does not change
        y = y + beta * border
    spread = np.zeros(len(problem))
    spread[touching] = root * y
    return beta - state.defect - problem.influence.apply(spread)


def _solve_scaled(problem: NormalProblem, touching: Indices, root: Array, right: Array) -> Array:
    """Solve (I + W A W) y = right on the touching set; with the shells added if indefinite."""
    from scipy.linalg.lapack import dpotrf, dpotrs  # 0.2 s to import: only when solving

    for shells in (0.0, problem.shells[touching]):
        matrix = problem.influence.matrix[np.ix_(touching, touching)]
        matrix *= root
        matrix *= root[:, None]
        np.fill_diagonal(matrix, 1.0 + root * shells * root)
        # The transpose of a symmetric matrix is itself, and in LAPACK's order: no copy.
        factor, info = dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
        if info == 0:
            solution: Array = dpotrs(factor, right, lower=1)[0]
            return solution
    raise SolverError("newton: the shell-shifted matrix is not positive definite")
