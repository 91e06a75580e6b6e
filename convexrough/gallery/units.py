"""The same contact in units that spread numbers over most of float64."""

from __future__ import annotations

from functools import partial

from convexrough.gallery.recipe import FRICTION, Recipe, Recipes, hexagon, roughness
from convexrough.scene.asperities import Asperities
from convexrough.scene.material import Material
from convexrough.scene.scene import Scene

#: Per metre and newton, and what the numbers then are.
UNITS = {
    "si": (1.0, 1.0, "metres and newtons: loads of a newton beside a modulus of 1e11"),
    "nanometre": (1e9, 1e9, "nanometres and nanonewtons"),
    "astronomical": (6.684587122268446e-12, 1.0, "astronomical units and newtons: 1e-17 and 1e33"),
    "tiny": (
        1e-30,
        1e-20,
        "lengths about 1e-35, loads about 1e-20",
    ),
    "huge": (1e30, 1e20, "lengths about 1e25, loads about 1e20"),
}


def _in_units(unit: str) -> Recipe:
    """Steel on steel: a ball of 10 mm on 19 asperities, half a micron of approach."""
    length, force, words = UNITS[unit]
    modulus = 210e9 / (2 * (1 - 0.3 * 0.3)) * (force / length / length)
    points = [(x * length, y * length) for x, y in hexagon(2, 25e-6)]
    heights = [1e-8 * length * height for height in roughness(len(points), 6)]
    asperities = Asperities(points, 2e-4 * length, heights)
    scene = Scene(0.01 * length, asperities, Material(modulus, 0.3), FRICTION)
    return Recipe("units", words, scene, approach=0.5e-6 * length)


RECIPES: Recipes = {f"units-{unit}": partial(_in_units, unit) for unit in UNITS}
