"""Answers to 50 digits, as `tests/gallery_answers.py` writes them, and for which scenes they are.

    PYTHONPATH=tests python tests/gallery_answers.py NAME ...

computes those of the named cases anew, in ball arithmetic that proves every digit.
"""

from __future__ import annotations

import hashlib
import json
from functools import cache
from importlib.resources import files
from typing import Any

from convexrough.errors import FileError
from convexrough.gallery.recipe import Recipe

DATA = "answers.json"


@cache
def _stored() -> dict[str, Any]:
    text = files("convexrough.gallery").joinpath(DATA).read_text(encoding="utf-8")
    stored: dict[str, Any] = json.loads(text)
    return stored


def tuned_height(name: str) -> float:
    """[length] of the asperity that was fitted, the float64 number nearest to what is asked."""
    return float.fromhex(_stored()["heights"][name])


def answer(name: str, recipe: Recipe) -> dict[str, Any]:
    """What is stored of a case; FileError where it belongs to other numbers than were built."""
    found: dict[str, Any] = _stored()["cases"][name]
    if found["sha256"] != digest(recipe):
        raise FileError(
            f"gallery case {name}: this machine builds other float64 numbers than those of the "
            "stored answer; please report it with the machine's name"
        )
    return found


def digest(recipe: Recipe) -> str:
    """SHA-256 of all numbers of a case, as float.hex writes them."""
    scene, a = recipe.scene, recipe.scene.asperities
    numbers = [scene.sphere_radius, scene.material.contact_modulus, scene.material.poisson_ratio]
    numbers += [*a.positions.ravel(), *a.tip_radii, *a.heights, *recipe.history]
    text = " ".join(float(number).hex() for number in numbers)
    text += f" {scene.geometry} {scene.friction} {recipe.approach} {recipe.load} {recipe.fraction}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]
