"""`load_path`: any sequence of normal and shear loads, by the memory curve.

docs/theory/load-paths.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact
from convexrough.drawn import Drawn
from convexrough.errors import InputError
from convexrough.influence import Kind
from convexrough.paths.energy import loss
from convexrough.paths.general_step import Stepper, stepped
from convexrough.paths.levels import Levels
from convexrough.paths.memory import MemoryCurve, Piece
from convexrough.paths.order import Order, order_of
from convexrough.paths.state import levels_of, states_of, words
from convexrough.progress import Announce
from convexrough.record import Along, Table
from convexrough.scene.scene import Scene

#: General steps per segment where order fails: of second order, so good to about a per cent.
STEPS = 8


@dataclass(frozen=True, eq=False, repr=False)
class LoadPath(Table, Drawn):
    """A sequence of m points (P, Q), with straight segments between. Errors are proved bounds.

    loads, applied : (m,) P and Q [force]
    displacements  : (m,) X [length], both bodies;  displacement_errors : (m,) [length]
    approaches     : (m,) D0 [length]; before the first contact that of the first touch
    energy         : (m,) lost since the beginning [force length];  energy_errors : (m,)
    forces         : (m, n) Q_i [force];  force_errors : (m, n)
    normal_loads   : (m, n) P_i [force]
    asperity_displacements : (m, n) own deflection and drift, without the others' influence [length]
    drifts         : (m, n) position of each asperity against its partner, also while open [length]
    fronts         : (m,) [force] level down to which the contact slips; nan where all sticks
    status         : (m, n) "stuck", "partial", "sliding", "open" or "undecided"
    curves         : the memory curve after each point; it and the fronts rest on order
    order          : whether indentations rise with the load, which errors and words rest on
    presses        : how many normal problems were solved

    >>> path = cr.load_path(scene, loads=[contact.load], forces=[0.1 * contact.load])
    >>> path.order, path.status.shape, path.presses
    ('proved at the levels used', (1, 61), 1)
    """

    _along: ClassVar[Along] = {
        ("point",): (
            *("loads", "applied", "displacements", "displacement_errors", "approaches"),
            *("energy", "energy_errors", "fronts"),
        ),
        ("point", "asperity"): (
            *("forces", "force_errors", "normal_loads"),
            *("asperity_displacements", "drifts", "status"),
        ),
    }

    scene: Scene
    loads: Array
    applied: Array
    displacements: Array
    displacement_errors: Array
    approaches: Array
    energy: Array
    energy_errors: Array
    forces: Array
    force_errors: Array
    normal_loads: Array
    asperity_displacements: Array
    drifts: Array
    fronts: Array
    status: NDArray[np.str_]
    curves: tuple[MemoryCurve, ...]
    order: Order
    presses: int


def load_path(
    scene: Scene,
    *,
    loads: ArrayLike,
    forces: ArrayLike,
    start: Contact | None = None,
    influence: Kind | None = None,
    steps: int | None = None,
    announce: Announce | None = None,
) -> LoadPath:
    """Any path of the total load P and the shear force Q, |Q| <= f P, straight between its points.

    loads, forces : (m,) P and Q at its points [force]; a load of 0 is pulled off
    start     : a pressed contact of this scene, without shear; else the path starts from no contact
    influence : how to couple the asperities; None for the cheapest that is exact
    steps     : take the general step, which assumes no order, so many times per segment; None for
        the memory curve, and STEPS of these where order fails. Nothing is proved of what they find.
    announce  : told in a line how far long work has come

    Raises InputError for an empty path, loads that are negative, shear beyond f P (where, and by
    how much) or left at a load of 0; SolverError where a normal problem is not solved.

    >>> P = contact.load
    >>> path = cr.load_path(scene, loads=[P / 2, P, P / 2], forces=[0.0, 0.3 * P, 0.1 * P])
    >>> (path.displacements > 0).tolist(), path.presses
    ([False, True, True], 4)
    """
    return walk(scene, loads, forces, start, influence, steps, announce)


def walk(
    scene: Scene,
    loads: ArrayLike,
    forces: ArrayLike,
    start: Contact | None = None,
    influence: Kind | None = None,
    steps: int | None = None,
    announce: Announce | None = None,
    stepper: type[Stepper] = Stepper,
) -> LoadPath:
    """`load_path`, with a choice of how a general step is solved."""
    points = points_of(scene, loads, forces)
    curve = MemoryCurve()
    if start is not None:
        curve = MemoryCurve.pressed(_same_scene(scene, start).load)
        influence = influence or start.influence
    curves, costs = follow(curve, points)
    highest = max(float(load) for load in (curve.load, *(load for load, _ in points)))
    levels = Levels(scene, highest, influence, announce)
    for each, pieces in zip(curves, costs, strict=True):
        levels.need(levels_of(each, pieces))
    order = order_of(levels)
    if steps is None and order == "fails":
        steps = STEPS
    if steps is None:
        found = states_of(levels, curves)
        energy, energy_errors = np.cumsum([loss(levels, each) for each in costs], axis=0).T
        status = np.array([words(levels, each) for each in curves])
    else:
        bundles = stepper(levels).along(curve, points, _count(steps))
        found, energy, status = stepped(levels, bundles)
        energy_errors = np.full(len(points), np.inf)
    here = [levels.at(load) for load, _ in points]
    return LoadPath(
        scene=scene,
        loads=frozen(np.array([each.load for each in here])),
        applied=frozen(np.array(forces, dtype=np.float64)),
        approaches=frozen(np.array([each.approach for each in here]) - scene.offsets.max()),
        energy=frozen(energy),
        energy_errors=frozen(energy_errors),
        normal_loads=frozen(np.array([each.loads for each in here])),
        fronts=frozen(np.array([np.nan if c.front is None else float(c.front) for c in curves])),
        status=frozen(status),
        curves=tuple(curves),
        order=order,
        presses=levels.presses,
        **found._asdict(),
    )


def points_of(scene: Scene, loads: ArrayLike, forces: ArrayLike) -> list[tuple[Fraction, Fraction]]:
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
        checks.bearable(f"forces[{k}]", float(Q[k]), f * P[k])
    limited = [Fraction(p) for p in P]
    heights = [Fraction(q) / Fraction(f) for q in Q]
    return [(p, min(max(t, -p), p)) for p, t in zip(limited, heights, strict=True)]


def follow(
    curve: MemoryCurve, points: Sequence[tuple[Fraction, Fraction]]
) -> tuple[list[MemoryCurve], list[list[Piece]]]:
    """The memory curve after each point, and the pieces that each segment costs."""
    curves: list[MemoryCurve] = []
    costs: list[list[Piece]] = []
    for load, height in points:
        curve, pieces = curve.go(load, height)
        curves.append(curve)
        costs.append(pieces)
    return curves, costs


def _same_scene(scene: Scene, start: Contact) -> Contact:
    if start.scene is not scene:
        raise InputError("start", found="a contact of another scene", expected="one of this scene")
    return start


def _count(steps: int) -> int:
    if not isinstance(steps, int) or steps < 1:
        raise InputError("steps", found=steps, expected="a whole number, at least 1")
    return steps
