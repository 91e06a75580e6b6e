"""How good are summits?  A self-affine surface pressed whole, and as its asperities.

A map of heights becomes asperities: hills that stand out, each a sphere at its top. Boundary
elements know the map itself, with its ridges, shoulders and valleys. The same sphere presses both
to the same approach. `convexrough summits MAP --whole` does this for a map of your own.

    python examples/measured_surface.py --seeds 8

Over eight surfaces at the default pruning the asperities carry 7 to 10 % less at the same approach.
A single surface is off from that by 6 % (standard deviation, some 5 contacts) to 2 % (some 30).
They touch on a quarter to a third less area, as shoulders and what was pruned carry, too; the
heaviest carries 7 to 16 % less. For the same load they need more approach, by 3 to 11 % of the rms
height. Pixels touch whole or not at all: those of half the width lower the area by a tenth of
itself, and the load by 1 %.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import convexrough as cr

RADIUS = 1e4  # of the sphere; lengths are in pixels of the scan, and E* = 1
LOADS = (3.0, 10.0, 30.0)  # on a smooth surface contact would be 56 to 122 pixels wide

Pair = tuple[str, float, float]  # what it is, computed, reference


class Picture(NamedTuple):
    """What is asked of both."""

    load: float
    area: float
    contacts: float
    heaviest: float


def scan(seed: int) -> cr.surface.Surface:
    """A surface of rms slope 0.1, its shortest wave 8 pixels."""
    return cr.surface.self_affine(0.8, 0.1, 32.0, seed)


def both(seed: int, prune: float) -> list[tuple[Picture, Picture, float]]:
    """Of one surface at each load: as asperities, whole, and by how much the asperities lag.

    The last is the approach that they need for the whole surface's load, less that which it needs,
    over the rms height.
    """
    surface = scan(seed)
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    scene = cr.Scene(RADIUS, surface.summits(prune), material, geometry="closest")
    found = []
    for load in LOADS:
        contact = cr.press(scene, load=load)
        whole = cr.surface.press_whole(surface, contact)
        asperities, exact = zip(*(pair for _, *pair in whole.compared()), strict=True)
        lag = cr.press(scene, load=whole.load).approach - contact.approach
        found.append((Picture(*asperities), Picture(*exact), lag / surface.rms_height))
    return found


def compare(seeds: Sequence[int] = (1, 2, 3)) -> list[Pair]:
    """Sums over some surfaces at the default pruning: as asperities, and by boundary elements."""
    pictures = np.array([[pair[:2] for pair in both(seed, 0.05)] for seed in seeds])
    pairs = []
    for load, (asperities, exact) in zip(LOADS, pictures.sum(axis=0), strict=True):
        for name, computed, reference in zip(Picture._fields, asperities, exact, strict=True):
            pairs.append((f"load {load:g}, {name}", float(computed), float(reference)))
    return pairs


def main() -> None:
    parser = argparse.ArgumentParser(description="summits against boundary elements")
    parser.add_argument("--seeds", type=int, default=3, help="how many surfaces")
    asked = parser.parse_args()
    print(f"{'pruning':>8}{'load':>6}{'total':>9}{'scatter':>9}{'area':>8}{'contacts':>10}"
          f"{'heaviest':>10}{'lag':>8}")  # fmt: skip
    for prune in (0.0, 0.05, 0.2):
        found = [both(seed, prune) for seed in range(1, asked.seeds + 1)]
        for i, load in enumerate(LOADS):
            ratios = np.array([np.divide(row[i][0], row[i][1]) for row in found]) - 1
            total, area, contacts, heaviest = ratios.mean(axis=0)
            lag = np.mean([row[i][2] for row in found])
            print(f"{prune:8.0%}{load:6g}{total:+9.1%}{ratios[:, 0].std():9.1%}{area:+8.1%}"
                  f"{contacts:+10.1%}{heaviest:+10.1%}{lag:+8.1%}")  # fmt: skip


if __name__ == "__main__":
    main()
