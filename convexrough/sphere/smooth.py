"""`smooth`: closed forms of the equivalent smooth sphere, for comparison with a rough contact.

The sphere of a scene on the same material without asperities, under the same load: Hertz's contact,
and Cattaneo, Mindlin and Deresiewicz's under shear. With t = Q / (f P), P the load, f the friction,
c_t Mindlin's ratio and delta the approach, all displacements are c_t f delta times functions of t
alone: those of `convexrough.sphere.mindlin`.
Source: Johnson, Contact Mechanics (1985), chapters 4 and 7; [12]-[16] of the source paper, which
gives one body's displacements and losses, where these are both bodies'.
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
    """The base of the scene, without asperities, under a normal load P [force].

    A `SmoothEllipsoid` where it is one. Raises InputError where it is flat or a cylinder, on which
    no load makes a contact of finite size.

    >>> print(f"{cr.smooth(scene, load=contact.load).approach:.4g}")  # the rough one's is 5e-5
    4.184e-05
    """
    checks.instance("scene", scene, Scene)
    if (found := smooth_reference(scene, checks.positive("load", load))) is None:
        expected = "a sphere or an ellipsoid: other bases have no smooth reference"
        raise InputError("scene", found=base.named(scene.sphere_radius), expected=expected)
    return found


def smooth_reference(scene: Scene, load: float) -> SmoothSphere | None:
    """`smooth`, or None for bases without a smooth reference."""
    if isinstance(scene.sphere_radius, tuple):
        return None if math.inf in scene.sphere_radius else SmoothEllipsoid(scene, load)
    return SmoothSphere(scene, load) if scene.curved else None


@dataclass(frozen=True, eq=False, repr=False)
class SmoothSphere(Record):
    """A smooth sphere under a normal load, and under a shear force at that load.

    Distances, forces and results are numbers or arrays alike. Whatever is tangential raises
    InputError where the scene has no friction or a force exceeds f P in size (gross sliding).

    >>> whole = cr.smooth(scene, load=contact.load)
    >>> print(f"{whole.contact_radius:.4g}", f"{whole.displacement(0.25 * contact.load):.3g}")
    0.006468 9.4e-06
    """

    _shown = ("contact_radius", "approach", "peak_pressure")

    scene: Scene
    load: float

    @property
    def radius(self) -> float:
        """R  [length]."""
        return self.scene.mean_radius

    @cached_property
    def contact_radius(self) -> float:
        """a_H = (3 P R / (4 E*))^(1/3)  [length]."""
        return float(hertz.contact_radius(self.load, self._modulus, self.radius))

    @cached_property
    def approach(self) -> float:
        """delta = a_H^2 / R, of two deep points, one in each body [length]."""
        coefficient = hertz.local_coefficient(self._modulus, self.radius)
        return float(hertz.indentation(self.load, coefficient))

    @cached_property
    def peak_pressure(self) -> float:
        """p0 = 2 E* a_H / (pi R)  [force / length^2]."""
        return float(hertz.peak_pressure(self.contact_radius, self._modulus, self.radius))

    def pressure(self, distance: ArrayLike) -> Any:
        """p(r) = p0 sqrt(1 - r^2 / a_H^2) at a distance from the axis [force / length^2]."""
        return hertz.pressure(distance, self.contact_radius, self.peak_pressure)

    def normal_displacement(self, distance: ArrayLike) -> Any:
        """Normal displacement of both surfaces at a distance from the axis [length]."""
        return hertz.surface_displacement(distance, self.contact_radius, self.radius)

    @property
    def largest_force(self) -> float:
        """f P, where gross sliding begins [force]."""
        return self._friction * self.load

    def stick_radius(self, force: ArrayLike) -> Any:
        """c = a_H (1 - |Q| / (f P))^(1/3)  [length]."""
        return self.contact_radius * np.cbrt(1.0 - np.abs(self._share("force", force)))

    def traction(self, distance: ArrayLike, force: ArrayLike) -> Any:
        """f p0 sqrt(1 - r^2/a^2) less f p0 (c/a) sqrt(1 - r^2/c^2)  [force / length^2].

        At a distance from the axis, along the shear; on first loading.
        """
        peak = self._friction * self.peak_pressure
        return surface_shear.traction(
            distance, self.contact_radius, self._share("force", force), peak
        )

    def displacement(self, force: ArrayLike) -> Any:
        """X = (3 (2-nu) f P / (8 G a_H)) [1 - (1 - Q/(f P))^(2/3)]  [length], on first loading."""
        return self._largest_displacement * mindlin.deflection(self._share("force", force))

    def branch(self, force: ArrayLike, turning_force: float) -> Any:
        """X on the way back from a turning point of first loading, to its mirror image [length].

        Masing's rule [14]-[15]: X1 - 2 X((Q1 - Q) / 2) for |Q| <= |Q1|, with Q1 the turning force
        and X(Q) the `displacement` of first loading. A positive Q1 unloads, a negative one reloads.
        """
        turning = checks.finite("turning_force", turning_force)
        first = self.displacement(turning)
        given = np.asarray(force, dtype=np.float64)
        if not (np.abs(given) <= abs(turning)).all():
            raise InputError(
                "force",
                found=given.flat[np.abs(given).argmax()],
                expected=f"at most the turning force {abs(turning):.17g} in size",
            )
        return first - 2.0 * self.displacement((turning - given) / 2.0)

    def energy(self, maximum: ArrayLike, minimum: ArrayLike | None = None) -> Any:
        """Energy lost per steady cycle between two forces, [16] for both bodies [force length].

        W0 e((maximum - minimum) / (2 f P)); the minimum defaults to the negative of the maximum.
        """
        upper = self._share("maximum", maximum)
        lower = -upper if minimum is None else self._share("minimum", minimum)
        if (lower > upper).any():
            expected = "at least the minimum, by default the negative of the maximum"
            raise InputError("maximum", found=maximum, expected=expected)
        return self.energy_scale * mindlin.loss((upper - lower) / 2.0)

    @property
    def energy_scale(self) -> float:
        """W0 = 9 (2 - nu) f^2 P^2 / (5 G a_H)  [force length]."""
        return 4.8 * self._friction * self.load * self._largest_displacement

    @property
    def _largest_displacement(self) -> float:
        """c_t f delta = 3 (2 - nu) f P / (8 G a_H), at Q = f P  [length]."""
        ratio = mindlin.ratio(self.scene.material.poisson_ratio)
        return float(ratio * self._friction * self.approach)

    @property
    def _modulus(self) -> float:
        return self.scene.material.contact_modulus

    @property
    def _friction(self) -> float:
        return checks.friction(self.scene.friction)

    def _share(self, what: str, forces: ArrayLike) -> Array:
        """t = Q / (f P), in [-1, 1]."""
        forces = checks.bearable(what, forces, self.largest_force)
        return np.clip(forces / self.largest_force, -1.0, 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class SmoothEllipsoid(SmoothSphere):
    """A smooth ellipsoid: the same, where the circle of the ellipse's area stands for the ellipse.

    A distance is s sqrt(a b) for a point at s^2 = x^2/a^2 + y^2/b^2, and the stick zone is an
    ellipse of the same shape. Whatever is tangential rests on the papers' assumption, as that of a
    rough contact does: c_t, the angular mean, for the ratio of compliances, exact at nu = 0.
    The normal displacement outside is of spheres alone.

    >>> oval = cr.Scene((1.0, 2.0), scene.asperities, scene.material)
    >>> "{:.4g} {:.4g}".format(*cr.smooth(oval, load=contact.load).semi_axes)
    '0.005728 0.009083'
    """

    _shown = ("semi_axes", "approach", "peak_pressure")

    @property
    def radius(self) -> float:
        """Of the sphere with the same approach under every load, 9 P^2 / (16 E*^2 delta^3)."""
        return 9.0 * self.load**2 / (16.0 * self._modulus**2 * self.approach**3)

    @cached_property
    def semi_axes(self) -> tuple[float, float]:
        """Of the ellipse of contact, along x and along y [length]."""
        return ellipse.semi_axes(self.load, self._modulus, base.along(self.scene.sphere_radius))

    @cached_property
    def contact_radius(self) -> float:
        """sqrt(a b), of the circle of the same area [length]."""
        return math.sqrt(math.prod(self.semi_axes))

    @cached_property
    def approach(self) -> float:
        """Of two deep points, one in each body [length]."""
        return ellipse.approach(self.load, self._modulus, self.semi_axes)

    @cached_property
    def peak_pressure(self) -> float:
        """p0 = 3 P / (2 pi a b)  [force / length^2]."""
        return 1.5 * self.load / (math.pi * math.prod(self.semi_axes))

    def normal_displacement(self, distance: ArrayLike) -> Any:
        """Not of an ellipsoid: raises InputError."""
        base.sphere_radius(self.scene.sphere_radius, "normal_displacement")
