"""The contact law as one second-order cone program, written in CVXPY to be read.

This is the program of `conic.py`, with the names of docs/theory/exact-cones.md. It satisfies
CVXPY's rules of convexity (DCP) and of parameters (DPP), so CVXPY compiles it once for all
approaches.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array
from convexrough.errors import InputError, SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.conic import ConeBoxes, ConeSolver, judged
from convexrough.solvers.programs import ProgramAnswer, load_library
from convexrough.solvers.solution import Solution

#: Options of some of CVXPY's solvers: names of tolerances of feasibility and of the duality gap,
#: the name of the limit on iterations, and this limit. Others keep their own. SCS, a first-order
#: method, needs thousands of iterations; interior-point methods need about twenty.
OPTIONS = {
    "CLARABEL": (("tol_gap_abs", "tol_gap_rel", "tol_feas"), "max_iter", 200),
    "ECOS": (("abstol", "reltol", "feastol"), "max_iters", 200),
    "QOCO": (("abstol", "reltol"), "max_iters", 200),
    "SCS": (("eps_abs", "eps_rel"), "max_iters", 20_000),
}


#: Package names, for `pip`, of CVXPY's solvers with second-order cones.
PACKAGES = {name: name.lower() for name in (*OPTIONS, "CVXOPT", "CPLEX")}
PACKAGES |= {"MOSEK": "Mosek", "GUROBI": "gurobipy", "COPT": "coptpy"}


@dataclass(frozen=True)
class ConicCVXPY(ConeSolver):
    """A solver of the cone program through CVXPY, with any of its second-order cone solvers.

    tolerance      : absolute and relative tolerance of feasibility and of the duality gap, in
        scaled units
    max_iterations : largest number of iterations; None for 200 (SCS: 20,000). Solvers that
        `OPTIONS` does not name keep their own tolerances and limits
    solver         : a name from `cvxpy.installed_solvers()`, in upper or lower case
    verbose        : True to print the output of CVXPY and of the solver
    newton_step    : True to end with Newton steps

    >>> contact = cr.press(scene, approach=5e-5, solver=cr.solvers.ConicCVXPY())
    >>> contact.solver, contact.certificate.all_proved
    ('conic in CVXPY + Newton step', True)
    """

    max_iterations: int | None = None
    solver: str = "CLARABEL"
    verbose: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.max_iterations is not None:
            checks.whole("max_iterations", self.max_iterations)
        if not isinstance(self.solver, str):
            raise InputError("solver", found=repr(self.solver), expected="the name of a solver")
        object.__setattr__(self, "solver", self.solver.upper())

    @property
    def formulation(self) -> str:
        """The name without the ending " + Newton step"."""
        default = self.solver == "CLARABEL"
        return "conic in CVXPY" if default else f"conic in CVXPY ({self.solver})"

    def answer(self, problem: NormalProblem, boxes: ConeBoxes) -> ProgramAnswer:
        """The loads and the approach that the solver returns for these boxes, not yet checked."""
        return LiftedModel.assemble(self, problem, boxes).answer()

    def model(self, problem: NormalProblem, *, five: bool = False) -> LiftedModel:
        """The program in CVXPY, with four or five cones, to be read, changed or solved again.

        problem : the contact problem, from `NormalProblem.assemble`
        five    : True for five cones per asperity, which are exact up to larger loads than four
        """
        return LiftedModel.assemble(self, problem, ConeBoxes.choose(problem, five=five))

    def run(self, program: Any) -> Any:
        """Solve a cvxpy.Problem; return the same object, which then contains the solution."""
        cp = load_library("cvxpy", self.name)
        options: dict[str, float] = {}
        if self.solver in OPTIONS:
            tolerances, limit, steps = OPTIONS[self.solver]
            options = dict.fromkeys(tolerances, self.tolerance)
            options[limit] = steps if self.max_iterations is None else self.max_iterations
        advice = "try more max_iterations, a larger tolerance, or another solver"
        try:
            with warnings.catch_warnings():  # loads are checked in the contact law later
                warnings.filterwarnings("ignore", message="Solution may be inaccurate")
                program.solve(solver=self.solver, verbose=self.verbose, **options)
        except cp.error.SolverError as error:
            what, advice = _missing(cp, self.solver) or (str(error), advice)
            raise SolverError(what, solver=self.name, advice=advice) from error
        if program.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
            what = f"{self.solver.lower()} stopped with {program.status}"
            raise SolverError(what, solver=self.name, advice=advice)
        return program


def _missing(cp: Any, solver: str) -> tuple[str, str] | None:
    """The reason why CVXPY cannot use this solver, and advice; None if CVXPY can use it."""
    from cvxpy.reductions.solvers import defines  # the cones that each solver accepts

    conic = defines.SOLVER_MAP_CONIC
    able = [name for name in conic if cp.SOC in conic[name].SUPPORTED_CONSTRAINTS]
    installed = [name for name in cp.installed_solvers() if name in able]
    if solver in installed:
        return None
    choice = f"choose one of {', '.join(installed)}"
    if solver in able:
        package = PACKAGES.get(solver)
        get = f"pip install {package}" if package else "install it as its documentation says"
        what = f"{solver} is not installed; CVXPY finds {', '.join(installed)}"
        return what, f"{get}, or {choice}"
    if solver in conic or solver in defines.SOLVER_MAP_QP:
        return f"{solver} has no second-order cones", f"{choice}, or solvers.BristleQP()"
    return f"CVXPY has no solver {solver}", checks.nearest(solver, installed)


@dataclass(frozen=True, eq=False, repr=False)
class LiftedModel:
    """The cone program as CVXPY objects, in the scaled units of `normal`.

    settings : the solver;  normal : the contact problem
    boxes    : the boxes 0 <= p <= B of loads
    program  : the cvxpy.Problem
    D0       : cvxpy.Parameter: the approach, or its upper bound if the load is prescribed
    p        : cvxpy.Variable: the loads of the asperities `boxes.members`
    link     : the constraint p == B y3, whose multiplier is minus the gap where p = 0
    total    : the constraint sum p == load, or None; its multiplier is D0 minus the approach

    >>> from convexrough.normal.problem import NormalProblem
    >>> problem = NormalProblem.assemble(scene, approach=5e-5)
    >>> model = cr.solvers.ConicCVXPY().model(problem)
    >>> solution = model.solve()
    >>> sorted(model.variables), model.loads.shape, bool(model.gaps.min() >= 0)
    (['p', 'y2', 'y3', 'y4', 'y5', 'z'], (55,), True)
    """

    settings: ConicCVXPY
    normal: NormalProblem
    boxes: ConeBoxes
    program: Any
    D0: Any
    p: Any
    link: Any
    total: Any

    def __repr__(self) -> str:
        size = self.program.size_metrics
        asperities = f"{len(self.boxes.members):,} asperities"
        sides = f"{size.num_scalar_variables:,} variables, {size.num_scalar_eq_constr:,} equations"
        return f"LiftedModel: {asperities}, {sides}; `program` is the cvxpy.Problem"

    @classmethod
    def assemble(cls, settings: ConicCVXPY, normal: NormalProblem, boxes: ConeBoxes) -> LiftedModel:
        """Program (1) of docs/theory/exact-cones.md, or (2) with five cones."""
        cp = load_library("cvxpy", settings.name)
        i, n = boxes.members, len(boxes.members)
        checks.fits_in_memory("asperities of the cone program in CVXPY", n, 400, power=2)
        B, S, e = boxes.loads, boxes.S, boxes.energies(normal)
        M = normal.influence.matrix[np.ix_(i, i)] + np.diag(normal.shells[i])
        d = normal.offsets[i]
        D0 = cp.Parameter(name="D0")
        D0.value = normal.approach_bound if normal.approach is None else normal.approach

        names = ("p", "y1", "y2", "y3", "y4", "y5", "z")
        p, y1, y2, y3, y4, y5, z = (cp.Variable(n, name=name) for name in names)
        energy = (
            (e * (3 / 5 - S / 3)) @ y5
            + (e * S / 3) @ z
            + cp.quad_form(p, cp.psd_wrap(M)) / 2  # CVXPY's own check fails on some valid M
            - D0 * cp.sum(p)
            - d @ p
        )

        def cone(x: Any, y: Any, w: Any) -> Any:
            """x y >= w^2"""
            return cp.SOC(x + y, cp.vstack([x - y, 2 * w]), axis=0)

        cones = [cone(y2 - y3, y4 - y5, y3 - y4), cone(y3, y5, y4), cone(y3 - y4, z, y4 - y5)]
        if boxes.five:
            cones += [cone(1 - y1, y2 - y3, y1 - y2), cone(y1 - y2, y3 - y4, y2 - y3)]
        else:
            cones.append(cone(np.ones(n), y4, y2))
        link = p == cp.multiply(B, y3)
        total = None if normal.load is None else cp.sum(p) == normal.load
        constraints = [link, *cones, *([] if total is None else [total])]
        program = cp.Problem(cp.Minimize(energy), constraints)
        return cls(settings, normal, boxes, program, D0, p, link, total)

    def solve(self, approach: float | None = None) -> Solution:
        """The solution of the program, which is compiled only once.

        approach : a new approach in scaled units, at most `normal.approach_bound`; default:
            unchanged

        Raises InputError for an approach above this limit, or if the load is prescribed;
        SolverError if the solver or a check fails; TooDenseError if the box is too small for the
        loads.
        """
        normal = self.normal
        if approach is not None:
            if normal.approach is None or not approach <= normal.approach_bound:
                expected = f"at most {normal.approach_bound:g}, and no prescribed load"
                raise InputError("approach", found=approach, expected=expected)
            self.D0.value = approach
            normal = normal.at_approach(Ball.exact(approach))
        return judged(self.settings, normal, self.boxes, self.answer())

    def answer(self) -> ProgramAnswer:
        """The loads and the approach that the solver returns for the current program."""
        raw = self.settings.run(self.program)
        return ProgramAnswer(self.loads, self.approach, int(raw.solver_stats.num_iters or 0))

    @property
    def variables(self) -> dict[str, Any]:
        """The variables by name: p, y2 to y5 and z; with five cones also y1."""
        return {variable.name(): variable for variable in self.program.variables()}

    @property
    def loads(self) -> Array:
        """(m,) loads of the latest solution in scaled units, not checked."""
        return np.array(self.p.value)

    @property
    def approach(self) -> float:
        """The prescribed approach, or the one from the multiplier of the prescribed load."""
        return float(self.D0.value - (0.0 if self.total is None else self.total.dual_value))

    @property
    def gaps(self) -> Array:
        """(m,) gaps of the latest solution in scaled units, from the multipliers of `link`."""
        return np.asarray(np.maximum(-self.link.dual_value, 0.0))
