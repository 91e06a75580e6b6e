"""How good are summits?  A self-affine surface pressed whole, and as its asperities.

A map of heights becomes asperities: hills that stand out, each a sphere at its top. The boundary
elements of `boundary_elements.py` know the map itself, with its ridges, shoulders and valleys. The
same sphere presses both to the same approach.

    python examples/measured_surface.py --seeds 8 --finest 4

Over eight surfaces at the default pruning the asperities carry 8 to 13 % more at the same approach.
A single surface is off by 9 % (standard deviation, some 30 contacts) to 25 % (some 5). They touch
on 1 to 7 % less area, in 20 to 40 % more contacts, as neighbours merge, and the heaviest carries up
to 20 % less. For the same load they need less approach, by 3 to 11 % of the rms height.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from boundary_elements import HalfSpace, Pair, touch
from scipy import ndimage
from scipy.spatial import cKDTree

import convexrough as cr

RADIUS = 1e4  # of the sphere; lengths are in pixels of the scan, and E* = 1
LOADS = (3.0, 10.0, 30.0)  # on a smooth surface contact would be 56 to 122 pixels wide
HALF_WIDTH = 64.0  # of the square that boundary elements cover


class Picture(NamedTuple):
    """What is asked of both."""

    load: float
    area: float
    contacts: int
    heaviest: float


def scan(seed: int, finer: int = 1) -> cr.surface.Surface:
    """A surface of rms slope 0.1, its shortest wave 8 pixels; the same one with finer pixels."""
    return cr.surface.self_affine(
        0.8, 0.1, 32.0, seed, pixels=256 * finer, pixel=1 / finer, cutoff=8.0
    )


def as_asperities(scene: cr.Scene, approach: float) -> Picture:
    contact = cr.press(scene, approach=approach)
    area = float((np.pi * contact.contact_radii**2).sum())
    touching = int((contact.status == "contact").sum())
    return Picture(contact.load, area, touching, float(contact.loads.max()))


def whole(seed: int, scene: cr.Scene, approach: float, finest: int) -> Picture:
    """The map in boundary elements; every level halves the pixels of the last.

    A pixel's load belongs to the nearest summit. Pixels that touch each other are one contact.
    """
    pressure = np.empty((0, 0))
    for finer in [2**level for level in range(finest.bit_length())]:
        heights = scan(seed, finer).heights
        x = (np.arange(len(heights)) - (len(heights) - 1) / 2) / finer
        inside = np.abs(x) < HALF_WIDTH
        x = x[inside]
        drop = (x[:, None] ** 2 + x**2) / (2 * RADIUS)
        overlap = approach - drop + heights[np.ix_(inside, inside)]
        coarse = pressure.repeat(2, axis=0).repeat(2, axis=1)
        start = coarse if len(coarse) else overlap / HALF_WIDTH
        pressure = touch(HalfSpace(len(x), 1 / finer, 1.0), overlap, start, accuracy=1e-4)
    row, column = np.nonzero(pressure)
    loads = pressure[row, column] / finest**2
    _, owner = cKDTree(scene.asperities.positions).query(np.column_stack((x[column], x[row])))
    _, pieces = ndimage.label(pressure > 0, structure=np.ones((3, 3)))
    heaviest = np.bincount(owner, loads).max()
    return Picture(float(loads.sum()), len(row) / finest**2, int(pieces), float(heaviest))


def both(seed: int, prune: float, finest: int) -> list[tuple[Picture, Picture, float]]:
    """Of one surface at each load: as asperities, whole, and by how much the asperities lag.

    The last is the approach that they need for the whole surface's load, less that which it needs,
    over the rms height.
    """
    surface = scan(seed)
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    scene = cr.Scene(RADIUS, surface.summits(prune), material, geometry="closest")
    found = []
    for load in LOADS:
        approach = cr.press(scene, load=load).approach
        exact = whole(seed, scene, approach, finest)
        lag = cr.press(scene, load=exact.load).approach - approach
        found.append((as_asperities(scene, approach), exact, lag / surface.rms_height))
    return found


def compare(seeds: Sequence[int] = (1, 2, 3), finest: int = 2) -> list[Pair]:
    """Sums over some surfaces at the default pruning: as asperities, and by boundary elements."""
    pictures = np.array([[pair[:2] for pair in both(seed, 0.05, finest)] for seed in seeds])
    pairs = []
    for load, (asperities, exact) in zip(LOADS, pictures.sum(axis=0), strict=True):
        for name, computed, reference in zip(Picture._fields, asperities, exact, strict=True):
            pairs.append((f"load {load:g}, {name}", float(computed), float(reference)))
    return pairs


def main() -> None:
    parser = argparse.ArgumentParser(description="summits against boundary elements")
    parser.add_argument("--seeds", type=int, default=3, help="how many surfaces")
    parser.add_argument("--finest", type=int, default=2, help="boundary elements in a pixel's side")
    asked = parser.parse_args()
    print(f"{'pruning':>8}{'load':>6}{'total':>9}{'scatter':>9}{'area':>8}{'contacts':>10}"
          f"{'heaviest':>10}{'lag':>8}")  # fmt: skip
    for prune in (0.0, 0.05, 0.2):
        found = [both(seed, prune, asked.finest) for seed in range(1, asked.seeds + 1)]
        for i, load in enumerate(LOADS):
            ratios = np.array([np.divide(row[i][0], row[i][1]) for row in found]) - 1
            total, area, contacts, heaviest = ratios.mean(axis=0)
            lag = np.mean([row[i][2] for row in found])
            print(f"{prune:8.0%}{load:6g}{total:+9.1%}{ratios[:, 0].std():9.1%}{area:+8.1%}"
                  f"{contacts:+10.1%}{heaviest:+10.1%}{lag:+8.1%}")  # fmt: skip


if __name__ == "__main__":
    main()
