"""The contact law as one second-order cone program, and its solution by Clarabel.

docs/theory/exact-cones.md states the program, and proves that its solution satisfies the contact
law. The sigma_i of that page are `NormalProblem.shells`. If the load is prescribed, an upper bound
replaces the approach. "Choice of the box" there explains the boxes 0 <= P_i <= B_i, when a box is
cut, and when five cones per asperity replace four, or the scene is refused.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT, power_cones
from convexrough.errors import InputError, SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.programs import ConeProgram, ProgramAnswer, RawAnswer, run_clarabel
from convexrough.solvers.solution import Solution
from convexrough.sphere import hertz

#: Asperities whose a priori bound on the load is below this part of the largest such bound are left
#: out of the program. The Newton step can still give them a load. A heuristic: loads are checked.
NEGLIGIBLE = 1e-12

#: Contact radius at the upper end of a box, divided by that at the a priori bound on the load.
WIDENED = 1.1

#: Without a Newton step, max |P - P(D - A P)| / max P may be at most ROOTS times the square root of
#: the tolerance, because an error of the energy causes errors of loads in proportion to its root.
#: Here P(delta) is Hertz's load at the indentation delta. A heuristic.
ROOTS = 10.0

#: Number of asperities from which Clarabel's supernodal factorisation is faster.
SUPERNODAL = 300

#: Statuses of Clarabel after which its solution is checked against the contact law. With tight
#: tolerances Clarabel often reports AlmostSolved at a correct solution.
STOPPED = ("Solved", "AlmostSolved")


class TooDenseError(InputError):
    """Some asperities would have contact radii that are too large for a convex program.

    asperities : (m,) the indices of these asperities in the scene
    ratios     : (m,) for each, an estimate of the contact radius that it would have if its box did
        not limit its load, divided by (pi/2) s_i, where s_i is half the distance to the nearest
        neighbour. Ratios must be below 1 for the form with five cones, 0.99 for bristles

    >>> blunt = cr.Asperities(scene.asperities.positions, tip_radii=0.6)
    >>> crowded = cr.Scene(1.0, blunt, cr.Material(1.0, 0.3), geometry="summit")
    >>> cr.press(crowded, approach=5e-5, solver="conic")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    convexrough.solvers.conic.TooDenseError: ... found 1, by index ... less than 1; Newton...
    """

    def __init__(self, solver: str, asperities: Indices, ratios: Array, limit: float) -> None:
        self.asperities, self.ratios = asperities, ratios
        worst = np.argsort(-ratios, kind="stable")[:8]
        described = ", ".join(f"{asperities[i]} ({ratios[i]:.4g})" for i in worst)
        more = f" and {len(ratios) - len(worst)} more" if len(ratios) > len(worst) else ""
        super().__init__(
            "asperities too dense for a convex program",
            found=f"{len(ratios)}, by index with an estimate of the contact radius divided by pi/4 "
            f"times the distance to the nearest neighbour: {described}{more}",
            expected=f"less than {limit:g}; Newton's method has no such limit",
            where=solver,
        )


@dataclass(frozen=True, eq=False)
class ConeBoxes:
    """The asperities of a cone program, their boxes, and the form of their cones."""

    members: Indices  # (m,) the asperities in the program, as indices into `problem.candidates`
    loads: Array  # (m,) B_i, upper ends of the boxes
    S: Array  # (m,) the numbers S_i of the boxes
    cut: NDArray[np.bool_]  # (m,) True where B_i is below the bound of `NormalProblem.bounds`
    five: bool  # True for the form with five cones per asperity, False for four
    limit: float  # largest S for which this form is exact

    @classmethod
    def choose(cls, problem: NormalProblem, *, five: bool = False) -> ConeBoxes:
        """Boxes that end above the a priori bounds, or lower where S_i would exceed `limit`."""
        bounds = problem.bounds(problem.approach_bound)
        members = np.flatnonzero(bounds > NEGLIGIBLE * bounds.max())
        bounds, k = bounds[members], problem.coefficients[members]
        limit = FIVE_CONES_LIMIT if five else FOUR_CONES_LIMIT
        with np.errstate(divide="ignore"):  # a single asperity has no shell and no face
            faces = (2.0 / 3.0 * limit * k / problem.shells[members]) ** 3
        loads = np.minimum(WIDENED**3 * bounds, faces)
        S = problem.shells[members] / problem.compliance(loads, members)
        return cls(members, loads, S, faces < bounds, five, limit)

    def energies(self, problem: NormalProblem) -> Array:
        """(m,) k B^(5/3). The local energy at P = B t^3 is k B^(5/3) ((3/5) t^5 - (S/3) t^6)."""
        return np.asarray(problem.coefficients[self.members] * np.cbrt(self.loads) ** 5)

    def to_candidates(self, problem: NormalProblem, loads: Array) -> Array:
        """(n,) loads of all candidates, from loads (m,) of the members; limited to the boxes."""
        return among_zeros(np.clip(loads, 0.0, self.loads), self.members, len(problem))

    def too_dense(self, problem: NormalProblem, solver: str, pressed: Array) -> TooDenseError:
        """The error for the members with `pressed` > 0, which are its `ratios`."""
        which = np.flatnonzero(pressed)
        indices = problem.candidates[self.members[which]]
        return TooDenseError(solver, indices, pressed[which], self.limit)


@dataclass(frozen=True)
class ConeSolver(ABC):
    """Base class of the solvers of the cone program. The class checks their answers.

    tolerance   : tolerance of the cone solver, in scaled units
    newton_step : True to end with steps of Newton's method, which reduce errors of about 1e-8 of
        the largest load to rounding errors

    SolverError is raised if loads violate the contact law: with `newton_step` by more than
    `solution.ACCURATE`, without it by more than `ROOTS` allows. TooDenseError is raised if the cut
    boxes do not contain the solution.
    """

    tolerance: float = 1e-9
    newton_step: bool = True

    def __post_init__(self) -> None:
        checks.positive("tolerance", self.tolerance)

    @property
    @abstractmethod
    def formulation(self) -> str:
        """The name of the solver, without the ending " + Newton step"."""

    @abstractmethod
    def answer(self, problem: NormalProblem, boxes: ConeBoxes) -> ProgramAnswer:
        """The loads and the approach that the solver returns for these boxes, not yet checked."""

    @property
    def name(self) -> str:
        """The name in results and messages."""
        return f"{self.formulation} + Newton step" if self.newton_step else self.formulation

    def solve(self, problem: NormalProblem, start: Array | None = None) -> Solution:
        """The solution in scaled units; `start` is not used. Raises SolverError and TooDenseError
        if a check fails."""
        try:
            return solve_in(self, problem, ConeBoxes.choose(problem))
        except TooDenseError:
            return solve_in(self, problem, ConeBoxes.choose(problem, five=True))


def solve_in(solver: ConeSolver, problem: NormalProblem, boxes: ConeBoxes) -> Solution:
    """The solution of the cone program on these boxes, after all checks."""
    most = float(boxes.loads.sum())
    if problem.load is not None and most <= problem.load:  # the boxes end below the load
        pressed = np.cbrt(problem.load / most) * np.where(boxes.cut, boxes.S, 0.0)
        raise boxes.too_dense(problem, solver.name, pressed)
    return judged(solver, problem, boxes, solver.answer(problem, boxes))


def judged(
    solver: ConeSolver, problem: NormalProblem, boxes: ConeBoxes, answer: ProgramAnswer
) -> Solution:
    """The solver's answer as a `Solution`, after the checks that `ConeSolver` describes.

    An asperity counts as open where D - A P <= 0, even if its computed load is not exactly 0.
    """
    if not (np.isfinite(answer.loads).all() and np.isfinite(answer.approach)):
        raise SolverError(
            "loads or an approach that are not finite numbers",
            solver=solver.name,
            advice="try a larger tolerance, or Newton's method",
        )
    loads, approach = boxes.to_candidates(problem, answer.loads), answer.approach
    indentation = approach + problem.offsets - problem.influence.apply(loads)  # D - A P
    wanted = indentation[boxes.members] / hertz.indentation(
        boxes.loads, problem.coefficients[boxes.members]
    )
    limited = boxes.cut & (wanted - 1.0 > 1.0 - loads[boxes.members] / boxes.loads)
    if limited.any():
        pressed = np.where(limited, boxes.S * np.sqrt(np.maximum(wanted, 1.0)), 0.0)
        raise boxes.too_dense(problem, solver.name, pressed)
    alone = hertz.load(indentation, problem.coefficients)  # P(D - A P)
    loads = np.where(indentation > 0, loads, 0.0)
    if solver.newton_step:
        step = Solution.refined(problem, loads, answer.iterations, solver.name)
        theta = problem.shells / problem.compliance(step.loads)
        if (theta >= FIVE_CONES_LIMIT).any():
            beyond = np.where(theta < 1, 0.0, theta)[boxes.members]
            raise boxes.too_dense(problem, solver.name, beyond)
        return step
    missed = float(np.abs(loads - alone).max() / max(loads.max(), np.finfo(float).tiny))
    if not missed <= (accepted := ROOTS * np.sqrt(solver.tolerance)):
        raise SolverError(
            f"loads err in the contact law by {missed:.3g} of the largest, accepted {accepted:.3g}",
            solver=solver.name,
            advice="try newton_step=True or more iterations",
            iterate=loads,
        )
    return Solution.of(problem, loads, approach, answer.iterations)


@dataclass(frozen=True)
class Conic(ConeSolver):
    """A solver of the cone program (docs/theory/exact-cones.md) with Clarabel, an interior-point
    method.

    tolerance      : tolerance of the duality gap and of feasibility, in scaled units
    newton_step    : True to end with Newton steps
    max_iterations : largest number of iterations

    >>> contact = cr.press(scene, approach=5e-5, solver=cr.solvers.Conic())
    >>> contact.solver, contact.certificate.all_proved
    ('conic + Newton step', True)
    """

    max_iterations: int = 200

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.whole("max_iterations", self.max_iterations)

    formulation = "conic"

    def answer(self, problem: NormalProblem, boxes: ConeBoxes) -> ProgramAnswer:
        """Clarabel's loads and approach for these boxes, not yet checked."""
        raw = run_clarabel(
            lifted_program(problem, boxes),
            self.name,
            self.tolerance,
            max_iter=self.max_iterations,
            direct_solve_method="faer" if len(boxes.members) >= SUPERNODAL else "qdldl",
        )
        answer = answer_of(problem, boxes, raw)
        if raw.status not in STOPPED:
            raise SolverError(
                f"clarabel stopped after {raw.iterations} steps with {raw.status}",
                solver=self.name,
                advice="try more max_iterations, a larger tolerance, or Newton's method",
                iterate=boxes.to_candidates(problem, answer.loads),
            )
        return answer


