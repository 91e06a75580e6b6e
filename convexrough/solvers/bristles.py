"""The contact as one quadratic program: Hertz's law as a row of bristles, through OSQP.

The method of dimensionality reduction (Popov and Hess 2015) makes Hertz's energy the value of a
quadratic program. On |x| <= b lies a row of independent springs, the bristles, with the stiffness
2 E* per length of the half row and the profile x^2 / R_i above the first to touch:

    (3/5) k P^(5/3) = min { integral f^2 / (4 E*) + (x^2 / R_i) f  dx :  f >= 0,  integral f = P },

all over 0 <= x <= b, for every P whose contact radius is at most b; f = 2 E* (delta - x^2 / R_i)+.
A force constant on each of m equal cells turns x^2 / R_i into its mean over the cell, and the
minimum into an upper bound on the energy. In own units, with the loads B_i at contact radius b_i,
their indentation d_i = k B_i^(2/3) and their stiffness h_i = (2/3) k B_i^(-1/3) = 1 / (2 E* b_i),
and phi_ij the force on cell j if every cell bore as much as it does,

    P_i = mean_j phi_ij,    energy_i = mean_j [h_i phi_ij^2 / 2 + d_i c_j phi_ij],
    c_j = (j^2 - j + 1/3) / m^2,    j = 1, ..., m.

P is exact where the contact ends on the edge of a cell, and off by 0.375 B_i b / (b_i m^2) at worst
in between: second order.

Convexity. With phi_ij = P_i + e_ij, sum_j e_ij = 0, the squares fall apart, and the program is

    minimise    P'(A + diag(h)) P / 2 + sum_ij h_i e_ij^2 / (2 m) + sum_ij d_i c_j phi_ij / m - D'P
    subject to  P_i + e_ij >= 0,   sum_j e_ij = 0        (and sum P_i = L under load control).

Its matrix is positive definite exactly if A + diag(h) is: the Hessian of the contact energy at the
upper corner of the box P <= B. No shift is needed, and m does not matter. The box is that of the
a priori bounds if a Cholesky factorisation finds the matrix positive definite there. Else it is
cut at b_i = 0.99 (pi/2) s_i, where the shell lemma proves it. Beyond the box the row has no more
bristles: an answer that gets there is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array
from convexrough.convex.definite import is_definite
from convexrough.errors import InputError, SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.cone_boxes import TooDenseError
from convexrough.solvers.newton import newton_step
from convexrough.solvers.programs import (
    ProgramAnswer,
    QuadraticProgram,
    RawAnswer,
    Reduction,
    run_osqp,
)
from convexrough.solvers.solution import Solution
from convexrough.sphere import hertz

#: The convexity number S of a box that has to be cut to the convex range. The lemma proves the
#: matrix definite below 1; the hundredth is a heuristic, so that rounding does not undo it.
LARGEST_S = 0.99

#: What is taken off the diagonal, as a part of it, where Cholesky decides whether the matrix is
#: definite. A heuristic: far above what rounding does to a factorisation.
MARGIN = 0.001

#: A box is not smaller than this part of the largest. A heuristic: of loads as small nothing need
#: be resolved, and the stiffness of a box, which goes as its load^(-1/3), stays within a hundred.
SMALLEST_BOX = 1e-6


@dataclass(frozen=True)
class BristleQP:
    """Settings of the bristle program: OSQP (1.0 or newer) with polishing.

    bristles    : m, over half the contact width of each asperity; the error of the loads is about
        0.4 / m^2 of the largest load
    newton_step : end with one Newton step, which squares the error and costs little
    tolerance   : OSQP's, absolute and relative, in the problem's units; polishing then solves the
        equations of the bristles in contact to rounding, where OSQP has found these
    verbose     : print OSQP's own table of iterations

    Raises TooDenseError where the contact leaves the convex range, and SolverError where OSQP is
    missing or does not solve the program.
    """

    bristles: int = 64
    newton_step: bool = True
    tolerance: float = 1e-6
    max_iterations: int = 20_000
    verbose: bool = False

    def __post_init__(self) -> None:
        for name in ("bristles", "max_iterations"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < 1:
                raise InputError(name, found=repr(value), expected="a positive whole number")
        checks.positive("tolerance", self.tolerance)

    @property
    def name(self) -> str:
        return "bristles + Newton step" if self.newton_step else "bristles"

    def solve(
        self,
        problem: NormalProblem,
        start: Array | None = None,
    ) -> Solution:
        """Loads of the candidates (own units). OSQP starts where it likes: `start` is not used."""
        program = BristleProgram.assemble(problem, self.bristles, self.name)
        loads, approach, iterations = program.through(self.run)
        if self.newton_step:
            last = newton_step(problem, loads)
            loads, approach = last.loads, last.approach
            iterations += last.iterations
        return Solution.of(problem, loads, approach, iterations, refine=self.newton_step)

    def run(self, program: QuadraticProgram) -> RawAnswer:
        """OSQP's answer to the program."""
        return run_osqp(program, self.name, self.tolerance, self.max_iterations, self.verbose)


