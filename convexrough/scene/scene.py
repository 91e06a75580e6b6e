"""What is pressed on what: a sphere on asperities. No loads, no solving."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, evenly, frozen
from convexrough.errors import InputError
from convexrough.record import Record
from convexrough.scene.asperities import Asperities
from convexrough.scene.lattice import Lattice
from convexrough.scene.layout import MANY
from convexrough.scene.material import Material
from convexrough.scene.neighbours import refuse_coincident

Geometry = Literal["summit", "closest"]


@dataclass(frozen=True, eq=False, repr=False)
class Scene(Record):
    """A sphere, the asperities it is pressed on, and what both are made of.

    sphere_radius : R [length]
    friction      : Coulomb's coefficient f; only the shear stages need it
    geometry      : "summit" (the source paper: an asperity meets the sphere at its summit) or
                    "closest" (it meets it where the two undeformed paraboloids are closest)

    >>> asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    >>> material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    >>> scene = cr.Scene(sphere_radius=1.0, asperities=asperities, material=material, friction=0.5)
    >>> len(scene)
    61
    """

    sphere_radius: float
    asperities: Asperities
    material: Material
    friction: float | None = None
    geometry: Geometry = "summit"

    def __post_init__(self) -> None:
        checks.instance("asperities", self.asperities, Asperities)
        checks.instance("material", self.material, Material)
        radius = checks.positive("sphere_radius", self.sphere_radius)
        object.__setattr__(self, "sphere_radius", radius)
        if self.friction is not None:
            object.__setattr__(self, "friction", checks.positive("friction", self.friction))
        if not isinstance(self.geometry, str) or self.geometry not in ("summit", "closest"):
            raise InputError(
                "geometry", found=repr(self.geometry), expected='"summit" or "closest"'
            )
        if self.geometry == "closest" and (len(self) <= MANY or self.lattice is None):
            refuse_coincident(self.contact_points)

    def __len__(self) -> int:
        return len(self.asperities)

    @cached_property
    def relative_radii(self) -> Array:
        """(n,) [length]  1/R_i = 1/R + 1/rho_i."""

        def relative(rho: Array) -> Array:
            return frozen(1.0 / (1.0 / self.sphere_radius + 1.0 / rho))

        return evenly(relative, self.asperities.tip_radii)

    @cached_property
    def contact_points(self) -> Array:
        """(n, 2) [length] where each asperity would first touch.

        The summit itself, or in the "closest" geometry r_i R / (R + rho_i).
        """
        points = self.asperities.positions
        if self.geometry == "summit":
            return points
        shrink = self.sphere_radius / (self.sphere_radius + self.asperities.tip_radii)
        return frozen(points * shrink[:, None])

    @cached_property
    def lattice(self) -> Lattice | None:
        """What the contact points lie on, if that is a lattice."""
        if self.geometry == "summit":
            return self.asperities.lattice
        return Lattice.through(self.contact_points)

    @property
    def point_error(self) -> float:
        """[length] bound on the rounding error of each coordinate of `contact_points`."""
        if self.geometry == "summit":
            return 0.0
        return 3 * 2.0**-53 * float(np.abs(self.contact_points).max())

    @property
    def drops(self) -> Array:
        """(n,) [length] how much further away the sphere's surface is than on the axis.

        r_i^2 / (2 R), or in the "closest" geometry r_i^2 / (2 (R + rho_i)).
        """
        x, y = self.asperities.positions.T
        further = self.asperities.tip_radii if self.geometry == "closest" else 0.0
        return frozen((x * x + y * y) / (2.0 * (self.sphere_radius + further)))

    @property
    def offsets(self) -> Array:
        """(n,) [length]  d_i = z_i - drop_i: prescribed approach of each asperity, less D0."""
        return frozen(self.asperities.heights - self.drops)

    @property
    def offset_errors(self) -> Array:
        """(n,) [length] bound on the rounding error of `offsets`."""
        return frozen(6 * 2.0**-53 * (np.abs(self.asperities.heights) + self.drops))

    def reach(self, approach: float) -> float:
        """Distance from the axis beyond which none of these asperities' kind could touch [length].

        Where even the tallest height and the largest tip radius give a prescribed approach of 0.
        """
        return reach(
            approach,
            sphere_radius=self.sphere_radius,
            tip_radius=float(self.asperities.tip_radii.max()),
            height=float(self.asperities.heights.max()),
            geometry=self.geometry,
        )


def reach(
    approach: float, *, sphere_radius: float, tip_radius: float, height: float, geometry: Geometry
) -> float:
    """Distance r at which D0 + z = r^2 / (2 R)  (closest: r^2 / (2 (R + rho)))  [length]."""
    radius = sphere_radius + (tip_radius if geometry == "closest" else 0.0)
    return float(np.sqrt(2.0 * radius * max(approach + height, 0.0)))
