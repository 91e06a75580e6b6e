"""Scenes and scene generators that several tests share."""

from functools import cache
from typing import Any

import multiprecision
import numpy as np
from hypothesis import strategies as st

import convexrough as cr

MATERIAL = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
STEEL = cr.Material.from_youngs(210e9, 0.3)
PAPER_APPROACH = 5e-5


def paper(geometry: Any = "summit") -> cr.Scene:
    """The source paper's example: 61 asperities, of which 37 touch."""
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    return cr.Scene(1.0, asperities, MATERIAL, geometry=geometry)


def rough(geometry: Any = "summit") -> cr.Scene:
    """91 asperities with random heights and tip radii."""
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025,
        tip_radius=0.02,
        within=0.0126,
        height_std=1e-6,
        tip_radius_cv=0.1,
        seed=7,
    )
    assert len(asperities) == 91
    return cr.Scene(1.0, asperities, MATERIAL, geometry=geometry)


def steel(geometry: Any = "summit") -> cr.Scene:
    """Steel on steel in SI units: R = 10 mm."""
    asperities = cr.Asperities.hexagonal(spacing=25e-6, tip_radius=2e-4, within=126e-6)
    return cr.Scene(0.01, asperities, STEEL, geometry=geometry)


#: name -> (scene, approach): every one in the convex range.
NAMED = {
    "paper": (paper(), PAPER_APPROACH),
    "paper, closest": (paper("closest"), PAPER_APPROACH),
    "rough": (rough(), PAPER_APPROACH),
    "rough, closest": (rough("closest"), PAPER_APPROACH),
    "steel": (steel(), 0.5e-6),
}


@cache
def reference(scene: cr.Scene, **control: float) -> multiprecision.Reference:
    """The proved 50-digit solution; kept, as several tests ask for the same one."""
    return solve_exactly(scene, **control)


def solve_exactly(scene: cr.Scene, **control: Any) -> multiprecision.Reference:
    """As `reference`, from a `start` if given."""
    return multiprecision.solve(
        scene.asperities.positions,
        scene.asperities.tip_radii,
        scene.asperities.heights,
        sphere_radius=scene.sphere_radius,
        contact_modulus=scene.material.contact_modulus,
        geometry=scene.geometry,
        **control,
    )


def scattered(seed: int, count: int, crowding: float, roughness: float) -> tuple[cr.Scene, float]:
    """A random scene and an approach.

    crowding  : about the convexity number it will have (well below 1 is easy, above is hard)
    roughness : standard deviation of heights over the approach
    """
    rng = np.random.default_rng(seed)
    separation = 0.6 / np.sqrt(count)
    points = [np.zeros(2)]
    while len(points) < count:
        point = rng.uniform(-1, 1, 2)
        if min(float(np.hypot(*(point - other))) for other in points) > separation:
            points.append(point)
    approach = 10.0 ** rng.uniform(-4, -1)
    tip_radii = (crowding * np.pi / 4 * separation) ** 2 / approach * rng.lognormal(0, 0.2, count)
    sphere = float(10.0 ** rng.uniform(0, 2)) / approach
    scale = float(10.0 ** rng.uniform(-6, 6))
    heights = rng.normal(0, roughness, count) * approach
    scene = cr.Scene(
        sphere * scale,
        cr.Asperities(np.array(points) * scale, tip_radii * scale, heights * scale),
        cr.Material(float(10.0 ** rng.uniform(-3, 12)), 0.3),
        geometry="closest" if rng.random() < 0.5 else "summit",
    )
    return scene, approach * scale


@st.composite
def random_scenes(draw: st.DrawFn, crowding: float = 0.8, most: int = 24) -> tuple[cr.Scene, float]:
    """Scattered asperities of any scale, with and without random heights."""
    return scattered(
        draw(st.integers(0, 2**32 - 1)),
        draw(st.integers(1, most)),
        draw(st.floats(0.05, crowding)),
        draw(st.sampled_from([0.0, 0.1, 0.5, 2.0])),
    )
