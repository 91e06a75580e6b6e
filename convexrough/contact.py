"""`press`: solve the normal contact problem of a scene, and certify the loads."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import ArrayLike, NDArray

from convexrough import checks, solvers
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, Indices, frozen
from convexrough.cached import Cached
from convexrough.errors import InputError, ProofError, SolverError
from convexrough.influence import Influence, Kind
from convexrough.influence.choice import couple
from convexrough.normal.certificate import MOST_KEPT, Certificate, certificate_of, proved_near
from convexrough.normal.level import Level
from convexrough.normal.levels import Levels
from convexrough.normal.problem import NormalProblem
from convexrough.normal.proved import proved
from convexrough.normal.refine import Trial, is_of, refined_loads
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import Along, Table
from convexrough.roundoff import AT_THE_END, ROUNDOFF
from convexrough.scene.scene import Scene
from convexrough.solvers import Solution, Solver
from convexrough.sphere import hertz

#: Under a prescribed load, Newton's method includes all asperities if there are at most FEW:
#: a bound on the approach, which would show that some are open, takes more time than it saves.
FEW = 128

#: A summit counts as beside a contact disc up to this multiple of the contact radius from the
#: centre. There the displacements by a point force are 5 % too small, at the rim of the disc 15 %.
BESIDE = 1.5

if TYPE_CHECKING:
    from convexrough.gradients.change import ContactChange, Direction
    from convexrough.gradients.gradient import Gradient, Holding
    from convexrough.proof import Proof, ShearedState


@dataclass(frozen=True, eq=False, repr=False)
class Contact(Cached, Table, Plottable):
    """A solved normal contact. Arrays are (n,), in the order of the scene's n asperities.

    loads         : [force] load of each asperity; 0 where open
    contact_radii : [length] radius of each contact disc; 0 where open
    approach      : [length] approach D0 of the two bodies;  load : [force] total load
    prescribed_load : [force] the load if it was prescribed; None if the approach was prescribed
    certificate   : what is proved about the loads, independent of the solver
    candidates    : number of asperities that the solver included; all others are proved open
    influence     : the compliance operator: "dense", "lattice" or "scattered"
    solver : name of the solver, with " + refinement" if Newton steps changed a user's loads
    iterations, seconds : iterations of the solver; time [s] of `press` or `solve`

    >>> contact = cr.press(scene, approach=5e-5)
    >>> print(contact.status[0], contact.status[-1], f"{contact.loads[0] / contact.load:.4f}")
    contact open 0.0536
    """

    _shown = ("status", "model_error", "crowding")
    _along: ClassVar[Along] = {
        ("asperity",): ("status", "loads", "contact_radii", "mean_pressures", "gaps")
    }

    scene: Scene
    loads: Array
    contact_radii: Array
    approach: float
    load: float
    certificate: Certificate
    candidates: int
    influence: Kind
    solver: str
    iterations: int
    seconds: float
    prescribed_load: float | None = None

    @property
    def gaps(self) -> Array:
        """(n,) [length] gap between each asperity and the sphere; 0 where they touch."""
        return self.certificate.gaps

    @property
    def status(self) -> NDArray[np.str_]:
        """(n,) "contact" or "open" where that is proved, else "undecided"."""
        return self.certificate.status

    @property
    def area(self) -> float:
        """[length^2] total contact area: the sum of the areas of the contact discs."""
        return float(np.pi * (self.contact_radii**2).sum())

    @cached_property
    def model_error(self) -> float:
        """Estimate of the largest relative error of displacements at loaded asperities because
        forces act at points (the largest of `surface.model_errors`).
        """
        return float(model_errors(self).max(initial=0.0))

    @cached_property
    def crowding(self) -> float:
        """Largest (a_i + a_j) / r_ij over pairs of touching asperities, with contact radii a and
        distances r; 0 if fewer than two touch. Above 1 contact discs overlap and the model fails.
        """
        loaded, A = among_loaded(self)
        return A.crowding(self.contact_radii[loaded]) if len(loaded) > 1 else 0.0

    @cached_property
    def covered(self) -> int:
        """Number of open summits within 1.5 contact radii of the centre of a contact disc.

        At these summits a point force does not represent the pressure of the disc.
        """
        return covered(self.scene, self.contact_radii)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the loads, as sentences: no certificate, crowding, few contacts, ...

        >>> contact.warnings
        ()
        """
        from convexrough.plausibility import cautions_of, doubts_of  # a higher layer

        return (*doubts_of(self), *cautions_of(self))

    def proof(self, *, sheared: Sequence[ShearedState] = ()) -> Proof:
        """A proof for `convexrough check` and other checkers; its method `save(path)` writes it.

        sheared : results of `shear` for this contact, with shear forces 0 < |Q| < f P. For each,
            the proof includes the state at |Q|, of which that at -|Q| is the mirror image, and the
            loss of the cycle between them

        docs/theory/proof-file.md describes the file. Raises InputError for scenes too large for
        exact arithmetic, and ProofError if nothing is proved, for example because the `order` of a
        shear state is "fails".

        >>> print(contact.proof().proved.splitlines()[0])
        proved: under the approach 5e-05 there is a solution, the only one
        """
        from convexrough.proof import prove, refuse_many

        refuse_many(self.scene)
        checks.sequence("sheared", sheared, "a list of shear states of this contact")
        by_load = self.prescribed_load is not None
        levels, states = self.cached(levels_of), []
        for k, state in enumerate(sheared):
            force = getattr(state, "force", None)
            if getattr(state, "contact", self) is not self or not isinstance(force, int | float):
                expected = "a shear state of this contact, a result of `shear`"
                other = isinstance(force, int | float)
                found = "a state of another contact" if other else checks.shown(state)
                raise InputError(f"sheared[{k}]", found=found, expected=expected)
            drop = abs(Fraction(force)) / Fraction(checks.friction(self.scene.friction))
            if drop == 0 or drop >= (1 - AT_THE_END * Fraction(ROUNDOFF)) * Fraction(self.load):
                found = f"the shear force {force:.17g}"
                expected = "one between 0 and f P: there is no proof of rest or gross sliding"
                raise InputError(f"sheared[{k}]", found=found, expected=expected)
            if getattr(state, "order", "") == "fails":
                raise ProofError(f"sheared[{k}]: an indentation may fall as the load rises")
            left = levels.top.load - Ball.exact(drop / Fraction(levels.problem.units.force))
            near = levels.at(left).trial
            assert near is not None  # only a level at the load 0 has no trial loads
            states.append((force, near))
        assert levels.top.trial is not None
        return prove(
            self.scene,
            levels.top.trial,
            approach=None if by_load else self.approach,
            load=self.prescribed_load,
            sheared=states,
        )

    def gradient(
        self,
        *,
        loads: ArrayLike | None = None,
        gaps: ArrayLike | None = None,
        approach: float | None = None,
        load: float | None = None,
        holding: Holding | None = None,
    ) -> Gradient:
        """Derivatives of a weighted sum of results with respect to the scene.

        docs/theory/gradients.md derives them.

        loads, gaps    : (n,) weights of the asperities' loads and gaps in the sum
        approach, load : weights of the approach and the total load in the sum
        holding        : quantity kept constant, "load" or "approach"; default: the prescribed one

        Raises InputError if no weight is given or no asperity is loaded, and SolverError if the
        loads have no derivative because the energy is not convex there.

        >>> print(f"{contact.gradient(load=1.0, holding='approach').approach:.5g}")
        0.012145
        """
        from convexrough.gradients.results import contact_gradient  # a higher layer

        weights = {"loads": loads, "gaps": gaps, "approach": approach, "load": load}
        return contact_gradient(self, holding, **weights)

    def change(self, direction: Direction) -> ContactChange:
        """First-order changes of loads, gaps and approach when the scene changes by `direction`.

        direction : the changes of the scene and of the prescribed quantity

        Raises InputError and SolverError as `gradient` does.

        >>> change = contact.change(cr.Direction(heights=1e-9))
        >>> change.loads.shape, change.load > 0
        ((61,), True)
        """
        from convexrough.gradients.change import contact_change  # a higher layer

        return contact_change(self, direction)

    @property
    def mean_pressures(self) -> Array:
        """(n,) [force / length^2] load divided by contact area; 0 where open."""
        return frozen(mean_pressures(self.loads, self.contact_radii))


