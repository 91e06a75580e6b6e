"""`Gradient`: derivatives of a number by all parameters of a scene, with proved error bounds.

The number is a weighted sum of energies V, approaches D0, loads and indentations at some levels.
A level is the normal solution at one total load (`gradients.parts`). The total loads depend on the
prescribed loads and shear forces, and on the coefficient of friction.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, ClassVar, Literal

import numpy as np

from convexrough import checks
from convexrough.arithmetic.balls import Ball, added, of_rows
from convexrough.arrays import Array, among_zeros, frozen
from convexrough.contact import Contact, levels_of
from convexrough.errors import InputError
from convexrough.gradients.parts import ZERO, Bending, Geometry, Moves, Part
from convexrough.normal.level import Level
from convexrough.normal.levels import Levels
from convexrough.plottable import Plottable
from convexrough.record import Along, Table
from convexrough.scene.base import named
from convexrough.sphere.smooth import smooth_reference

Holding = Literal["load", "approach"]

#: The parameters of a whole scene or state by which only some gradients have a derivative.
WHOLE = ("friction", "load", "approach", "force", "maximum", "minimum")


@dataclass(frozen=True)
class Number:
    """A number J that depends on a contact, with its derivatives at constant forces and load."""

    top: Level  # of the contact; n asperities could touch (candidates)
    value: Ball  # J
    parts: Sequence[Part]  # of J that come from levels
    slopes: Moves  # derivatives of J at constant offsets d, coefficients k and matrix A
    steep: Mapping[str, float]  # those that are infinite, or nan if this is not certain
    sides: Mapping[str, Array]  # for "forces" or "loads" of a path: (m, 2) from below and above

    @classmethod
    def of(
        cls, top: Level, value: Ball, parts: Sequence[Part], explicit: Moves, **sides: Array
    ) -> Number:
        """The number with these parts; `explicit` has its derivatives at fixed levels."""
        slopes, steep = dict(explicit), dict[str, float]()
        for part in parts:
            for name, rate in part.moves.items():
                slopes[name] = slopes.get(name, ZERO) + part.slopes.load * rate
                if part.level.trial is None and part.weight.size > 0.0:
                    growth = part.weight * rate
                    sure = bool(growth.positive | growth.negative)
                    steep[name] = float(np.copysign(np.inf, growth.value)) if sure else np.nan
        return cls(top, value, parts, slopes, steep, sides)

    def times(self, factor: Ball, **slopes: Ball) -> Number:
        """The number times a factor; `slopes` are the number times derivatives of the factor.

        Only for numbers whose parts have no weights of P and n.
        """
        both = {name: slope * factor for name, slope in self.slopes.items()}
        for name, slope in slopes.items():
            both[name] = both.get(name, ZERO) + slope
        parts = [
            replace(part, energy=factor * part.energy, approach=factor * part.approach)
            for part in self.parts
        ]
        return replace(self, value=self.value * factor, parts=parts, slopes=both)

    def holding_the_approach(self) -> Number:
        """The number with derivatives at constant approach: dJ|D0 = dJ|P - (dJ/dP / S) dD0|P."""
        slopes, units = dict(self.slopes), self.top.problem.units
        by_approach = slopes.pop("load", ZERO) * units.force / self.top.tangent.approach
        slopes["approach"] = by_approach / units.length
        parts = [*self.parts, Part(self.top, approach=-by_approach)]
        return replace(self, parts=parts, slopes=slopes)

    @cached_property
    def geometry(self) -> Geometry:
        return Geometry.of(self.top.problem, self.top.problem.candidates)

    @cached_property
    def offsets(self) -> Ball:
        """(n,) derivatives by the offsets d."""
        scaled = added(self._zero, *(part.slopes.offsets for part in self.parts))
        return scaled / self.top.problem.units.length

    @cached_property
    def local(self) -> Ball:
        """(n,) derivatives by log k."""
        return added(self._zero, *(part.slopes.local for part in self.parts))

    @property
    def _zero(self) -> Ball:
        return Ball.exact(np.zeros(len(self.top.problem)))

    @cached_property
    def coupled(self) -> Ball:
        """The sum of left^T A P over the parts: minus the derivative by log E* at constant k."""
        return sum((part.slopes.left.dot(part.coupled) for part in self.parts), start=ZERO)

    @cached_property
    def turning(self) -> Ball:
        """(n, 2) derivatives by the contact points c, on which A depends."""
        n, turned = len(self.offsets), [(part.slopes.left, part.level.loads) for part in self.parts]
        sizes = [each.size for pair in turned for each in pair]
        which = np.flatnonzero(sum(sizes, start=np.zeros(n)))
        total = Ball.exact(np.zeros((len(which), 2)))
        turned = [(left[which], loads[which]) for left, loads in turned if left.size.any()]
        slopes = iter(self.geometry.slopes([each for pair in turned for each in pair], which))
        for left, loads in turned:
            total = total + loads[:, None] * next(slopes) + left[:, None] * next(slopes)
        everywhere: Ball = of_rows(partial(among_zeros, places=which, count=n), total)
        return everywhere

    @cached_property
    def positions(self) -> Ball:
        """(n, 2) derivatives by the positions of the summits."""
        sinking = self.offsets[:, None] * self.geometry.bend * self.geometry.points
        return self.turning * self.geometry.share - sinking

    def along(self, by: Bending) -> Ball:
        """(n,) for each asperity, the derivative along the change `by` of its geometry."""
        found = self.offsets * by.offsets + self.local * by.local
        return found + (self.turning * by.points).sum() if self.geometry.closest else found

    @property
    def whole(self) -> dict[str, Ball]:
        """The number, and its derivatives by parameters of the whole scene or state, by name."""
        scene, slopes = self.top.problem.scene, self.slopes
        modulus = (self.local.sum() * -2.0 / 3.0 - self.coupled) / scene.material.contact_modulus
        found = {"value": self.value, "poisson_ratio": slopes.get("poisson_ratio", ZERO)}
        found |= {name: slopes[name] for name in WHOLE if name in slopes}
        found["contact_modulus"] = modulus + slopes.get("contact_modulus", ZERO)
        if named(scene.sphere_radius) == "a sphere":
            sphere = self.along(self.geometry.by_radius).sum()
            found["sphere_radius"] = sphere + slopes.get("sphere_radius", ZERO)
        return found

    @property
    def balance_defect(self) -> float:
        """Relative error in the identity  E* dJ/dE* + sum of L dJ/dL = sum of `Part.scaled`."""
        bent = self.local.sum() * -2.0 / 3.0
        terms = [bent, -self.coupled, *(part.slopes.load * part.level.load for part in self.parts)]
        terms += [-sum((part.scaled for part in self.parts), start=ZERO)]
        defect = float(sum(terms, start=ZERO).value)
        size = max(float(np.abs(term.value)) for term in terms)
        return abs(defect) / size if size > 0 else 0.0


@dataclass(frozen=True, eq=False, repr=False)
class Gradient(Table, Plottable):
    """Derivatives of one number with respect to a scene and the prescribed quantities.

    The unit of a derivative is the unit of the number over the unit of the parameter. Each
    derivative is at constant values of the other parameters named here. So shear forces Q are
    constant, but the fractions Q / (f P) and the displacements are not. docs/theory/gradients.md
    derives them; "Derivatives at a prescribed approach or displacement" there tells how to keep a
    displacement constant.

    Attributes that end in `_error` or `_errors` are proved bounds on the errors of the derivatives,
    including all rounding, for the given float64 data of the scene. They are infinite if the
    normal solution is not proved at some load on which the number depends. With more than 1,000
    loaded asperities and the influence "scattered", bounds for positions are also infinite, and in
    the geometry "closest" those for radii, too. The bound of an infinite derivative, in gross
    sliding, is 0.

    contact         : the contact on which the number depends
    value           : the number itself
    holding         : "load" or "approach", the quantity that is kept constant
    heights, tip_radii : (n,) derivatives by heights and tip radii, in the scene's order; 0 for
        asperities that cannot touch, and for open ones unless the number contains their gap
    positions       : (n, 2) derivatives by x and y, with zeros as in `heights`
    sphere_radius   : derivative by the radius; None for shapes other than a sphere
    contact_modulus : derivative at constant Poisson's ratio
    poisson_ratio   : derivative at constant contact modulus E*
    load, approach  : derivative by the quantity that `holding` names; the other one is None
    friction        : derivative by the coefficient f; None for a scene without friction
    force           : derivative by the shear force of a friction state
    maximum, minimum : derivatives by the largest and smallest shear force of a cycle
    forces, loads   : (m,) derivatives by the forces and loads of a history or path; nan where the
        derivatives from below and above differ, as at a point that agrees with an earlier point
        (up to rounding)
    force_sides, load_sides : (m, 2) the derivatives by `forces` and `loads` from below and above
    """

    _along: ClassVar[Along] = {
        ("asperity",): ("heights", "height_errors", "tip_radii", "tip_radius_errors"),
        ("asperity", "direction"): ("positions", "position_errors"),
        ("point",): ("forces", "force_errors", "loads", "load_errors"),
        ("point", "side"): ("force_sides", "load_sides"),
    }
    _shown = ("positions", "position_errors", "balance_defect")

    contact: Contact
    holding: Holding
    value: float
    value_error: float
    heights: Array
    height_errors: Array
    tip_radii: Array
    tip_radius_errors: Array
    contact_modulus: float
    contact_modulus_error: float
    poisson_ratio: float
    poisson_ratio_error: float
    number: Number = field(repr=False)
    shown: Number = field(repr=False)
    sphere_radius: float | None = None
    sphere_radius_error: float | None = None
    load: float | None = None
    load_error: float | None = None
    approach: float | None = None
    approach_error: float | None = None
    friction: float | None = None
    friction_error: float | None = None
    force: float | None = None
    force_error: float | None = None
    maximum: float | None = None
    maximum_error: float | None = None
    minimum: float | None = None
    minimum_error: float | None = None
    forces: Array | None = None
    force_errors: Array | None = None
    force_sides: Array | None = None
    loads: Array | None = None
    load_errors: Array | None = None
    load_sides: Array | None = None

    @classmethod
    def of(cls, contact: Contact, number: Number, holding: Holding) -> Gradient:
        """The gradient of a number, in the scene's units."""
        shown = number.holding_the_approach() if holding == "approach" else number
        found: dict[str, Any] = {}
        for name, ball in shown.whole.items():
            found[name], found[f"{name}_error"] = float(ball.value), float(ball.error)
        for name, steep in shown.steep.items():
            found[name], found[f"{name}_error"] = steep, np.inf if np.isnan(steep) else 0.0
        for name, sides in shown.sides.items():
            one, slopes = name.removesuffix("s"), shown.slopes[name]
            found[name] = frozen(slopes.value.copy())
            found[f"{one}_errors"] = frozen(slopes.error.copy())
            found[f"{one}_sides"] = frozen(sides)
        to_scene = shown.top.problem.to_scene
        for name, one, each in (
            ("heights", "height", shown.offsets),
            ("tip_radii", "tip_radius", shown.along(shown.geometry.by_tip)),
        ):
            found[name] = frozen(to_scene(each.value))
            found[f"{one}_errors"] = frozen(to_scene(each.error))
        return cls(contact, holding, number=number, shown=shown, **found)

    @property
    def balance_defect(self) -> float:
        """Difference between two formulas for the derivative by the modulus, divided by the largest
        term of both formulas; a check of rounding."""
        return self.shown.balance_defect

    @cached_property
    def positions(self) -> Array:
        """(n, 2) derivatives by x and y, with zeros as in `heights`."""
        return frozen(self.shown.top.problem.to_scene(self.shown.positions.value))

    @cached_property
    def position_errors(self) -> Array:
        """(n, 2) proved bounds on the errors of `positions`."""
        return frozen(self.shown.top.problem.to_scene(self.shown.positions.error))

    @cached_property
    def normalised(self) -> Gradient:
        """The gradient of `Cycle.loss_normalised` = W / W0, from the gradient of a cycle's loss W.

        W0 is the energy scale of `Cycle.loss_normalised`; at constant approach its load P varies.
        Raises InputError for gradients of other numbers, and for shapes of which no smooth solution
        is known.
        """
        if self.maximum is None:
            expected = "the gradient of the loss of a cycle"
            raise InputError("normalised", found="another number", expected=expected)
        number, scene = self.number, self.contact.scene
        reference = smooth_reference(scene, self.contact.load)
        if reference is None:
            expected = "a sphere or an ellipsoid"
            raise InputError("normalised", found=named(scene.sphere_radius), expected=expected)
        E, nu = map(Ball.exact, (scene.material.contact_modulus, scene.material.poisson_ratio))
        R, f = map(Ball.exact, (scene.mean_radius, checks.friction(scene.friction)))
        P = number.top.load * number.top.problem.units.force
        radius = (P * R * 0.75 / E).cbrt()  # a_H
        factor = (1.0 - nu) * E * radius * 5.0 / ((2.0 - nu) * f * f * P * P * 9.0)  # 1 / W0
        if named(scene.sphere_radius) != "a sphere":  # W0 of an ellipsoid is a float64 number
            whole = 1.0 / reference.energy_scale
            factor = Ball.around(whole, 1e-13 * whole)
        value = number.value * factor
        normalised = number.times(
            factor,
            sphere_radius=value / (R * 3.0),
            contact_modulus=value * 2.0 / (E * 3.0),
            poisson_ratio=-value / ((1.0 - nu) * (2.0 - nu)),
            friction=value * -2.0 / f,
            load=value * -5.0 / (P * 3.0),
        )
        return Gradient.of(self.contact, normalised, self.holding)

    def _rows(self) -> Iterator[tuple[str, str]]:
        """The printed rows, without parameters that are None."""
        return (row for row in super()._rows() if row[1] != "None")


def control_held(contact: Contact, holding: Holding | None) -> Holding:
    """The checked name of the quantity that is kept constant; by default the prescribed one."""
    checks.instance("contact", contact, Contact)
    if holding is None:
        return "approach" if contact.prescribed_load is None else "load"
    if holding not in ("load", "approach"):
        raise InputError("holding", found=repr(holding), expected='"load" or "approach"')
    return holding


def levels(contact: Contact) -> Levels:
    """The levels of a contact. Raises InputError if its load is 0."""
    if contact.load == 0.0:
        expected = "a contact with a load: at the load 0 there is no derivative"
        raise InputError("contact", found="no load", expected=expected)
    return contact.cached(levels_of)
