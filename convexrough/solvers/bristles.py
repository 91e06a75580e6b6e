"""The contact as one quadratic program for OSQP: each Hertz contact becomes a row of springs.

docs/theory/bristles.md derives the program, its error and the box B on which it is convex. In
scaled units, phi_ij / m is the force on cell j of asperity i, h_i the compliance and d_i the
indentation under the load B_i. The variables are P_i = mean_j phi_ij and e_ij = phi_ij - P_i.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array
from convexrough.convex.definite import is_definite
from convexrough.normal.law import on_hertz_pressure
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.conic import TooDenseError
from convexrough.solvers.programs import ProgramAnswer, QuadraticProgram, RawAnswer, run_osqp
from convexrough.solvers.solution import Solution
from convexrough.sphere import hertz

#: The convexity number S = 2 b_i / (pi s_i) at which a box is cut; below 1 the matrix is definite.
#: A heuristic.
LARGEST_S = 0.99

#: This part of the diagonal is subtracted from the matrix before a Cholesky factorisation decides
#: whether it is definite. A heuristic, far above rounding errors.
MARGIN = 0.001

#: Smallest upper end B_i of a box, divided by the largest, unless the box must be cut below it. A
#: heuristic: smaller loads need not be resolved, and compliances, in proportion to B^(-1/3), differ
#: by at most a factor of a hundred.
SMALLEST_BOX = 1e-6


@dataclass(frozen=True)
class BristleQP:
    """A solver of the bristle program with OSQP (1.0 or newer) and polishing.

    bristles    : m, number of cells in half a row, 0 <= x <= b_i; the error of the loads is about
        0.4 / m^2 of the largest load
    newton_step : True to end with Newton steps, each of which squares the relative error
    tolerance   : absolute and relative tolerance of OSQP, in scaled units. If OSQP finds which
        bristles carry forces (the active set), polishing computes these forces up to rounding
    max_iterations : largest number of iterations of OSQP
    verbose     : True to print OSQP's table of iterations

    Raises TooDenseError where contacts are too crowded for a convex program, and SolverError where
    OSQP is missing or does not solve the program.

    >>> rough = cr.solvers.BristleQP(bristles=16, newton_step=False)
    >>> found = cr.press(scene, approach=5e-5, solver=rough)
    >>> print(f"{abs(found.loads - contact.loads).max() / contact.loads.max():.1e}")
    1.0e-03
    """

    bristles: int = 64
    newton_step: bool = True
    tolerance: float = 1e-6
    max_iterations: int = 20_000
    verbose: bool = False

    def __post_init__(self) -> None:
        for name in ("bristles", "max_iterations"):
            checks.whole(name, getattr(self, name))
        checks.positive("tolerance", self.tolerance)

    @property
    def name(self) -> str:
        """The name in results and messages."""
        return "bristles + Newton step" if self.newton_step else "bristles"

    def solve(self, problem: NormalProblem, start: Array | None = None) -> Solution:
        """The solution in scaled units. `start` is not used."""
        program = BristleProgram.assemble(problem, self.bristles, self.name)
        loads, approach, iterations = program.invert(self.run(program.apply()))
        if self.newton_step:
            return Solution.refined(problem, loads, iterations, self.name)
        return Solution.of(problem, loads, approach, iterations)

    def run(self, program: QuadraticProgram) -> RawAnswer:
        """The solution of the program by OSQP, not yet checked."""
        return run_osqp(program, self.name, self.tolerance, self.max_iterations, self.verbose)


@dataclass(frozen=True, eq=False)
class BristleProgram:
    """The contact law as rows of bristles; the variables are P (n,), then e (n, m) row by row."""

    problem: NormalProblem
    m: int  # number of cells in half a row, `BristleQP.bristles`
    solver: str  # name of the solver, for error messages
    box: Array  # (n,) B
    cut: NDArray[np.bool_]  # (n,) True where the box was cut to make the program convex
    hessian: Array  # (n, n) A + diag(h), positive definite

    @classmethod
    def assemble(cls, problem: NormalProblem, m: int, solver: str) -> BristleProgram:
        n = len(problem)
        checks.fits_in_memory("asperities of the bristle program", n, 60 * n + 1000 * m)
        trial = hertz.load(on_hertz_pressure(problem), problem.coefficients)
        approach_bound = problem.overhang(trial, problem.plain_product(Pair.exact(trial)))
        with np.errstate(divide="ignore"):  # a single asperity has no shell and no face
            faces = (2.0 / 3.0 * problem.coefficients * LARGEST_S / problem.shells) ** 3
        whole = problem.bounds(approach_bound)
        whole = np.maximum(whole, np.minimum(faces, SMALLEST_BOX * whole.max()))
        root = np.sqrt(1.0 / problem.compliance(whole))
        matrix = problem.influence.matrix
        scaled = matrix * root * root[:, None]
        np.fill_diagonal(scaled, 1.0 - MARGIN)
        box = whole if is_definite(scaled) else np.minimum(whole, faces)
        hessian = matrix + np.diag(problem.compliance(box))
        return cls(problem, m, solver, box, box < whole, hessian)

    def apply(self) -> QuadraticProgram:
        """The program, with constraints phi_ij >= 0, sum_j e_ij / m = 0, and the given load."""
        from scipy import sparse  # 0.1 s to import: only when solving

        problem, n, m = self.problem, len(self.problem), self.m
        h, depth = problem.compliance(self.box), hertz.indentation(self.box, problem.coefficients)
        cell = np.arange(1, m + 1)
        profile = depth[:, None] * (cell**2 - cell + 1 / 3) / m**2
        prescribed = problem.offsets + (problem.approach or 0.0)

        rows = sparse.kron(sparse.eye_array(n), np.ones((m, 1)))  # one entry per bristle
        bristles = sparse.hstack((rows, sparse.eye_array(n * m)))
        means = sparse.hstack((sparse.csc_array((n, n)), rows.T / m))
        blocks = [bristles, means]
        lower, upper = np.zeros(n * m + n), np.concatenate((np.full(n * m, np.inf), np.zeros(n)))
        if problem.load is not None:
            blocks.append(sparse.csc_array(np.repeat([1.0, 0.0], [n, n * m])[None]))
            lower, upper = np.append(lower, problem.load), np.append(upper, problem.load)
        springs = sparse.diags_array(np.repeat(h / m, m))
        return QuadraticProgram(
            quadratic=sparse.csc_array(sparse.block_diag((np.triu(self.hessian), springs))),
            linear=np.concatenate((profile.mean(axis=1) - prescribed, profile.ravel() / m)),
            constraints=sparse.csc_array(sparse.vstack(blocks)),
            lower=lower,
            upper=upper,
        )

    def invert(self, raw: RawAnswer) -> ProgramAnswer:
        """The loads, from the forces phi of the bristles and the multipliers of phi >= 0.

        A bristle carries a force where h phi exceeds m times the absolute value of its multiplier.
        At the exact solution one of the two is 0, so this decides even where the solver's phi is
        nearly 0. Raises TooDenseError if a load reaches an upper end that was cut.
        """
        problem, n, m = self.problem, len(self.problem), self.m
        P, e = raw.x[:n], raw.x[n:].reshape(n, m)
        pushed = raw.multipliers[: n * m].reshape(n, m) * m / problem.compliance(self.box)[:, None]
        loads = np.maximum(P[:, None] + e + pushed, 0.0).mean(axis=1)  # pushed is not positive
        approach = -float(raw.multipliers[-1]) if problem.approach is None else problem.approach
        if problem.load is not None and loads.any():  # all may be below the tolerance of OSQP
            loads = loads * (problem.load / loads.sum())
        self.refuse_cut(loads)
        return ProgramAnswer(loads, approach, raw.iterations)

    def refuse_cut(self, loads: Array) -> None:
        """Raise TooDenseError if loads (n,) reach upper ends of the box that were cut."""
        problem = self.problem
        if len(beyond := np.flatnonzero(self.cut & (loads >= self.box))):
            ratios = problem.shells[beyond] / problem.compliance(loads[beyond], beyond)
            raise TooDenseError(self.solver, problem.candidates[beyond], ratios, LARGEST_S)
