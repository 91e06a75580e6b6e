"""The interface of solvers, and the solution that they return."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from convexrough.arrays import Array
from convexrough.errors import SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.normal.refine import Trial, refined_loads
from convexrough.record import Record

#: Largest accepted residual of the contact law (|gap| at loaded asperities, -gap at others) after
#: the Newton steps that follow a program, divided by |D0| + max |d_i|.
ACCURATE = 1e-13

#: These steps may change a load by CORRECTED times the largest load, plus TINY in scaled units, as
#: some solvers find loads to an absolute tolerance only.
CORRECTED, TINY = 0.05, 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Record):
    """A solution in scaled units: the approach, and the loads of all asperities that could touch.

    approach : used by the solver only; results contain the approach that follows from the loads
    iterations : number of steps of the solver
    residual : residual of the contact law for `loads`, as in `NormalProblem.residual`; if `trial`
        is given, an upper bound on the residual of the loads in `trial`
    refine   : True if Newton steps may correct the loads; False to certify and report them
        unchanged
    trial    : the loads to more digits, if the solver has computed such loads; else None

    >>> from convexrough.normal.problem import NormalProblem
    >>> problem = NormalProblem.assemble(scene, approach=5e-5)
    >>> solution = cr.solvers.Newton().solve(problem)
    >>> again = cr.solvers.Solution.of(problem, solution.loads, solution.approach, 0)
    >>> again.residual < 1e-14
    True
    """

    loads: Array
    approach: float
    iterations: int
    residual: float
    refine: bool = False
    trial: Trial | None = None

    @classmethod
    def of(
        cls,
        problem: NormalProblem,
        loads: ArrayLike,
        approach: float,
        iterations: int,
        *,
        refine: bool = False,
    ) -> Solution:
        """A solution with the residual computed from the loads; inf if it is not a number.

        Raises SolverError unless there is a real number for each asperity of the problem.
        """
        if np.ma.is_masked(loads):
            raise SolverError("loads with masked entries, expected real numbers")
        loads = np.asarray(loads)
        if loads.shape != (len(problem),):
            expected = f"({len(problem)},): one for each asperity that could touch"
            raise SolverError(f"loads of shape {loads.shape}, expected {expected}")
        if loads.dtype.kind not in "iuf":
            raise SolverError(f"loads of type {loads.dtype}, expected real numbers")
        known = np.isfinite(loads).all()
        residual = problem.residual(loads, approach) if known else np.inf
        residual = np.inf if np.isnan(residual) else residual
        return cls(loads, approach, iterations, residual, refine)

    @classmethod
    def of_trial(cls, state: Trial, iterations: int) -> Solution:
        """The solution with the loads of a refined trial."""
        approach, residual = float(state.approach.value), float(state.excess.max())
        return cls(state.loads.high, approach, iterations, residual, True, state.frozen())

    @classmethod
    def refined(
        cls, problem: NormalProblem, loads: Array, iterations: int, solver: str
    ) -> Solution:
        """The solution by Newton steps from the loads (n,) >= 0 of another solver. Raises
        SolverError if they leave a residual above `ACCURATE`, or change the loads by more than
        `CORRECTED` allows: else any answer would be right.
        """
        start = loads if loads.any() else np.ones(len(loads))
        step = cls.of_trial(refined_loads(problem, start), iterations)
        missed = step.residual / (abs(step.approach) + float(np.abs(problem.offsets).max()))
        changed, largest = float(np.abs(step.loads - loads).max()), float(step.loads.max())
        if not missed <= ACCURATE:
            what = f"residual of {missed:.3g} of the approach after Newton steps"
            what, iterate = f"{what}, at most {ACCURATE:g} accepted", step.loads
        elif not changed <= CORRECTED * largest + TINY:
            what = f"Newton steps changed loads of up to {largest:.3g} by {changed:.3g}"
            what, iterate = f"{what}, at most {CORRECTED:g} of the largest accepted", loads
        else:
            return step
        advice = "try more iterations, a smaller tolerance, or Newton's method"
        raise SolverError(what, solver=solver, advice=advice, iterate=iterate)


class Solver(Protocol):
    """The interface of solvers. Solvers are immutable objects that contain their settings.

    A solver that does not reach its tolerance raises SolverError.
    """

    @property
    def name(self) -> str:
        """The name in results and messages."""

    def solve(self, problem: NormalProblem, start: Array | None = None) -> Solution:
        """The solution of `problem`, in its scaled units (docs/how-to/solvers.md).

        start : (n,) initial loads of the asperities of `problem`, not negative; None: no estimate
        """