def discs_of(scene: Scene, loads: Array) -> Array:
    """(n,) [length] the radii of the contact discs under loads (n,) [force]."""
    modulus = scene.material.contact_modulus
    return np.asarray(hertz.contact_radius(loads, modulus, scene.relative_radii))


def mean_pressures(loads: Array, radii: Array) -> Array:
    """(n,) loads divided by contact areas; 0 where the contact radius is 0."""
    areas = np.pi * radii**2
    return np.asarray(np.divide(loads, areas, out=np.zeros(len(areas)), where=areas > 0))


def press(
    scene: Scene,
    *,
    approach: float | None = None,
    load: float | None = None,
    solver: Solver | str | None = None,
    start: ArrayLike | None = None,
    influence: Kind | None = None,
) -> Contact:
    """The contact of a scene under a prescribed approach or total load.

    approach [length] or load [force] : the prescribed quantity, exactly one; at the approach 0 the
        undeformed sphere just touches the plane of height 0
    solver : a solver or its name in scene files, such as "conic"; default `solvers.Newton()`
    start  : (n,) [force] initial loads; if the scope is "global", the solution does not depend on
        them
    influence : compliance operator: "dense" (a matrix), "lattice" (Fourier transforms, for points
        on a lattice), "scattered" (transforms on a mesh); None for the cheapest of these

    Raises InputError for wrong values and SolverError if the solver stops without a solution.
    Loads about which nothing is proved are returned too: check `contact.certificate.scope`.

    >>> contact = cr.press(scene, approach=5e-5)
    >>> print(f"{contact.load:.4g}", (contact.status == "contact").sum(), contact.certificate.scope)
    3.609e-07 37 global
    """
    began = time.perf_counter()
    checks.instance("scene", scene, Scene)
    solver = solvers.named(solver)
    return _contact(assembled(solver, scene, approach, load, influence), solver, start, began)


