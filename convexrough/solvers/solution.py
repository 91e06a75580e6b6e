"""What every solver takes and returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from convexrough.arrays import Array
from convexrough.normal.problem import NormalProblem
from convexrough.normal.refine import Trial
from convexrough.record import Record


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Record):
    """Loads of the candidates and the approach, in the problem's units.

    residual : how far the contact law is from holding, as in `problem.residual`: with a trial, a
        bound at the loads of all its digits, rounding counted; else recomputed in float64
    refine   : whether the loads may be corrected to more digits; False where they are to be judged
        as the solver left them
    trial    : these loads to more digits, where the solver has them
    """

    loads: Array
    approach: float
    iterations: int
    residual: float
    refine: bool = True
    trial: Trial | None = None

    @classmethod
    def of(
        cls,
        problem: NormalProblem,
        loads: Array,
        approach: float,
        iterations: int,
        *,
        refine: bool = True,
    ) -> Solution:
        """With its residual from the problem, infinite where that is undefined."""
        residual = problem.residual(loads, approach)
        residual = np.inf if np.isnan(residual) else residual
        return cls(loads, approach, iterations, residual, refine)


class Solver(Protocol):
    """A frozen settings object. Raises SolverError rather than return a poor answer."""

    @property
    def name(self) -> str: ...

    def solve(
        self,
        problem: NormalProblem,
        start: Array | None = None,
    ) -> Solution: ...
