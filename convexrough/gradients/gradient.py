"""`Gradient`: derivatives of a number by all parameters of a scene, with proved bounds.

The number is a weighted sum of energies V, approaches D0, loads and indentations at some levels.
A level is the normal solution at one total load (`gradients.pulled`). These total loads depend on
the prescribed loads and shear forces, and on the coefficient of friction.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact, levels_of
from convexrough.errors import InputError
from convexrough.gradients.pulled import ZERO, Moves, Part, Pulled, value_of
from convexrough.gradients.scene import Derivatives
from convexrough.normal.level import Level
from convexrough.normal.levels import Levels
from convexrough.normal.problem import NormalProblem
from convexrough.plottable import Plottable
from convexrough.record import Along, Table
from convexrough.scene.base import named
from convexrough.sphere.smooth import smooth_reference

Holding = Literal["load", "approach"]

#: Parameters that only some gradients have: single numbers, and arrays.
WHOLE = ("friction", "load", "approach", "force", "maximum", "minimum")
SEVERAL = ("loads", "forces")


class Number(NamedTuple):
    """A number J that depends on a contact, with derivatives at constant forces and load.

    value    : J
    scaled   : the part of J that consists of energies and loads. If the modulus and all loads are
        multiplied by a number, this part is multiplied by the same number
    pulled   : for each level, the derivatives of its part of J by the load, and by offsets, Hertz's
        coefficients and compliances of the asperities that could touch
    slopes   : derivatives of J by parameters outside the scene's geometry, by name
    steep    : for each such name, the factor of dD0/dL at the load 0, where dD0/dL is infinite
    sides    : for "forces" or "loads" of a path, (m, 2) derivatives from below and from above
    """

    contact: Contact
    problem: NormalProblem
    top: Level
    value: Ball
    scaled: Ball
    pulled: Sequence[Pulled]
    slopes: Mapping[str, Ball]
    steep: Mapping[str, Ball]
    sides: Mapping[str, Array] = {}

    @classmethod
    def of(cls, contact: Contact, top: Level, parts: Sequence[Part], explicit: Moves) -> Number:
        """The number that is the sum of these parts.

        explicit : derivatives by parameters at fixed levels
        """
        pulled, slopes = [Pulled.of(part) for part in parts], dict(explicit)
        steep: dict[str, Ball] = {}
        for part, each in zip(parts, pulled, strict=True):
            for name, rate in part.moves.items():
                slopes[name] = slopes.get(name, ZERO) + each.load * rate
                if each.steep.size > 0.0:
                    steep[name] = steep.get(name, ZERO) + each.steep * rate
        value = value_of(parts)
        scaled = value - sum((part.length for part in parts), start=ZERO)
        return cls(contact, top.problem, top, value, scaled, pulled, slopes, steep)

    def times(self, factor: Ball, slopes: Mapping[str, Ball]) -> Number:
        """The number times a factor; `slopes` are derivatives of the factor, times the number."""
        names = {*self.slopes, *slopes}
        pulled = [each.times(factor) for each in self.pulled]
        both = {
            name: self.slopes.get(name, ZERO) * factor + slopes.get(name, ZERO) for name in names
        }
        value, scaled = self.value * factor, self.scaled * factor
        return self._replace(value=value, scaled=scaled, pulled=pulled, slopes=both)

    def holding_the_approach(self) -> Number:
        """The number with derivatives at constant approach: dJ|D0 = dJ|P - (dJ/dP / S) dD0|P.

        The bar names what is constant: the approach D0 or the load P. S is dD0/dP.
        """
        slopes, units = dict(self.slopes), self.problem.units
        by_approach = slopes.pop("load", ZERO) * units.force / self.top.tangent.approach
        slopes["approach"] = by_approach / units.length
        follows = Pulled.of(Part(self.top, approach=-by_approach))
        return self._replace(pulled=[*self.pulled, follows], slopes=slopes)


@dataclass(frozen=True, eq=False, repr=False)
class Gradient(Table, Plottable):
    """Derivatives of one number with respect to a scene and the prescribed quantities.

    The unit of a derivative is the unit of the number over the unit of the parameter. Each
    derivative is at constant values of the other parameters named here. So shear forces Q are
    constant, but neither their fractions Q / (f P) nor the displacements are. If instead the
    displacement amplitude X of a symmetric cycle is constant, its loss W changes by
    dW|X = dW|Q - (W_Q / X_Q) dX|Q. Here W_Q is the derivative of W by the amplitude of Q, twice
    that by `maximum`. dX|Q and X_Q, the derivative by `force`, are from the gradient of the `shear`
    state whose force is the amplitude of the cycle.

    Attributes that end in `_error` or `_errors` are proved bounds on the errors of the derivatives,
    including all rounding, for the given float64 data of the scene. They are infinite if the
    contact is not proved at some load that the number depends on. With more than 1,000 loaded
    asperities and no stored matrix, bounds for positions are also infinite, and in the geometry
    "closest" bounds for radii, too. An infinite derivative, in gross sliding, has the error 0.

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
        derivatives from below and above differ, as at a repeated point
    force_sides, load_sides : (m, 2) the derivatives by `forces` and `loads` from below and above
    balance_defect  : difference between two formulas for the derivative by the modulus, divided by
        the largest term of both formulas; a check of rounding

    >>> gradient = cr.cycle(contact, maximum=0.25 * contact.load).gradient(holding="load")
    >>> print(f"{gradient.heights[0]:.4g}", f"{gradient.maximum:.4g}")
    5.907e-10 2.717e-06
    """

    _along: ClassVar[Along] = {
        ("asperity",): ("heights", "height_errors", "tip_radii", "tip_radius_errors")
    }

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
    balance_defect: float
    number: Number
    derivatives: Derivatives
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
    def of(cls, number: Number, holding: Holding) -> Gradient:
        """The gradient of a number, in the scene's units."""
        shown = number.holding_the_approach() if holding == "approach" else number
        slopes = shown.slopes
        found = Derivatives.of(shown.problem, shown.pulled)
        numbers = {"value": number.value, "poisson_ratio": slopes.get("poisson_ratio", ZERO)}
        numbers |= {name: slopes[name] for name in WHOLE if name in slopes}
        modulus = found.contact_modulus + slopes.get("contact_modulus", ZERO)
        numbers["contact_modulus"] = modulus
        if (sphere := found.sphere_radius) is not None:
            numbers["sphere_radius"] = sphere + slopes.get("sphere_radius", ZERO)
        named: dict[str, Any] = {}
        for name, ball in numbers.items():
            named[name], named[f"{name}_error"] = float(ball.value), float(ball.error)
        for name, ball in shown.steep.items():
            named[name], named[f"{name}_error"] = float(np.copysign(np.inf, ball.value)), 0.0
        for name in SEVERAL:
            if name in slopes:
                one = name.removesuffix("s")
                named[name] = frozen(slopes[name].value.copy())
                named[f"{one}_errors"] = frozen(slopes[name].error.copy())
                named[f"{one}_sides"] = frozen(shown.sides[name])

        tips, in_scene = found.tip_radii, found.in_scene
        return cls(
            contact=shown.contact,
            holding=holding,
            heights=in_scene(found.offsets.value),
            height_errors=in_scene(found.offsets.error),
            tip_radii=in_scene(tips.value),
            tip_radius_errors=in_scene(tips.error),
            balance_defect=_balance_defect(shown, found),
            number=number,
            derivatives=found,
            **named,
        )

    @cached_property
    def positions(self) -> Array:
        return self.derivatives.in_scene(self.derivatives.positions.value)

    @cached_property
    def position_errors(self) -> Array:
        return self.derivatives.in_scene(self.derivatives.positions.error)

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
        R = Ball.exact(scene.mean_radius)
        E = Ball.exact(scene.material.contact_modulus)
        nu, f = (
            Ball.exact(scene.material.poisson_ratio),
            Ball.exact(checks.friction(scene.friction)),
        )
        P = number.top.load * number.problem.units.force
        radius = (P * R * 0.75 / E).cbrt()  # a_H
        factor = (1.0 - nu) * E * radius * 5.0 / ((2.0 - nu) * f * f * P * P * 9.0)  # 1 / W0
        if named(scene.sphere_radius) != "a sphere":  # W0 of an ellipsoid is a float64 number
            whole = 1.0 / reference.energy_scale
            factor = Ball.around(whole, 1e-13 * whole)
        value = number.value * factor
        slopes = {
            "sphere_radius": value / (R * 3.0),
            "contact_modulus": value * 2.0 / (E * 3.0),
            "poisson_ratio": -value / ((1.0 - nu) * (2.0 - nu)),
            "friction": value * -2.0 / f,
            "load": value * -5.0 / (P * 3.0),
        }
        return Gradient.of(number.times(factor, slopes), self.holding)

    def _rows(self) -> Iterator[tuple[str, str]]:
        """The printed rows, without internal data and parameters that are None."""
        hidden = ("number", "derivatives")
        return (row for row in super()._rows() if row[0] not in hidden and row[1] != "None")


def _balance_defect(number: Number, found: Derivatives) -> float:
    """Relative error in the identity  E* dJ/dE* + sum over levels of L dJ/dL = `number.scaled`."""
    bent, by_coupling = found.local.sum() * -2.0 / 3.0, -found.coupled
    terms = [bent, by_coupling, -number.scaled, *(each.load * each.total for each in number.pulled)]
    defect = float(sum(terms, start=ZERO).value)
    size = max(float(np.abs(term.value)) for term in terms)
    return abs(defect) / size if size > 0 else 0.0


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
