"""The friction problem with the full tangential kernel as one second-order cone program.

Let m_i >= |q_i| be the size of force that friction must bear at asperity i, m_i / P_i = 1 - t_i^3,
and M = B + shift the kernel made semidefinite. With S the share of the shift, the local energy of
m less shift m^2 / 2 is P_i ceiling_i times

    (3/5) t^5 - (S/3) t^6 - (1 - 2S/3) t^3 + 2/5 - S/3,

which does not fall as m grows where S <= 1. So it may be minimised over m_i >= |q_i| together with
(1/2) q'Mq, convex, under sum q = T: and the powers of t lifted to variables in the cones of
`convexrough.convex.cones` make that exact, with four per asperity where all S_i <= 21/25 and with
five where S_i <= 1. The multiplier of the total is the rigid displacement; that of |q_i| <= m_i is
the slip and the slope of the local energy together.

Under a small force every t is near 1 and the powers of t are nearly equal: in them the program
loses all digits. So the same cones are written in u = 1 - t. Each says that a 2 x 2 matrix, of the
basis 1, t or 1, t^2 times a weight, is semidefinite; the basis 1, u or 1, 1 - t^2 says the same. A
variable of order u^k is solved for over epsilon_i^k, and q over epsilon_i P_i, where epsilon_i is
the elastic estimate of |q_i| / P_i, or 1; so the numbers are about 1 under any force.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT
from convexrough.convex.libraries import load_library
from convexrough.errors import SolverError
from convexrough.vector_shear.problem import VectorProblem, VectorState, along


class _Lift(NamedTuple):
    """Cones x y >= w^2, forms in the variables of one asperity; each but the first is small.

    orders : (k,) the power of u that each variable is of; the first is the number 1
    cones  : (cones, 3, k) the forms x, y, w
    share  : (k,) the form m / P = 1 - t^3
    energy : (2, k) the forms whose sum, the second times S, is the local energy
    """

    orders: Array
    cones: Array
    share: Array
    energy: Array


#: Variables 1, (1 - t^2)^2, t^2 u, t^2 u^2, t^2 u^3, t^3 u^3.
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

#: Variables 1, u, u^2, u^3, u^4, u^5, t^3 u^3.
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

#: x y >= w^2 with x, y >= 0 is the second-order cone  x + y >= || (x - y, 2 w) ||.
_SECOND_ORDER = np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 2.0]])

#: Below this part of gross sliding the state is elastic, to more digits than the cones give.
ELASTIC = 1e-9


@dataclass(frozen=True)
class FrictionConic:
    """Settings of the cone program for `shear_vector`, through Clarabel.

    tolerance : of Clarabel: duality gap and feasibility. Its word is not relied on
    accepted  : an answer is accepted if the dual bound made from its forces and its displacement
        proves its energy to be within this of the least, relatively, and its `residual`, slips
        included, is at most 1e4 times this; else SolverError
    """

    tolerance: float = 1e-12
    accepted: float = 1e-8
    name: str = field(default="conic", init=False)

    def solve(self, problem: VectorProblem, total: Array) -> VectorState:
        """The state of a total increment (2,), |T| < sum P (own units)."""
        clarabel = load_library("clarabel", f"friction ({self.name})")
        shares = _shares(problem)
        # Below, the state is elastic: proportional to T to more digits than the cones give.
        limit = ELASTIC * problem.scalar.loads.sum()
        scale = min(float(np.hypot(*total)) / limit, 1.0)
        program = _Program.of(problem, shares, total / scale)
        data = program.data(clarabel)
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = self.tolerance
        for fraction in (0.9, 0.99):  # short steps are an order more accurate; a few need long ones
            settings.max_step_fraction = fraction
            solution = clarabel.DefaultSolver(*data, settings).solve()
            answer, multipliers = np.array(solution.x), np.array(solution.z)
            if not (np.isfinite(answer).all() and np.isfinite(multipliers).all()):
                raise SolverError(
                    "the answer of clarabel is not a number", solver=f"friction ({self.name})"
                )
            q, rise, slips = program.read(answer, multipliers)
            state = VectorState(total / scale, q, rise, slips, int(solution.iterations))
            energy = problem.energy(q, problem.couple(q))
            gap, residual = problem.duality_gap(state) / energy, problem.residual(state)
            if gap <= self.accepted and residual <= 1e4 * self.accepted:
                return VectorState(total, scale * q, scale * rise, scale * slips, state.iterations)
        raise SolverError(
            f"clarabel stopped after {solution.iterations} steps with "
            f"{solution.status}, at an energy proved to be within {gap:.3g} of the least, "
            f"relatively, and a residual of {residual:.3g}; accepted are {self.accepted:g} and "
            f"{1e4 * self.accepted:g}",
            solver=f"friction ({self.name})",
        )


def _shares(problem: VectorProblem) -> Array:
    """(n,) S, in the range of the cones; or an error that says who is too dense."""
    shares = problem.shift.shares
    if shares.max() <= FIVE_CONES_LIMIT:
        return shares
    touching = problem.scalar.touching
    numbers = problem.convexity_numbers
    worst = np.argsort(-numbers)[:5]
    named = ", ".join(f"{touching[i]} ({numbers[i]:.4g})" for i in worst)
    raise SolverError(
        f"too dense for a convex program: the least shift of the tangential "
        f"kernel is {shares.max():.4g} of the local stiffness, and at most 1 is convex. Largest "
        f"convexity numbers, contact radii over (pi/4) times the distance to the nearest "
        f"neighbour, by their indices: {named}. Use a smaller load, sharper tips, or asperities "
        f"further apart",
        solver="friction (conic)",
    )


@dataclass(frozen=True, eq=False)
class _Program:
    """The program, with its numbers about 1.

    lift   : its cones;  total : (2,) T;  shares : (n,) S
    small  : (n,) epsilon
    energy : what the energy is counted in
    """

    problem: VectorProblem
    lift: _Lift
    total: Array
    shares: Array
    small: Array
    energy: float

    @classmethod
    def of(cls, problem: VectorProblem, shares: Array, total: Array) -> _Program:
        scalar = problem.scalar
        elastic = np.hypot(*total) * scalar.elastic / scalar.loads
        small = np.clip(elastic, 0.01 * elastic.max(), 1.0)
        energy = float((scalar.loads * scalar.ceilings * small**2).max())
        lift = FOUR if shares.max() <= FOUR_CONES_LIMIT else FIVE
        return cls(problem, lift, total, shares, small, energy)

    @property
    def force(self) -> float:
        """What the total is counted in."""
        return float(np.hypot(*self.total))

    def data(self, clarabel: Any) -> tuple[Any, ...]:
        """P, q, A, b, cones of  minimise (1/2) x'P x + q'x,  A x + s = b,  s in the cones.

        The variables are q / (epsilon P), in the order x_1, y_1, x_2, ..., and then the lifts, each
        asperity's together.
        """
        from scipy import sparse  # 0.1 s to import: only when solving

        problem, lift, small = self.problem, self.lift, self.small[:, None]
        n, P, S = len(problem), problem.scalar.loads, self.shares[:, None]
        size = len(lift.orders) - 1
        unit = np.repeat(self.small * P, 2)
        M = problem.kernel.copy()
        M[np.diag_indices(2 * n)] += np.repeat(problem.shift.values, 2)
        upper = sparse.csc_matrix(np.triu(M * (unit / self.energy) * unit[:, None]))
        quadratic = sparse.csc_matrix(
            sparse.block_diag((upper, sparse.csc_matrix((size * n, size * n))))
        )
        counted = (P * problem.scalar.ceilings / self.energy)[:, None] * small**lift.orders
        lifted = (counted * (lift.energy[0] + S * lift.energy[1]))[:, 1:]
        linear = np.concatenate((np.zeros(2 * n), lifted.ravel()))

        rows = self._rows()
        vectors = np.zeros((rows.shape[1], 2))
        vectors[[1, 2], [0, 1]] = 1.0
        coefficients = (np.ascontiguousarray(rows[:, :, 1:]), np.arange(n), np.arange(n + 1))
        balance = sparse.kron((self.small * P)[None] / self.force, sparse.identity(2))
        powers = sparse.csc_matrix(sparse.bsr_matrix(coefficients))
        each = sparse.hstack([sparse.csc_matrix(sparse.kron(sparse.identity(n), vectors)), powers])
        totals = sparse.hstack([balance, sparse.csc_matrix((2, size * n))])
        constraints = sparse.csc_matrix(sparse.vstack([totals, -each]))
        constraints.eliminate_zeros()
        constant = np.concatenate((self.total / self.force, rows[:, :, 0].ravel()))
        count = n * (rows.shape[1] // 3)
        cones = [clarabel.ZeroConeT(2), *[clarabel.SecondOrderConeT(3)] * count]
        return quadratic, linear, constraints, constant, cones

    def _rows(self) -> Array:
        """(n, rows, k) the cones of every asperity, three rows each:  m / P >= |(x, y)|  first.

        Each form is counted in the power of epsilon that it is of.
        """
        lift, small = self.lift, self.small[:, None]
        leading = np.where(lift.cones != 0, lift.orders, np.inf).min(axis=2, keepdims=True)
        powers = np.maximum(lift.orders - leading, 0.0)
        forms = lift.cones * small[:, :, None, None] ** powers
        rows = (_SECOND_ORDER @ forms).reshape(len(small), -1, len(lift.orders))
        friction = np.zeros((len(small), 3, len(lift.orders)))
        friction[:, 0] = lift.share * small ** (lift.orders - 1)
        return np.concatenate((friction, rows), axis=1)

    def read(self, answer: Array, multipliers: Array) -> tuple[Array, Array, Array]:
        """Forces, rigid displacement and slips from the answer and its multipliers.

        An interior point leaves an asperity that slides a little short of P, and one that does not
        a little slip: of the two, the larger part of its ceiling is kept.
        """
        problem = self.problem
        n, P, ceilings = len(problem), problem.scalar.loads, problem.scalar.ceilings
        unit = self.small * P
        q = answer[: 2 * n].reshape(n, 2) * unit[:, None]
        size = np.hypot(*q.T)
        rise = -multipliers[:2] * self.energy / self.force
        limit = multipliers[2:].reshape(n, -1)[:, 0] * self.energy / unit  # of |q_i| <= m_i
        slip = limit - (ceilings - problem.shift.values * P)  # where |q_i| = P_i
        left = ceilings - problem.scalar.deflections(np.minimum(size, P))
        sliding = slip > left
        q = along(np.where(sliding, P, np.minimum(size, P)), q, size)
        return q, rise, along(np.where(sliding, slip, 0.0), q, np.hypot(*q.T))
