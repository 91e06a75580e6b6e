"""Forward derivatives: first-order changes of results when a scene and its load change.

docs/theory/gradients.md, "The change in one direction", derives the formulas.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arithmetic import balls
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact, turned
from convexrough.errors import InputError
from convexrough.friction.shear import ShearState
from convexrough.gradients.gradient import control_held, levels
from convexrough.gradients.parts import ZERO, Bending, Geometry, Part, product
from convexrough.gradients.results import by_ratio, level_below, with_friction
from convexrough.influence.choice import couple
from convexrough.normal.level import Level, Response
from convexrough.record import Along, Record, Table
from convexrough.scene.base import sphere_radius


@dataclass(frozen=True, eq=False, repr=False)
class Direction(Record):
    """Changes of the parameters of a scene and of the prescribed quantities; by default all 0.

    heights, tip_radii : [length] (n,), or one number for all asperities
    positions : [length] (n, 2), or one number for all coordinates
    sphere_radius : [length]
    contact_modulus : [force / length^2] at constant Poisson's ratio
    poisson_ratio : at constant contact modulus
    load, approach : [force], [length] give at most one. Without either, the quantity that was
        prescribed for the contact is kept constant
    friction, force : coefficient of friction and shear force [force]; only for friction states
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
        for name in ("heights", "tip_radii", "positions"):
            checks.in_order(name, given := getattr(self, name))
            object.__setattr__(self, name, frozen(checks.numbers(name, given)))
        for name in ("load", "approach"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, checks.finite(name, getattr(self, name)))
        for name in ("sphere_radius", "contact_modulus", "poisson_ratio", "friction", "force"):
            object.__setattr__(self, name, checks.finite(name, getattr(self, name)))


