"""Layouts of points, without a lattice and on one, and the operator of points on a lattice."""

from typing import Any

import numpy as np

from convexrough.influence.lattice import LatticeInfluence
from convexrough.scene.lattice import Lattice
from convexrough.scene.layout import Layout

COUNT = 4000


def disc(rng: np.random.Generator, count: int = COUNT) -> np.ndarray:
    angle, radius = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.random(count))
    return np.stack((radius * np.cos(angle), radius * np.sin(angle)), axis=1)


def clustered(rng: np.random.Generator) -> np.ndarray:
    centres = rng.uniform(-1, 1, (20, 2))
    sizes = 10.0 ** rng.uniform(-3, -1, 20)
    which = rng.integers(0, 20, COUNT)
    return centres[which] + sizes[which, None] * rng.standard_normal((COUNT, 2))


def two(rng: np.random.Generator) -> np.ndarray:
    return np.concatenate((disc(rng, COUNT // 2), disc(rng, COUNT // 2) + np.array([300.0, 40.0])))


def line(rng: np.random.Generator) -> np.ndarray:
    return np.stack((rng.uniform(-1, 1, COUNT), np.zeros(COUNT)), axis=1)


def jittered(rng: np.random.Generator) -> np.ndarray:
    sites = np.stack(np.meshgrid(np.arange(63.0), np.arange(63.0)), axis=-1).reshape(-1, 2)
    return (sites + rng.uniform(-0.3, 0.3, sites.shape)) * 1e-4


def coincident(rng: np.random.Generator) -> np.ndarray:
    points = disc(rng, COUNT // 2)
    return np.concatenate((points, points + 10.0 ** rng.uniform(-12, -6, points.shape)))


LAYOUTS = {each.__name__: each for each in (disc, clustered, two, line, jittered, coincident)}


def loadings(count: int, rng: np.random.Generator) -> np.ndarray:
    """(5, count) equal loads, over many decades, one, of either sign, and of few."""
    equal, few = np.full(count, 0.5 + 2.0**-20), rng.random(count) * (rng.random(count) < 0.05)
    signs, one = rng.uniform(-1.0, 1.0, count), np.eye(count)[count // 3]
    return np.array([equal, 10 ** rng.uniform(-30, 0, count), one, signs, few])


BASES = {
    "hexagonal": [[1.0, 0.0], [0.5, np.sqrt(0.75)]],
    "square": [[1.0, 0.0], [0.0, 1.0]],
    "rectangular": [[1.0, 0.0], [0.0, 2.6]],
    "sheared": [[1.0, 0.0], [7.3, 1.4]],
}


def turned(basis: Any, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array(basis) @ np.array([[c, s], [-s, c]])


def lattice_patch(basis: np.ndarray, count: int) -> np.ndarray:
    """The sites nearest to the origin, of a lattice given by any basis."""
    steps = np.arange(-120, 121) if count > 300 else np.arange(-40, 41)
    points = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) @ basis
    order = np.argsort((points**2).sum(axis=1), kind="stable")
    return points[order[:count]]


def on_lattice(
    points: np.ndarray, scale: float, lattice: Lattice | None = None
) -> LatticeInfluence:
    """The operator of points on a lattice, which is found if it is not given."""
    lattice = lattice or Lattice.through(points)
    assert lattice is not None
    sites = lattice.sites(points)
    assert sites is not None
    layout = Layout(points, (lattice, sites))
    return LatticeInfluence(points, np.arange(len(points)), layout, lattice, scale)
