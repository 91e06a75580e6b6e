"""The contact law as one second-order cone program, written for reading, in CVXPY.

The same program as `conic.py` sends to Clarabel, in the names of docs/theory/exact-cones.md. CVXPY
checks it: it is convex by its rules (DCP), and stays compiled while the approach changes (DPP).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.convex.libraries import load_library
from convexrough.errors import InputError, SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.progress import Announce
from convexrough.solvers.cone_boxes import Answer, Boxes, accept, solve_in_boxes
from convexrough.solvers.solution import Solution


@dataclass(frozen=True)
class ConicCVXPY:
    """Settings of the cone program in CVXPY, with Clarabel behind it; as those of `Conic`."""

    tolerance: float = 1e-9
    newton_step: bool = True
    max_iterations: int = 200

    def __post_init__(self) -> None:
        checks.positive("tolerance", self.tolerance)

    @property
    def name(self) -> str:
        return "conic in CVXPY + Newton step" if self.newton_step else "conic in CVXPY"

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
        return self._model(problem, boxes).answer()

    def model(self, problem: NormalProblem, *, five: bool = False) -> LiftedModel:
        """The program itself, with four cones or five: to read, to change, to solve again."""
        return self._model(problem, Boxes.choose(problem, five=five))

    def _model(self, normal: NormalProblem, boxes: Boxes) -> LiftedModel:
        cp = load_library("cvxpy", self.name)

        def rotated(x: Any, y: Any, w: Any) -> Any:
            """x y >= w^2 with x, y >= 0."""
            return cp.SOC(x + y, cp.vstack([x - y, 2 * w]), axis=0)

        i, n = boxes.members, len(boxes.members)
        checks.fits_in_memory("asperities of the cone program in CVXPY", n, 400, power=2)
        B, S, e = boxes.loads, boxes.S, boxes.energies(normal)
        M = normal.influence.matrix[np.ix_(i, i)] + np.diag(normal.shells[i])
        d = normal.offsets[i]
        D0 = cp.Parameter(name="D0")
        D0.value = normal.ceiling if normal.approach is None else normal.approach

        p, y1, y2, y3, y4, y5, z = (
            cp.Variable(n, name=name) for name in ("p", "y1", "y2", "y3", "y4", "y5", "z")
        )
        energy = (
            (e * (3 / 5 - S / 3)) @ y5
            + (e * S / 3) @ z
            + cp.quad_form(p, cp.psd_wrap(M)) / 2  # its own check is known to fail on valid M
            - (D0 + d) @ p
        )
        link = p == cp.multiply(B, y3)
        cones = [
            rotated(y2 - y3, y4 - y5, y3 - y4),
            rotated(y3, y5, y4),
            rotated(y3 - y4, z, y4 - y5),
        ]
        if boxes.five:
            cones += [rotated(1 - y1, y2 - y3, y1 - y2), rotated(y1 - y2, y3 - y4, y2 - y3)]
        else:
            cones += [rotated(np.ones(n), y4, y2)]
        total = None if normal.load is None else cp.sum(p) == normal.load
        constraints = [link, *cones] if total is None else [link, *cones, total]
        program = cp.Problem(cp.Minimize(energy), constraints)
        return LiftedModel(self, normal, boxes, program, D0, p, link, total)


@dataclass(frozen=True, eq=False)
class LiftedModel:
    """A compiled program: CVXPY objects, in the problem's own units.

    program  : cvxpy.Problem
    D0       : cvxpy.Parameter; the approach, or the ceiling of it under load control
    p        : cvxpy.Variable, loads of `boxes.members`
    link     : p == B y3; its multiplier is D - M p, minus the gap where p = 0
    total    : sum p == load, or None; its multiplier is D0 less the approach
    """

    settings: ConicCVXPY
    normal: NormalProblem
    boxes: Boxes
    program: Any
    D0: Any
    p: Any
    link: Any
    total: Any

    def solve(self, approach: float | None = None) -> Solution:
        """Solve, at another approach if given (own units; no larger than the boxes are made for).

        Compiled once: from the second time on CVXPY only changes numbers.
        """
        normal = self.normal
        if approach is not None:
            if normal.approach is None or not approach <= normal.ceiling:
                expected = f"approach control, and not above {normal.ceiling:g}"
                raise InputError("approach", found=approach, expected=expected)
            self.D0.value = approach
            normal = replace(normal, approach=approach)
        return accept(self.settings, normal, self.boxes, self.answer())

    def answer(self) -> Answer:
        """Run Clarabel on the program as it stands."""
        settings, cp = self.settings, load_library("cvxpy", self.settings.name)
        tolerance = settings.tolerance
        try:
            with warnings.catch_warnings():  # whether it is accurate is judged by the contact law
                warnings.filterwarnings("ignore", message="Solution may be inaccurate")
                self.program.solve(
                    solver=cp.CLARABEL,
                    max_iter=settings.max_iterations,
                    tol_gap_abs=tolerance,
                    tol_gap_rel=tolerance,
                    tol_feas=tolerance,
                )
        except cp.error.SolverError as error:
            if cp.CLARABEL not in cp.installed_solvers():
                load_library("clarabel", settings.name)
            raise SolverError(f"{error}", solver=settings.name) from error
        if self.program.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
            raise SolverError(f"clarabel stopped with {self.program.status}", solver=settings.name)
        iterations = int(self.program.solver_stats.num_iters or 0)
        return Answer(self.loads, self.approach, iterations)

    @property
    def variables(self) -> dict[str, Any]:
        """p, y2 (y1 with five cones), ..., y5 and z by name."""
        return {variable.name(): variable for variable in self.program.variables()}

    @property
    def loads(self) -> Array:
        """(m,) of the last solution, as the solver left them."""
        return np.array(self.p.value)

    @property
    def approach(self) -> float:
        """The prescribed one, or the multiplier of the total load."""
        return float(self.D0.value - (0.0 if self.total is None else self.total.dual_value))

    @property
    def gaps(self) -> Array:
        """(m,) of the last solution, from the multiplier of the link."""
        gaps: Array = np.maximum(-self.link.dual_value, 0.0)
        return gaps