@dataclass(frozen=True, eq=False, repr=False)
class ContactChange(Table):
    """First-order changes of a contact when the scene or the load changes.

    contact, direction : the contact, and the given changes of scene and load
    loads    : (n,) [force] loads, in the scene's order
    gaps     : (n,) [length] gaps, in the scene's order
    approach : [length] approach
    load     : [force] total load
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
    """First-order changes of a friction state when the scene, load or shear force changes.

    contact, direction : the pressed contact, and the given changes of scene, load and shear force
    pressed : changes of the pressed contact (loads, gaps, approach)
    forces  : (n,) [force] shear forces, in the scene's order
    slips   : (n,) [length] gross slips, in the scene's order
    displacement : [length] tangential displacement of one body relative to the other
    """

    _along: ClassVar[Along] = {("asperity",): ("forces", "slips")}

    contact: Contact
    direction: Direction
    pressed: ContactChange
    forces: Array
    slips: Array
    displacement: float


def contact_change(contact: Contact, direction: Direction) -> ContactChange:
    """The result of `Contact.change`."""
    checks.instance("direction", direction, Direction)
    for name in ("friction", "force"):
        if (given := getattr(direction, name)) != 0.0:
            expected = "0: a contact does not depend on it; use the change of a friction state"
            raise InputError(name, found=given, expected=expected)
    return _pressed(contact, direction, _Bent.of(levels(contact).top, direction))[0]


def _pressed(
    contact: Contact, direction: Direction, bent: _Bent
) -> tuple[ContactChange, Ball, Response]:
    """The change of the contact; also that of its load, and of its solution, in scaled units."""
    if direction.load is not None and direction.approach is not None:
        found, expected = "both", "at most one of the two"
        raise InputError("load, approach", found=found, expected=expected)
    by_load = direction.approach is None
    if by_load and direction.load is None:
        by_load = control_held(contact, None) == "load"
    top = levels(contact).top
    units = top.problem.units
    if by_load:
        total = Ball.exact(direction.load or 0.0) / units.force
    else:
        alone, _ = bent.of_level(top, ZERO)
        lowered = Ball.exact(direction.approach or 0.0) / units.length - alone.approach
        total = lowered / top.tangent.approach
    moved, _ = bent.of_level(top, total)
    loads = top.problem.to_scene(moved.loads.value * units.force)
    approach = float(moved.approach.value) * units.length if by_load else direction.approach or 0.0
    change = ContactChange(
        contact=contact,
        direction=direction,
        loads=frozen(loads),
        gaps=frozen(_gap_changes(contact, bent, loads, approach)),
        approach=approach,
        load=float(total.value) * units.force,
    )
    return change, total, moved


def _gap_changes(contact: Contact, bent: _Bent, loads: Array, approach: float) -> Array:
    """(n,) [length] dA P + A dP - dd - dD0, the changes of open gaps, in float64; 0 elsewhere."""
    scene, pressed = contact.scene, levels(contact).loads
    open_ones = pressed == 0.0
    if not open_ones.any():
        return np.zeros(len(scene))
    scale = 1.0 / (np.pi * scene.material.contact_modulus)
    influence = couple(scene, np.arange(len(scene)), scale, contact.influence)
    moved = influence.apply(loads) - bent.modulus * influence.apply(pressed)
    if (points := bent.everywhere.points.value).any():
        moved += turned(influence, points, pressed)
    return np.where(open_ones, moved - bent.everywhere.offsets.value - approach, 0.0)


def shear_change(state: ShearState, direction: Direction) -> ShearChange:
    """The result of `ShearState.change`, from the changes at the loads P and P - Q / f."""
    contact, known = state.contact, with_friction(state)
    checks.instance("direction", direction, Direction)
    if abs(state.height) == known.load:
        expected = "a force below f P, where the derivative is finite"
        raise InputError("force", found=f"{state.force}: gross sliding", expected=expected)
    sign = -1.0 if state.force < 0 else 1.0
    top, low = known.top, level_below(known, "force", state.height, "load")
    bent, f, unit = _Bent.of(top, direction), known.coefficient, known.units.force
    first, total, above = _pressed(contact, direction, bent)
    by_friction = Ball.exact(direction.friction) / f
    slid = sign * direction.force / f / unit - (top.load - low.load) * by_friction  # dT
    below, opened = bent.of_level(low, total - slid)
    ratio = Ball.exact(direction.poisson_ratio) * by_ratio(known) + by_friction
    far, travel = sign * known.travel_unit, sign * known.force_unit
    sliding, gaps = ~low.springs.touching & (top.loads.value > 0), -low.indentation
    slips = balls.where(sliding, far * (opened + ratio * gaps), 0.0 * gaps)
    carried, moved = top.loads - low.loads, above.loads - below.loads
    approach_change, risen = top.approach - low.approach, above.approach - below.approach
    to_scene = top.problem.to_scene
    return ShearChange(
        contact=contact,
        direction=direction,
        pressed=first,
        forces=frozen(to_scene((travel * (moved + by_friction * carried)).value)),
        slips=frozen(to_scene(slips.value)),
        displacement=float((far * (risen + ratio * approach_change)).value),
    )


@dataclass(frozen=True)
class _Bent:
    """The changes of a scene's geometry and modulus in one direction."""

    everywhere: Bending  # of all asperities
    modulus: float  # dlog E*, the relative change of the contact modulus

    @classmethod
    def of(cls, top: Level, direction: Direction) -> _Bent:
        problem = top.problem
        scene, n = problem.scene, len(problem.scene)
        heights = checks.array("heights", direction.heights, length=n)
        tips = checks.array("tip_radii", direction.tip_radii, length=n)
        if direction.sphere_radius:
            sphere_radius(scene.sphere_radius, "sphere_radius")
        expected = f"({n}, 2) finite numbers: x and y of each asperity"
        moved = checks.numbers("positions", direction.positions, expected)
        if moved.shape not in ((), (n, 2)):
            raise InputError("positions", found=f"shape {moved.shape}", expected=expected)
        if not (np.abs(moved) <= checks.LARGEST).all():  # False for nan
            raise InputError("positions", found="numbers that are not finite", expected=expected)
        changes = heights, tips, np.broadcast_to(moved, (n, 2)), direction.sphere_radius
        modulus = Ball.exact(direction.contact_modulus) / scene.material.contact_modulus
        every = Geometry.of(problem, np.arange(n))
        bent = every.bent(*(Ball.exact(each) for each in changes))
        bent = bent._replace(local=bent.local - modulus * 2.0 / 3.0)
        return cls(bent, float(modulus.value))

    def of_level(self, level: Level, total: Ball) -> tuple[Response, Ball]:
        """The solution of  dP / c + A dP = dd - C dlog k - dA P + dD0,  sum dP = total.

        C is the diagonal matrix of indentations, and c_i is the local stiffness of asperity i. The
        second result is (n,) dA P + A dP - dd - dD0, the changes of gaps of open asperities.
        """
        problem, P = level.problem, level.loads
        which, felt = problem.candidates, Part(level).coupled * -self.modulus  # dA P
        offsets, local, points = (each[which] for each in self.everywhere)
        if points.value.any():
            carried = [P, points[:, 0] * P, points[:, 1] * P]
            geometry = Geometry.of(problem, which)
            by_points, by_x, by_y = geometry.slopes(carried, np.arange(len(which)))
            felt = felt + (points * by_points).sum() - by_x[:, 0] - by_y[:, 1]
        raised = offsets / problem.units.length - felt
        right = raised - level.indentation.positive_part() * local
        moved = level.response(right, total)
        return moved, product(level, moved.loads) - raised - moved.approach
