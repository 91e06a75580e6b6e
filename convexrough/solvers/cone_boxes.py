"""What every solver of the cone program does around it: choose the boxes, judge what comes back.

The lifted program (docs/theory/exact-cones.md) is exact in boxes 0 <= P_i <= B_i whose convexity
numbers S_i = (3/2) shell_i B_i^(1/3) / k_i are at most 21/25 (four cones) or 1 (five). Boxes that
hold the a priori bounds are used where they are small enough. Elsewhere they are cut, and then
every cut box must turn out to be wide enough: else the five cones are tried, and then the scene is
refused ("Which box").
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT
from convexrough.errors import InputError, SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.newton import newton_step
from convexrough.solvers.programs import ProgramAnswer
from convexrough.solvers.solution import Solution
from convexrough.sphere import hertz

#: An asperity whose a priori bound is this small a part of the largest is left out of the program:
#: it gets no load, or what the Newton step finds. A heuristic, well below what a solver tells from
#: nothing; were it ever too large, the contact law would say so: it is checked for all asperities.
NEGLIGIBLE = 1e-12

#: Contact radii of a box over those of the a priori bound, where the convex range allows. On the
#: bound itself an asperity with no neighbours would sit just at t = 1, where the room it has left
#: and what presses it on are both nothing: interior points lose half their digits there. That it
#: is a tenth is a heuristic: any more room would do, at the price of a larger S.
WIDENED = 1.1

#: After a Newton step: the largest max |g| over |D0| + max |d_i| that is accepted. Where the first
#: step leaves more, a second is taken: few, weakly coupled asperities need it now and then.
ACCURATE = 1e-13

#: Without one: the largest max |P - P(D - A P)| over max P that is accepted, in square roots of
#: the tolerance. An energy within the tolerance fixes the loads to its root; the ten is a
#: heuristic, for the constant that this leaves open.
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
        described = ", ".join(f"{asperities[i]} ({ratios[i]:.4g})" for i in worst)
        more = f" and {len(ratios) - len(worst)} more" if len(ratios) > len(worst) else ""
        super().__init__(
            "asperities too dense for a convex program",
            found="contact radii pressed towards these multiples of pi/4 of the distance to the "
            f"nearest neighbour, by asperity: {described}{more}",
            expected=f"less than {limit:g}",
            where=solver,
        )


@dataclass(frozen=True, eq=False)
class ConeBoxes:
    """Which asperities are in a lifted program, in which boxes, tied by which cones.

    members : (m,) candidates in the program
    loads   : (m,) B_i, the loads at t = 1
    S       : (m,) convexity numbers of the boxes
    cut     : (m,) whether B_i is below the a priori bound
    five    : five-cone form;  limit : the largest S that the form can do
    """

    members: Indices
    loads: Array
    S: Array
    cut: NDArray[np.bool_]
    five: bool
    limit: float

    @classmethod
    def choose(cls, problem: NormalProblem, *, five: bool = False) -> ConeBoxes:
        """A little wider than the a priori bounds, and S_i not above what the form can do."""
        bounds = problem.bounds(problem.approach_bound)
        members = np.flatnonzero(bounds > NEGLIGIBLE * bounds.max())
        bounds, k = bounds[members], problem.coefficients[members]
        limit = FIVE_CONES_LIMIT if five else FOUR_CONES_LIMIT
        with np.errstate(divide="ignore"):  # a single asperity has no shell and no face
            faces = (2.0 / 3.0 * limit * k / problem.shells[members]) ** 3
        loads = np.minimum(WIDENED**3 * bounds, faces)
        S = problem.shells[members] / problem.stiffness(loads, members)
        return cls(members, loads, S, faces < bounds, five, limit)

    def energies(self, problem: NormalProblem) -> Array:
        """(m,) k B^(5/3): times (3/5) t^5 - (S/3) t^6 the one-asperity energy h."""
        energies: Array = problem.coefficients[self.members] * np.cbrt(self.loads) ** 5
        return energies

    def to_candidates(self, problem: NormalProblem, loads: Array) -> Array:
        """(n,) loads (m,) of the members as loads of all candidates, each within its box."""
        everywhere = np.zeros(len(problem))
        everywhere[self.members] = np.clip(loads, 0.0, self.loads)
        return everywhere

    def too_dense(self, problem: NormalProblem, solver: str, pressed: Array) -> TooDenseError:
        """The error that names the members which are `pressed` on, (m,), 0 where they are not."""
        which = np.flatnonzero(pressed)
        indices = problem.candidates[self.members[which]]
        return TooDenseError(solver, indices, pressed[which], self.limit)


@dataclass(frozen=True)
class ConeSolver(ABC):
    """Settings of a solver of the cone program, and what all of them do with its answer.

    newton_step : end with a step of Newton's method, which takes loads from some 1e-8 of the
        largest to rounding; a second one where the first leaves more than is accepted

    Accepted is an answer with  max |g_i| <= 1e-13 (|D0| + max |d_i|)  where touching, and overlaps
    no larger than that where open; without the Newton step, one with
    max |P - P(D - A P)| <= 10 sqrt(tolerance) max P.  Else SolverError is raised; TooDenseError
    where the boxes of the convex range do not hold the solution.
    """

    tolerance: float = 1e-9
    newton_step: bool = True

    def __post_init__(self) -> None:
        checks.positive("tolerance", self.tolerance)

    @property
    @abstractmethod
    def formulation(self) -> str:
        """The name, but for the Newton step."""

    @abstractmethod
    def answer(self, problem: NormalProblem, boxes: ConeBoxes) -> ProgramAnswer:
        """What the solver makes of the program in these boxes, not yet judged."""

    @property
    def name(self) -> str:
        return f"{self.formulation} + Newton step" if self.newton_step else self.formulation

    def solve(
        self,
        problem: NormalProblem,
        start: Array | None = None,
    ) -> Solution:
        """Loads of the candidates: with four cones, with five where a cut box stops an asperity.

        `start` is not used: cone solvers begin in the middle.
        """
        try:
            return solve_in(self, problem, ConeBoxes.choose(problem))
        except TooDenseError:
            return solve_in(self, problem, ConeBoxes.choose(problem, five=True))


def solve_in(solver: ConeSolver, problem: NormalProblem, boxes: ConeBoxes) -> Solution:
    """The answer of one form, if it is the solution of the contact law."""
    most = float(boxes.loads.sum())
    if problem.load is not None and most <= problem.load:  # no state in the boxes carries as much
        pressed = np.cbrt(problem.load / most) * np.where(boxes.cut, boxes.S, 0.0)
        raise boxes.too_dense(problem, solver.name, pressed)
    return judged(solver, problem, boxes, solver.answer(problem, boxes))


def judged(
    solver: ConeSolver, problem: NormalProblem, boxes: ConeBoxes, answer: ProgramAnswer
) -> Solution:
    """The answer as the solution of the contact law, if it is that; else the errors above.

    The sign of D - A P tells open asperities from lightly loaded ones ("What comes back").
    """
    if not (np.isfinite(answer.loads).all() and np.isfinite(answer.approach)):
        raise SolverError(
            "loads or an approach that are not numbers",
            solver=solver.name,
            advice="try a larger tolerance, or Newton's method",
        )
    loads, approach = boxes.to_candidates(problem, answer.loads), answer.approach
    indentation = approach + problem.offsets - problem.influence.apply(loads)  # D - A P
    if (pressed := _pressed_on(problem, boxes, loads, indentation)).any():
        raise boxes.too_dense(problem, solver.name, pressed)
    alone = hertz.load(indentation, problem.coefficients)  # P(D - A P)
    loads = np.where(indentation > 0, loads, 0.0)
    if solver.newton_step:
        step = _after_newton_step(solver, problem, loads, alone)
        theta = problem.shells / problem.stiffness(step.loads)
        if (theta >= FIVE_CONES_LIMIT).any():
            beyond = np.where(theta < 1, 0.0, theta)[boxes.members]
            raise boxes.too_dense(problem, solver.name, beyond)
        return replace(step, iterations=answer.iterations + step.iterations)
    missed = float(np.abs(loads - alone).max() / max(loads.max(), np.finfo(float).tiny))
    if not missed <= (accepted := ROOTS * np.sqrt(solver.tolerance)):
        raise SolverError(
            f"loads miss the contact law by {missed:.3g} of the largest, accepted {accepted:.3g}",
            solver=solver.name,
            advice="try newton_step=True or more iterations",
            iterate=loads,
        )
    return Solution.of(problem, loads, approach, answer.iterations, refine=False)


def _pressed_on(
    problem: NormalProblem, boxes: ConeBoxes, loads: Array, indentation: Array
) -> Array:
    """(m,) contact radius over (pi/2) s_i that an asperity stopped by its box wants; else 0.

    What presses an asperity on and the room it has left, as parts of what it has in its box, are
    complementary: one of the two is 0 at the solution, and the smaller one near it.
    """
    k = problem.coefficients[boxes.members]
    wanted = indentation[boxes.members] / hertz.indentation(boxes.loads, k)
    room = 1.0 - loads[boxes.members] / boxes.loads
    stopped = boxes.cut & (wanted - 1.0 > room)
    return np.where(stopped, boxes.S * np.sqrt(np.maximum(wanted, 1.0)), 0.0)


def _after_newton_step(
    solver: ConeSolver, problem: NormalProblem, loads: Array, alone: Array
) -> Solution:
    """One step of Newton's method, or two, from the loads or from what each would bear alone.

    An error e of the loads is h_i e_i in an asperity's own indentation and A e in D - A P: begin
    with the better of the two, so that the step starts close also where a load is almost 0.
    """
    light = problem.stiffness(loads) > problem.influence.apply(np.ones(len(problem)))
    loads = np.where(light, alone, loads)
    for steps in (1, 2):
        step = newton_step(problem, loads)
        missed = step.residual / (abs(step.approach) + float(np.abs(problem.offsets).max()))
        if missed <= ACCURATE:
            return replace(step, iterations=steps)
        loads = step.loads
    raise SolverError(
        f"residual of {missed:.3g} of the approach after two Newton steps, accepted {ACCURATE:g}",
        solver=solver.name,
        advice="try a smaller tolerance, or Newton's method",
        iterate=loads,
    )
