"""Newton's method for the loads under normal pressure: docs/theory/newton.md.

The unknown delta is the indentation of a touching asperity, and minus the gap of an open one. With
P_i = (max(delta_i, 0) / k_i)^(3/2) the contact law is  F = delta + A P - D = 0,  with k, A and
D = D0 + d of `NormalProblem`. F is called the defect. For many asperities the iteration first
includes only those near the contact, and adds others until all asperities that it leaves out are
found to be open.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.convex import newton
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.normal.law import Pressed, on_hertz_pressure
from convexrough.normal.problem import NormalProblem
from convexrough.normal.refine import Trial, refined, refined_loads, trial_of
from convexrough.roundoff import SAFETY
from convexrough.solvers.mean_field import mean_field_indentation
from convexrough.solvers.solution import Solution
from convexrough.sphere import hertz

#: Newton's method may end if the norm of the defect is at most LINEAR times the square root of that
#: of the indentations: one correction then leaves the rounding error of a sharp product. Heuristic.
LINEAR = 3e-10

#: If at most this many asperities could touch, the iteration includes all of them, and the start
#: uses a product with A. Affects speed only.
ALL_ITERATED = 1000

#: Largest residual of a solution, divided by |D0| + max |d_i|, unless `tolerance` is larger.
ACCURATE = 1e-12

#: Rounding errors are estimated where the residual is at most this part of |D0| + max |d_i|; larger
#: residuals are far above them. Affects speed only.
NOISY = 1e-6

#: Asperities are near the contact if their gap at the start is at most MARGIN times the largest D_i
#: plus the standard deviation of heights about their means over RINGS rings about the axis, of a
#: SAMPLE if there are more. UNEVEN replaces MARGIN for bodies that are not spheres, which have a
#: poor start. Affects speed only.
MARGIN, UNEVEN, RINGS, SAMPLE = 0.01, 0.3, 32, 50_000

#: If at most this many asperities could touch, those near the contact are refined alone. This saves
#: time, but takes memory for a second problem.
MOST_APART = 2**21


@dataclass(frozen=True)
class Pressing:
    """The contact law of the asperities of an iteration, in the form of `convex.newton`."""

    problem: NormalProblem
    farthest: float  # max |d_i| over all asperities that could touch

    solver: ClassVar[str] = "newton"
    unit: ClassVar[str] = "the approach"

    def evaluate(self, unknown: Array) -> newton.Iterate | None:
        """The state by `Pressed.at`; None under a prescribed load if no indentation is positive."""
        problem, total = self.problem, 0.0
        if problem.approach is not None:
            unknown = np.minimum(unknown, problem.approach + problem.offsets)
        elif not unknown.max() > 0:
            return None
        at = Pressed.at(problem, unknown)
        if problem.load is not None:  # Phi has D0 = 0 under load control
            total = at.approach * problem.load
        energy = float(at.loads @ (at.gap - 0.4 * at.own - 0.5 * at.displacement)) + total
        residual, scale = float(np.abs(at.defect).max()), float(abs(at.approach)) + self.farthest
        noise = 0.0
        if residual <= NOISY * scale:
            noise = problem.influence.rounding(at.loads).negligible(at.displacement)
        return newton.Iterate(
            unknown=at.unknown,
            forces=at.loads,
            defect=at.defect,
            gradient=at.gap,
            energy=energy,
            rounding=SAFETY * float(at.loads.sum()) * scale,
            residual=residual,
            scale=scale,
            noise=noise,
            at=at,
        )

    def direction(self, state: newton.Iterate, left: float) -> Array:
        problem, root = self.problem, np.sqrt(state.at.slopes)
        matrices = problem.influence, problem.shells
        return correct(*matrices, root, state.defect, balanced=problem.by_load, tolerance=left)

    def advice(self, state: newton.Iterate) -> str:
        """What to try, which depends on the convexity number where the method stopped."""
        loads = state.forces
        if not loads.any():  # take those of single asperities
            loads = hertz.load(self.problem.offsets + state.at.approach, self.problem.coefficients)
        number = self.problem.convexity_number(loads)
        if number < 1:
            return (
                f"the energy is convex (convexity number {number:.3g}): allow more steps, or "
                "start from loads of a neighbouring problem"
            )
        return (
            f"contacts are so crowded that the energy may not be convex (convexity number "
            f"{number:.3g}, convex below 1): use a smaller approach or load, sharper tips, or "
            "asperities further apart"
        )


@dataclass(frozen=True)
class Newton:
    """A solver with Newton's method (docs/theory/newton.md).

    tolerance : stop at  max_i |delta_i + (A P)_i - D_i| <= tolerance (|D0| + max_i |d_i|),  with
        the symbols of docs/theory/newton.md;  0 for the accuracy of float64
    max_iterations : largest number of steps; SolverError is raised if they are not enough

    The left side of the inequality for `tolerance` is the residual. Once it is below 1e-12 (|D0| +
    max_i |d_i|), the method also stops if it is small compared with the rounding errors of A P, or
    if a step does not halve it.

    >>> contact = cr.press(scene, approach=5e-5, solver=cr.solvers.Newton(tolerance=1e-6))
    >>> contact.iterations, contact.certificate.all_proved
    (2, True)
    """

    tolerance: float = 0.0
    max_iterations: int = 100
    name: str = field(default="newton", init=False)

    def __post_init__(self) -> None:
        checks.non_negative("tolerance", self.tolerance)
        checks.whole("max_iterations", self.max_iterations)

    def solve(self, problem: NormalProblem, start: Array | None = None) -> Solution:
        """The solution in scaled units; `start` (n,) are initial loads >= 0, or None.

        Raises SolverError after `max_iterations`, and if no step lowers the energy.
        """
        indentation = _start(problem, start)
        near, iterations = np.arange(len(problem)), 0
        refines = problem.influence.cheap_sums and not self.tolerance > 0
        if len(problem) > ALL_ITERATED and start is None:
            highest = float(np.maximum(problem.approach_bound + problem.offsets, 0.0).max())
            share = UNEVEN if isinstance(problem.scene.sphere_radius, tuple) else MARGIN
            margin = share * highest + _roughness(problem) / problem.units.length
            near = np.flatnonzero(indentation > -margin)
        while True:
            begin = indentation[near]
            del indentation  # saves memory
            state, steps, trial = self._iterate(problem, near, begin, refines)
            iterations += steps
            loads = among_zeros(state.forces, near, len(problem))
            unknown, approach = state.unknown, float(state.at.approach)
            del state  # saves memory
            if refines and trial is None:
                trial = trial_of(problem, loads, roughly=True)
            if len(near) == len(problem):
                break
            # The iteration left out some asperities: compute the gaps of all.
            gap = trial.gap.value if trial else problem.gap(loads, problem.apply(loads), approach)
            touched = gap < 0
            touched[near] = False
            if not touched.any():
                break
            indentation = -gap
            indentation[near] = unknown
            touched[near] = True  # `near` only grows, so the loop ends
            near = np.flatnonzero(touched | (indentation > -margin))
        if trial is not None:
            return Solution.of_trial(refined(problem, trial), iterations)
        return Solution.of(problem, loads, approach, iterations, refine=self.tolerance <= 0)

    def _iterate(
        self, problem: NormalProblem, near: Indices, indentation: Array, refines: bool
    ) -> tuple[newton.Iterate, int, Trial | None]:
        """The solution in which only the asperities `near` carry loads, the number of steps, and
        the trial of all asperities if only those near are refined, else None.

        refines : True if the solution is refined at last
        """
        early = refines and not problem.precise  # refinement makes the last linear correction
        if apart := early and len(near) < len(problem) <= MOST_APART:
            problem.exact  # noqa: B018  `part` takes its own from these
        part = problem if len(near) == len(problem) else problem.restricted(near)
        law, left = Pressing(part, float(np.abs(problem.offsets).max())), 0.0
        if early:
            left = LINEAR * math.sqrt(np.linalg.norm(np.maximum(indentation, 0.0)))
        try:
            state = law.evaluate(indentation)
            assert state is not None  # an asperity is loaded at the start
            state, steps = newton.solve(
                law, state, ACCURATE, self.tolerance, self.max_iterations, left
            )
        except SolverError as error:
            if error.iterate is not None:
                error.iterate = among_zeros(error.iterate, near, len(problem))
            raise
        trial = refined_loads(part, state.forces).among(problem, near) if apart else None
        return state, steps, trial


def _roughness(problem: NormalProblem) -> float:
    """[length] standard deviation of heights about their means over rings about the axis."""
    some = problem.candidates[:: max(1, len(problem) // SAMPLE)]
    heights = problem.scene.asperities.heights[some]
    distances = np.hypot(*problem.scene.asperities.positions.take(some, axis=0).T)
    ring = np.minimum(RINGS * (distances / distances.max()) ** 2, RINGS - 1).astype(np.intp)
    means = np.bincount(ring, heights) / np.maximum(np.bincount(ring), 1)
    return float((heights - means[ring]).std())


def _start(problem: NormalProblem, loads: Array | None) -> Array:
    """(n,) initial indentations: by Hertz's law where `loads` are positive, and -1 elsewhere.

    They are estimated if `loads` is None, or if a load is prescribed and all `loads` are 0.
    """
    if loads is None or (problem.by_load and not loads.any()):
        few = len(problem) <= ALL_ITERATED
        return on_hertz_pressure(problem) if few else mean_field_indentation(problem)
    if problem.load is not None:
        loads = loads / loads.max() * problem.load  # so that sums of tiny loads do not underflow
    return np.where(loads > 0, hertz.indentation(loads, problem.coefficients), -1.0)
