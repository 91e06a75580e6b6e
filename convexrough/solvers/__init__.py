"""Ways to solve the normal problem: settings objects, each with `solve(problem)`.

Those written elsewhere (Clarabel, CVXPY, OSQP) are imported when first used.
"""

from convexrough.solvers.bristles import BristleQP
from convexrough.solvers.cone_boxes import TooDenseError
from convexrough.solvers.conic import Conic
from convexrough.solvers.conic_cvxpy import ConicCVXPY, LiftedModel
from convexrough.solvers.newton import Newton
from convexrough.solvers.solution import Solution, Solver

__all__ = [
    "BristleQP",
    "Conic",
    "ConicCVXPY",
    "LiftedModel",
    "Newton",
    "Solution",
    "Solver",
    "TooDenseError",
]