def lifted_program(problem: NormalProblem, boxes: ConeBoxes) -> ConeProgram:
    """The cone program on boxes of loads (docs/theory/exact-cones.md, "The lifted program").

    The variables are, in blocks of n, the loads p, then y2 to y5 for the powers t^2 to t^5 of
    t = (p / B)^(1/3), with the upper ends B of the boxes, and z for t^5 - t^6. The form with five
    cones also has y1 for t, before y2. There are rows for the prescribed total, if any, for
    p = B y3, and for cones.
    """
    from scipy import sparse  # 0.1 s to import: only when solving

    members, n, lifts = boxes.members, len(boxes.members), 6 if boxes.five else 5
    checks.fits_in_memory("asperities of the cone program", n, 100, power=2)
    k_box, S = boxes.energies(problem), boxes.S
    M = problem.influence.matrix[np.ix_(members, members)]
    np.fill_diagonal(M, problem.shells[members])
    level = problem.approach_bound if problem.approach is None else problem.approach
    linear = np.zeros((1 + lifts, n))
    linear[0] = -(level + problem.offsets[members])
    linear[-2] = k_box * (3 / 5 - S / 3)  # y5
    linear[-1] = k_box * S / 3  # z

    y3 = np.eye(1, lifts, lifts - 4)
    cones, constant = power_cones(n, five=boxes.five)
    boxed = sparse.kron(y3, sparse.diags_array(boxes.loads))  # B y3
    rows: list[list[Any]] = [[sparse.eye_array(n), -boxed]]
    right = np.zeros(n)
    if problem.load is not None:
        rows.insert(0, [np.ones((1, n)), None])
        right = np.append(problem.load, right)
    upper, empty = sparse.csc_array(np.triu(M)), sparse.csc_array((lifts * n, lifts * n))
    return ConeProgram(
        quadratic=sparse.csc_array(sparse.block_diag((upper, empty))),
        linear=linear.ravel(),
        constraints=sparse.csc_array(sparse.block_array([*rows, [None, cones]])),
        constant=np.append(right, constant),
        equalities=len(right),
    )


def answer_of(problem: NormalProblem, boxes: ConeBoxes, raw: RawAnswer) -> ProgramAnswer:
    """The loads, and the approach: prescribed, or from the multiplier of the total load."""
    approach = problem.approach
    if approach is None:
        approach = problem.approach_bound - float(raw.multipliers[0])
    return ProgramAnswer(raw.x[: len(boxes.members)], approach, raw.iterations)
