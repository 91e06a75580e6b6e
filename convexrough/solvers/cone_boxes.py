"""What every conic solver does around its program: choose the boxes, and judge what comes back.

The lifted program (docs/theory/exact-cones.md) is exact in boxes 0 <= P_i <= B_i whose convexity
numbers S_i = (3/2) shell_i B_i^(1/3) / k_i are at most 21/25 (four cones) or 1 (five). Boxes that
hold the a priori bounds are used where they are small enough. Elsewhere they are cut, and then
every cut box must turn out to be wide enough: else the five cones are tried, and then the scene is
refused.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT
from convexrough.errors import InputError, SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.newton import newton_step
from convexrough.solvers.solution import Solution
from convexrough.sphere import hertz

#: An asperity whose a priori bound is this small a part of the largest is left out of the program:
#: it gets no load, or what the Newton step finds.
NEGLIGIBLE = 1e-12

#: Contact radii of a box over those of the a priori bound, where the convex range allows. On the
#: bound itself an asperity with no neighbours would sit just at t = 1, where the room it has left
#: and what presses it on are both nothing: interior points lose half their digits there.
WIDENED = 1.1

#: After a Newton step: the largest max |g| over |D0| + max |d_i| that is accepted. Where the first
#: step leaves more, a second is taken: few, weakly coupled asperities need it now and then.
ACCURATE = 1e-13

#: Without one: the largest max |P - P(D - A P)| over max P that is accepted, in square roots of
#: the tolerance. An energy within the tolerance fixes the loads to its root.
ROOTS = 10.0


class TooDenseError(InputError):
    """Asperities whose contacts leave the convex range, a_i < (pi/2) s_i.

    asperities : (m,) their indices in the scene
    ratios     : (m,) over (pi/2) s_i, the contact radius that each would reach with its
        neighbours kept in the convex range
    """

    def __init__(self, solver: str, asperities: Indices, ratios: Array, limit: float) -> None:
        self.asperities, self.ratios = asperities, ratios
        worst = np.argsort(-ratios, kind="stable")[:8]
        listed = ", ".join(f"{asperities[i]} ({ratios[i]:.4g})" for i in worst)
        more = f" and {len(ratios) - len(worst)} more" if len(ratios) > len(worst) else ""
        super().__init__(
            "asperities too dense for a convex program",
            found="contact radii pressed towards these multiples of pi/4 of the distance to the "
            f"nearest neighbour, by asperity: {listed}{more}",
            expected=f"less than {limit:g}",
            where=solver,
        )


@dataclass(frozen=True, eq=False)
class Boxes:
    """Who is in a lifted program, in which boxes, tied by which cones.

    members : (m,) candidates in the program
    loads   : (m,) B_i, the loads at t = 1
    S       : (m,) convexity numbers of the boxes
    cut     : (m,) whether B_i is below the a priori bound
    five    : five-cone form
    """

    members: Indices
    loads: Array
    S: Array
    cut: NDArray[np.bool_]
    five: bool

    @classmethod
    def choose(cls, problem: NormalProblem, *, five: bool = False) -> Boxes:
        """A little wider than the a priori bounds, and S_i not above what the form can do."""
        bounds = problem.bounds(problem.ceiling)
        members = np.flatnonzero(bounds > NEGLIGIBLE * bounds.max())
        bounds, k = bounds[members], problem.coefficients[members]
        limit = FIVE_CONES_LIMIT if five else FOUR_CONES_LIMIT
        with np.errstate(divide="ignore"):  # a single asperity has no shell and no face
            faces = (2.0 / 3.0 * limit * k / problem.shells[members]) ** 3
        loads = np.minimum(WIDENED**3 * bounds, faces)
        S = problem.shells[members] / problem.stiffness(loads, members)
        return cls(members, loads, S, faces < bounds, five)

    @property
    def limit(self) -> float:
        """The largest S that the form can do."""
        return FIVE_CONES_LIMIT if self.five else FOUR_CONES_LIMIT

    def energies(self, problem: NormalProblem) -> Array:
        """(m,) k B^(5/3): times (3/5) t^5 - (S/3) t^6 the one-asperity energy h."""
        energies: Array = problem.coefficients[self.members] * np.cbrt(self.loads) ** 5
        return energies


class Answer(NamedTuple):
    """What a conic solver makes of one lifted program."""

    loads: Array  # (m,) of the members
    approach: float  # the multiplier of the total, under load control
    iterations: int


class ConeSolver(Protocol):
    """Settings that `solve_in_boxes` needs, and the one thing that solvers do differently."""

    @property
    def name(self) -> str: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def newton_step(self) -> bool: ...
    def answer(self, problem: NormalProblem, boxes: Boxes) -> Answer: ...


def solve_in_boxes(solver: ConeSolver, problem: NormalProblem) -> Solution:
    """Four cones, and five where a cut box stops an asperity.

    Raises TooDenseError where an asperity is stopped by the largest convex box, and SolverError
    where the contact law is missed.
    """
    try:
        return solve_in(solver, problem, Boxes.choose(problem))
    except TooDenseError:
        return solve_in(solver, problem, Boxes.choose(problem, five=True))


def solve_in(solver: ConeSolver, problem: NormalProblem, boxes: Boxes) -> Solution:
    """The answer of one form, if it is the solution of the contact law."""
    most = float(boxes.loads.sum())
    if problem.load is not None and most <= problem.load:  # no state in the boxes carries as much
        pressed = np.cbrt(problem.load / most) * np.where(boxes.cut, boxes.S, 0.0)
        raise _too_dense(solver, problem, boxes, pressed)
    return accept(solver, problem, boxes, solver.answer(problem, boxes))


def accept(solver: ConeSolver, problem: NormalProblem, boxes: Boxes, answer: Answer) -> Solution:
    """The answer as the solution of the contact law, if it is that; else the errors above."""
    if not np.isfinite(answer.loads).all():
        raise SolverError("loads that are not numbers", solver=solver.name)
    loads = np.zeros(len(problem))
    loads[boxes.members] = np.clip(answer.loads, 0.0, boxes.loads)
    pressed = _pressed_on(problem, boxes, loads, answer.approach)
    if pressed.any():
        raise _too_dense(solver, problem, boxes, pressed)
    return _judged(solver, problem, boxes, loads, answer)


def _too_dense(
    solver: ConeSolver, problem: NormalProblem, boxes: Boxes, pressed: Array
) -> TooDenseError:
    which = np.flatnonzero(pressed)
    indices = problem.candidates[boxes.members[which]]
    return TooDenseError(solver.name, indices, pressed[which], boxes.limit)


def _pressed_on(problem: NormalProblem, boxes: Boxes, loads: Array, approach: float) -> Array:
    """(m,) contact radius over (pi/2) s_i that an asperity stopped by its box wants; else 0.

    What presses an asperity on and the room it has left, as parts of what it has in its box, are
    complementary: one of the two is 0 at the solution, and the smaller one near it.
    """
    indentation = approach + problem.offsets - problem.influence.apply(loads)  # D - A P
    k = problem.coefficients[boxes.members]
    wanted = indentation[boxes.members] / hertz.indentation(boxes.loads, k)
    room = 1.0 - loads[boxes.members] / boxes.loads
    stopped = boxes.cut & (wanted - 1.0 > room)
    return np.where(stopped, boxes.S * np.sqrt(np.maximum(wanted, 1.0)), 0.0)


def _judged(
    solver: ConeSolver, problem: NormalProblem, boxes: Boxes, loads: Array, answer: Answer
) -> Solution:
    """Tell open asperities from lightly loaded ones, take the Newton step, check the law."""
    indentation = answer.approach + problem.offsets - problem.influence.apply(loads)
    alone = hertz.load(indentation, problem.coefficients)  # P(D - A P)
    loads = np.where(indentation > 0, loads, 0.0)
    if not solver.newton_step:
        missed = float(np.abs(loads - alone).max() / max(loads.max(), np.finfo(float).tiny))
        if not missed <= ROOTS * np.sqrt(solver.tolerance):
            raise SolverError(
                f"loads miss the contact law by {missed:.3g} of the largest", solver=solver.name
            )
        residual = problem.residual(loads, answer.approach)
        return Solution(loads, answer.approach, answer.iterations, residual)

    # An error e of the loads is h_i e_i in an asperity's own indentation and A e in D - A P: begin
    # with the better of the two, so that the step starts close also where a load is almost 0.
    light = problem.stiffness(loads) > problem.influence.apply(np.ones(len(problem)))
    step, iterations = newton_step(problem, np.where(light, alone, loads)), answer.iterations + 1
    if not _missed(problem, step) <= ACCURATE:
        step, iterations = newton_step(problem, step.loads), iterations + 1
    if not (missed := _missed(problem, step)) <= ACCURATE:
        raise SolverError(
            f"residual of {missed:.3g} of the approach after two Newton steps", solver=solver.name
        )
    theta = problem.shells / problem.stiffness(step.loads)
    if (theta >= FIVE_CONES_LIMIT).any():
        raise _too_dense(solver, problem, boxes, np.where(theta < 1, 0.0, theta)[boxes.members])
    return replace(step, iterations=iterations)


def _missed(problem: NormalProblem, solution: Solution) -> float:
    """Its residual over |D0| + max |d_i|."""
    scale = abs(solution.approach) + float(np.abs(problem.offsets).max())
    return solution.residual / scale
