"""Ways to solve the normal problem: settings objects, each with `solve(problem)`."""

from convexrough.solvers.newton import Newton
from convexrough.solvers.solution import Solution, Solver

__all__ = ["Newton", "Solution", "Solver"]
