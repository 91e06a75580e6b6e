"""Scenes with friction, pressed and along load paths, that the tests of shear share."""

from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
from scenes import EVERY, hexagonal, on_sphere

import convexrough as cr
from convexrough.arrays import Array
from convexrough.sphere import hertz

FRICTION = 0.5
KINDS = ["dense", "lattice"]


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
SCENES = {name: (with_friction(scene), approach) for name, (scene, approach) in EVERY.items()}
SCENES["dense"] = (with_friction(hexagonal(tip_radius=0.07, height_std=1e-6, seed=3)), 5e-5)
PAPER = SCENES["paper"][0]

#: The two scenes of the load paths: the largest loads; (P, T) over these.
LARGEST = {"paper": 3.6085338874666633e-07, "rough": 3.541076216864549e-07}
ONE = [(0.6, 0), (0.6, 0.3), (1, 0.3), (1, -0.15), (0.7, -0.15), (0.7, 0.2), (0.5, 0.1)]
TWO = [(1, 0.5), (0.3, -0.2), (0.9, 0.35), (0.9, -0.6), (0.05, 0), (0.8, 0.6)]


def path_of(name: str, points: Any) -> tuple[cr.Scene, Array, Array]:
    """The scene, and P and Q of these points."""
    P, T = np.array(points).T * LARGEST[name]
    return SCENES[name][0], P, 0.5 * T


def follow(name: str, points: Any, along: Any = cr.load_path) -> Any:
    scene, loads, forces = path_of(name, points)
    return along(scene, loads=loads, forces=forces)


#: Asperities under a sphere so large that it is flat where they are, with friction.
on_flat = partial(on_sphere, radius=1e6, friction=FRICTION)


def ring(count: int) -> Array:
    """So many points around one, at the distance 1."""
    turn = 2 * np.pi * np.arange(count) / count
    return np.vstack(([0.0, 0.0], np.column_stack((np.cos(turn), np.sin(turn)))))


def around(load: float) -> cr.Contact:
    """Three equal contacts around a shorter one, so crowded that they lift it out again."""
    return cr.press(on_flat(ring(3), 1.0, [-0.05, 0.0, 0.0, 0.0]), load=load)


def shaded() -> cr.Scene:
    """A small low asperity between five crowded ones: pressed far, it loses load again."""
    return on_flat(ring(5), np.r_[0.05, np.ones(5)], np.r_[-0.06, np.zeros(5)])


def lengths(vectors: np.ndarray) -> np.ndarray:
    return np.hypot(*vectors.T)
