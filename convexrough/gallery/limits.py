"""The ends of the convex range, of the model, and of float64."""

from __future__ import annotations

import math
from functools import partial

from convexrough.gallery.recipe import (
    APPROACH,
    SPACING,
    TIP_RADIUS,
    Point,
    Recipe,
    Recipes,
    hexagon,
    manufactured,
    placed,
)

#: Two asperities this far apart.
APART: list[Point] = [(0.0, 0.0), (SPACING, 0.0)]

#: Convexity numbers where something ends, and what.
THRESHOLDS = {
    "21/25": (21 / 25, "where the cone program needs a fifth cone"),
    "1": (1.0, "where shells prove convexity no longer"),
}

#: Relative distance from a threshold.
ASIDE = 1e-9

#: The load of the paper's example, of which loads are parts.
REFERENCE = 3.6e-7


def _solved(threshold: str, side: int) -> Recipe:
    """The contact radii of the solution are at the threshold: a = theta (pi/4) r."""
    theta, what = THRESHOLDS[threshold]
    radius = theta * (1 + side * ASIDE) * math.pi / 4 * SPACING
    scene, approach = manufactured(APART, [TIP_RADIUS] * 2, [radius] * 2, [0.0] * 2)
    word = "above" if side > 0 else "below"
    why = f"convexity number 1e-9 {word} {threshold}, {what}; the discs overlap"
    return Recipe("convexity", why, scene, approach=approach)


def _bounded(threshold: str, side: int) -> Recipe:
    """Those of the a priori bound are: R D = a^2."""
    theta, what = THRESHOLDS[threshold]
    radius = theta * (1 + side * ASIDE) * math.pi / 4 * SPACING
    scene = placed(APART, sphere_radius=1e6)
    relative = 1.0 / (1e-6 + 1.0 / TIP_RADIUS)
    word = "above" if side > 0 else "below"
    why = f"convexity number of the a priori box 1e-9 {word} {threshold}, {what}"
    return Recipe("convexity", why, scene, approach=radius * radius / relative)


def _ending(part: float, what: str) -> Recipe:
    """The a priori box ends at this part of a = (pi/2) r, where A + diag(1 / (2 E* a)) does."""
    radius = part * math.pi / 2 * SPACING
    relative = 1.0 / (1e-6 + 1.0 / TIP_RADIUS)
    scene = placed(APART, sphere_radius=1e6)
    why = f"the energy is {what} on the a priori box of a pair: no global proof reaches further"
    return Recipe("convexity", why, scene, approach=radius * radius / relative)


def _unequal(crowding: float) -> Recipe:
    """A large contact amid six small ones, for which shells must be fitted to the loads.

    That of the large one is (0.9 * 0.8 + 0.1 / 2) r, so its convexity number reaches 1 at a
    crowding of 0.77 pi / 1.6 (docs/theory/certificate.md, "Which box", 3).
    """
    large, small = 0.8 * crowding * SPACING, 0.2 * crowding * SPACING
    tips = [25 * TIP_RADIUS, *[TIP_RADIUS] * 6]
    scene, approach = manufactured(hexagon(1), tips, [large] + [small] * 6, [0.0] * 7)
    why = f"a large contact amid small ones, crowding {crowding:g}: fitted shells end at 1.512"
    return Recipe("convexity", why, scene, approach=approach)


def _discs(count: int, crowding: float, word: str) -> Recipe:
    """Equal contacts whose radii sum to this part of their distance."""
    points = APART if count == 2 else hexagon(1)
    radii = [0.5 * crowding * SPACING] * count
    scene, approach = manufactured(points, [TIP_RADIUS] * count, radii, [0.0] * count)
    why = f"{count} equal contacts, discs {word}: (a_i + a_j) / r_ij = {crowding:g}"
    return Recipe("discs", why, scene, approach=approach)


def _loaded(part: float, why: str) -> Recipe:
    return Recipe("loads", why, placed(hexagon(2)), load=part * REFERENCE)


RECIPES: Recipes = {
    f"convexity-{kind}-{threshold.replace('/', '-')}-{word}": partial(make, threshold, side)
    for kind, make in (("solution", _solved), ("bound", _bounded))
    for threshold in THRESHOLDS
    for word, side in (("below", -1), ("above", 1))
}
RECIPES |= {
    f"convexity-fitted-{word}": partial(_unequal, crowding)
    for word, crowding in (("below", 1.51), ("above", 1.513))
}
RECIPES |= {
    "convexity-end-below": partial(_ending, 0.998, "just convex"),
    "convexity-end-above": partial(_ending, 1 + ASIDE, "no longer convex"),
}
RECIPES |= {
    f"discs-{count}-{name}": partial(_discs, count, crowding, word)
    for count in (2, 7)
    for name, crowding, word in (
        ("almost-touching", 0.999, "that almost touch"),
        ("overlapping", 1.05, "that overlap, where the model has ended"),
    )
}
RECIPES |= {
    f"load-{part}": partial(_loaded, float(part), f"a load of {part} of the paper's, on 19")
    for part in ("1e-15", "1e-12", "1e-9", "1e-6", "1e-3")
}
RECIPES["load-end"] = partial(
    _loaded, 5.8, "the largest load on 19 before the discs overlap, where the model ends"
)
RECIPES["one"] = lambda: Recipe(
    "few", "one contact: no neighbours, no shells, an answer in closed form",
    placed([(0.0, 0.0)]), approach=APPROACH,
)  # fmt: skip
RECIPES["one-under-load"] = lambda: Recipe(
    "few", "one contact under a load: the approach is the only unknown",
    placed([(0.0, 0.0)]), load=1e-8,
)  # fmt: skip
RECIPES["two-equal"] = lambda: Recipe(
    "few", "two equal contacts: the smallest that interact, the root of a cubic",
    placed([(-0.5 * SPACING, 0.0), (0.5 * SPACING, 0.0)]), approach=APPROACH,
)  # fmt: skip
