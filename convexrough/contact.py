"""`press`: pick what the scene needs, solve, certify."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks, hertz
from convexrough.certificate import Certificate, judge
from convexrough.checks import Array, frozen
from convexrough.influence import inverse_distances
from convexrough.normal import NormalProblem
from convexrough.scene import Scene
from convexrough.solvers import Newton, Solution, Solver


@dataclass(frozen=True, eq=False)
class Contact:
    """A solved normal contact. Arrays are (n,), in the order of the scene's asperities.

    loads         : [force]
    contact_radii : [length]
    approach      : D0 [length];  load : total [force]
    certificate   : what is proved of the loads, whatever the solver said
    model_error   : largest relative error of the indentations from treating each asperity's
        pressure as a point force, to leading order: max sum_j A_ij P_j a_j^2 / (10 r_ij^2) / D_i
        over the loaded asperities
    crowding      : largest (a_i + a_j) / r_ij; above 1 contact discs overlap and the model fails
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
) -> Contact:
    """Press the sphere on the asperities by an approach [length] or with a load [force].

    solver : default `solvers.Newton()`
    start  : (n,) [force] loads to start from; in the convex range the answer is the same for all

    Raises InputError for bad values and SolverError where the solver stops without an answer. An
    answer without a certificate is returned: look at `contact.certificate.scope`.
    """
    began = time.perf_counter()
    solver = Newton() if solver is None else solver
    problem = NormalProblem.assemble(scene, approach=approach, load=load)
    force, length = problem.units.force, problem.units.length
    first = None
    if start is not None:
        given = checks.array("start", start, length=len(scene), sign="not negative")
        first = given[problem.candidates] / force
    if len(problem) == 0:  # too small an approach for anything to touch
        solution = Solution(np.zeros(0), float(problem.approach or 0.0), 0, 0.0)
    else:
        solution = solver.solve(problem, first)
    loads = frozen(problem.to_scene(solution.loads * force))
    radii = hertz.contact_radius(loads, scene.material.contact_modulus, scene.relative_radii)
    certificate = judge(problem, loads)
    model_error, crowding = _model_limits(scene, loads, radii, solution.approach * length)
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
        solver=solver.name,
        iterations=solution.iterations,
        seconds=time.perf_counter() - began,
    )


def _model_limits(scene: Scene, loads: Array, radii: Array, approach: float) -> tuple[float, float]:
    """How far the point-force model is stretched: `model_error` and `crowding` of Contact."""
    touching = np.flatnonzero((loads > 0) & (approach + scene.offsets > 0))
    if len(touching) < 2:
        return 0.0, 0.0
    points, a = scene.contact_points[touching], radii[touching]
    inverse = inverse_distances(points, points)
    crowding = float(((a[:, None] + a) * inverse).max())
    source = loads[touching] * a**2 / (10 * np.pi * scene.material.contact_modulus)
    prescribed = approach + scene.offsets[touching]
    return float((inverse**3 @ source / prescribed).max()), crowding
