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
    parts = getattr(solver, "name", None), getattr(solver, "solve", None)
    if isinstance(solver, (str, type)) or not (isinstance(parts[0], str) and callable(parts[1])):
        names = ", ".join(f'"{name}"' for name in SOLVERS)
        kinds = f"one of {names}, or settings such as solvers.Newton()"
        expected = f"{kinds}: an object with a text `name` and a method `solve`"
        shown = repr(solver) if isinstance(solver, (str, type)) else f"type {type(solver).__name__}"
        raise InputError("solver", found=shown, expected=expected)
    return solver
