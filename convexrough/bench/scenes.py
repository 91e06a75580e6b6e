"""The scenes that are timed: the source paper's example, refined."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from convexrough.paper.example import APPROACH as APPROACH
from convexrough.paper.example import scene_of
from convexrough.scene.asperities import Asperities
from convexrough.scene.scene import Scene

Family = Literal["lattice", "rough", "scattered"]

#: A hexagonal lattice of equal asperities; the same with random heights (standard deviation 1e-6 R)
#: and tip radii (10 %); the first with asperities moved at random by up to 0.15 of the spacing.
FAMILIES: tuple[Family, ...] = ("lattice", "rough", "scattered")

#: The refinement with which a scene has about this many asperities.
REFINEMENTS = {61: 1.0, 700: 3.4, 8_400: 12.0, 13_000: 15.0, 36_000: 25.0, 120_000: 45.0,
               330_000: 75.0, 1_300_000: 150.0, 5_200_000: 300.0}  # fmt: skip


def scene(family: Family, refinement: float) -> Scene:
    """The paper's scene with spacing and tip radius divided by the refinement."""
    spacing, tip_radius = 0.0025 / refinement, 0.02 / refinement
    lattice: dict[str, Any] = dict(spacing=spacing, tip_radius=tip_radius, within=0.01)
    if family == "rough":
        lattice |= dict(height_std=1e-6, tip_radius_cv=0.1, seed=1)
    asperities = Asperities.hexagonal(**lattice)
    if family == "scattered":
        random = np.random.default_rng(1)
        distance = 0.15 * spacing * np.sqrt(random.random(len(asperities)))
        angle = 2.0 * np.pi * random.random(len(asperities))
        moved = distance[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
        asperities = Asperities(asperities.positions + moved, tip_radius)
    return scene_of(asperities)
