"""`load_path`: friction states along a path of load and shear force; `history`: at one load."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arithmetic.balls import of_rows
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact, press
from convexrough.errors import InputError
from convexrough.friction.conic_step import ConicStepper
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.general_step import Stepper
from convexrough.friction.levels import FrictionLevels, height_at, rounded
from convexrough.friction.order import Order
from convexrough.friction.walk import Walk
from convexrough.influence import Kind
from convexrough.plottable import Plottable
from convexrough.record import Along, Table
from convexrough.scene.scene import Scene

if TYPE_CHECKING:
    from convexrough.gradients.gradient import Gradient, Holding

#: The smallest ratio of two positive loads of a path; smaller ratios could underflow in float64.
LEAST_PART = 1e-250

#: How general steps are solved, by the name of the solver.
STEPPERS: dict[str, type[Stepper]] = {"newton": Stepper, "conic": ConicStepper}


@dataclass(frozen=True, eq=False, repr=False)
class LoadPath(Table, Plottable):
    """The friction states at m points of a path (P, Q) with straight segments between them.

    contact        : the contact at the highest load of the path
    loads, forces  : (m,) [force] load P and shear force Q
    displacements  : (m,) [length] tangential displacement X of one body relative to the other, at
        distant points
    approaches     : (m,) [length] approach D0; at the load 0, the approach at the first touch
    losses         : (m,) [force length] energy lost by both bodies since the start
    asperity_forces, asperity_loads : (m, n) [force] shear force Q_i and load P_i of each asperity
    drifts         : (m, n) [length] tangential displacement of each asperity relative to the
        opposite surface, also while it is open; 0 for asperities that cannot touch along the path
    asperity_displacements : (m, n) [length] drift plus the displacement that the own force causes
    displacement_errors, loss_errors, asperity_force_errors : proved bounds on the errors; infinite
        where nothing is proved
    fronts         : (m,) [force] load down to which the contact slips on arrival at the point; nan
        if nothing slips then. A segment along which P and Q do not change does not change fronts
        and status. Not valid if `order` is "fails"
    status : (m, n) status on arrival at the point: "stuck" (no slip), "partial" (a disc sticks),
        "sliding" (the whole asperity slides), "open" (no contact) or "undecided"
    curves         : the memory curve after each point; not valid if `order` is "fails"
    order          : "proved" if order (docs/theory/states.md) is proved between the lowest and the
        highest load of all normal solutions used; other values as in `Cycle`
    presses        : number of normal problems that were solved
    start          : [force] load of the contact at the start; 0 if the bodies are separate
    """

    _along: ClassVar[Along] = {
        ("point",): (
            *("loads", "forces", "displacements", "displacement_errors", "approaches"),
            *("losses", "loss_errors", "fronts"),
        ),
        ("point", "asperity"): (
            *("asperity_forces", "asperity_force_errors", "asperity_loads"),
            *("asperity_displacements", "drifts", "status"),
        ),
    }

    contact: Contact
    loads: Array
    forces: Array
    displacements: Array
    displacement_errors: Array
    approaches: Array
    losses: Array
    loss_errors: Array
    asperity_forces: Array
    asperity_force_errors: Array
    asperity_loads: Array
    asperity_displacements: Array
    drifts: Array
    fronts: Array
    status: NDArray[np.str_]
    curves: tuple[MemoryCurve, ...]
    order: Order
    presses: int
    start: float

    @property
    def scene(self) -> Scene:
        """The scene of the contact."""
        return self.contact.scene

    @property
    def load_constant(self) -> bool:
        """True if the load of every point is the load at the start, as in a history."""
        return bool((self.loads == self.start).all())

    @property
    def slips(self) -> Array:
        """(m, n) [length] slip of each asperity as a whole: its drift while it touches, else 0."""
        return frozen(np.where(self.asperity_loads > 0, self.drifts, 0.0))

    def gradient(
        self,
        *,
        losses: ArrayLike | None = None,
        displacements: ArrayLike | None = None,
        holding: Holding | None = None,
    ) -> Gradient:
        """Derivatives of a weighted sum of losses and displacements, by data of scene and path.

        losses, displacements : (m,) weights of `losses` and `displacements`; by default the weight
            of the last loss is 1, and all other weights are 0
        holding : quantity kept constant, as in `Contact.gradient`. All derivatives but those by
            `forces` are taken at constant forces Q, not at constant Q / (f P)

        Raises InputError where there is no derivative, as for a history in gross sliding.

        >>> past = cr.history(contact, forces=contact.load * np.array([0.3, -0.3]))
        >>> print([f"{each:.3g}" for each in past.gradient().forces])
        ['5.88e-06', '-2.94e-06']
        """
        from convexrough.gradients.results import path_gradient  # a higher layer

        return path_gradient(self, holding, losses=losses, displacements=displacements)


def load_path(
    scene: Scene,
    *,
    loads: ArrayLike,
    forces: ArrayLike,
    start: Contact | None = None,
    influence: Kind | None = None,
    general_steps: int | None = None,
    solver: Literal["newton", "conic"] = "newton",
) -> LoadPath:
    """The friction states along a path of load and shear force with straight segments.

    docs/theory/paths.md gives the rules.

    loads, forces : (m,) [force] load P and shear force Q at the points, |Q| <= f P; the bodies
        separate where P = 0. As in `shear`, Q counts as f P if they differ only by rounding
    start     : a pressed contact of this scene, without shear; default: the bodies are separate
    influence : how the compliance matrix is stored, as in `press`; with None, in the cheapest way
    general_steps : number of general steps per segment (docs/theory/without-order.md), whose
        results are not proved. With None, the states come from the memory curve; if order fails and
        the normal solution of the contact is proved, from 16, 32 or 64 general steps per segment
    solver    : method for general steps, if there are any: "newton", or "conic" for a second-order
        cone program. If order is proved, one step per segment gives the states of the memory curve;
        losses need more steps

    Raises InputError for an empty path, negative loads, shear forces that exceed f P, a scene
    without friction, or a `start` of another scene; SolverError if a normal problem or a general
    step is not solved, or if asperities are too dense for a cone program.

    >>> P = contact.load
    >>> path = cr.load_path(scene, loads=[P / 2, P, P / 2], forces=[0.0, 0.3 * P, 0.1 * P])
    >>> (path.displacements > 0).tolist(), path.presses
    ([False, True, True], 4)
    """
    if general_steps is not None:
        general_steps = checks.whole("general_steps", general_steps)
    if not isinstance(solver, str) or solver not in STEPPERS:
        raise InputError("solver", found=repr(solver), expected=f"one of {', '.join(STEPPERS)}")
    contact, walk = walk_of(scene, loads, forces, start, influence)
    return path_of(contact, replace(walk, steps=general_steps, stepper=STEPPERS[solver]))


def history(contact: Contact, *, forces: ArrayLike) -> LoadPath:
    """The friction states along a sequence of shear forces at constant load P.

    docs/theory/paths.md gives the rules.

    forces : (m,) [force] shear forces Q, |Q| <= f P, starting from the contact without shear. As in
        `shear`, Q counts as f P if they differ only by rounding

    Raises InputError if the scene has no friction, if m = 0, or if a force exceeds f P.

    >>> past = cr.history(contact, forces=contact.load * np.array([0.4, 0.0]))
    >>> print([f"{moved:.3g}" for moved in past.displacements])  # the way back is not the way there
    ['1.81e-05', '2.66e-06']
    """
    checks.instance("contact", contact, Contact)
    f = checks.friction(contact.scene.friction)
    levels = contact.cached(FrictionLevels)
    Q = checks.bearable("forces", checks.array("forces", forces), f * float(levels.load))
    checks.some("forces", Q)
    points = [(levels.load, levels.height(force)) for force in Q.tolist()]
    return path_of(contact, Walk(levels, MemoryCurve.pressed(levels.load), points))


def walk_of(
    scene: Scene, loads: ArrayLike, forces: ArrayLike, start: Contact | None, influence: Kind | None
) -> tuple[Contact, Walk]:
    """The contact at the highest load of a path, and the path; arguments as in `load_path`."""
    checks.instance("scene", scene, Scene)
    f = checks.friction(scene.friction)
    P, Q = checks.array("loads", loads, sign="not negative"), checks.array("forces", forces)
    if len(P) == 0 or len(P) != len(Q):
        found = f"{len(P)} loads and {len(Q)} forces"
        raise InputError("loads, forces", found=found, expected="equal numbers, at least one")
    if len(bare := np.flatnonzero((P == 0) & (Q != 0))):
        expected = "0 at a load of 0: shear must end before contact is lost"
        raise InputError(f"forces[{bare[0]}]", found=Q[bare[0]], expected=expected)
    checks.bearable("forces", Q, f * P)
    pairs = zip(map(Fraction, P.tolist()), Q.tolist(), strict=True)
    points, curve = [(load, height_at(load, force, scene)) for load, force in pairs], MemoryCurve()
    if start is not None:
        checks.instance("start", start, Contact)
        if start.scene is not scene:
            expected = "a contact whose scene is this very object: pass start.scene"
            raise InputError("start", found="a contact of another scene", expected=expected)
        curve = MemoryCurve.pressed(start.cached(FrictionLevels).load)
    if positive := [float(load) for load in (curve.load, *(load for load, _ in points)) if load]:
        if min(positive) < LEAST_PART * max(positive):
            expected = f"0, or at least {LEAST_PART:g} of the largest load, {max(positive):g}"
            raise InputError("loads", found=min(positive), expected=expected)
        contact = press(scene, load=max(positive), influence=influence)
    else:  # at the first touch
        contact = press(scene, approach=-float(scene.offsets.max()))
    return contact, Walk(contact.cached(FrictionLevels), curve, points)


def path_of(contact: Contact, walk: Walk) -> LoadPath:
    """The result for a path whose highest load is that of the contact."""
    levels, points = walk.levels, [load for load, _ in walk.points]
    levels.prepare([*walk.needed, *points])
    (losses, loss_errors), (moved, *each) = walk.losses(), walk.states()
    displacements, displacement_errors = rounded(moved)
    found = (rounded(of_rows(levels.to_scene, it)) for it in each)
    (asperity_forces, force_errors), own, drifts = found
    rows = levels.rows(points)
    fronts = [np.nan if curve.front is None else float(curve.front) for curve in walk.curves]
    return LoadPath(
        contact=contact,
        loads=frozen(np.array(points, dtype=np.float64)),
        forces=walk.forces,
        displacements=displacements,
        displacement_errors=displacement_errors,
        approaches=frozen(rows.approach.value * levels.units.length + 0.0),
        losses=losses,
        loss_errors=loss_errors,
        asperity_forces=asperity_forces,
        asperity_force_errors=force_errors,
        asperity_loads=frozen(levels.to_scene(rows.loads.value * levels.units.force)),
        asperity_displacements=own[0],
        drifts=drifts[0],
        fronts=frozen(np.array(fronts)),
        status=walk.status(),
        curves=tuple(walk.curves),
        order=walk.order,
        presses=levels.presses,
        start=float(walk.start.load),
    )
