"""`press`: pick what the scene needs, solve, certify."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.errors import InputError, SolverError
from convexrough.influence import Influence, Kind
from convexrough.kept import Keeper
from convexrough.normal.certificate import Certificate, judge
from convexrough.normal.problem import NormalProblem
from convexrough.progress import Announce
from convexrough.scene.scene import Scene
from convexrough.solvers import Newton, Solution, Solver
from convexrough.sphere import hertz


@dataclass(frozen=True, eq=False)
class Contact(Keeper):
    """A solved normal contact. Arrays are (n,), in the order of the scene's asperities.

    loads         : [force]
    contact_radii : [length]
    approach      : D0 [length]: the solver's, unless the certificate excludes that;  load : [force]
    certificate   : what is proved of the loads, whatever the solver said
    model_error   : largest relative error of the indentations from treating each asperity's
        pressure as a point force, to leading order: max sum_j A_ij P_j a_j^2 / (10 r_ij^2) / D_i
        over the loaded asperities
    crowding      : largest (a_i + a_j) / r_ij; above 1 contact discs overlap and the model fails
    influence     : how the candidates were coupled: "dense", "lattice" or "scattered"
    seconds       : [s] that `press` took, or `solve`
    """

    scene: Scene
    loads: Array
    contact_radii: Array
    approach: float
    load: float
    certificate: Certificate
    model_error: float
    crowding: float
    candidates: int
    influence: Kind
    solver: str
    iterations: int
    seconds: float

    @property
    def gaps(self) -> Array:
        """(n,) [length] 0 where touching."""
        return self.certificate.gaps

    @property
    def status(self) -> NDArray[np.str_]:
        """(n,) "contact", "open" or "undecided"; each of the first two is proved."""
        return self.certificate.status


def press(
    scene: Scene,
    *,
    approach: float | None = None,
    load: float | None = None,
    solver: Solver | None = None,
    start: ArrayLike | None = None,
    influence: Kind | None = None,
    announce: Announce | None = None,
) -> Contact:
    """Press the sphere on the asperities by an approach [length] or with a load [force].

    solver : default `solvers.Newton()`
    start  : (n,) [force] loads to start from; in the convex range the answer is the same for all
    influence : how to couple the asperities: "dense" (a matrix), "lattice" (transforms, where they
        lie on a lattice), "scattered" (transforms on a mesh); None for the cheapest that is exact
    announce : told in a line how far long work has come

    Raises InputError for bad values and SolverError where the solver stops without an answer. An
    answer without a certificate is returned: look at `contact.certificate.scope`.
    """
    began = time.perf_counter()
    problem = NormalProblem.assemble(scene, approach=approach, load=load, influence=influence)
    contact = solve(problem, solver, start, announce)
    return replace(contact, seconds=time.perf_counter() - began)


def solve(
    problem: NormalProblem,
    solver: Solver | None = None,
    start: ArrayLike | None = None,
    announce: Announce | None = None,
) -> Contact:
    """`press` for a problem already assembled; its arguments are as there."""
    began = time.perf_counter()
    solver = Newton() if solver is None else solver
    scene = problem.scene
    force, length = problem.units.force, problem.units.length
    first = None
    if start is not None:
        given = checks.array("start", start, length=len(scene), sign="not negative")
        first = given[problem.candidates] / force
    if len(problem) == 0:  # too small an approach for anything to touch
        solution = Solution(np.zeros(0), float(problem.approach or 0.0), 0, 0.0)
    else:
        solution = _solved(solver, problem, first, announce)
    loads = frozen(problem.to_scene(solution.loads * force))
    radii = hertz.contact_radius(loads, scene.material.contact_modulus, scene.relative_radii)
    if announce is not None:
        announce("certifying")
    certificate = judge(problem, loads)
    if not abs(solution.approach * length - certificate.approach) <= certificate.approach_error:
        solution = replace(solution, approach=certificate.approach / length)
    model_error, crowding = _model_limits(problem, solution, radii[problem.candidates])
    return Contact(
        scene=scene,
        loads=loads,
        contact_radii=frozen(radii),
        approach=solution.approach * length,
        load=float(loads.sum()),
        certificate=certificate,
        model_error=model_error,
        crowding=crowding,
        candidates=len(problem),
        influence=problem.influence.name,
        solver=solver.name,
        iterations=solution.iterations,
        seconds=time.perf_counter() - began,
    )


def _solved(
    solver: Solver, problem: NormalProblem, start: Array | None, announce: Announce | None
) -> Solution:
    """The solver's answer, if it is one; the last loads of an error in scene units and order."""
    try:
        solution = solver.solve(problem, start, announce)
    except SolverError as error:
        if error.iterate is not None:
            error.iterate = problem.to_scene(error.iterate * problem.units.force)
        raise
    try:
        loads = checks.array("loads", solution.loads, length=len(problem), sign="not negative")
    except InputError as error:
        raise SolverError(f"no loads were found: {error}", solver=solver.name) from error
    return replace(solution, loads=loads)


def _model_limits(problem: NormalProblem, solution: Solution, radii: Array) -> tuple[float, float]:
    """How far the point-force model is stretched: `model_error` and `crowding` of Contact.

    radii : (n,) [length] of the candidates
    """
    prescribed = solution.approach + problem.offsets
    touching = np.flatnonzero((solution.loads > 0) & (prescribed > 0))
    if len(touching) < 2:
        return 0.0, 0.0
    A: Influence = problem.influence
    if len(touching) < len(problem):
        A = A.among(touching)
    a = radii[touching]
    moved = A.scale * A.falloff(solution.loads[touching] * a**2 / 10, 3)
    return float((moved / prescribed[touching]).max()), A.crowding(a)
