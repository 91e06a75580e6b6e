"""Layouts of points without a lattice, and the operator of points on one."""

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
