"""The friction problem with the full tangential kernel as one second-order cone program.

docs/theory/vector-friction.md, "Cones", derives it and defines t, u, S and epsilon. The *shift*, S
times the local compliance, makes the quadratic form convex. The variables are q / (epsilon P) of
each asperity with the shear force q and the load P, and those of the cones. The multiplier of the
total is the rigid displacement.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT, SECOND_ORDER
from convexrough.errors import SolverError
from convexrough.solvers.programs import ConeProgram, RawAnswer, run_clarabel
from convexrough.vector_shear.certificate import certify_vectors
from convexrough.vector_shear.problem import FrictionProblem, VectorState, along


class _Lift(NamedTuple):
    """Cones x y >= w^2 for one asperity, with x, y, w linear in k variables.

    The first plus S times the second row of `energy` are coefficients of the local energy.
    """

    orders: Array  # (k,) order of each variable in u; the first variable is the number 1
    cones: Array  # (cones, 3, k) coefficients of x, y, w
    share: Array  # (k,) coefficients of m / P = 1 - t^3, where m is a bound on |q|
    energy: Array  # (2, k)


#: The form with four cones, in the variables 1, (1 - t^2)^2, t^2 u, t^2 u^2, t^2 u^3, t^3 u^3.
FOUR = _Lift(
    orders=np.array([0.0, 2, 1, 2, 3, 3]),
    cones=np.array(
        [
            [[1.0, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 1, 2, -1, 0, 0]],
            [[0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 1, 0, 0]],
            [[1, -1, -3, 1, 0, 0], [0, 0, 0, 1, -1, 0], [0, 0, 1, -1, 0, 0]],
            [[0, 0, 1, -1, 0, 0], [0, 0, 0, 0, 0, 1], [0, 0, 0, 1, -1, 0]],
        ]
    ),
    share=np.array([0.0, 1, 3, -1, 0, 0]),
    energy=np.array([[0, 2 / 5, 0, 7 / 5, -3 / 5, 0], [0, -1 / 3, 0, -5 / 3, 1, 1 / 3]]),
)

#: The form with five cones, in the variables 1, u, u^2, u^3, u^4, u^5, t^3 u^3.
FIVE = _Lift(
    orders=np.array([0.0, 1, 2, 3, 4, 5, 3]),
    cones=np.array(
        [
            [[0.0, 1, 0, 0, 0, 0, 0], [0, 0, 0, 1, 0, 0, 0], [0, 0, 1, 0, 0, 0, 0]],
            [[0, 1, -1, 0, 0, 0, 0], [0, 0, 0, 1, -1, 0, 0], [0, 0, 1, -1, 0, 0, 0]],
            [[0, 1, -2, 1, 0, 0, 0], [0, 0, 0, 1, -2, 1, 0], [0, 0, 1, -2, 1, 0, 0]],
            [[1, -3, 3, -1, 0, 0, 0], [0, 0, 1, -3, 3, -1, 0], [0, 1, -3, 3, -1, 0, 0]],
            [[0, 1, -3, 3, -1, 0, 0], [0, 0, 0, 0, 0, 0, 1], [0, 0, 1, -3, 3, -1, 0]],
        ]
    ),
    share=np.array([0.0, 3, -3, 1, 0, 0, 0]),
    energy=np.array([[0, 0, 3, -5, 3, -3 / 5, 0], [0, 0, -3, 17 / 3, -4, 1, 1 / 3]]),
)

#: If |T| is below this fraction of gross sliding, sum P, the state is proportional to T to the
#: solver's accuracy: the program is solved at this fraction, and the result scaled. A heuristic.
ELASTIC = 1e-9

#: Largest accepted residual divided by the largest accepted `duality_gap`. A heuristic: errors of
#: forces are about the root of that of the energy, which is 1e-4 for the default gap of 1e-8.
SLIPS = 1e4

#: Limits on Clarabel's steps, as parts of the way to the boundary of the cones, in order of trial.
#: Errors with 0.9 are a tenth of those with 0.99, which a few problems need. Heuristics.
STEPS = (0.9, 0.99)


@dataclass(frozen=True)
class FrictionConic:
    """A solver of `shear_vector` by a cone program, through Clarabel.

    tolerance : tolerance of Clarabel for duality gap and feasibility
    accepted  : largest accepted `duality_gap`, as a fraction of the energy; `residual` may be 1e4
        times this number. If a result exceeds these limits, `solve` raises SolverError

    >>> state = cr.shear_vector(contact, force=0.25 * contact.load, solver=cr.FrictionConic())
    >>> state.residual < 1e-5
    True
    """

    tolerance: float = 1e-12
    accepted: float = 1e-8
    name: str = field(default="conic", init=False)

    def solve(self, problem: FrictionProblem, total: Array) -> VectorState:
        """The state under a total (2,), |T| < sum P, in scaled units.

        Raises SolverError if the program is not convex or the result exceeds `accepted`.
        """
        solver, size = f"friction ({self.name})", float(np.hypot(*total))
        if problem.share > FIVE_CONES_LIMIT:
            raise _too_dense(problem)
        scale = min(size / (ELASTIC * problem.loads.sum()), 1.0)
        elastic = (size / scale) * problem.elastic.value / problem.loads
        small = np.clip(elastic, 0.01 * elastic.max(), 1.0)
        data, energy = _program(problem, total / scale, small)
        for step in STEPS:
            raw = run_clarabel(data, solver, self.tolerance, max_step_fraction=step)
            state = _state(problem, total / scale, small, energy, raw)
            least = problem.energy(state.increments, problem.couple(state.increments))
            known = certify_vectors(problem, state, Ball.exact(total / scale))
            gap, residual = known.excess / least, problem.residual(state)
            if gap <= self.accepted and residual <= SLIPS * self.accepted:
                q, X, slips = (scale * each for each in state[1:4])
                return VectorState(total, q, X, slips, state.iterations)
        raise SolverError(
            f"clarabel stopped after {raw.iterations} steps with {raw.status}, a duality gap of "
            f"{gap:.3g} of the energy and a residual of {residual:.3g}; accepted are "
            f"{self.accepted:g} and {SLIPS * self.accepted:g}",
            solver=solver,
            advice="try a larger `accepted`, or FrictionNewton()",
            iterate=scale * state.increments,
        )


def _too_dense(problem: FrictionProblem) -> SolverError:
    touching, numbers = problem.touching, problem.convexity_numbers
    named = (f"{touching[i]} ({numbers[i]:.4g})" for i in np.argsort(-numbers)[:5])
    return SolverError(
        "asperities too dense for a convex program, which needs S <= 1: the kernel is "
        f"convex from a shift S that is {problem.share:.4g} of the local compliance. "
        "Largest convexity numbers (contact radii divided by pi/4 times the distance to "
        f"the nearest neighbour), by asperity: {', '.join(named)}",
        solver="friction (conic)",
        advice="use a smaller load, sharper tips, or asperities further apart",
    )


def _program(problem: FrictionProblem, total: Array, small: Array) -> tuple[ConeProgram, float]:
    """The cone program for a total (2,), with numbers of about 1, and its unit of energy.

    With epsilon = `small` (n,), the variables are q / (epsilon P), in the order x_1, y_1, x_2, ...,
    then those of the cones, asperity by asperity; those of order k in u are divided by epsilon^k.
    Of the rows of the cones, the first three of each asperity are m / P >= |q| / P, over epsilon.
    """
    from scipy import sparse  # 0.1 s to import: only when solving

    n, P, force = len(problem), problem.loads, float(np.hypot(*total))
    energy = float((P * problem.thresholds * small**2).max())
    lift, e = FOUR if problem.share <= FOUR_CONES_LIMIT else FIVE, small[:, None]
    unit, more = np.repeat(small * P, 2), (len(lift.orders) - 1) * n
    M = problem.kernel.copy()
    M[np.diag_indices(2 * n)] += np.repeat(problem.share * problem.compliance, 2)
    upper = sparse.csc_array(np.triu(M * (unit / energy) * unit[:, None]))
    counted = (P * problem.thresholds / energy)[:, None] * e**lift.orders
    lifted = (counted * (lift.energy[0] + problem.share * lift.energy[1]))[:, 1:]

    leading = np.where(lift.cones != 0, lift.orders, np.inf).min(axis=2, keepdims=True)
    forms = lift.cones * e[:, :, None, None] ** np.maximum(lift.orders - leading, 0.0)
    rows = (SECOND_ORDER @ forms).reshape(n, -1, len(lift.orders))
    friction = np.zeros((n, 3, len(lift.orders)))
    friction[:, 0] = lift.share * e ** (lift.orders - 1)
    rows = np.concatenate((friction, rows), axis=1)

    vectors = np.zeros((rows.shape[1], 2))
    vectors[[1, 2], [0, 1]] = 1.0
    balance = sparse.kron((small * P)[None] / force, sparse.eye_array(2))
    blocks = (np.ascontiguousarray(rows[:, :, 1:]), np.arange(n), np.arange(n + 1))
    forces = sparse.csc_array(sparse.kron(sparse.eye_array(n), vectors))
    cones = sparse.hstack([forces, sparse.csc_array(sparse.bsr_array(blocks))])
    totals = sparse.hstack([balance, sparse.csc_array((2, more))])
    constraints = sparse.csc_array(sparse.vstack([totals, -cones]))
    constraints.eliminate_zeros()
    program = ConeProgram(
        quadratic=sparse.csc_array(sparse.block_diag((upper, sparse.csc_array((more, more))))),
        linear=np.concatenate((np.zeros(2 * n), lifted.ravel())),
        constraints=constraints,
        constant=np.concatenate((total / force, rows[:, :, 0].ravel())),
        equalities=2,
    )
    return program, energy


def _state(
    problem: FrictionProblem, total: Array, small: Array, energy: float, raw: RawAnswer
) -> VectorState:
    """Forces, rigid displacement and slips, from the solver's variables and multipliers.

    An interior-point method returns |q_i| < P_i and a slip > 0 everywhere. An asperity slides if
    the slip exceeds the threshold minus the deflection.
    """
    n, P, thresholds = len(problem), problem.loads, problem.thresholds
    unit = small * P
    q = raw.x[: 2 * n].reshape(n, 2) * unit[:, None]
    size = np.hypot(*q.T)
    displacement = -raw.multipliers[:2] * energy / float(np.hypot(*total))
    limit = raw.multipliers[2:].reshape(n, -1)[:, 0] * energy / unit  # of |q_i| <= m_i
    slip = limit - (thresholds - problem.share * problem.compliance * P)  # where |q_i| = P_i
    left = thresholds - problem.deflections(np.minimum(size, P))
    sliding = slip > left
    q = along(np.where(sliding, P, np.minimum(size, P)), q, size)
    slips = along(np.where(sliding, slip, 0.0), q, np.hypot(*q.T))
    return VectorState(total, q, displacement, slips, raw.iterations)
