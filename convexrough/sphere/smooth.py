"""`smooth`: closed forms of the smooth sphere, for comparison with a rough contact.

It is the scene's sphere, pressed with the same load on a plane without asperities. Displacements
and losses are sums over both bodies. Source: Johnson, Contact Mechanics (1985), chapters 4 and 7;
and Dini and Hills (2009), equations 12 to 16, for one of the bodies.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.record import Record
from convexrough.scene import base
from convexrough.scene.scene import Scene
from convexrough.sphere import ellipse, hertz, mindlin, surface_shear


def smooth(scene: Scene, *, load: float) -> SmoothSphere:
    """The smooth contact of the scene's sphere or ellipsoid, without asperities.

    load : [force] normal load P

    Raises InputError for a flat or a cylinder, which have no smooth contact of finite size.

    >>> print(f"{cr.smooth(scene, load=contact.load).approach:.4g}")  # 5e-5 in the rough contact
    4.184e-05
    """
    checks.instance("scene", scene, Scene)
    if (found := smooth_reference(scene, checks.positive("load", load))) is None:
        expected = "a sphere or an ellipsoid: other shapes have no smooth reference"
        raise InputError("scene", found=base.named(scene.sphere_radius), expected=expected)
    return found


def smooth_reference(scene: Scene, load: float) -> SmoothSphere | None:
    """The result of `smooth`, or None for a flat or a cylinder."""
    if isinstance(scene.sphere_radius, tuple):
        return None if math.inf in scene.sphere_radius else SmoothEllipsoid(scene, load)
    return SmoothSphere(scene, load) if scene.curved else None


@dataclass(frozen=True, eq=False, repr=False)
class SmoothSphere(Record):
    """A smooth sphere under a normal load P, and under shear forces Q at this load.

    scene, load : the scene, and P [force]

    Methods take numbers or arrays, and return numbers or arrays of the same shape. Tangential
    results raise InputError if the scene has no friction or a shear force exceeds f P, the
    coefficient of friction times the load. E* is the contact modulus, nu Poisson's ratio, and G the
    shear modulus. Source: Johnson, Contact Mechanics (1985), chapters 3, 4 and 7.

    >>> whole = cr.smooth(scene, load=contact.load)
    >>> print(f"{whole.contact_radius:.4g} {whole.pressure(0.005):.4g}")
    0.006468 0.002612
    >>> print(f"{whole.normal_displacement(0.005):.4g} {whole.largest_force:.3g}")
    2.934e-05 1.8e-07
    >>> Q = 0.5 * whole.largest_force
    >>> print(f"{whole.stick_radius(Q):.4g} {whole.traction(0.006, Q):.3g}")
    0.005134 0.000769
    >>> print(f"{whole.displacement(Q):.3g} {whole.branch(0.0, Q):.3g} {whole.energy(Q):.3g}")
    9.4e-06 5.34e-07 1.29e-13
    """

    _shown = ("contact_radius", "approach", "peak_pressure")

    scene: Scene
    load: float

    @property
    def radius(self) -> float:
        """[length] radius R; for an ellipsoid see `SmoothEllipsoid.radius`."""
        return self.scene.mean_radius

    @cached_property
    def contact_radius(self) -> float:
        """[length] a_H = (3 P R / (4 E*))^(1/3)."""
        return float(hertz.contact_radius(self.load, self._modulus, self.radius))

    @cached_property
    def approach(self) -> float:
        """[length] delta = a_H^2 / R, the approach of distant points of the two bodies."""
        coefficient = hertz.local_coefficient(self._modulus, self.radius)
        return float(hertz.indentation(self.load, coefficient))

    @cached_property
    def peak_pressure(self) -> float:
        """[force / length^2] p0 = 2 E* a_H / (pi R)."""
        return float(hertz.peak_pressure(self.contact_radius, self._modulus, self.radius))

    def pressure(self, distance: ArrayLike) -> Any:
        """[force / length^2] p(r) = p0 sqrt(1 - r^2 / a_H^2) at a distance r from the axis."""
        return hertz.pressure(distance, self.contact_radius, self.peak_pressure)

    def normal_displacement(self, distance: ArrayLike) -> Any:
        """[length] sum of both surfaces' normal displacements at a distance r from the axis.

        It is delta - r^2 / (2 R) inside the contact (Johnson, 3.42, gives it outside).
        """
        return hertz.surface_displacement(distance, self.contact_radius, self.radius)

    @property
    def largest_force(self) -> float:
        """[force] the friction limit f P, at which gross sliding begins."""
        return self._friction * self.load

    def stick_radius(self, force: ArrayLike) -> Any:
        """[length] stick radius c = a_H (1 - |Q| / (f P))^(1/3) under a shear force [force]."""
        return self.contact_radius * np.cbrt(1.0 - np.abs(self._share("force", force)))

    def traction(self, distance: ArrayLike, force: ArrayLike) -> Any:
        """[force / length^2] shear traction after loading from rest, at a distance r from the axis.

        For Q >= 0 it is f p0 [sqrt(1 - r^2/a_H^2) - (c/a_H) sqrt(1 - r^2/c^2)], where the last root
        counts as 0 for r > c. The force -Q gives the opposite traction.
        """
        share, peak = self._share("force", force), self._friction * self.peak_pressure
        return surface_shear.traction(distance, self.contact_radius, share, peak)

    def displacement(self, force: ArrayLike) -> Any:
        """[length] displacement along the shear after loading from rest.

        X = (3 (2 - nu) f P / (8 G a_H)) [1 - (1 - Q/(f P))^(2/3)] for Q >= 0;  X(-Q) = -X(Q).
        """
        return self._largest_displacement * mindlin.deflection(self._share("force", force))

    def branch(self, force: ArrayLike, turning_force: float) -> Any:
        """[length] displacement after loading from rest to `turning_force` and back to `force`.

        By Masing's rule it is X(Q1) - 2 X((Q1 - Q) / 2) for |Q| <= |Q1|, with the turning force Q1
        and X of `displacement`: [14]-[15] of Dini and Hills (2009). Raises InputError for larger
        forces.
        """
        turning = checks.finite("turning_force", turning_force)
        first = self.displacement(turning)
        given = np.asarray(force, dtype=np.float64)
        if not (np.abs(given) <= abs(turning)).all():
            expected = f"at most the turning force {abs(turning):.17g} in size"
            raise InputError("force", found=given.flat[np.abs(given).argmax()], expected=expected)
        return first - 2.0 * self.displacement((turning - given) / 2.0)

    def energy(self, maximum: ArrayLike, minimum: ArrayLike | None = None) -> Any:
        """[force length] energy lost per steady cycle between two shear forces.

        It is W0 e((maximum - minimum) / (2 f P)), with the `energy_scale` W0 and the function e of
        `sphere.mindlin.loss`: [16] of Dini and Hills (2009). The default minimum is -maximum.
        Raises InputError if a minimum exceeds the maximum.
        """
        upper = self._share("maximum", maximum)
        lower = -upper if minimum is None else self._share("minimum", minimum)
        if (lower > upper).any():
            expected = "at least the minimum, by default the negative of the maximum"
            raise InputError("maximum", found=maximum, expected=expected)
        return self.energy_scale * mindlin.loss((upper - lower) / 2.0)

    @property
    def energy_scale(self) -> float:
        """[force length] W0 = 9 (2 - nu) f^2 P^2 / (5 G a_H)."""
        return 4.8 * self._friction * self.load * self._largest_displacement

    @property
    def _largest_displacement(self) -> float:
        """[length] 3 (2 - nu) f P / (8 G a_H), the displacement at Q = f P."""
        ratio = mindlin.ratio(self.scene.material.poisson_ratio)
        return float(ratio * self._friction * self.approach)

    @property
    def _modulus(self) -> float:
        return self.scene.material.contact_modulus

    @property
    def _friction(self) -> float:
        return checks.friction(self.scene.friction)

    def _share(self, what: str, forces: ArrayLike) -> Array:
        """The shares t = Q / (f P). Raises InputError if they are not in [-1, 1]."""
        forces = checks.bearable(what, forces, self.largest_force)
        return np.clip(forces / self.largest_force, -1.0, 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class SmoothEllipsoid(SmoothSphere):
    """A smooth ellipsoid, with results like those of `SmoothSphere`.

    The contact is an ellipse with the semi-axes a, b. `contact_radius` is sqrt(a b). For a point
    (x, y), the argument `distance` is s sqrt(a b), with s^2 = x^2/a^2 + y^2/b^2. The stick zone is
    an ellipse of the same shape. The ratio of tangential to normal compliance is approximated by
    its mean over all directions, Mindlin's ratio; this is exact at nu = 0. docs/theory/bodies.md
    derives the formulas.

    >>> oval = cr.Scene((1.0, 2.0), scene.asperities, scene.material)
    >>> "{:.4g} {:.4g}".format(*cr.smooth(oval, load=contact.load).semi_axes)
    '0.005728 0.009083'
    """

    _shown = ("semi_axes", "approach", "peak_pressure")

    @property
    def radius(self) -> float:
        """[length] radius of the sphere with the same load and approach."""
        return 9.0 * self.load**2 / (16.0 * self._modulus**2 * self.approach**3)

    @cached_property
    def semi_axes(self) -> tuple[float, float]:
        """[length] semi-axes of the contact ellipse along x and y."""
        return ellipse.semi_axes(self.load, self._modulus, base.along(self.scene.sphere_radius))

    @cached_property
    def contact_radius(self) -> float:
        """[length] sqrt(a b), the radius of the circle with the same area."""
        return math.sqrt(math.prod(self.semi_axes))

    @cached_property
    def approach(self) -> float:
        """[length] approach of distant points of the two bodies."""
        return ellipse.approach(self.load, self._modulus, self.semi_axes)

    @cached_property
    def peak_pressure(self) -> float:
        """[force / length^2] p0 = 3 P / (2 pi a b)."""
        return 1.5 * self.load / (math.pi * math.prod(self.semi_axes))

    def normal_displacement(self, distance: ArrayLike) -> Any:
        """Raises InputError: not available for an ellipsoid."""
        base.sphere_radius(self.scene.sphere_radius, "normal_displacement")
