"""Scenes, layouts of points, and their generators, that several tests share."""

from contextlib import suppress
from dataclasses import replace
from functools import cache
from math import inf
from typing import Any

import multiprecision
import numpy as np
from flint import arb, ctx
from hypothesis import strategies as st

import convexrough as cr
from convexrough.influence import Kind, couple
from convexrough.influence.lattice import LatticeInfluence
from convexrough.scene.lattice import Lattice
from convexrough.scene.layout import Layout

#: The ways of coupling that the tests of the dense path run through, where a scene allows them.
OPERATORS: tuple[Kind, ...] = ("dense", "lattice", "scattered")

MATERIAL = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
STEEL = cr.Material.from_youngs(210e9, 0.3)
PAPER_APPROACH = 5e-5


def hexagonal(
    spacing: float = 0.0025, tip_radius: float = 0.02, within: float = 0.0102, **options: Any
) -> cr.Scene:
    """The source paper's example, 61 asperities, or another array on its sphere."""
    options |= dict(spacing=spacing, tip_radius=tip_radius, within=within)
    return cr.Scene(1.0, cr.Asperities.hexagonal(**options), MATERIAL, geometry="summit")


def on_sphere(
    points: Any, tip_radii: Any = 0.02, heights: Any = 0.0, radius: Any = 1.0, friction: Any = None
) -> cr.Scene:
    """Asperities at these points under a sphere of this radius."""
    asperities = cr.Asperities(points, tip_radii, heights)
    return cr.Scene(radius, asperities, MATERIAL, friction, "summit")


def paper(geometry: Any = "summit") -> cr.Scene:
    """The source paper's example: 61 asperities, of which 37 touch."""
    return replace(hexagonal(), geometry=geometry)


def rough(geometry: Any = "summit") -> cr.Scene:
    """91 asperities with random heights and tip radii."""
    scene = hexagonal(within=0.0126, height_std=1e-6, tip_radius_cv=0.1, seed=7)
    return replace(scene, geometry=geometry)


def steel(geometry: Any = "summit") -> cr.Scene:
    """Steel on steel in SI units: R = 10 mm."""
    asperities = cr.Asperities.hexagonal(spacing=25e-6, tip_radius=2e-4, within=126e-6)
    return cr.Scene(0.01, asperities, STEEL, geometry=geometry)


def twins() -> tuple[cr.Scene, float]:
    """Two equal asperities so close that both may touch, but at no least of the energy; a load."""
    return on_sphere([[-5e-5, 0.0], [5e-5, 0.0]], friction=0.5), 6.6e-8


def prescribed(scene: cr.Scene, approach: float, control: str) -> dict[str, float]:
    """How to prescribe the contact at this approach: by the approach, or by its load."""
    return {control: getattr(cr.press(scene, approach=approach), control)}


def complementary_energy(contact: cr.Contact) -> float:
    """V = sum (3/5) k P^(5/3) + P'AP / 2 - d'P, from docs/theory/convexity.md, (1)."""
    with ctx.workdps(50):
        loads = multiprecision.exact(contact.loads)
        return float(multiprecision.energy(contact.scene, loads, arb(0)))


def scaled(scene: cr.Scene, length: float, modulus: float) -> cr.Scene:
    """In other units: lengths times `length`, moduli times `modulus`."""
    a, material = scene.asperities, scene.material
    asperities = cr.Asperities(a.positions * length, a.tip_radii * length, a.heights * length)
    material = cr.Material(material.contact_modulus * modulus, material.poisson_ratio)
    radius = scene.sphere_radius * length
    return replace(scene, sphere_radius=radius, asperities=asperities, material=material)


#: name -> (scene, approach): every one in the convex range.
NAMED = {
    "paper": (paper(), PAPER_APPROACH),
    "paper, closest": (paper("closest"), PAPER_APPROACH),
    "rough": (rough(), PAPER_APPROACH),
    "rough, closest": (rough("closest"), PAPER_APPROACH),
    "steel": (steel(), 0.5e-6),
}


@cache
def operators(scene: cr.Scene) -> tuple[Kind, ...]:
    """Those of OPERATORS that the package accepts for a scene: asked of it, not assumed."""
    accepted = []
    for kind in OPERATORS:
        with suppress(cr.InputError):
            accepted.append(couple(scene, np.arange(len(scene)), 1.0, kind).name)
    return tuple(accepted)


#: Bases that are no sphere, with an approach; and every named scene, and the rough ones on these.
BASES = {"flat": (inf, 1e-6), "ellipsoid": ((1.0, 2.5), 4e-5), "cylinder": ((inf, 0.8), 4e-5)}
EVERY = NAMED | {
    f"rough on {base}, {geometry}": (replace(rough(geometry), sphere_radius=radii), approach)
    for geometry in ("summit", "closest")
    for base, (radii, approach) in BASES.items()
}

