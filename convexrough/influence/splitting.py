"""How to split 1 / r^q, and where to interpolate its smooth part: the cheapest that is accurate.

docs/theory/operators-mesh.md, "Choice of p, h and a". All numbers here are heuristics: what
they choose costs more or less, and its error, a little more or less than the tolerance, is bounded
anyway.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.influence.coupling import squared_distances
from convexrough.influence.softened import Softened

#: Numbers of nodes to interpolate from, in each direction.
ORDERS = range(4, 30, 2)

#: Points whose sums, over so many more, stand for those of all when parameters are chosen.
SAMPLE, MORE = 32, 2**15

#: Nearest points that do not count for the size of a sum.
NEAREST = 8

#: [ns] estimates, for two cores: a node's transforms; a pair, its share of the assembly included;
#: a point's interpolation for each number of its dense row, squared.
NODE_COST, PAIR_COST, ROW_COST = 60.0, 6.0, 0.3


@dataclass(frozen=True)
class Splitting:
    """How to split and where to interpolate.

    kernel  : q, p and a
    spacing : h [length] of the mesh
    block   : mesh cells to a side of what is interpolated at once
    """

    kernel: Softened
    spacing: float
    block: int

    @classmethod
    def choose(cls, points: Array, power: int, tolerance: float) -> Splitting:
        """The cheapest that is expected to keep the error of a product to the tolerance."""
        n = len(points)
        extent = np.ptp(points, axis=0) if n else np.zeros(2)
        best, least = cls(Softened(power, 2, np.inf), 1.0, 1), PAIR_COST * n * n / 2
        if n < 2 or not extent.any():
            return best
        sums = _Sums.of(points, power)
        widest = float(np.hypot(*extent))
        for reach in (widest * 2.0 ** (-0.25 * np.arange(1, 80))).tolist():
            if (near := sums.around(reach)) < 2:
                break
            if (pairs := PAIR_COST * n * near / 2) > least:
                continue
            for order in ORDERS:
                kernel = Softened(power, order, reach)
                spacing = _spacing(kernel, sums, tolerance)
                if not spacing * order < widest:
                    continue
                nodes = float(np.prod(extent / spacing + 1.5 * order))
                found = cls(kernel, float(spacing), _block(order, nodes / n))
                cost = pairs + NODE_COST * nodes + ROW_COST * n * (found.width**2 + 100)
                if cost < least:
                    best, least = found, cost
        return best

    @property
    def meshed(self) -> bool:
        """Whether there is a smooth part at all."""
        return bool(np.isfinite(self.kernel.reach))

    @property
    def cut(self) -> float:
        """[length] the distance from which on nothing is left to do pair by pair."""
        return self.kernel.cut(self.spacing)

    @property
    def width(self) -> int:
        """Nodes to a side that the points of one block need."""
        return self.block + self.kernel.order - 1


class _Sums(NamedTuple):
    """How large sums over all points are, from some points and more of them."""

    distances: Array  # of these pairs, by size
    share: float  # these pairs for each of all points
    size: float  # of a sum of 1 / r^q

    @classmethod
    def of(cls, points: Array, power: int) -> _Sums:
        chosen = np.random.default_rng(0).permutation(len(points))
        some, more = points[np.resize(chosen, SAMPLE)], points[chosen[-MORE:]]
        distances, share = np.sqrt(squared_distances(some, more)), len(more) / len(points)
        ordered = np.sort(distances.ravel())
        # But for the nearest few: one close pair is not to stand for all.
        nearest = float(ordered[min(int(NEAREST * SAMPLE * share), ordered.size - 1)])
        sums = (np.maximum(distances, nearest) ** -power).sum(axis=1)
        return cls(ordered, SAMPLE * share, float(np.median(sums)) / share)

    def around(self, distance: float) -> float:
        """Points within a distance of one, on average."""
        return float(np.searchsorted(self.distances, distance)) / self.share


def _spacing(kernel: Softened, sums: _Sums, tolerance: float) -> float:
    """[length] h at which (1) of docs/theory/operators-mesh.md leaves just the tolerance."""
    spacing = kernel.reach / (2.0 * kernel.order)
    for _ in range(4):
        counted = 1.8 * sums.around(kernel.reach + kernel.sway(spacing))
        near_error = kernel.pair_error(spacing) * counted / sums.size
        excess = max(near_error, kernel.far_error(spacing)) / tolerance
        spacing *= excess ** (-1.0 / kernel.order)
    return spacing


def _block(order: int, nodes_per_point: float) -> int:
    """Some tens of points to a block, but no row of the interpolation too empty."""
    wanted = int(np.ceil(np.sqrt(48.0 * nodes_per_point)))
    return int(np.clip(wanted, order // 2, 2 * order))
