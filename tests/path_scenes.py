"""The two scenes of the load paths, with friction, and their largest loads."""

from dataclasses import replace
from typing import Any

import numpy as np
from scenes import MATERIAL, paper, rough

import convexrough as cr
from convexrough.arrays import Array

PAPER, ROUGH = replace(paper(), friction=0.5), replace(rough(), friction=0.5)
LARGEST = {"paper": 3.6085338874666633e-07, "rough": 3.541076216864549e-07}
SCENES = {"paper": PAPER, "rough": ROUGH}

#: (P, T) over the largest load.
ONE = [(0.6, 0), (0.6, 0.3), (1, 0.3), (1, -0.15), (0.7, -0.15), (0.7, 0.2), (0.5, 0.1)]
TWO = [(1, 0.5), (0.3, -0.2), (0.9, 0.35), (0.9, -0.6), (0.05, 0), (0.8, 0.6)]


def path_of(name: str, points: Any) -> tuple[cr.Scene, Array, Array]:
    """The scene, and P and Q of these points."""
    P, T = np.array(points).T * LARGEST[name]
    return SCENES[name], P, 0.5 * T


def follow(name: str, points: list[tuple[float, float]]) -> cr.LoadPath:
    scene, loads, forces = path_of(name, points)
    return cr.load_path(scene, loads=loads, forces=forces)


def on_flat(points: Any, tip_radii: Any, heights: Any) -> cr.Scene:
    """Asperities under a sphere so large that it is flat where they are, with friction."""
    asperities = cr.Asperities(points, tip_radii, heights)
    return cr.Scene(1e6, asperities, MATERIAL, friction=0.5, geometry="summit")


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
