"""What every solver takes and returns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from convexrough.checks import Array
from convexrough.normal.problem import NormalProblem

#: Told in a line how far long work has come.
Announce = Callable[[str], object]


@dataclass(frozen=True, eq=False)
class Solution:
    """Loads of the candidates and the approach, in the problem's units.

    residual : problem.residual(loads, approach), recomputed from the loads
    """

    loads: Array
    approach: float
    iterations: int
    residual: float


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