#: (name, operator): each of these scenes with each operator that it allows.
CASES = [(name, kind) for name, (scene, _) in EVERY.items() for kind in operators(scene)]


#: The proved solution, of 50 digits if no others are asked for, from a `start` if given.
solve_exactly = multiprecision.solve


@cache
def reference(scene: cr.Scene, **control: float) -> multiprecision.Reference:
    """As `solve_exactly`; kept, as several tests ask for the same one."""
    return solve_exactly(scene, **control)


def scattered(seed: int, count: int, crowding: float, roughness: float) -> tuple[cr.Scene, float]:
    """A random scene and an approach."""
    rng = np.random.default_rng(seed)
    separation = 0.6 / np.sqrt(count)
    points = [np.zeros(2)]
    while len(points) < count:
        point = rng.uniform(-1, 1, 2)
        if min(float(np.hypot(*(point - other))) for other in points) > separation:
            points.append(point)
    return _pressed(rng, np.array(points), separation, crowding, roughness)


def on_lattice(seed: int, count: int, crowding: float, roughness: float) -> tuple[cr.Scene, float]:
    """As `scattered`, on a random lattice: sheared, turned and shifted, with holes."""
    rng = np.random.default_rng(seed)
    ratio, skew, angle = rng.uniform(1, 2), rng.uniform(-0.5, 0.5), rng.uniform(0, 2 * np.pi)
    basis = turned([[1.0, 0.0], [skew, np.sqrt(max(ratio**2 - skew**2, 0.75))]], angle)
    points = lattice_patch(basis, count + count // 5)
    middle = min(count, 9)  # no holes here: this is where a lattice is looked for
    others = middle + rng.permutation(count + count // 5 - middle)[: count - middle]
    points = points[np.append(np.arange(middle), others)] + rng.uniform(-1, 1, 2)
    separation = 0.6 / np.sqrt(count)
    scene, approach = _pressed(rng, points * separation, separation, crowding, roughness)
    if scene.geometry == "closest":  # contact points of unequal tip radii are not on a lattice
        a = scene.asperities
        equal = replace(a, tip_radii=np.full(count, np.median(a.tip_radii)))
        scene = replace(scene, asperities=equal)
    return scene, approach


def _pressed(
    rng: np.random.Generator, points: Any, separation: float, crowding: float, roughness: float
) -> tuple[cr.Scene, float]:
    """A random sphere, material, geometry and size for asperities at these points."""
    count = len(points)
    approach = 10.0 ** rng.uniform(-4, -1)
    tip_radii = (crowding * np.pi / 4 * separation) ** 2 / approach * rng.lognormal(0, 0.2, count)
    sphere = float(10.0 ** rng.uniform(0, 2)) / approach
    scale = float(10.0 ** rng.uniform(-6, 6))
    asperities = cr.Asperities(points, tip_radii, rng.normal(0, roughness, count) * approach)
    material = cr.Material(float(10.0 ** rng.uniform(-3, 12)), 0.3)
    geometry: Any = "closest" if rng.random() < 0.5 else "summit"
    scene = cr.Scene(sphere, asperities, material, None, geometry)
    return scaled(scene, scale, 1.0), approach * scale


@st.composite
def random_scenes(
    draw: st.DrawFn, crowding: float = 0.8, most: int = 24, make: Any = scattered
) -> tuple[cr.Scene, float]:
    """Scattered asperities of any scale, with and without random heights."""
    return make(
        draw(st.integers(0, 2**32 - 1)),
        draw(st.integers(1, most)),
        draw(st.floats(0.05, crowding)),
        draw(st.sampled_from([0.0, 0.1, 0.5, 2.0])),
    )


Case = tuple[cr.Scene, float, Kind]


@st.composite
def random_cases(draw: st.DrawFn, crowding: float = 0.8, most: int = 24) -> Case:
    """Scattered asperities or some on a lattice, and one of the operators that they allow."""
    make = draw(st.sampled_from([scattered, on_lattice]))
    scene, approach = draw(random_scenes(crowding, most, make))
    # The last one first: hypothesis begins with it, and where there is a choice it is not dense.
    return scene, approach, draw(st.sampled_from(operators(scene)[::-1]))


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


LATTICES = {
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


def lattice_operator(
    points: np.ndarray, scale: float, lattice: Lattice | None = None
) -> LatticeInfluence:
    """The operator of points on a lattice, which is found if it is not given."""
    lattice = lattice or Lattice.through(points)
    sites = lattice.sites(points)
    layout = Layout(points, (lattice, sites))
    return LatticeInfluence(points, np.arange(len(points)), layout, lattice, scale)
