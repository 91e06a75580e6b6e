"""Forward derivatives: what changes when a scene and its load change a little, in one direction.

One linear system for the pressed state and one for a friction state: the same as of gradients, read
the other way (docs/theory/gradients.md, "Forwards").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.gradients.adjoint import Friction
from convexrough.gradients.origin import far_radii, felt, held, pressed
from convexrough.gradients.system import TOLERANCE, System
from convexrough.influence import Influence
from convexrough.influence.choice import couple
from convexrough.record import Along, Record, Table
from convexrough.scene.scene import Scene
from convexrough.shearing.problem import TangentialProblem
from convexrough.shearing.state import ShearState

#: What a direction has one number of.
WHOLE = (
    *("sphere_radius", "contact_modulus", "poisson_ratio", "friction"),
    *("load", "approach", "force"),
)


@dataclass(frozen=True, eq=False, repr=False)
class Direction(Record):
    """A change of a scene and of what is prescribed: the parameters of `Gradient`.

    heights, tip_radii : (n,) or one number for all [length];  positions : (n, 2) [length]
    load or approach   : of what is held; where neither is given what was prescribed is held as is
    force              : of the shear force [force]; it and friction are of friction states alone

    >>> contact.change(cr.Direction(heights=1e-9)).load > 0
    True
    """

    heights: ArrayLike = 0.0
    tip_radii: ArrayLike = 0.0
    positions: ArrayLike = 0.0
    sphere_radius: float = 0.0
    contact_modulus: float = 0.0
    poisson_ratio: float = 0.0
    friction: float = 0.0
    load: float | None = None
    approach: float | None = None
    force: float = 0.0

    def __post_init__(self) -> None:
        for name in WHOLE:
            if (given := getattr(self, name)) is not None or name not in ("load", "approach"):
                object.__setattr__(self, name, checks.finite(name, given))


@dataclass(frozen=True, eq=False, repr=False)
class ContactChange(Table):
    """First-order change of a contact. Arrays are (n,), in the scene's order.

    loads : [force];  gaps : [length];  approach : [length];  load : of the total [force]

    >>> print(f"{contact.change(cr.Direction(load=1e-9)).approach:.4g}")
    8.234e-08
    """

    _along: ClassVar[Along] = {("asperity",): ("loads", "gaps")}

    contact: Contact
    direction: Direction
    loads: Array
    gaps: Array
    approach: float
    load: float


@dataclass(frozen=True, eq=False, repr=False)
class ShearChange(Table):
    """First-order change of a friction state. Arrays are (n,), in the scene's order.

    pressed : of the contact;  forces : [force];  slips : [length];  displacement : [length]

    >>> state = cr.shear(contact, force=0.25 * contact.load)
    >>> print(f"{state.change(cr.Direction(force=1e-9)).displacement:.4g}")
    1.246e-07
    """

    _along: ClassVar[Along] = {("asperity",): ("forces", "slips")}

    contact: Contact
    direction: Direction
    pressed: ContactChange
    forces: Array
    slips: Array
    displacement: float


def contact_change(
    contact: Contact, direction: Direction, *, tolerance: float = TOLERANCE
) -> ContactChange:
    """As `Contact.change`: what friction and a shear force do is asked of a friction state."""
    checks.instance("direction", direction, Direction)
    for name in ("friction", "force"):
        if (given := getattr(direction, name)) != 0.0:
            expected = "0: a contact depends on neither friction nor force; states change by both"
            raise InputError(name, found=given, expected=expected)
    return _pressed_change(contact, direction, tolerance)


def _pressed_change(contact: Contact, direction: Direction, tolerance: float) -> ContactChange:
    """Of the contact alone.

    zeta + A (c0 zeta) = dd - P^(2/3) dk - dA P + dD0,  dP = c0 zeta;  sum dP = dP under load.
    """
    if direction.load is not None and direction.approach is not None:
        found, expected = "both", "at most one of the two, as only one is held"
        raise InputError("load, approach", found=found, expected=expected)
    holding = held(contact, None)
    if direction.load is not None or direction.approach is not None:
        holding = "approach" if direction.load is None else "load"
    problem = pressed(contact)
    bent = _Bent.of(contact, direction)
    units, touching = problem.units, problem.touching
    turned = bent.coupling(problem.influence, touching, problem.loads)
    local = problem.ceilings * bent.local[touching]
    right = bent.offsets[touching] / units.length - local - turned
    system = System(problem, problem.stiffest, tolerance)
    if holding == "load":
        solution = system.solve(right, (direction.load or 0.0) / units.force)
        approach = solution.shift * units.length
    else:
        approach = direction.approach or 0.0
        solution = system.solve(right + approach / units.length)
    loads = problem.stiffest * solution.values
    apart = np.flatnonzero(contact.loads == 0.0)
    return ContactChange(
        contact=contact,
        direction=direction,
        loads=frozen(problem.to_scene(loads * units.force)),
        gaps=frozen(_gap_changes(contact, problem, bent, apart, loads, approach)),
        approach=approach,
        load=float(loads.sum()) * units.force,
    )


def _gap_changes(
    contact: Contact,
    problem: TangentialProblem,
    bent: _Bent,
    apart: Indices,
    loads: Array,
    approach: float,
) -> Array:
    """(n,) [length] of open asperities: dg = A dP + dA P - dd - dD0."""
    scene, changes = contact.scene, np.zeros(len(contact.scene))
    if len(apart) == 0:
        return changes
    everywhere = np.arange(len(scene))
    influence = couple(scene, everywhere, problem.influence.scale, contact.influence)
    moved = influence.apply(problem.to_scene(loads))
    moved += bent.coupling(influence, everywhere, problem.to_scene(problem.loads))
    gap = moved * problem.units.length - bent.offsets - approach
    changes[apart] = gap[apart]
    return changes


def shear_change(
    state: ShearState, direction: Direction, *, tolerance: float = TOLERANCE
) -> ShearChange:
    """As `ShearState.change`.

    m = sigma x dP - c eta dlog k,  Y + A (c Y) = beta - dA u - A m,  sum c Y = dT - sum m;
    du = m + c Y,  dDelta = beta,  d|slip| = sigma Y - C (dlog k + 2 dP / (3 P)) where sliding.
    """
    contact = state.contact
    checks.instance("direction", direction, Direction)
    first = _pressed_change(contact, direction, tolerance)
    problem, bent = pressed(contact), _Bent.of(contact, direction)
    there = Friction.of_state(problem, state)
    felt(problem, "force", np.array([there.total]))
    sign = -1.0 if state.force < 0 else 1.0
    if problem.at_limit(np.array([there.total]))[0]:
        expected = "a force below f P, where the derivative is finite"
        raise InputError("force", found=f"{state.force}: gross sliding", expected=expected)
    touching, f = problem.touching, problem.friction
    dP = first.loads[touching] / problem.units.force
    local = bent.local[touching]
    dT = sign * direction.force / problem.force_unit - there.total * direction.friction / f
    m = there.signs * there.widths * dP - there.slopes * there.deflections * local
    turned = bent.coupling(problem.influence, touching, there.increments)
    system = System(problem, there.slopes, tolerance)
    solution = system.solve(-turned - problem.couple(m), dT - float(m.sum()))
    du = m + there.slopes * solution.values
    ceilings = problem.ceilings * (local + 2.0 * dP / (3.0 * problem.loads))
    slides = np.where(there.slides, solution.values - there.signs * ceilings, 0.0)
    nu = contact.scene.material.poisson_ratio
    ratio = direction.poisson_ratio / ((1.0 - nu) * (2.0 - nu)) + direction.friction / f
    travel = sign * problem.travel_unit
    slips = problem.to_scene(travel * slides) + state.slips * ratio
    forces = (
        problem.to_scene(sign * problem.force_unit * du) + state.forces * direction.friction / f
    )
    return ShearChange(
        contact=contact,
        direction=direction,
        pressed=first,
        forces=frozen(forces),
        slips=frozen(slips),
        displacement=travel * solution.shift + state.displacement * ratio,
    )


@dataclass(frozen=True, eq=False)
class _Bent:
    """What a direction does to a scene: (n,) each, and (n, 2).

    offsets : dd [length];  local : d log k;  points : of the contact points [length]
    modulus : d log E*
    """

    offsets: Array
    local: Array
    points: Array
    modulus: float

    @classmethod
    def of(cls, contact: Contact, direction: Direction) -> _Bent:
        scene: Scene = contact.scene
        n, asperities, R = len(scene), scene.asperities, scene.sphere_radius
        heights = checks.array("heights", direction.heights, length=n)
        tips = checks.array("tip_radii", direction.tip_radii, length=n)
        moved = _moved(direction.positions, n)
        sphere = direction.sphere_radius
        modulus = direction.contact_modulus / scene.material.contact_modulus
        points, rho = asperities.positions, asperities.tip_radii
        far = far_radii(contact, np.arange(n))
        closest = scene.geometry == "closest"
        dfar = sphere + (tips if closest else 0.0)
        r2 = (points**2).sum(axis=1)
        sunk = (points * moved).sum(axis=1) / far - r2 * dfar / (2.0 * far**2)
        radii = scene.relative_radii * (sphere / R**2 + tips / rho**2)  # d log R_i
        if closest:
            turned = (sphere * rho - tips * R) / far**2
            moved = moved * (R / far)[:, None] + points * turned[:, None]
        return cls(heights - sunk, -(2.0 * modulus + radii) / 3.0, moved, modulus)

    def coupling(self, influence: Influence, places: Indices, loads: Array) -> Array:
        """(n,) dA loads among the asperities at these places."""
        change = -self.modulus * influence.apply(loads)
        points = self.points[places]
        if points.any():
            change += (points * influence.slopes(loads)).sum(axis=1)
            for k in (0, 1):
                change -= influence.slopes(points[:, k] * loads)[:, k]
        return np.asarray(change)


def _moved(positions: ArrayLike, n: int) -> Array:
    """(n, 2) checked; one number stands for all."""
    expected = f"({n}, 2) finite numbers: x and y of each asperity"
    try:
        if np.asarray(positions).dtype.kind not in "biuf":
            raise TypeError("no real numbers")
        moved = np.asarray(positions, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError("positions", found=repr(positions)[:60], expected=expected) from error
    if moved.shape not in ((), (n, 2)):
        raise InputError("positions", found=f"shape {moved.shape}", expected=expected)
    if not (np.abs(moved) <= checks.LARGEST).all():  # nan is not
        raise InputError("positions", found="numbers that are not finite", expected=expected)
    return np.broadcast_to(moved, (n, 2))
