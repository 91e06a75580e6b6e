"""How far a scene has to reach under a load: as growing it step by step finds, in fewer bounds."""

from collections.abc import Callable
from typing import Any

import pytest

import convexrough as cr
from convexrough.normal.load_control import all_that_could_touch
from convexrough.scene.asperities import largest_tip_radius
from convexrough.scene.patterns import CUT_DEVIATIONS
from convexrough.scene.scene import reach

Maker = tuple[Callable[[float], cr.Scene], Callable[[float], float]]

ROUGHNESS: dict[str, dict[str, Any]] = {
    "even": dict(),
    "heights": dict(height_std=1e-6, seed=3),
    "heights and radii": dict(height_std=1e-6, tip_radius_cv=0.1, seed=7),
    "very rough": dict(height_std=2e-5, tip_radius_cv=0.5, seed=5),
}


def maker(pattern: Any, geometry: Any, k: float = 1.0, **rough: Any) -> Maker:
    """The paper's sphere on a lattice k times finer, and how far out one could touch."""
    tip_radius = 0.02 / k

    def scene_within(within: float) -> cr.Scene:
        asperities = pattern(spacing=0.0025 / k, tip_radius=tip_radius, within=within, **rough)
        return cr.Scene(1.0, asperities, cr.Material(1.0, 0.3), geometry=geometry)

    def farthest(approach: float) -> float:
        return reach(
            approach,
            sphere_radius=1.0,
            tip_radius=largest_tip_radius(tip_radius, rough.get("tip_radius_cv", 0.0)),
            height=CUT_DEVIATIONS * rough.get("height_std", 0.0),
            geometry=geometry,
        )

    return scene_within, farthest


@pytest.mark.sample(3)
@pytest.mark.parametrize("rough", ROUGHNESS)
@pytest.mark.parametrize("load", [1e-9, 2e-7])
def test_the_bound_is_above_the_approach(rough: str, load: float) -> None:
    scene, bound = all_that_could_touch(
        *maker(cr.Asperities.hexagonal, "summit", **ROUGHNESS[rough]), load
    )
    contact = cr.press(scene, load=load)
    assert contact.certificate.approach <= bound * (1 + 1e-12)
