"""Where asperities stand, how sharp and how tall they are."""

from __future__ import annotations

import math
import random

from convexrough.gallery.recipe import (
    APPROACH,
    SPACING,
    TIP_RADIUS,
    Point,
    Recipe,
    Recipes,
    hexagon,
    placed,
    roughness,
)


def _six_decades() -> Recipe:
    points = hexagon(2, 0.03)[:13]
    tips = [2.0 / math.sqrt(10.0**i) for i in range(13)]
    scene = placed(points, tips, sphere_radius=1e4)
    why = "tip radii over six decades, so loads over three and stiffnesses alike"
    return Recipe("radii", why, scene, approach=APPROACH)


def _tall() -> Recipe:
    numbers = random.Random(1)
    heights = [-10 * APPROACH * numbers.random() for _ in range(61)]
    scene = placed(hexagon(4), TIP_RADIUS / 4, heights)
    why = "heights random over ten times the approach: they alone decide who touches"
    return Recipe("heights", why, scene, approach=APPROACH)


def _rough(geometry: str) -> Recipe:
    heights = [1e-6 * height for height in roughness(37, 2)]
    tips = [TIP_RADIUS * (1 + 0.1 * size) for size in roughness(37, 3)]
    scene = placed(hexagon(3), tips, heights, geometry="closest" if geometry else "summit")
    why = "random heights and tip radii" + (", closest-point geometry" if geometry else "")
    return Recipe("heights", why, scene, approach=APPROACH)


def _many() -> Recipe:
    """On a flatter sphere, so that most of them touch."""
    heights = [1e-5 * height for height in roughness(169, 9)]
    scene = placed(hexagon(7), TIP_RADIUS / 2, heights, sphere_radius=10.0)
    why = "169 asperities with random heights: the low ones are open amid the others"
    return Recipe("heights", why, scene, approach=APPROACH)


def _collinear() -> Recipe:
    points = [(SPACING * (i - 6), 0.0) for i in range(13)]
    why = "all on one line: no lattice in the plane, no hull"
    return Recipe("layout", why, placed(points), approach=APPROACH)


def _clustered() -> Recipe:
    corners = [(1.0, 0.2), (-0.7, 0.9), (-0.4, -1.1)]
    points: list[Point] = [
        (0.004 * X + 1e-3 * x, 0.004 * Y + 1e-3 * y)
        for X, Y in corners
        for x, y in hexagon(1, SPACING)
    ]
    scene = placed(points, 2e-8, geometry="closest")
    why = "clusters a thousand times smaller than the distances between them"
    return Recipe("layout", why, scene, approach=APPROACH)


def _vacancies() -> Recipe:
    numbers = random.Random(4)
    points = [point for point in hexagon(3) if numbers.random() < 0.7]
    heights = [2e-7 * height for height in roughness(len(points), 5)]
    why = "a lattice with sites left empty, where its operator must not put loads"
    return Recipe("layout", why, placed(points, TIP_RADIUS, heights), approach=APPROACH)


def _accumulating() -> Recipe:
    """Distances halve towards the axis, and contact radii with them: R D = a^2."""
    distances = [0.008 * 0.5**i for i in range(24)]
    points = [(r if i % 2 else 0.6 * r, 0.0 if i % 2 else 0.8 * r) for i, r in enumerate(distances)]
    tips = [0.02 * r * r / APPROACH for r in distances]
    why = "points that accumulate, so with no least distance: contact radii over seven decades"
    return Recipe("layout", why, placed(points, tips), approach=APPROACH)


def _symmetric() -> Recipe:
    why = "a ring of six alike: all slide at once, and none can be told from the last one"
    return Recipe("layout", why, placed(hexagon(1)[1:]), approach=APPROACH)


RECIPES: Recipes = {
    "radii-six-decades": _six_decades,
    "heights-ten-approaches": _tall,
    "heights-random": lambda: _rough(""),
    "heights-random-closest": lambda: _rough("closest"),
    "heights-random-169": _many,
    "collinear": _collinear,
    "clustered": _clustered,
    "vacancies": _vacancies,
    "no-least-distance": _accumulating,
    "ring-of-six": _symmetric,
}
