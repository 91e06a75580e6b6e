"""Any sequence of normal and shear loads, by the memory curve: docs/theory/paths.md.

`load_path` follows any (P, Q), `history` shear forces at constant P.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact, press
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve, Piece
from convexrough.friction.general_step import Stepper, followed
from convexrough.friction.levels import FrictionLevels, rounded
from convexrough.friction.loss import losses
from convexrough.friction.order import Order
from convexrough.friction.shear import limited
from convexrough.friction.state import States, states_of, statuses_of, used_by
from convexrough.influence import Kind
from convexrough.numbers.balls import TINY, UP, Ball
from convexrough.numbers.pairs import PAIR_ROUNDOFF, Pair
from convexrough.plottable import Plottable
from convexrough.record import Along, Table
from convexrough.roundoff import SAFETY
from convexrough.scene.scene import Scene

if TYPE_CHECKING:
    from convexrough.gradients.gradient import Gradient, Holding

Point = tuple[Fraction, Fraction]  # (P, T = Q / f)


@dataclass(frozen=True, eq=False, repr=False)
class Path(Table, Plottable):
    """A sequence of m points (P, Q), with straight segments between. Errors are proved bounds.

    loads, forces  : (m,) P and Q [force]
    displacements  : (m,) X [length], both bodies;  displacement_errors : (m,) [length]
    approaches     : (m,) D0 [length]; before the first contact that of the first touch
    losses         : (m,) energy lost since the beginning [force length];  loss_errors : (m,)
    asperity_forces : (m, n) Q_i [force];  asperity_force_errors : (m, n)
    asperity_loads : (m, n) P_i [force]
    asperity_displacements : (m, n) own deflection and drift, without the others' influence [length]
    drifts         : (m, n) position of each asperity against its partner, also while open [length]
    fronts         : (m,) [force] level down to which the contact slips; nan where all sticks
    status         : (m, n) "stuck", "partial", "sliding", "open" or "undecided"
    curves         : the memory curve after each point; it and the fronts rest on order
    order          : "proved" that no indentation falls with the load, as far as the path asks;
        "proved for one step": statuses and bounds of states are those of the program with one step
        for each segment, and no loss is proved; "fails": general steps answer, without a proof
    presses        : how many normal problems were solved
    start          : [force] the load of the pressed contact that it starts from; 0 of none
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
        """What is pressed."""
        return self.contact.scene


@dataclass(frozen=True, eq=False, repr=False)
class LoadPath(Path):
    """What `load_path` finds; its fields are those of `Path`.

    >>> path = cr.load_path(scene, loads=[contact.load], forces=[0.1 * contact.load])
    >>> path.order, path.status.shape, path.presses
    ('proved', (1, 61), 2)
    """

    def gradient(self, *, displacement: float | None = None) -> Gradient:
        """Derivatives of the loss up to the last point with respect to the scene and all loads.

        displacement : a weight on the last displacement instead

        Raises InputError where there is no derivative.
        """
        from convexrough.gradients.losses import path_gradient  # a floor above: when asked

        return path_gradient(self, displacement=displacement)


@dataclass(frozen=True, eq=False, repr=False)
class History(Path):
    """What `history` finds, at constant normal load from a pressed contact; fields as of `Path`.

    slips : (m, n) gross slip [length] of those that touch

    >>> past = cr.history(contact, forces=contact.load * np.array([0.4, -0.4, 0.4]))
    >>> past.asperity_forces.shape, bool((np.diff(past.losses) > 0).all())
    ((3, 61), True)
    """

    @property
    def slips(self) -> Array:
        """(m, n) gross slip [length] of those that touch; 0 of others."""
        return frozen(np.where(self.contact.loads > 0, self.drifts, 0.0))

    def gradient(
        self,
        *,
        losses: ArrayLike | None = None,
        displacements: ArrayLike | None = None,
        holding: Holding | None = None,
    ) -> Gradient:
        """Derivatives of a weighted sum over the points: one pressed state for all reversals.

        losses, displacements : (m,) weights on them, at least one of the two
        holding : as in `Contact.gradient`; the forces of all points are held

        Raises InputError where the history has reached gross sliding.

        >>> past = cr.history(contact, forces=contact.load * np.array([0.3, -0.3]))
        >>> print([f"{each:.3g}" for each in past.gradient(losses=[0, 1]).forces])
        ['5.88e-06', '-2.94e-06']
        """
        from convexrough.gradients.losses import history_gradient  # a floor above: when asked

        return history_gradient(self, losses=losses, displacements=displacements, holding=holding)


