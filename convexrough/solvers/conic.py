"""The contact law as one second-order cone program, solved with Clarabel.

docs/theory/exact-cones.md states the program (1) and proves that its solution satisfies the contact
law. The sigma_i of that page are `NormalProblem.shells`. D_i is the sum of the offset and the
approach; if the load is prescribed, an upper bound takes the place of the approach.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from convexrough import checks
from convexrough.convex.cones import power_cones
from convexrough.errors import SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.cone_boxes import ConeBoxes, ConeSolver
from convexrough.solvers.programs import (
    ConeProgram,
    ProgramAnswer,
    RawAnswer,
    run_clarabel,
)

#: Number of asperities from which Clarabel's supernodal factorisation is faster.
SUPERNODAL = 300

#: Statuses of Clarabel after which its solution is checked against the contact law. With tight
#: tolerances Clarabel often reports AlmostSolved at a correct solution.
STOPPED = ("Solved", "AlmostSolved")


@dataclass(frozen=True)
class Conic(ConeSolver):
    """A solver of the cone program with Clarabel, an interior-point method.

    tolerance      : tolerance of the duality gap and of feasibility, in scaled units
    max_iterations : largest number of iterations
    """

    max_iterations: int = 200

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.whole("max_iterations", self.max_iterations)

    @property
    def formulation(self) -> str:
        return "conic"

    def answer(self, problem: NormalProblem, boxes: ConeBoxes) -> ProgramAnswer:
        """Clarabel's loads and approach for these boxes, not yet checked."""
        lifted = LiftedProgram.assemble(problem, boxes)
        raw = run_clarabel(
            lifted.apply(),
            self.name,
            self.tolerance,
            max_iter=self.max_iterations,
            direct_solve_method="faer" if len(boxes.members) >= SUPERNODAL else "qdldl",
        )
        answer = lifted.invert(raw)
        if raw.status not in STOPPED:
            raise SolverError(
                f"clarabel stopped after {raw.iterations} steps with {raw.status}",
                solver=self.name,
                advice="try more max_iterations, a larger tolerance, or Newton's method",
                iterate=boxes.to_candidates(problem, answer.loads),
            )
        return answer


@dataclass(frozen=True, eq=False)
class LiftedProgram:
    """The cone program on boxes of loads (docs/theory/exact-cones.md, "The lifted program").

    The variables are, in blocks of n, the loads p, then y2 to y5 and z. For each asperity these
    stand for powers of t = (p / B)^(1/3), where B ends the box: t^2 to t^5, and t^5 - t^6. The form
    with five cones, for larger boxes, also has y1 for t, before y2.
    """

    problem: NormalProblem
    boxes: ConeBoxes

    @classmethod
    def assemble(cls, problem: NormalProblem, boxes: ConeBoxes) -> LiftedProgram:
        n = len(boxes.members)
        checks.fits_in_memory("asperities of the cone program", n, 100, power=2)
        return cls(problem, boxes)

    def apply(self) -> ConeProgram:
        """The program; its rows are the prescribed total load, if any, p = B y3, and the cones."""
        from scipy import sparse  # 0.1 s to import: only when solving

        problem, boxes = self.problem, self.boxes
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
        level = problem.approach_bound if problem.approach is None else problem.approach
        linear = np.zeros(width)
        linear[p] = -(level + problem.offsets[members])
        linear[y5] = k_box * (3 / 5 - S / 3)
        linear[z] = k_box * S / 3

        link = np.concatenate((np.ones(n), -boxes.loads)), (np.tile(p, 2), np.append(p, y3))
        rows, right = [sparse.csc_matrix(link, shape=(n, width))], [np.zeros(n)]
        if problem.load is not None:
            total = np.ones(n), (np.zeros(n, dtype=int), p)
            rows.insert(0, sparse.csc_matrix(total, shape=(1, width)))
            right.insert(0, np.array([problem.load]))
        power = power_cones(list(lift), width)
        constraints = sparse.csc_matrix(sparse.vstack([*rows, power.matrix], format="csc"))
        constant = np.concatenate((*right, power.constant))
        return ConeProgram(quadratic, linear, constraints, constant, sum(map(len, right)))

    def invert(self, raw: RawAnswer) -> ProgramAnswer:
        """The loads and the approach, which follows from the multiplier of a prescribed load."""
        approach = self.problem.approach
        if approach is None:
            approach = self.problem.approach_bound - float(raw.multipliers[0])
        return ProgramAnswer(raw.x[: len(self.boxes.members)], approach, raw.iterations)
