"""Asperities that hardly touch, or hardly do not, and such as lose what they had."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from convexrough.gallery.answers import tuned_height
from convexrough.gallery.recipe import (
    APPROACH,
    TIP_RADIUS,
    Recipe,
    Recipes,
    hexagon,
    manufactured,
    placed,
)

#: How near to 0, over the approach or the largest load.
NEAR = ("1e-6", "1e-9", "1e-12", "1e-15")

#: What is that small, in the last of the asperities.
KINDS = {
    "gap": "a gap of {} of the approach: open, and closed by an error of that size",
    "indentation": "an indentation of {} of the approach: it touches, with next to no load",
    "load": "a load of {} of the largest: it touches, and solvers of that accuracy drop it",
}


#: In a word, on which side of touching.
SIDES = {"gap": "open", "indentation": "in contact"}


def _grazing(kind: str, near: str, height: float) -> Recipe:
    """Seven asperities of the paper's example, and one beside them, of this height."""
    points = [*hexagon(1), (0.0035, 0.0029)]
    scene = placed(points, TIP_RADIUS, [0.0] * 7 + [height])
    return Recipe("grazing", KINDS[kind].format(near), scene, approach=APPROACH)


def _ringed(kind: str, near: str, height: float) -> Recipe:
    """A short asperity amid six tall, blunt ones, which hold the sphere off it."""
    tips = [TIP_RADIUS, *[2.5 * TIP_RADIUS] * 6]
    scene = placed(hexagon(1), tips, [height] + [0.0] * 6)
    side = SIDES[kind]
    why = f"a short asperity amid six tall ones, {near} of the approach from touching: {side}"
    return Recipe("ringed", why, scene, approach=3e-5)


#: What makes a case from a height, which is fitted to 60 digits, and whose height that is.
FITTED: dict[str, tuple[Callable[[float], Recipe], int]] = {
    f"grazing-{kind}-{near}": (partial(_grazing, kind, near), 7) for kind in KINDS for near in NEAR
}
FITTED |= {f"ringed-{kind}-1e-9": (partial(_ringed, kind, "1e-9"), 0) for kind in SIDES}


def _dragged() -> Recipe:
    scene = placed(hexagon(1), [TIP_RADIUS, *[5 * TIP_RADIUS] * 6], [-1e-5] + [0.0] * 6)
    why = "the short one loses load as the total rises, so shear gives it some; the discs overlap"
    return Recipe("ringed", why, scene, approach=7.6e-5, fraction=0.01)


#: Contact radii of three equal asperities, over their distance to the short one amid them, and the
#: shear; the last one's leaves p_i(P - Q / f) where the short one touches.
STAGES = {
    "before": (0.82, 0.4, "not yet touching"),
    "touching": (0.8512, 0.4, "touching, at its deepest"),
    "after": (0.8655, 0.0487, "open again"),
}


def _losing(stage: str) -> Recipe:
    """Three asperities with contact radii a at distance r from a fourth between them.

    Its indentation rises as (a / r)^2 - c (a / r)^3, c = (4 / (3 pi)) (3 - 2 / sqrt(3)), so it
    falls from a = 2 r / (3 c) = 0.8512 r on, and discs first overlap at a = 0.866 r.
    """
    distance = 0.01
    half, rise = -0.5 * distance, math.sqrt(0.75) * distance
    points = [(0.0, 0.0), (distance, 0.0), (half, rise), (half, -rise)]
    radius = STAGES["touching"][0] * distance
    tips = [TIP_RADIUS, *[2.0] * 3]
    scene, _ = manufactured(points, tips, [0.0] + [radius] * 3, [-2e-8, 0.0, 0.0, 0.0])
    part, fraction, word = STAGES[stage]
    relative = 1.0 / (1.0 + 1.0 / tips[1])
    radius = part * distance
    load = 4.0 * radius * radius * radius / relative
    why = f"a short asperity that loses contact as the load rises, no discs overlapping: {word}"
    return Recipe("losing-contact", why, scene, load=load, fraction=fraction)


def _fitted(name: str) -> Recipe:
    make, _ = FITTED[name]
    return make(tuned_height(name))


RECIPES: Recipes = {name: partial(_fitted, name) for name in FITTED}
RECIPES |= {f"losing-contact-{stage}": partial(_losing, stage) for stage in STAGES}
RECIPES["ringed-dragged"] = _dragged
