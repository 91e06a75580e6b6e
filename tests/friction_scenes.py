"""Pressed scenes with friction, and their states by definition, that the tests of shear share."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from scenes import NAMED, hexagonal

import convexrough as cr
from convexrough import FrictionConic, VectorShearState, shear_vector
from convexrough.sphere import hertz

FRICTION = 0.5
FRACTIONS = [1e-9, 1e-6, 1e-3, 0.1, 0.35, 0.37, 0.5, 0.7, 0.9, 0.999]
NAMES = ["paper", "rough"]
KINDS = ["dense", "lattice"]
VECTOR_FRACTIONS = [1e-9, 1e-3, 0.1, 0.3, 0.5, 0.8, 0.99]
VECTOR_NAMES = ["paper", "rough", "steel", "rough, closest"]


@cache
def pressed(
    name: str, influence: Any = "dense", control: str = "approach", nu: float = 0.3
) -> cr.Contact:
    scene, approach = SCENES[name]
    contact = cr.press(with_friction(scene, nu=nu), approach=approach, influence=influence)
    if control == "load":
        return cr.press(contact.scene, load=contact.load, influence=influence)
    return contact


def in_doubt(contact: cr.Contact, digits: int) -> cr.Contact:
    """The contact with rounded loads, and the certificate of those."""
    rounded = np.array([float(f"{load:.{digits - 1}e}") for load in contact.loads])
    # Not symmetric: every other load is off the other way.
    rounded[1::2] += 10.0 ** (-digits) * rounded[1::2]
    return replace(
        contact,
        loads=rounded,
        load=float(rounded.sum()),
        contact_radii=hertz.contact_radius(rounded, 1.0, contact.scene.relative_radii),
        certificate=cr.certify(contact.scene, rounded, approach=contact.approach),
    )


def with_friction(scene: cr.Scene, friction: float = FRICTION, nu: float = 0.3) -> cr.Scene:
    material = cr.Material(scene.material.contact_modulus, nu)
    return replace(scene, material=material, friction=friction)


#: name -> (scene, approach), with friction; "dense" has the crowding 0.88.
SCENES = {name: (with_friction(scene), approach) for name, (scene, approach) in NAMED.items()}
SCENES["dense"] = (with_friction(hexagonal(tip_radius=0.07, height_std=1e-6, seed=3)), 5e-5)


@cache
def found(name: str, nu: float, fraction: float, conic: bool = False) -> VectorShearState:
    contact = pressed(name, nu=nu)
    solver = FrictionConic() if conic else None
    return shear_vector(contact, force=fraction * FRICTION * contact.load, solver=solver)


def lengths(vectors: np.ndarray) -> np.ndarray:
    return np.hypot(*vectors.T)
