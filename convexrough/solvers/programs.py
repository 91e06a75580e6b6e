"""Optimisation programs in standard form, their solution by libraries, and the answers.

A reduction converts a contact problem to a program, and the answer back, as in cvxpy (Agrawal,
Verschueren, Diamond and Boyd, J. Control Decis. 5 (2018) 42). docs/how-to/solvers.md shows how to
add a solver.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import SolverError
from convexrough.progress import log_step

if TYPE_CHECKING:
    from scipy.sparse import csc_array


class ConeProgram(NamedTuple):
    """minimise (1/2) x'P x + q'x  subject to  A x + s = b,  over x and s.

    The first `equalities` entries of s are 0. Each further group of three entries lies in a
    second-order cone, s_1 >= || (s_2, s_3) ||.
    """

    quadratic: csc_array  # P, upper triangle
    linear: Array  # q
    constraints: csc_array  # A
    constant: Array  # b
    equalities: int  # number of entries of s that are 0

    @property
    def cones(self) -> int:
        return (len(self.constant) - self.equalities) // 3

    def dual(self) -> ConeProgram:
        """The dual in the same form: minimise (1/2) v'P v + b'z,  P v + A'z = -q,  z in the cones.

        The variables are (v, z). v has one entry for each x_i of this program with P_ii != 0. The
        first `equalities` entries of z are free. At any feasible point, minus the objective is a
        lower bound on the minimum of this program; at the solution the multipliers of the equations
        are -x.
        """
        from scipy import sparse  # takes 0.1 s to import

        upper = self.quadratic
        used = np.flatnonzero(upper.diagonal())
        whole = (upper + sparse.triu(upper, 1).T)[:, used]
        rows = len(self.constant)
        in_cones = sparse.eye_array(rows, format="csr")[self.equalities :]
        nothing = sparse.csr_array((rows - self.equalities, len(used)))
        quadratic = sparse.block_diag((upper[used][:, used], sparse.csc_array((rows, rows))))
        stationary = sparse.hstack((whole, self.constraints.T))
        constraints = sparse.vstack((stationary, sparse.hstack((nothing, -in_cones))))
        return ConeProgram(
            quadratic=sparse.csc_array(quadratic),
            linear=np.concatenate((np.zeros(len(used)), self.constant)),
            constraints=sparse.csc_array(constraints),
            constant=np.concatenate((-self.linear, np.zeros(rows - self.equalities))),
            equalities=len(self.linear),
        )

    def __repr__(self) -> str:
        sides = f"{self.equalities:,} equations, {self.cones:,} second-order cones"
        return f"ConeProgram: {len(self.linear):,} variables, {sides}"


class QuadraticProgram(NamedTuple):
    """minimise (1/2) x'P x + q'x  subject to  lower <= A x <= upper."""

    quadratic: csc_array  # P, upper triangle
    linear: Array  # q
    constraints: csc_array  # A
    lower: Array
    upper: Array

    def __repr__(self) -> str:
        return f"QuadraticProgram: {len(self.linear):,} variables, {len(self.lower):,} rows"


class RawAnswer(NamedTuple):
    """A solver's answer to a program in standard form."""

    x: Array
    multipliers: Array  # one for each row of A
    iterations: int
    status: str  # as the solver names it


class ProgramAnswer(NamedTuple):
    """The answer to a `NormalProblem`, converted from a library's answer, and not checked."""

    loads: Array  # of the asperities in the program, in the order and units of the problem
    approach: float  # prescribed, or from the multiplier of the total load
    iterations: int


def load_library(package: str, solver: str) -> Any:
    """The module `package`, imported on first use. Raises SolverError if it cannot be imported."""
    try:
        return import_module(package)
    except ImportError as error:
        raise SolverError(
            f"needs the package {package}, which cannot be imported ({error})",
            solver=solver,
            advice=f"pip install {package}",
        ) from error


def run_clarabel(
    program: ConeProgram, solver: str, tolerance: float, **settings: object
) -> RawAnswer:
    """The answer of Clarabel, an interior-point method; `settings` are those of Clarabel."""
    clarabel = load_library("clarabel", solver)
    chosen = clarabel.DefaultSettings()
    chosen.verbose = False
    chosen.tol_gap_abs = chosen.tol_gap_rel = chosen.tol_feas = tolerance
    for name, value in settings.items():
        setattr(chosen, name, value)
    *data, equalities = program
    cones = [clarabel.ZeroConeT(equalities), *[clarabel.SecondOrderConeT(3)] * program.cones]
    method = clarabel.DefaultSolver(*data, cones, chosen)

    def logged(info: Any) -> bool:
        residual = max(info.res_primal, info.res_dual, info.gap_rel)
        log_step("clarabel", info.iterations, info.cost_primal, residual)
        return False  # tells Clarabel to continue

    method.set_termination_callback(logged)
    found = method.solve()
    raw = RawAnswer(np.array(found.x), np.array(found.z), int(found.iterations), str(found.status))
    return _of_numbers(raw, "Clarabel", solver)


def run_osqp(
    program: QuadraticProgram, solver: str, tolerance: float, max_iterations: int, verbose: bool
) -> RawAnswer:
    """The answer of OSQP, a first-order method with a final solution on the active set."""
    from scipy.sparse import csc_matrix  # 0.1 s to import: only when solving

    osqp = load_library("osqp", solver)
    if int(osqp.__version__.split(".")[0]) < 1:
        what = f"OSQP {osqp.__version__} is too old"
        raise SolverError(what, solver=solver, advice='pip install "osqp>=1.0"')
    method = osqp.OSQP()
    try:
        limits = {"eps_abs": tolerance, "eps_rel": tolerance, "max_iter": max_iterations}
        quadratic, linear, constraints, *bounds = program
        sides = csc_matrix(quadratic), linear, csc_matrix(constraints)  # OSQP warns of arrays
        method.setup(*sides, *bounds, verbose=verbose, polishing=True, **limits)
        found = method.solve(raise_error=True)
    except osqp.OSQPException as error:
        reasons = {int(status): status.name for status in osqp.SolverStatus}
        reason = reasons.get(error.args[0] if error.args else 0, f"error {error}")
        if reason == "OSQP_SIGINT":  # OSQP catches the signal itself
            raise KeyboardInterrupt from error
        raise SolverError(
            f"OSQP did not solve the program: {reason}",
            solver=solver,
            advice="try more max_iterations or a larger tolerance",
        ) from error
    raw = RawAnswer(np.asarray(found.x), np.asarray(found.y), int(found.info.iter), "solved")
    return _of_numbers(raw, "OSQP", solver)


def _of_numbers(raw: RawAnswer, library: str, solver: str) -> RawAnswer:
    if not (np.isfinite(raw.x).all() and np.isfinite(raw.multipliers).all()):
        raise SolverError(
            f"{library} returned values that are not finite, after {raw.iterations} steps "
            f"({raw.status})",
            solver=solver,
            advice="try a larger tolerance, or Newton's method",
        )
    return raw
