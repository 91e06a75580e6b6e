"""Solvers of the normal problem: objects with settings and a method `solve(problem)`.

The libraries Clarabel, CVXPY and OSQP are imported when first used.
"""

from collections.abc import Callable

from convexrough.errors import InputError
from convexrough.solvers.bristles import BristleQP
from convexrough.solvers.conic import Conic, TooDenseError
from convexrough.solvers.conic_cvxpy import ConicCVXPY, LiftedModel
from convexrough.solvers.newton import Newton
from convexrough.solvers.solution import Solution, Solver

__all__ = [
    "SOLVERS",
    "BristleQP",
    "Conic",
    "ConicCVXPY",
    "LiftedModel",
    "Newton",
    "Solution",
    "Solver",
    "TooDenseError",
    "named",
]

#: The solvers by their names in scene files and in `press`.
SOLVERS: dict[str, Callable[[], Solver]] = {
    "newton": Newton,
    "conic": Conic,
    "conic_cvxpy": ConicCVXPY,
    "bristles": BristleQP,
}


def named(solver: Solver | str | None) -> Solver:
    """The given solver, the solver that `SOLVERS` has under this name, or Newton's method for None.

    Raises InputError for other arguments.

    >>> cr.solvers.named("newton") == cr.solvers.named(None) == cr.solvers.Newton()
    True
    """
    if solver is None:
        return Newton()
    if isinstance(solver, str) and solver in SOLVERS:
        return SOLVERS[solver]()
    if isinstance(solver, (str, type)) or not callable(getattr(solver, "solve", None)):
        names = ", ".join(f'"{name}"' for name in SOLVERS)
        expected = f"one of {names}, or settings such as solvers.Newton()"
        raise InputError("solver", found=_short(solver), expected=expected)
    if not isinstance(getattr(solver, "name", None), str):
        raise InputError("solver", found=_short(solver), expected="an attribute `name`, a text")
    return solver


def _short(solver: object) -> str:
    if isinstance(solver, type):
        return f"the class {solver.__name__}"
    if isinstance(solver, str):
        return repr(solver)
    missing = "" if callable(getattr(solver, "solve", None)) else ", which has no method solve"
    return f"type {type(solver).__name__}{missing}"
