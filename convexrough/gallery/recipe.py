"""What a hard case is made of, and pieces that several are made from.

Only operations that IEEE 754 rounds correctly, so that every machine builds the same float64
numbers: the answers belong to those, and `answers` holds their hash against what was built.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from convexrough.scene.asperities import Asperities
from convexrough.scene.material import Material
from convexrough.scene.scene import Geometry, Scene

Point: TypeAlias = tuple[float, float]

#: That of every case: the words of friction do not depend on it.
FRICTION = 0.5
MATERIAL = Material(contact_modulus=1.0, poisson_ratio=0.3)

#: The source paper's example, sphere radius 1: spacing, tip radius and approach.
SPACING, TIP_RADIUS, APPROACH = 0.0025, 0.02, 5e-5


@dataclass(frozen=True)
class Recipe:
    """A case without its answer.

    family   : cases of one kind of hardness
    why      : what is hard about it
    approach [length] or load [force] : what is prescribed, exactly one
    fraction : shear force over f P
    history  : shear forces over the last one, where it is reached by a history
    """

    family: str
    why: str
    scene: Scene
    approach: float | None = None
    load: float | None = None
    fraction: float = 0.4
    history: tuple[float, ...] = ()


#: Recipes by the names of their cases.
Recipes: TypeAlias = dict[str, Callable[[], Recipe]]


def placed(
    points: Sequence[Point],
    tip_radii: float | Sequence[float] = TIP_RADIUS,
    heights: float | Sequence[float] = 0.0,
    *,
    sphere_radius: float = 1.0,
    geometry: Geometry = "summit",
) -> Scene:
    """Asperities at these points, of the usual material."""
    asperities = Asperities(points, tip_radii, heights)
    return Scene(sphere_radius, asperities, MATERIAL, FRICTION, geometry)


def hexagon(rings: int, spacing: float = SPACING) -> list[Point]:
    """A hexagonal patch, 1 + 3 rings (rings + 1) points from the middle outwards."""
    steps = range(-rings, rings + 1)
    sites = [(i, j) for i in steps for j in steps if abs(i + j) <= rings]
    sites.sort(key=lambda site: (site[0] ** 2 + site[0] * site[1] + site[1] ** 2, site))
    return [((i + 0.5 * j) * spacing, math.sqrt(0.75) * j * spacing) for i, j in sites]


def roughness(count: int, seed: int) -> list[float]:
    """Random numbers of mean 0 and deviation 1, bell-shaped: sums of twelve uniform ones."""
    numbers = random.Random(seed)
    return [math.fsum(numbers.random() for _ in range(12)) - 6.0 for _ in range(count)]


def manufactured(
    points: Sequence[Point],
    tip_radii: Sequence[float],
    contact_radii: Sequence[float],
    gaps: Sequence[float],
    *,
    sphere_radius: float = 1.0,
) -> tuple[Scene, float]:
    """Heights and an approach with (almost) these contact radii, and gaps where those are 0.

    D_i = a_i^2 / R_i + (4 / (3 pi)) sum_j a_j^3 / (R_j r_ij) - g_i: docs/theory/convexity.md, (1),
    in contact radii. The heights are rounded, so the answer is near the radii and not at them.
    """
    relative = [1.0 / (1.0 / sphere_radius + 1.0 / tip) for tip in tip_radii]
    volumes = [a * a * a / R for a, R in zip(contact_radii, relative, strict=True)]

    def asked(i: int) -> float:
        others = math.fsum(
            volumes[j] / math.dist(points[i], points[j]) for j in range(len(points)) if j != i
        )
        own = contact_radii[i] * contact_radii[i] / relative[i]
        return own + 4.0 / (3.0 * math.pi) * others - gaps[i]

    prescribed = [asked(i) for i in range(len(points))]
    approach = max(prescribed)
    drops = [(x * x + y * y) / (2.0 * sphere_radius) for x, y in points]
    heights = [D - approach + drop for D, drop in zip(prescribed, drops, strict=True)]
    return placed(points, tip_radii, heights, sphere_radius=sphere_radius), approach
