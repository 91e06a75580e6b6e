"""Pressed scenes with friction that the tests of shear share."""

from functools import cache
from typing import Any

from scenes import NAMED

import convexrough as cr

FRICTION = 0.5
DIGITS = 80
FRACTIONS = [1e-9, 1e-6, 1e-3, 0.1, 0.35, 0.37, 0.5, 0.7, 0.9, 0.999]
NAMES = ["paper", "rough"]
KINDS = ["dense", "lattice"]


@cache
def pressed(name: str, influence: Any = "dense", control: str = "approach") -> cr.Contact:
    scene, approach = NAMED[name]
    contact = cr.press(with_friction(scene), approach=approach, influence=influence)
    if control == "load":
        return cr.press(contact.scene, load=contact.load, influence=influence)
    return contact


def with_friction(scene: cr.Scene, friction: float = FRICTION, nu: float = 0.3) -> cr.Scene:
    material = cr.Material(scene.material.contact_modulus, nu)
    return cr.Scene(scene.sphere_radius, scene.asperities, material, friction, scene.geometry)
