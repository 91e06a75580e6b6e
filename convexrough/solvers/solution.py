"""What every solver takes and returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from convexrough.arrays import Array
from convexrough.normal.problem import NormalProblem
from convexrough.normal.residual import Displaced
from convexrough.progress import Announce
from convexrough.record import Record


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Record):
    """Loads of the candidates and the approach, in the problem's units.

    residual  : problem.residual(loads, approach), recomputed from the loads
    displaced : these loads and A times them to many digits, where the solver knows that: it saves
        the certificate some work
    """

    loads: Array
    approach: float
    iterations: int
    residual: float
    displaced: Displaced | None = None

    @classmethod
    def of(cls, problem: NormalProblem, loads: Array, approach: float, iterations: int) -> Solution:
        """With its residual from the problem, infinite where that is undefined."""
        residual = problem.residual(loads, approach)
        return cls(loads, approach, iterations, np.inf if np.isnan(residual) else residual)


class Solver(Protocol):
    """A frozen settings object. Raises SolverError rather than return a poor answer."""

    @property
    def name(self) -> str: ...

    def solve(
        self,
        problem: NormalProblem,
        start: Array | None = None,
        announce: Announce | None = None,
    ) -> Solution: ...
