"""Shear forces next to nothing and next to all that friction bears, and long histories."""

from __future__ import annotations

import random
from functools import partial

from convexrough.gallery.recipe import (
    TIP_RADIUS,
    Recipe,
    Recipes,
    hexagon,
    placed,
    roughness,
)

#: The load that the contacts are sheared under.
LOAD = 1e-7

#: Shear force over f P, by name.
FRACTIONS = {
    "1e-12-of-nothing": (1e-12, "Q = 1e-12 f P: slip annuli too thin for what is computed of P"),
    "1e-12-of-all": (1 - 1e-12, "Q = (1 - 1e-12) f P: the last stick radii, 1e-4 of the contacts"),
}

#: How many times the shear turns in a history.
REVERSALS = 100_000


def _sheared(fraction: float, why: str) -> Recipe:
    heights = [1e-6 * height for height in roughness(7, 7)]
    scene = placed(hexagon(1), TIP_RADIUS, heights)
    return Recipe("friction", why, scene, load=LOAD, fraction=fraction)


def _random_history() -> Recipe:
    """Up to 0.9 of the last force, which wipes all of it out; some repeated, some 0."""
    numbers, past = random.Random(8), [0.0]
    for step in range(1, REVERSALS):
        kept = past[-1] if step % 10 == 0 else 1.8 * numbers.random() - 0.9
        past.append(0.0 if step % 7 == 0 else kept)
    why = "100,000 random shear forces, repeated ones and zeros among them, then a larger one"
    return _with(why, past)


def _nested_history() -> Recipe:
    """Each turn inside the one before, so that all are remembered until the last."""
    past = [(-0.9 if step % 2 else 0.9) * (1 - step / REVERSALS) for step in range(REVERSALS)]
    why = "100,000 reversals, each inside the last, all remembered until one larger wipes them out"
    return _with(why, past)


def _with(why: str, past: list[float]) -> Recipe:
    plain = _sheared(0.8, why)
    return Recipe("friction", why, plain.scene, load=LOAD, fraction=0.8, history=(*past, 1.0))


RECIPES: Recipes = {
    f"shear-{name}": partial(_sheared, fraction, why) for name, (fraction, why) in FRACTIONS.items()
}
RECIPES["reversals-random"] = _random_history
RECIPES["reversals-nested"] = _nested_history
