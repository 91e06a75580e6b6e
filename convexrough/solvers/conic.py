"""The contact law as one second-order cone program, straight to Clarabel.

    minimise    sum e_i [(3/5 - S_i/3) y5_i + (S_i/3) z_i] + (1/2) p'M p - D'p
    subject to  p = B y3,  four or five cones per asperity,  and sum p = load if prescribed,

with boxes 0 <= p <= B, e = k B^(5/3), and M = A + diag(shells), positive semidefinite. Its only
solution is the contact state (docs/theory/exact-cones.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.convex.cones import power_cones
from convexrough.convex.libraries import load_library
from convexrough.errors import SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.progress import Announce
from convexrough.solvers.cone_boxes import Answer, Boxes, solve_in_boxes
from convexrough.solvers.solution import Solution

#: From this many asperities on Clarabel's supernodal factorisation is the faster one.
SUPERNODAL = 300

#: Words of Clarabel after which there is a point to judge. At tight tolerances it often stops a
#: little short of them, at a point that is right: the contact law decides, not the word.
STOPPED = ("Solved", "AlmostSolved")


@dataclass(frozen=True)
class Conic:
    """Settings of the cone program through Clarabel, an interior-point method.

    tolerance      : Clarabel's, of the duality gap and of feasibility, in the problem's units
    newton_step    : end with a step of Newton's method, which takes loads from some 1e-8 of the
        largest to rounding; a second one where the first leaves more than is accepted
    max_iterations : Clarabel's

    Accepted is an answer with  max |g_i| <= 1e-13 (|D0| + max |d_i|)  where touching, and overlaps
    no larger than that where open; without the Newton step, one with
    max |P - P(D - A P)| <= 10 sqrt(tolerance) max P.  Else SolverError is raised; TooDenseError
    where the boxes of the convex range do not hold the solution.
    """

    tolerance: float = 1e-9
    newton_step: bool = True
    max_iterations: int = 200

    def __post_init__(self) -> None:
        checks.positive("tolerance", self.tolerance)

    @property
    def name(self) -> str:
        return "conic + Newton step" if self.newton_step else "conic"

    def solve(
        self,
        problem: NormalProblem,
        start: Array | None = None,
        announce: Announce | None = None,
    ) -> Solution:
        """Loads of the candidates. `start` is not used: interior points begin in the middle."""
        return solve_in_boxes(self, problem)

    def answer(self, problem: NormalProblem, boxes: Boxes) -> Answer:
        """What Clarabel makes of the program in these boxes, not yet judged."""
        clarabel = load_library("clarabel", self.name)
        checks.fits_in_memory(
            "asperities of the cone program", n := len(boxes.members), 100, power=2
        )
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_iter = self.max_iterations
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = self.tolerance
        settings.direct_solve_method = "faer" if n >= SUPERNODAL else "qdldl"
        solution = clarabel.DefaultSolver(*_program(clarabel, problem, boxes), settings).solve()
        if str(solution.status) not in STOPPED:
            raise SolverError(
                f"clarabel stopped after {solution.iterations} steps with {solution.status}",
                solver=self.name,
            )
        approach = problem.approach
        if approach is None:  # the program counts it from the ceiling; V'(L) = -multiplier
            approach = problem.ceiling - float(solution.z[0])
        return Answer(np.array(solution.x[:n]), approach, solution.iterations)


def _program(clarabel: Any, problem: NormalProblem, boxes: Boxes) -> tuple[Any, ...]:
    """P, q, A, b, cones of  minimise (1/2) x'P x + q'x,  A x + s = b,  s in the cones.

    The variables are p and then the lift, y2 to z (y1 to z), each a block of n.
    """
    from scipy import sparse

    members, n = boxes.members, len(boxes.members)
    k_box, S = boxes.energies(problem), boxes.S
    blocks = np.arange((7 if boxes.five else 6) * n).reshape(-1, n)
    p, lift = blocks[0], blocks[1:]
    y3, y5, z = lift[-4], lift[-2], lift[-1]
    width = blocks.size

    M = problem.influence.matrix[np.ix_(members, members)]
    np.fill_diagonal(M, problem.shells[members])
    upper = np.triu_indices(n)
    quadratic = sparse.csc_matrix((M[upper], (p[upper[0]], p[upper[1]])), shape=(width, width))
    level = problem.ceiling if problem.approach is None else problem.approach
    linear = np.zeros(width)
    linear[p] = -(level + problem.offsets[members])
    linear[y5] = k_box * (3 / 5 - S / 3)
    linear[z] = k_box * S / 3

    entries = (np.concatenate((np.ones(n), -boxes.loads)), (np.tile(p, 2), np.concatenate((p, y3))))
    rows = [sparse.csc_matrix(entries, shape=(n, width))]  # p - B y3 = 0
    right = [np.zeros(n)]
    if problem.load is not None:
        rows.insert(
            0, sparse.csc_matrix((np.ones(n), (np.zeros(n, dtype=int), p)), shape=(1, width))
        )
        right.insert(0, np.array([problem.load]))
    equalities = sum(len(values) for values in right)
    power = power_cones(list(lift), width)
    constraints = sparse.vstack([*rows, power.matrix], format="csc")
    cones = [clarabel.ZeroConeT(equalities), *[clarabel.SecondOrderConeT(3)] * power.cones]
    return (
        quadratic,
        linear,
        sparse.csc_matrix(constraints),
        np.concatenate((*right, power.constant)),
        cones,
    )
