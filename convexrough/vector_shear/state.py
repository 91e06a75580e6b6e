"""`shear_vector`: the friction state of a pressed contact with the full tangential kernel.

`shear` uses the approximation of Ciavarella and Jaeger. Here tangential point forces displace the
surface by Cerruti's solution. So forces and slips are vectors, with directions that differ a little
from that of the shear force (docs/theory/vector-friction.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError, SolverError
from convexrough.friction.shear import ShearCertificate, shear
from convexrough.plottable import Plottable
from convexrough.record import Along, Table
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.solvers import BristleQP, Conic, ConicCVXPY, Newton
from convexrough.vector_shear.certificate import ROUNDED, VectorBounds, certify_vectors
from convexrough.vector_shear.newton import FrictionNewton
from convexrough.vector_shear.problem import FrictionProblem, VectorState, in_plane


class FrictionSolver(Protocol):
    """The interface of solvers of `shear_vector`. For inaccurate results they raise SolverError."""

    @property
    def name(self) -> str: ...

    def solve(self, problem: FrictionProblem, total: Array) -> VectorState: ...


@dataclass(frozen=True, eq=False, repr=False)
class VectorShearState(Table, Plottable):
    """A vector friction state. Arrays are in the order of the scene's asperities.

    contact      : the pressed contact
    force        : (2,) [force] shear force Q
    displacement : (2,) [length] relative tangential displacement X of distant points
    forces       : (n, 2) [force] shear forces on the asperities; their sum is `force`
    slips        : (n, 2) [length] gross slip along the forces, 0 where not sliding
    stick_radii  : (n,) [length] radii of the stick discs, 0 where sliding
    disagreement : relative difference (2-norm) of the forces from those of `shear`; nan if general
        steps, which give these where order fails, do not converge
    residual     : largest relative violation of the conditions of least energy, recomputed from
        this result: `FrictionProblem.residual`
    duality_gap  : [force length] upper bound on the energy of these forces minus the least energy;
        infinite if the energy is not proved to be convex
    certificate  : proved statuses and bounds; a bound on the error of a vector is a bound on the
        length of the difference
    solver, iterations : name of the solver, and its number of steps

    As in `shear`, Q counts as f P if |Q| and f P differ only by rounding. At |Q| = f P the forces
    are f P_i along Q. If these forces displace the asperities by different amounts perpendicular
    to Q, this state is the limit of an infinite displacement. The displacement, the slips,
    `residual` and `duality_gap` are then infinite.
    """

    _shown = ("status",)
    _along: ClassVar[Along] = {
        ("asperity",): ("status", "stick_radii"),
        ("asperity", "direction"): ("forces", "slips"),
        ("direction",): ("force", "displacement"),
    }

    contact: Contact
    force: Array
    displacement: Array
    forces: Array
    slips: Array
    stick_radii: Array
    disagreement: float
    residual: float
    duality_gap: float
    certificate: ShearCertificate
    solver: str
    iterations: int

    @property
    def status(self) -> NDArray[np.str_]:
        """(n,) "sliding", "partial", "open" or "undecided"; each of the first three is proved."""
        return self.certificate.status


def shear_vector(
    contact: Contact, *, force: ArrayLike, solver: FrictionSolver | None = None
) -> VectorShearState:
    """The friction state with the full tangential kernel, after Q grew from 0 at constant load.

    docs/theory/vector-friction.md derives the equations and the bounds.

    force  : [force] (2,) Qx and Qy, or a number along x
    solver : default `FrictionNewton()`; or `FrictionConic()`, a cone program solved by Clarabel

    Raises InputError if the scene has no friction or |Q| exceeds f P; SolverError if the solver
    does not converge or is not installed, or if asperities are too crowded for a convex program.

    >>> state = cr.shear_vector(contact, force=0.25 * contact.load)
    >>> print(f"{state.disagreement:.3f}")
    0.027
    """
    checks.instance("contact", contact, Contact)
    solver = FrictionNewton() if solver is None else solver
    if isinstance(solver, (str, type, Newton, Conic, ConicCVXPY, BristleQP)):
        expected = "a solver of friction, such as FrictionNewton() or FrictionConic()"
        raise InputError("solver", found=repr(solver)[:60], expected=expected)
    friction = checks.friction(contact.scene.friction)
    Q = in_plane(force)
    size = checks.finite("force", float(np.hypot(*Q)))
    checks.bearable("force", size, friction * contact.load)
    if contact.load == 0.0:
        return _unmoved(contact, solver.name)
    problem = contact.cached(FrictionProblem)
    exact = Ball.exact(Q) / friction / problem.units.force
    height = problem.levels.height(size)
    force_error = 0.0
    if size == 0.0:
        nothing = np.zeros((len(problem), 2))
        state = VectorState(np.zeros(2), nothing, np.zeros(2), nothing, 0)
    elif height == problem.levels.load:  # Q counts as f P
        exact = exact / (exact * exact).sum().sqrt() * problem.levels.top.load
        limit = exact * problem.levels.force_unit
        Q, force_error = limit.value, float(np.hypot(*limit.error) * (1 + SAFETY))
        state = _gross(problem, exact.value)
    else:
        state = _solved(solver, problem, exact.value)
    unit, travel = problem.force_unit, problem.travel_unit
    known = certify_vectors(problem, state, exact)
    left = np.maximum(1.0 - problem.sizes(state.increments) / problem.loads, 0.0)
    forces = problem.to_scene(state.increments * unit)
    return VectorShearState(
        contact=contact,
        force=frozen(Q),
        displacement=frozen(_times(state.displacement, travel)),
        forces=frozen(forces),
        slips=frozen(problem.to_scene(state.slips * travel)),
        stick_radii=frozen(contact.contact_radii * problem.to_scene(np.cbrt(left))),
        disagreement=_disagreement(forces, contact, Q),
        residual=problem.residual(state),
        duality_gap=known.excess * unit * travel,
        certificate=_certificate(contact, state, known, force_error),
        solver=solver.name,
        iterations=state.iterations,
    )


def _solved(solver: FrictionSolver, problem: FrictionProblem, total: Array) -> VectorState:
    """The solver's result, checked to be finite; forces in a SolverError become [force] (N, 2)."""
    try:
        state = solver.solve(problem, total)
    except SolverError as error:
        if error.iterate is not None and error.iterate.ndim == 2:
            error.iterate = problem.to_scene(error.iterate * problem.force_unit)
        raise
    pairs = len(problem), 2
    for what, values, shape in (
        ("forces", state.increments, pairs),
        ("slips", state.slips, pairs),
        ("displacement", state.displacement, (2,)),
    ):
        if np.shape(values) != shape or not np.isfinite(values).all():
            raise SolverError(f"no {what} were found: not finite numbers", solver=solver.name)
    return state._replace(total=total)