@dataclass(frozen=True, eq=False)
class BristleProgram(Reduction[QuadraticProgram, RawAnswer, ProgramAnswer]):
    """The contact law as rows of bristles, in the variables P and e, row by row.

    m       : bristles of each row
    solver  : the name that errors give
    box     : (n,) loads B;  cut : (n,) whether the convex range ends there
    hessian : (n, n) A + diag(h), positive definite
    """

    problem: NormalProblem
    m: int
    solver: str
    box: Array
    cut: NDArray[np.bool_]
    hessian: Array

    @classmethod
    def assemble(cls, problem: NormalProblem, m: int, solver: str) -> BristleProgram:
        n = len(problem)
        checks.fits_in_memory("asperities of the bristle program", n, 60 * n + 1000 * m)
        return cls(problem, m, solver, *_convex_box(problem, solver))

    def apply(self) -> QuadraticProgram:
        """Constrained are phi_ij, then sum_j e_ij / m, then the total load if prescribed."""
        from scipy import sparse  # 0.1 s to import: only when solving

        problem, n, m = self.problem, len(self.problem), self.m
        h, depth = problem.stiffness(self.box), hertz.indentation(self.box, problem.coefficients)
        cell = np.arange(1, m + 1)
        profile = depth[:, None] * (cell**2 - cell + 1 / 3) / m**2
        prescribed = problem.offsets + (problem.approach or 0.0)

        rows = sparse.kron(sparse.identity(n), np.ones((m, 1)))  # one entry per bristle
        bristles = sparse.hstack((rows, sparse.identity(n * m)))
        means = sparse.hstack((sparse.csc_matrix((n, n)), rows.T / m))
        blocks = [bristles, means]
        lower, upper = np.zeros(n * m + n), np.concatenate((np.full(n * m, np.inf), np.zeros(n)))
        if problem.load is not None:
            blocks.append(sparse.csc_matrix(np.repeat([1.0, 0.0], [n, n * m])[None]))
            lower, upper = np.append(lower, problem.load), np.append(upper, problem.load)
        springs = sparse.diags(np.repeat(h / m, m))
        return QuadraticProgram(
            quadratic=sparse.csc_matrix(sparse.block_diag((np.triu(self.hessian), springs))),
            linear=np.concatenate((profile.mean(axis=1) - prescribed, profile.ravel() / m)),
            constraints=sparse.csc_matrix(sparse.vstack(blocks)),
            lower=lower,
            upper=upper,
        )

    def invert(self, raw: RawAnswer) -> ProgramAnswer:
        """A bristle is in contact where h phi exceeds its multiplier.

        The sign of their difference is decided, where phi itself is 0 to the solver's accuracy
        only. Raises TooDenseError if the answer lies on a face where the convex range was cut.
        """
        problem, n, m = self.problem, len(self.problem), self.m
        P, e = raw.x[:n], raw.x[n:].reshape(n, m)
        pushed = raw.multipliers[: n * m].reshape(n, m) * m / problem.stiffness(self.box)[:, None]
        loads = np.maximum(P[:, None] + e + pushed, 0.0).mean(axis=1)  # pushed is not positive
        approach = -float(raw.multipliers[-1]) if problem.approach is None else problem.approach
        if problem.load is not None:
            loads = loads * (problem.load / loads.sum())
        if len(beyond := np.flatnonzero(self.cut & (loads >= self.box))):
            ratios = problem.shells[beyond] / problem.stiffness(loads[beyond], beyond)
            raise TooDenseError(self.solver, problem.candidates[beyond], ratios, LARGEST_S)
        return ProgramAnswer(loads, approach, raw.iterations)


def _convex_box(problem: NormalProblem, solver: str) -> tuple[Array, NDArray[np.bool_], Array]:
    """The box of loads, where the convex range cuts it, and A + diag(h): positive definite."""
    approach_bound = problem.approach_bound
    if problem.load is not None:
        trial = hertz.load(problem.smooth_indentation(), problem.coefficients)
        approach_bound = min(
            approach_bound, problem.overhang(trial, problem.influence.apply(trial))
        )
    with np.errstate(divide="ignore"):  # a single asperity has no shell and no face
        faces = (2.0 / 3.0 * problem.coefficients * LARGEST_S / problem.shells) ** 3
    box = problem.bounds(approach_bound)
    box = np.maximum(box, np.minimum(faces, SMALLEST_BOX * box.max()))
    if (hessian := _positive_definite(problem, box)) is not None:
        return box, np.zeros(len(box), dtype=bool), hessian
    cut = faces < box
    box = np.minimum(box, faces)
    if (hessian := _positive_definite(problem, box)) is not None:
        return box, cut, hessian
    raise SolverError(
        f"the matrix is not positive definite by {MARGIN:g} of its diagonal at S = {LARGEST_S:g}",
        solver=solver,
        advice="try solvers.Conic(), or Newton's method",
    )


def _positive_definite(problem: NormalProblem, box: Array) -> Array | None:
    """A + diag(h) on the box; None unless Cholesky finds it so with MARGIN of its diagonal off."""
    root = np.sqrt(1.0 / problem.stiffness(box))
    scaled = problem.influence.matrix * root * root[:, None]
    np.fill_diagonal(scaled, 1.0 - MARGIN)
    if not is_definite(scaled):
        return None
    hessian: Array = problem.influence.matrix + np.diag(problem.stiffness(box))
    return hessian