def load_path(
    scene: Scene,
    *,
    loads: ArrayLike,
    forces: ArrayLike,
    start: Contact | None = None,
    influence: Kind | None = None,
    steps: int | None = None,
) -> LoadPath:
    """Any path of the total load P and the shear force Q, |Q| <= f P, straight between its points.

    loads, forces : (m,) P and Q at its points [force]; a load of 0 is pulled off
    start     : a pressed contact of this scene, without shear; else the path starts from no contact
    influence : how to couple the asperities; None for the cheapest that is exact
    steps     : take the general step, which assumes no order, so many times per segment; None for
        the memory curve, and as many as are needed where order fails. Nothing is proved of them.

    Raises InputError for an empty path, loads that are negative, shear beyond f P (where, and by
    how much) or left at a load of 0; SolverError where a normal problem is not solved.

    >>> P = contact.load
    >>> path = cr.load_path(scene, loads=[P / 2, P, P / 2], forces=[0.0, 0.3 * P, 0.1 * P])
    >>> (path.displacements > 0).tolist(), path.presses
    ([False, True, True], 4)
    """
    return walk(scene, loads, forces, start, influence, steps)


def history(contact: Contact, *, forces: ArrayLike) -> History:
    """Any sequence of shear forces (m,) [force], |Q| <= f P, from the freshly pressed contact.


    >>> past = cr.history(contact, forces=contact.load * np.array([0.4, 0.0]))
    >>> print([f"{moved:.3g}" for moved in past.displacements])  # the way back is not the way there
    ['1.81e-05', '2.66e-06']
    """
    checks.instance("contact", contact, Contact)
    f = checks.friction(contact.scene.friction)
    Q = checks.bearable("forces", checks.array("forces", forces), f * contact.load)
    if contact.load == 0.0 or len(Q) == 0:
        return History(contact, **_nothing(contact, Q))
    load = contact.cached(FrictionLevels).load
    points = [point_at(load, q, contact.scene) for q in Q.tolist()]
    start = MemoryCurve.pressed(load)
    fields = _followed(contact, start, points, None, Stepper)
    return History(contact, forces=frozen(np.array(Q)), **fields)


def walk(
    scene: Scene,
    loads: ArrayLike,
    forces: ArrayLike,
    start: Contact | None = None,
    influence: Kind | None = None,
    steps: int | None = None,
    stepper: type[Stepper] = Stepper,
) -> LoadPath:
    """`load_path`, with a choice of how a general step is solved."""
    points = points_of(scene, loads, forces)
    if steps is not None and (not isinstance(steps, int) or steps < 1):
        raise InputError("steps", found=steps, expected="a whole number, at least 1")
    curve = MemoryCurve()
    if start is not None:
        curve = MemoryCurve.pressed(_same_scene(scene, start).cached(FrictionLevels).load)
        influence = influence or start.influence
    contact = pressed_for(scene, [curve.load, *(load for load, _ in points)], influence)
    Q = frozen(np.array(forces, dtype=np.float64))
    if contact.load == 0.0:
        return LoadPath(contact, **_nothing(contact, Q))
    return LoadPath(contact, forces=Q, **_followed(contact, curve, points, steps, stepper))


def pressed_for(scene: Scene, loads: Sequence[Fraction], influence: Kind | None) -> Contact:
    """The scene at the highest of these loads."""
    if highest := float(max(loads)):
        return press(scene, load=highest, influence=influence)
    apart = 1e-9 * float(scene.asperities.tip_radii.max())
    return press(scene, approach=-float(scene.offsets.max()) - apart)


def points_of(scene: Scene, loads: ArrayLike, forces: ArrayLike) -> list[Point]:
    """(P, T = Q / f) of each point, exactly; each checked."""
    f = checks.friction(scene.friction)
    P = checks.array("loads", loads, sign="not negative")
    Q = checks.array("forces", forces)
    if len(P) == 0 or len(P) != len(Q):
        found = f"{len(P)} loads and {len(Q)} forces"
        raise InputError("loads, forces", found=found, expected="as many of both, at least one")
    bare = (P == 0) & (Q != 0)
    if bare.any():
        k = int(np.argmax(bare))
        expected = "0, as the load is 0 there: shear must be gone before contact is lost"
        raise InputError(f"forces[{k}]", found=Q[k], expected=expected)
    for k in np.flatnonzero(np.abs(Q) > f * P).tolist():
        checks.bearable(f"forces[{k}]", float(Q[k]), float(f * P[k]))
    return [point_at(Fraction(p), q, scene) for p, q in zip(P.tolist(), Q.tolist(), strict=True)]


def point_at(load: Fraction, force: float, scene: Scene) -> Point:
    """(P, T = Q / f), exactly."""
    return load, limited(load, Fraction(force) / Fraction(checks.friction(scene.friction)))