def solve(
    problem: NormalProblem, solver: Solver | str | None = None, start: ArrayLike | None = None
) -> Contact:
    """The contact of an assembled problem; `solver` and `start` are as for `press`."""
    return _contact(problem, solvers.named(solver), start, time.perf_counter())


def levels_of(contact: Contact) -> Levels:
    """The normal solutions (levels) of a contact's scene at loads up to that of the contact."""
    solver: Solver = vars(contact).get("_by") or solvers.Newton()
    top: Level | None = vars(contact).get("_top")
    if top is None:  # prove the loads again
        load = contact.prescribed_load
        approach = contact.approach if load is None else None
        problem = assembled(solver, contact.scene, approach, load, contact.influence).sharpened()
        given = contact.loads[problem.candidates] / problem.units.force
        top = proved(problem, refined_loads(problem, given))
    state = top.trial
    assert state is not None
    if not top.problem.precise:
        problem = top.problem.sharpened()
        state = refined_loads(problem, state.loads)
        top = proved(problem, state, top.box)
    loads = state.loads.high

    def pressed(at_load: NormalProblem, start: Array | None) -> tuple[Array, Trial | None]:
        try:
            found = solver.solve(at_load, start)
        except SolverError:  # happens if contacts are crowded
            found = solver.solve(at_load, loads)
        return found.loads, found.trial

    return Levels(top, pressed, together=isinstance(solver, solvers.Newton))


def assembled(
    solver: Solver,
    scene: Scene,
    approach: float | None,
    load: float | None,
    influence: Kind | None = None,
    highest: float | None = None,
) -> NormalProblem:
    """The problem that `press` solves, with the asperities that can touch (see `FEW`)."""
    few = len(scene) <= FEW and isinstance(solver, solvers.Newton)
    highest = np.inf if few and highest is None and load is not None else highest
    given = {"approach": approach, "load": load, "highest": highest}
    return NormalProblem.assemble(scene, **given, influence=influence)


