"""The scene: a sphere or another shape, asperities and material, without loads and solutions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from convexrough import checks
from convexrough.arithmetic.pairs import Pair, two_sum
from convexrough.arrays import Array, even, evenly, frozen
from convexrough.errors import InputError
from convexrough.record import Record
from convexrough.scene import base
from convexrough.scene.asperities import Asperities
from convexrough.scene.lattice import Lattice
from convexrough.scene.material import Material
from convexrough.scene.neighbours import nearest_distances, refuse_coincident
from convexrough.tabular.units import NAMELESS, UnitNames, parsed

Geometry = Literal["summit", "closest"]


@dataclass(frozen=True, eq=False, repr=False)
class Scene(Record):
    """A sphere, the asperities on which it is pressed, and the material of both bodies.

    sphere_radius : [length] radius R of a sphere; inf for a flat. A pair (Rx, Ry) of radii of
        curvature along x and y makes an ellipsoid, or a cylinder if one of them is inf
    friction      : Coulomb's coefficient of friction f; None if the scene is not sheared
    geometry      : position of each contact: "closest" (where the undeformed paraboloids of sphere
        and asperity are closest) or "summit" (at the summit of the asperity, as in Dini and Hills
        2009)
    units         : names of the units of length and force, such as ("mm", "N"), for figures and
        reports, which may convert to SI units; the numbers of the scene and of results stay as they
        are

    Raises InputError for bad values, and if two contact points coincide.

    >>> asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    >>> material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    >>> scene = cr.Scene(sphere_radius=1.0, asperities=asperities, material=material, friction=0.5)
    >>> len(scene)
    61
    """

    sphere_radius: base.Radius
    asperities: Asperities
    material: Material
    friction: float | None = None
    geometry: Geometry = "closest"
    units: UnitNames = NAMELESS

    def __post_init__(self) -> None:
        checks.instance("asperities", self.asperities, Asperities)
        checks.instance("material", self.material, Material)
        object.__setattr__(self, "sphere_radius", base.checked(self.sphere_radius))
        if self.friction is not None:
            object.__setattr__(self, "friction", checks.positive("friction", self.friction))
        if not isinstance(self.geometry, str) or self.geometry not in ("summit", "closest"):
            raise InputError(
                "geometry", found=repr(self.geometry), expected='"summit" or "closest"'
            )
        object.__setattr__(self, "units", UnitNames.of(self.units))
        unit = getattr(getattr(self.asperities, "origin", None), "unit", "")  # of a map
        own, named = parsed(unit), self.units.unit("length")
        if own and named and own.into(named) != 1:
            expected = f'units=("{unit}", ...), or Surface.to_unit("{self.units.length}")'
            raise InputError("units", found=f"summits in {unit}", expected=expected)
        # With equal tips, at most as large as the sphere, contact points are the distinct summits,
        # scaled.
        tips, sphere = self.asperities.tip_radii, min(base.along(self.sphere_radius))
        if self.geometry == "closest" and ((tips != tips[0]).any() or tips[0] > sphere):
            refuse_coincident(self.contact_points, self.nearest)

    def __len__(self) -> int:
        return len(self.asperities)

    @cached_property
    def curved(self) -> list[tuple[float, slice]]:
        """[length] each finite radius, with the slice of the axes (0: x, 1: y) that have it."""
        return base.curved(self.sphere_radius)

    @property
    def curvature(self) -> float:
        """[1 / length] curvature of the sphere: 1/R, or the mean (1/Rx + 1/Ry) / 2."""
        Rx, Ry = base.along(self.sphere_radius)
        return (1.0 / Rx + 1.0 / Ry) / 2.0

    @property
    def mean_radius(self) -> float:
        """[length] radius of a sphere with the same `curvature`; inf for a flat."""
        R = self.sphere_radius
        return 1.0 / self.curvature if isinstance(R, tuple) else R

    @cached_property
    def relative_radii(self) -> Array:
        """(n,) [length] R_i, from 1/R_i = `curvature` + 1/rho_i with the tip radius rho_i."""
        radii = self.asperities.tip_radii
        return evenly(lambda rho: frozen(1.0 / (self.curvature + 1.0 / rho)), radii)

    @cached_property
    def contact_points(self) -> Array:
        """(n, 2) [length] the point at which each asperity first touches.

        In the geometry "summit" it is the summit r_i. In the geometry "closest" it is
        r_i R / (R + rho_i) along each axis, with the sphere's radius R and the tip radius rho_i.
        """
        if self.geometry == "summit" or not self.curved:
            return self.asperities.positions
        points = self.asperities.positions.copy()
        for R, axes in self.curved:
            points[:, axes] *= (R / self.far_radii(R))[:, None]
        return frozen(points)

    @cached_property
    def nearest(self) -> Array:
        """(n,) [length] distance of each contact point to the nearest other one."""
        layout = self.asperities.layout
        summits = self.contact_points is layout.points
        return layout.nearest if summits else frozen(nearest_distances(self.contact_points))

    def far_radii(self, radius: float) -> Array:
        """(n,) [length] `radius`; in the geometry "closest", `radius` + the tip radius rho_i.

        radius : [length] a radius of the sphere

        >>> cr.Scene(1.0, scene.asperities, scene.material, geometry="closest").far_radii(1.0)[:2]
        array([1.02, 1.02])
        """
        if self.geometry == "summit":
            return even(radius, len(self))
        return frozen(radius + self.asperities.tip_radii)

    @cached_property
    def contact_tails(self) -> Array | None:
        """(n, 2) [length] exact contact points minus `contact_points`; None if all are 0.

        The error of each number is at most 2^-96 times the absolute value of the same coordinate of
        the contact point.
        """
        points = self.asperities.positions
        if self.contact_points is points:
            return None
        tails = np.zeros_like(points)
        for radius, axes in self.curved:
            share = Pair.exact(radius) / Pair(*two_sum(radius, self.asperities.tip_radii))
            for axis in np.arange(2)[axes]:
                exactly = Pair.exact(points[:, axis]) * share
                tails[:, axis] = (exactly - Pair.exact(self.contact_points[:, axis])).high
        return frozen(tails)

    @cached_property
    def lattice(self) -> Lattice | None:
        """The lattice of the contact points: that of the summits, perhaps scaled, or None."""
        lattice, radii = self.asperities.lattice, self.asperities.tip_radii
        if self.contact_points is self.asperities.positions or lattice is None:
            return lattice
        if (radii != radii[0]).any():
            return None
        return _shrunk(lattice, base.along(self.sphere_radius), float(radii[0]))

    @property
    def point_error(self) -> float:
        """[length] bound on the rounding error of each coordinate of `contact_points`."""
        if self.contact_points is self.asperities.positions:
            return 0.0
        return 3 * 2.0**-53 * float(np.abs(self.contact_points).max())

    @cached_property
    def drops(self) -> Array:
        """(n,) [length] gaps between the sphere and asperities of height 0, at the approach 0.

        At the distance r_i from the axis the gap is r_i^2 / (2 R), or r_i^2 / (2 (R + rho_i)) in
        the geometry "closest". With two radii it is the sum of such terms in x and y.
        """
        squares, drops = self.asperities.positions**2, np.zeros(len(self))
        for R, axes in self.curved:
            drops += squares[:, axes] @ np.ones(2)[axes] / (2.0 * self.far_radii(R))
        return frozen(drops)

    @property
    def offsets(self) -> Array:
        """(n,) [length] d_i, heights minus `drops`; at the approach D0, the overlap is D0 + d_i."""
        return frozen(self.asperities.heights - self.drops)

    @property
    def offset_errors(self) -> Array:
        """(n,) [length] bound on the rounding error of `offsets`."""
        return frozen(6 * 2.0**-53 * (np.abs(self.asperities.heights) + self.drops))

    def reach(self, approach: float) -> float:
        """[length] distance from the axis beyond which none of these asperities can touch.

        It is computed for the largest height and tip radius; inf on a flat or a cylinder.

        approach : [length] D0

        >>> round(scene.reach(approach=5e-5), 10)
        0.01
        """
        return reach(
            checks.finite("approach", approach),
            sphere_radius=self.sphere_radius,
            tip_radius=float(self.asperities.tip_radii.max()),
            height=float(self.asperities.heights.max()),
            geometry=self.geometry,
        )


@lru_cache(8)  # scenes that differ only in heights share it
def _shrunk(lattice: Lattice, radii: tuple[float, float], tip: float) -> Lattice | None:
    """The lattice of the points x R / (R + tip), with the radii R along x and y."""
    factors = (Fraction(R) / (Fraction(R) + Fraction(tip)) if math.inf > R else 1 for R in radii)
    return lattice.shrunk(*map(Fraction, factors))


def reach(
    approach: float,
    *,
    sphere_radius: base.Radius,
    tip_radius: float,
    height: float,
    geometry: Geometry,
) -> float:
    """[length] the distance r from the axis at which an asperity of this height just touches.

    It solves D0 + z = r^2 / (2 R), or D0 + z = r^2 / (2 (R + rho)) in the geometry "closest". D0 is
    the approach, z the height, R the (larger) radius of the sphere, and rho the tip radius.
    """
    radius = max(base.along(sphere_radius)) + (tip_radius if geometry == "closest" else 0.0)
    depth = approach + height
    return float(np.sqrt(2.0 * radius * depth)) if depth > 0 else 0.0