def follow(
    curve: MemoryCurve, points: Sequence[Point]
) -> tuple[list[MemoryCurve], list[list[Piece]]]:
    """The memory curve after each point, and the pieces that each segment costs."""
    curves: list[MemoryCurve] = []
    costs: list[list[Piece]] = []
    for load, height in points:
        curve, pieces = curve.go(load, height)
        curves.append(curve)
        costs.append(pieces)
    return curves, costs


def levels_needed(curves: Sequence[MemoryCurve], pieces: Sequence[Piece]) -> set[Fraction]:
    """The loads of all levels that states and losses rest on."""
    along = {
        load
        for piece in pieces
        for load in (piece.top, piece.bottom, piece.load_before, piece.load_after)
    }
    return used_by(curves) | along


def _followed(
    contact: Contact,
    start: MemoryCurve,
    points: Sequence[Point],
    steps: int | None,
    stepper: type[Stepper],
) -> dict[str, Any]:
    """All fields of a path but its contact and its forces."""
    levels = contact.cached(FrictionLevels)
    curves, costs = follow(start, points)
    pieces = [piece for each in costs for piece in each]
    needed = levels_needed(curves, pieces)
    levels.prepare([*needed, *(load for load, _ in points)])
    order = levels.order(needed)
    found: States
    if steps is None and (order != "fails" or not levels.proved):
        found = states_of(levels, curves)
        spent, spent_errors = rounded(_cumulated(losses(levels, costs)) * levels.loss_unit)
        status = np.array([statuses_of(levels, each, order) for each in curves])
        if order == "fails":
            found = found.unproved()
        if order != "proved":
            spent_errors = frozen(np.full(len(points), np.inf))
    else:
        answer = followed(levels, start, points, steps, stepper)
        found, spent, status = answer.states, answer.losses, answer.status
        spent_errors = frozen(np.full(len(points), np.inf))
    here = [levels.at(load) for load, _ in points]
    force, length = levels.units.force, levels.units.length
    return {
        "loads": frozen(np.array([float(load) for load, _ in points])),
        "displacements": found.displacements,
        "displacement_errors": found.displacement_errors,
        "approaches": frozen(np.array([float(each.approach.value) * length for each in here])),
        "losses": spent,
        "loss_errors": spent_errors,
        "asperity_forces": found.forces,
        "asperity_force_errors": found.force_errors,
        "asperity_loads": frozen(
            levels.to_scene(np.array([each.loads.value * force for each in here]))
        ),
        "asperity_displacements": found.asperity_displacements,
        "drifts": found.drifts,
        "fronts": frozen(np.array([np.nan if c.front is None else float(c.front) for c in curves])),
        "status": frozen(status),
        "curves": tuple(curves),
        "order": order,
        "presses": levels.presses,
        "start": float(start.load),
    }


def _cumulated(each: Ball) -> Ball:
    """(m,) the sums of the first, the first two, ..."""
    total, error, sums = Pair(0.0, 0.0), 0.0, []
    for high, low, radius in zip(
        *(part.tolist() for part in (*each.mid, each.radius)), strict=True
    ):
        total = total + Pair(high, low)
        error += radius + PAIR_ROUNDOFF * abs(total.high) + TINY
        sums.append((*total, error * UP))
    found = np.array(sums).reshape(-1, 3).T
    return Ball(Pair(found[0], found[1]), found[2] * (1 + SAFETY))


def _nothing(contact: Contact, forces: Array) -> dict[str, Any]:
    """The fields of a path on which nothing ever touches, or of no points."""
    m, n = len(forces), len(contact.scene)
    zero, none = frozen(np.zeros(m)), frozen(np.zeros((m, n)))
    approach = -float(contact.scene.offsets.max())
    return {
        "loads": zero,
        "forces": frozen(np.array(forces, dtype=np.float64)),
        "displacements": zero,
        "displacement_errors": zero,
        "approaches": frozen(np.full(m, approach)),
        "losses": zero,
        "loss_errors": zero,
        "asperity_forces": none,
        "asperity_force_errors": none,
        "asperity_loads": none,
        "asperity_displacements": none,
        "drifts": none,
        "fronts": frozen(np.full(m, np.nan)),
        "status": frozen(np.full((m, n), "open", dtype="<U12")),
        "curves": (MemoryCurve(),) * m,
        "order": "proved",
        "presses": 0,
        "start": 0.0,
    }


def _same_scene(scene: Scene, start: Contact) -> Contact:
    if start.scene is not scene:
        raise InputError("start", found="a contact of another scene", expected="one of this scene")
    return start