def _contact(
    problem: NormalProblem, solver: Solver, start: ArrayLike | None, began: float
) -> Contact:
    scene, force = problem.scene, problem.units.force
    first, top, corrected = None, None, False
    if start is not None:
        given = checks.array("start", start, length=len(scene), sign="not negative")
        first = given[problem.candidates] / force
    with problem.one_thread():
        if len(problem) == 0:  # no asperity can touch at so small an approach
            solution = Solution(np.zeros(0), float(problem.approach or 0.0), 0, 0.0)
        else:
            solution = _solved(solver, problem, first)
        state = solution.trial
        if refine := bool(solution.refine and len(problem)):
            if not is_of(state, problem, solution.loads):
                state = refined_loads(problem, solution.loads)
            corrected = not np.array_equal(state.loads.high, solution.loads)
            solution = replace(solution, loads=state.loads.high)
        loads = frozen(problem.to_scene(solution.loads * force))
        radii = discs_of(scene, loads)
        LOGGER.info("certifying")
        if refine:
            assert state is not None
            level = proved(problem, state)
            top = level if len(problem) <= MOST_KEPT[problem.influence.name] else None
        else:
            level, state = proved_near(problem, loads)
        certificate = certificate_of(level, loads, state)
    said = isinstance(solver, solvers.Newton) or solver.name.endswith("Newton step")
    contact = Contact(
        scene=scene,
        loads=loads,
        contact_radii=frozen(radii),
        approach=certificate.approach,
        load=float(loads.sum()),
        certificate=certificate,
        candidates=len(problem),
        influence=problem.influence.name,
        solver=solver.name + (" + refinement" if corrected and not said else ""),
        iterations=solution.iterations,
        seconds=time.perf_counter() - began,
        prescribed_load=None if problem.load is None else problem.load * force,
    )
    # Where `_top` is None, or a pickle omits these two, `levels_of` proves the loads again.
    contact.__dict__.update(_by=solver, _top=top)
    return contact


def _solved(solver: Solver, problem: NormalProblem, start: Array | None) -> Solution:
    """The checked solution. SolverErrors get the latest loads in the scene's units and order."""
    try:
        solution = solver.solve(problem, start)
    except SolverError as error:
        if error.iterate is not None:
            error.iterate = problem.to_scene(error.iterate * problem.units.force)
        raise
    if not isinstance(solution, Solution):
        found = type(solution).__name__
        raise SolverError(f"returned {found}, expected a Solution", solver=solver.name)
    try:
        loads = checks.array("loads", solution.loads, length=len(problem), sign="not negative")
    except InputError as error:
        raise SolverError(f"no loads were found: {error}", solver=solver.name) from error
    if problem.load is not None and not loads.any():
        raise SolverError("all loads are 0, but a total is prescribed", solver=solver.name)
    return replace(solution, loads=loads)


def among_loaded(contact: Contact) -> tuple[Indices, Influence]:
    """(m,) the loaded asperities with D0 + d_i > 0, and the compliance operator among them."""
    prescribed = contact.approach + contact.scene.offsets
    loaded = np.flatnonzero((contact.loads > 0) & (prescribed > 0))
    scale = 1.0 / (np.pi * contact.scene.material.contact_modulus)
    return loaded, couple(contact.scene, loaded, scale, contact.influence)


def model_errors(contact: Contact) -> Array:
    """(n,) relative model error of each asperity, 0 if open; the largest is `Contact.model_error`.

    The Hertz pressure of a neighbour at the distance r_ij, with the contact radius a_j and the load
    P_j, displaces the surface more than a point force P_j does. The difference is
    a_j^2 / (10 r_ij^2) times P_j / (pi E* r_ij). The model error is the sum over neighbours divided
    by D0 + d_i, with the approach D0 and the entry d_i of `Scene.offsets`.

    >>> print(f"{cr.surface.model_errors(contact).max() / contact.model_error:.6g}")
    1
    """
    checks.instance("contact", contact, Contact)
    (loaded, A), errors = among_loaded(contact), np.zeros(len(contact.scene))
    if len(loaded) > 1:
        discs = contact.loads[loaded] * contact.contact_radii[loaded] ** 2 / 10
        moved = A.scale * A.falloff(discs, 3)
        errors[loaded] = moved / (contact.approach + contact.scene.offsets[loaded])
    return frozen(errors)


def covered(scene: Scene, radii: Array) -> int:
    """`covered` of `Contact`, from contact radii (n,) [length]."""
    radii = BESIDE * radii
    discs, summits = np.flatnonzero(radii), np.flatnonzero(radii == 0)
    nearest = 0.0 if scene.lattice is None else scene.lattice.spacing
    if len(discs) == 0 or len(summits) == 0 or float(radii.max()) < 0.99 * nearest:
        return 0

    points = scene.contact_points
    under = scipy.spatial.cKDTree(points[summits]).query_ball_point(points[discs], radii[discs])
    return len({int(i) for each in under for i in each})


def turned(A: Influence, moved: Array, loads: Array) -> Array:
    """(n,) change of A P, P = `loads`, if the points of A move by `moved` (n, 2)."""
    gained = (moved * A.slopes(loads).value).sum(axis=1)
    for k in (0, 1):
        gained -= A.slopes(moved[:, k] * loads).value[:, k]
    return np.asarray(gained)
