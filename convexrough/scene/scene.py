"""What is pressed on what: material, asperities, and the sphere. No loads, no solving."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.checks import Array, Indices, frozen
from convexrough.errors import InputError
from convexrough.scene.lattice import Lattice
from convexrough.scene.patterns import CUT, checked_seed, cut_normal, hexagonal_sites, square_sites

Geometry = Literal["summit", "closest"]

#: Of more asperities than this, a lattice is looked for before the nearest neighbours of all.
MANY = 5000


@dataclass(frozen=True)
class Material:
    """Two elastically similar bodies.

    contact_modulus : E* = E / (2 (1 - nu^2))  [force / length^2]
    poisson_ratio   : nu, from 0 to 0.5
    """

    contact_modulus: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        for name, value in (
            ("contact_modulus", checks.positive("contact_modulus", self.contact_modulus)),
            ("poisson_ratio", checks.between("poisson_ratio", self.poisson_ratio, 0.0, 0.5)),
        ):
            object.__setattr__(self, name, value)

    @classmethod
    def from_youngs(cls, modulus: float, poisson_ratio: float) -> Material:
        """Both bodies of Young's modulus E: E* = E / (2 (1 - nu^2))."""
        modulus = checks.positive("youngs_modulus", modulus)
        ratio = checks.between("poisson_ratio", poisson_ratio, 0.0, 0.5)
        return cls(modulus / (2.0 * (1.0 - ratio**2)), ratio)

    @property
    def youngs_modulus(self) -> float:
        """E = 2 (1 - nu^2) E*  [force / length^2]."""
        return 2.0 * (1.0 - self.poisson_ratio**2) * self.contact_modulus

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)) = (1 - nu) E*  [force / length^2]."""
        return (1.0 - self.poisson_ratio) * self.contact_modulus


@dataclass(frozen=True, eq=False)
class Asperities:
    """Spherical asperities on the half-space, in the caller's order.

    positions : (n, 2) [length]  summits; the axis of the sphere is the origin
    tip_radii : (n,) [length]    one number stands for all
    heights   : (n,) [length]    offset of each summit, positive is taller; one number for all
    """

    positions: Array
    tip_radii: Array
    heights: Array

    def __init__(
        self, positions: ArrayLike, tip_radii: ArrayLike, heights: ArrayLike = 0.0
    ) -> None:
        points = _points(positions)
        object.__setattr__(self, "positions", points)
        n = len(points)
        radii = checks.array("tip_radii", tip_radii, length=n, sign="positive")
        object.__setattr__(self, "tip_radii", radii)
        object.__setattr__(self, "heights", checks.array("heights", heights, length=n))
        if n <= MANY or self.lattice is None:
            refuse_coincident(points)

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def lattice(self) -> Lattice | None:
        """What the summits lie on, each on a site of its own, if that is a lattice."""
        return Lattice.through(self.positions)

    @cached_property
    def distances(self) -> Array:
        """(n,) [length] distance of each summit from the axis."""
        x, y = self.positions.T
        return frozen(np.hypot(x, y))

    @classmethod
    def hexagonal(
        cls,
        *,
        spacing: float,
        tip_radius: ArrayLike,
        within: float,
        height_std: float = 0.0,
        tip_radius_cv: float = 0.0,
        seed: int | None = None,
    ) -> Asperities:
        """A triangular lattice of six nearest neighbours, one asperity on the axis.

        spacing       : distance of nearest neighbours [length]
        tip_radius    : a number, or one per asperity in the order of the result [length]
        within        : keep the asperities at most this far from the axis [length]
        height_std    : standard deviation of normal random heights [length]
        tip_radius_cv : coefficient of variation of lognormal tip radii of mean `tip_radius`
        seed          : required when heights or radii are random

        Asperities are ordered by distance from the axis, then by angle. A larger `within`
        adds asperities behind the others and leaves those, with their random heights and
        radii, as they were.
        """
        rough = (height_std, tip_radius_cv, seed)
        return cls._lattice(hexagonal_sites, 2 / np.sqrt(3), spacing, tip_radius, within, *rough)

    @classmethod
    def square(
        cls,
        *,
        spacing: float,
        tip_radius: ArrayLike,
        within: float,
        height_std: float = 0.0,
        tip_radius_cv: float = 0.0,
        seed: int | None = None,
    ) -> Asperities:
        """A square lattice, one asperity on the axis; arguments as for `hexagonal`."""
        rough = (height_std, tip_radius_cv, seed)
        return cls._lattice(square_sites, 1.0, spacing, tip_radius, within, *rough)

    @classmethod
    def _lattice(
        cls,
        sites: Callable[[float], tuple[Array, Indices]],
        density: float,
        spacing: float,
        tip_radius: ArrayLike,
        within: float,
        height_std: float,
        tip_radius_cv: float,
        seed: int | None,
    ) -> Asperities:
        spacing = checks.positive("spacing", spacing)
        within = checks.non_negative("within", within)
        height_std = checks.non_negative("height_std", height_std)
        tip_radius_cv = checks.non_negative("tip_radius_cv", tip_radius_cv)
        checks.fits_in_memory("spacing", np.pi * density * (within / spacing) ** 2 + 1, 300)

        unit, norms = sites((within / spacing) ** 2 * (1 + 1e-12))
        angles = np.arctan2(unit[:, 1], unit[:, 0]) % (2 * np.pi)
        unit = unit[np.lexsort((angles, norms))]
        n = len(unit)
        radii = checks.array("tip_radius", tip_radius, length=n, sign="positive")
        heights = np.zeros(n)
        if height_std > 0 or tip_radius_cv > 0:
            seed = checked_seed(seed)
            heights = height_std * cut_normal(n, seed, stream=0)
            width = np.sqrt(np.log1p(tip_radius_cv**2))
            radii = radii * np.exp(width * cut_normal(n, seed, stream=1) - width**2 / 2)
        return cls(spacing * unit, radii, heights)


@dataclass(frozen=True, eq=False)
class Scene:
    """A sphere, the asperities it is pressed on, and what both are made of.

    sphere_radius : R [length]
    friction      : Coulomb's coefficient f; only the shear stages need it
    geometry      : "summit" (the source paper: an asperity meets the sphere at its summit) or
                    "closest" (it meets it where the two undeformed paraboloids are closest)
    """

    sphere_radius: float
    asperities: Asperities
    material: Material
    friction: float | None = None
    geometry: Geometry = "summit"

    def __post_init__(self) -> None:
        if not isinstance(self.asperities, Asperities):
            raise InputError("asperities", found=repr(self.asperities)[:60], expected="Asperities")
        if not isinstance(self.material, Material):
            raise InputError("material", found=repr(self.material)[:60], expected="a Material")
        radius = checks.positive("sphere_radius", self.sphere_radius)
        object.__setattr__(self, "sphere_radius", radius)
        if self.friction is not None:
            object.__setattr__(self, "friction", checks.positive("friction", self.friction))
        if self.geometry not in ("summit", "closest"):
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
        rho = self.asperities.tip_radii
        return frozen(1.0 / (1.0 / self.sphere_radius + 1.0 / rho))

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

    @cached_property
    def drops(self) -> Array:
        """(n,) [length] how much further away the sphere's surface is than on the axis.

        r_i^2 / (2 R), or in the "closest" geometry r_i^2 / (2 (R + rho_i)).
        """
        x, y = self.asperities.positions.T
        further = self.asperities.tip_radii if self.geometry == "closest" else 0.0
        return frozen((x * x + y * y) / (2.0 * (self.sphere_radius + further)))

    @cached_property
    def offsets(self) -> Array:
        """(n,) [length]  d_i = z_i - drop_i: prescribed approach of each asperity, less D0."""
        return frozen(self.asperities.heights - self.drops)

    @cached_property
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


def largest_tip_radius(tip_radius: ArrayLike, tip_radius_cv: float) -> float:
    """The largest tip radius that `hexagonal` and `square` can draw [length]."""
    width = np.sqrt(np.log1p(tip_radius_cv**2))
    return float(np.max(tip_radius) * np.exp(CUT * width - width**2 / 2))


def refuse_coincident(points: Array) -> None:
    """Two asperities at one place have no finite interaction."""
    if len(points) < 2:
        return
    distances = nearest_distances(points)
    blur = 16 * np.finfo(float).eps * np.abs(points).max()  # well beyond the points' rounding
    if (worst := float(distances.min())) <= blur:
        first = int(np.argmin(distances))
        others = np.hypot(*(points[first + 1 :] - points[first]).T)
        second = first + 1 + int(np.argmin(others))
        raise InputError(
            "positions",
            found=f"asperities {first} and {second} (from 0) at a distance of {worst:g}",
            expected="distinct positions",
        )


def nearest_distances(points: Array) -> Array:
    """(n,) [length] distance of each point to its nearest neighbour; by a k-d tree."""
    from scipy.spatial import cKDTree  # 0.1 s to import: only when asked

    return np.asarray(cKDTree(points).query(points, k=2)[0])[:, 1]


def _points(positions: ArrayLike) -> Array:
    try:
        points = np.array(positions, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError("positions", found=repr(positions)[:60], expected="numbers") from error
    if points.size == 0:
        raise InputError("positions", found="no asperity", expected="at least one")
    if points.ndim != 2 or points.shape[1] != 2:
        found = f"shape {points.shape}"
        raise InputError("positions", found=found, expected="shape (n, 2): x and y of each")
    if not (good := (np.abs(points) <= checks.LARGEST).all(axis=1)).all():
        first = int(np.argmin(good))
        found = str(points[first])
        raise InputError(f"positions[{first}]", found=found, expected="finite numbers")
    points.flags.writeable = False
    return points
