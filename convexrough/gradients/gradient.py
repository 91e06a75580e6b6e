"""The result: derivatives with respect to everything in a scene, in its units.

A derivative comes as dJ = offsets'dd + local'd log k + sum over pairs left'dA right + ...
(`gradients.adjoint`); here dd, dk and dA become changes of heights, tip radii, positions, the
sphere's radius and the modulus (docs/theory/scene-derivatives.md, "To the scene").
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from convexrough.arrays import Array, among_zeros, frozen
from convexrough.contact import Contact
from convexrough.drawn import Drawn
from convexrough.errors import InputError
from convexrough.gradients.adjoint import Holding, Pulled, through_pressing
from convexrough.gradients.bounds import FEW
from convexrough.gradients.doubts import LossDoubt, height_errors
from convexrough.gradients.origin import Origin, far_radii, pressed
from convexrough.gradients.refined import refined_errors
from convexrough.gradients.system import TOLERANCE
from convexrough.record import Along, Table
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.cycle import cycle
from convexrough.sphere.smooth import smooth

#: What a derivative may be by, one number or one for each asperity, but for positions.
PARAMETERS = (
    *("heights", "tip_radii", "sphere_radius", "contact_modulus", "poisson_ratio"),
    *("load", "approach", "friction", "force", "maximum", "minimum", "forces"),
)


@dataclass(frozen=True, eq=False, repr=False)
class Gradient(Table, Drawn):
    """Derivatives of one number with respect to a scene and to what is prescribed.

    Units are those of the number over those of the parameter. Arrays are (n,), in the scene's
    order; screened asperities, and open ones unless their gap is asked for, have 0 everywhere. Each
    derivative is at fixed values of the other parameters named here: shear forces are held, not
    their fractions of f P, nor a displacement by which a state or cycle was prescribed. At a held
    displacement X a loss W changes by dW|X = dW|Q - (W_Q / X_Q) dX|Q, with X_Q the derivative by
    the force of the state at the amplitude of the cycle, and W_Q that by `maximum`, twice.

    value           : the number itself
    holding         : "load" or "approach": which of the two is held
    heights, tip_radii : (n,)
    contact_modulus : of E* at fixed Poisson's ratio;  poisson_ratio : at fixed E*
    load, approach  : of the one that is held; None of the other
    friction        : None where there is none
    force           : the shear force of a friction state;  maximum, minimum : those of a cycle
    forces          : (m,) those of a history; None each where there is none
    balance_defect  : how far the modulus by its own sum is from what scaling all forces says,
        over the largest term of both

    >>> gradient = cr.cycle(contact, maximum=0.25 * contact.load).gradient(holding="load")
    >>> print(f"{gradient.heights[0]:.4g}", f"{gradient.maximum:.4g}")
    5.907e-10 2.717e-06
    """

    _along: ClassVar[Along] = {("asperity",): ("heights", "tip_radii", "height_errors")}

    contact: Contact
    holding: Holding
    value: float
    heights: Array
    tip_radii: Array
    sphere_radius: float
    contact_modulus: float
    poisson_ratio: float
    load: float | None
    approach: float | None
    friction: float | None
    balance_defect: float
    origin: Origin
    force: float | None = None
    maximum: float | None = None
    minimum: float | None = None
    forces: Array | None = None

    @cached_property
    def positions(self) -> Array:
        """(n, 2) of x and y of each summit."""
        scene, origin = self.contact.scene, self.origin
        points = scene.asperities.positions[origin.places]
        far, moved = far_radii(self.contact, origin.places)[:, None], origin.turning
        if scene.geometry == "closest":
            moved = moved * (scene.sphere_radius / far)
        moved = moved - origin.offsets[:, None] * points / far
        return frozen(among_zeros(moved, origin.places, len(scene)))

    @cached_property
    def height_errors(self) -> Array:
        """(n,) proved bounds on |heights - those of the true state|.

        Where all asperities are decided, mostly what these derivatives miss of those computed to
        twice the digits; in gross sliding of the derivatives from below. Infinite where nothing is
        proved of the state, and for onsets: there one asperity is at its ceiling, no proof can say
        whether it slides, and the slope of its law has no bound but the root of a doubt. They are
        for the scene whose data are the given float64 numbers, and count all rounding.
        """
        origin = self.origin
        problem = pressed(self.contact)
        errors = height_errors(problem, origin.doubts, origin.pressing, origin.total)
        if origin.doubts is not None and not origin.mixed:
            finer = refined_errors(self.contact, origin.doubts, origin.pressing, origin.total)
            errors = np.minimum(errors, finer)
        off = among_zeros(
            origin.rounding + np.zeros(len(origin.places)), origin.places, len(errors)
        )
        return frozen(errors / problem.units.length + off)

    @cached_property
    def normalised(self) -> Gradient:
        """That of `Cycle.energy_normalised` = W / W0, for the gradient of a cycle's energy.

        W0 is in proportion to c_t f^2 P^(5/3) E*^(-2/3) R^(-1/3), P the total load, which follows
        where the approach is held.
        """
        contact, scene = self.contact, self.contact.scene
        if self.maximum is None or self.minimum is None or self.friction is None:
            expected = "the gradient of a cycle, whose energy a smooth sphere's stands beside"
            raise InputError("normalised", found="another number", expected=expected)
        assert scene.friction is not None  # there is a cycle
        W0, nu = smooth(scene, load=contact.load).energy_scale, scene.material.poisson_ratio
        value = self.value / W0
        by_load = -5.0 / 3.0 * value / contact.load
        explicit = {
            "sphere_radius": value / 3.0 / scene.sphere_radius,
            "contact_modulus": 2.0 / 3.0 * value / scene.material.contact_modulus,
            "poisson_ratio": -value / ((1.0 - nu) * (2.0 - nu)),
            "friction": -2.0 * value / scene.friction,
            "load": by_load,
        }
        following = total_load(contact) if self.holding == "approach" else None
        factor, other = (0.0, None) if following is None else (by_load, following.origin)
        doubt = self._doubt_about_smooth(lossy=following is not None)
        found: dict[str, Any] = {"value": value}
        found["origin"] = self.origin.combined(1.0 / W0, doubt, factor, other)
        for name in PARAMETERS:
            if (slope := getattr(self, name)) is not None:
                found[name] = slope / W0 + explicit.get(name, 0.0)
                if following is not None and (follows := getattr(following, name)) is not None:
                    found[name] = found[name] + by_load * follows
        return replace(self, **found)

    def _doubt_about_smooth(self, *, lossy: bool) -> float:
        """Bound on what 1 / W0, or W / (W0 P), is off, over it: W0 goes with P^(5/3)."""
        contact, rounding = self.contact, FEW * ROUNDOFF
        if contact.prescribed_load is None:
            off = float(contact.certificate.load_errors.sum())
        else:
            off = abs(contact.load - contact.prescribed_load)
        carried = (8.0 if lossy else 5.0) / 3.0 * off / contact.load
        if lossy and self.value and self.origin.doubts:
            half = [each.force for each in self.origin.doubts if isinstance(each, LossDoubt)]
            carried += cycle(contact, maximum=float(half[0])).energy_error / self.value
        return (1 + SAFETY) * (carried + rounding)

    def _rows(self) -> Iterator[tuple[str, str]]:
        """But for what it was made from, and for parameters that it has not."""
        return (row for row in super()._rows() if row[0] != "origin" and row[1] != "None")


def to_scene(
    origin: Origin,
    holding: Holding,
    *,
    value: float,
    scaled: tuple[float, ...],
    cancels: bool,
    poisson_ratio: float = 0.0,
    friction: float | None = None,
    load: float | None = None,
    force: float | None = None,
    maximum: float | None = None,
    minimum: float | None = None,
    forces: Array | None = None,
) -> Gradient:
    """The gradient that an origin is.

    scaled  : terms whose sum, less P dJ/dP under load control, is E* dJ/dE* by scaling all forces
    cancels : whether the modulus' own sum does, so that the other is reported
    load    : dJ/dP where it is not that of the origin
    """
    contact, places = origin.contact, origin.places
    scene = contact.scene
    R, rho = scene.sphere_radius, scene.asperities.tip_radii[places]
    radii, points = scene.relative_radii[places], scene.asperities.positions[places]
    offsets, local, far = origin.offsets, origin.local, far_radii(contact, places)
    tips, sphere = -local / 3.0 * radii / rho**2, -local / 3.0 * radii / R**2
    sunk = offsets * (points**2).sum(axis=1) / (2.0 * far**2)
    sphere += sunk
    if scene.geometry == "closest":
        outwards = (origin.turning * points).sum(axis=1) / far**2
        tips += sunk - outwards * R
        sphere += outwards * rho

    by_load = holding == "load"
    prescribed = origin.prescribed
    terms = (*scaled, -contact.load * prescribed) if by_load else scaled
    coupled, sizes = origin.coupled
    own, by_scaling = -2.0 / 3.0 * float(local.sum()) - coupled, sum(terms)
    size = max(2.0 / 3.0 * float(np.abs(local).sum()), sizes, *map(abs, terms))
    return Gradient(
        contact=contact,
        holding=holding,
        value=value,
        heights=frozen(among_zeros(offsets, places, len(scene))),
        tip_radii=frozen(among_zeros(tips, places, len(scene))),
        sphere_radius=float(sphere.sum()),
        contact_modulus=(by_scaling if cancels else own) / scene.material.contact_modulus,
        poisson_ratio=poisson_ratio,
        load=(prescribed if load is None else load) if by_load else None,
        approach=None if by_load else prescribed,
        friction=friction,
        balance_defect=abs(own - by_scaling) / size if size > 0 else 0.0,
        origin=origin,
        force=force,
        maximum=maximum,
        minimum=minimum,
        forces=forces,
    )


def total_load(contact: Contact, tolerance: float = TOLERANCE) -> Gradient:
    """That of the total load, the approach held."""
    problem = pressed(contact)
    ones = np.full(len(problem), problem.units.force)
    weights = Pulled(ones, np.zeros(len(problem)), [])
    adjoint = through_pressing(problem, weights, "approach", tolerance)
    origin = Origin.of(contact, adjoint, "approach")
    return to_scene(origin, "approach", value=contact.load, scaled=(contact.load,), cancels=False)