def _gross(problem: FrictionProblem, total: Array) -> VectorState:
    """The state at |T| = sum P, where all forces and slips are along T.

    If the components across T of the displacements B q by these forces q differ, forces tend to
    this state only as the displacement X along T goes to infinity.
    """
    t = total / np.hypot(*total)
    across = np.array([-t[1], t[0]])
    q = problem.loads[:, None] * t
    coupling = problem.couple(q)
    least, side = problem.thresholds + coupling @ t, coupling @ across
    size = float(least.max())  # the X at which the last starts to slide
    if float(np.ptp(side)) <= 64 * ROUNDOFF * len(q) * size:
        displacement = t * size + float(side.mean()) * across
    else:
        size, displacement = np.inf, _times(t, np.inf)
    slips = _times(np.broadcast_to(t, q.shape), (size - least)[:, None])
    return VectorState(total, q, displacement, slips, 0)


def _times(vectors: Array, size: Array | float) -> Array:
    """vectors * size, and 0 where a vector is 0, even times infinity."""
    product = np.zeros(np.broadcast_shapes(vectors.shape, np.shape(size)))
    np.multiply(vectors, size, out=product, where=vectors != 0)
    return product


def _disagreement(forces: Array, contact: Contact, Q: Array) -> float:
    """Relative 2-norm of the forces minus those of `shear`, directed along Q; 0 if Q is 0."""
    if (size := float(np.hypot(*Q))) == 0.0:
        return 0.0
    try:
        other = shear(contact, force=size).forces / size
    except SolverError:
        return np.nan
    difference = forces / size - other[:, None] * (Q / size)
    return float(np.linalg.norm(difference) / np.linalg.norm(other))


def _certificate(
    contact: Contact, state: VectorState, bounds: VectorBounds, force_error: float
) -> ShearCertificate:
    problem = contact.cached(FrictionProblem)

    def in_scene(errors: Array, values: Array, unit: float) -> Array:
        size = np.where(np.isfinite(values).all(axis=-1), np.hypot(*values.T), 0.0)
        return problem.to_scene((errors * (1 + SAFETY) + ROUNDED * size) * unit)

    unit, travel, levels = problem.force_unit, problem.travel_unit, problem.levels
    displacement_error = float(bounds.displacement_error + ROUNDED * np.hypot(*state.displacement))
    open_ = contact.status == "open"
    status = np.where(open_, "open", np.full(len(open_), "undecided", dtype="<U12"))
    status[problem.to_scene(bounds.partial)] = "partial"
    status[problem.to_scene(bounds.sliding)] = "sliding"
    loaded = problem.to_scene(np.ones(len(problem), dtype=bool))
    strays = np.where(loaded, 0.0, levels.to_scene(np.asarray(levels.top.loads.error)) * unit)
    unknown = np.where(loaded | open_, 0.0, np.inf)
    return ShearCertificate(
        scope=problem.scope if bounds.proved else "none",
        order="proved for one step",
        status=frozen(status),
        force_errors=frozen(strays + in_scene(bounds.increments, state.increments, unit)),
        slip_errors=frozen(unknown + in_scene(bounds.slips, state.slips, travel)),
        stick_radius_errors=frozen(np.where(open_, 0.0, np.inf)),
        force_error=force_error,
        displacement_error=displacement_error * travel,
    )


def _unmoved(contact: Contact, solver: str) -> VectorShearState:
    n = len(contact.scene)
    zero, none, nothing = frozen(np.zeros(n)), frozen(np.zeros(2)), frozen(np.zeros((n, 2)))
    certificate = shear(contact, force=0.0).certificate
    return VectorShearState(
        contact, none, none, nothing, nothing, zero, 0.0, 0.0, 0.0, certificate, solver, 0
    )
