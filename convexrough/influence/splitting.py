"""How to split 1 / r^q, and where to interpolate its smooth part: the cheapest that is accurate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from convexrough.arrays import Array
from convexrough.influence.softened import Softened

#: Numbers of nodes to interpolate from, in each direction.
ORDERS = range(4, 30, 2)

#: Points whose sums, over so many more, stand for those of all when parameters are chosen.
SAMPLE, MORE = 32, 2**15

#: Nearest points that do not count for the size of a sum.
FEW = 8

#: [ns] estimates, for two cores: a node's transforms; a pair, its share of the assembly included;
#: a point's interpolation for each number of its dense row, squared.
NODE_COST, PAIR_COST, ROW_COST = 60.0, 6.0, 0.3


@dataclass(frozen=True)
class Plan:
    """How to split and where to interpolate.

    spacing : h [length] of the mesh;  block : mesh cells to a side of what is interpolated at once
    """

    kernel: Softened
    spacing: float
    block: int

    @classmethod
    def choose(cls, points: Array, power: int, tolerance: float) -> Plan:
        """The cheapest that is expected to keep the error of a product to the tolerance."""
        n = len(points)
        extent = np.ptp(points, axis=0) if n else np.zeros(2)
        best, least = cls(Softened(power, 2, np.inf), 1.0, 1), PAIR_COST * n * n / 2
        if n < 2 or not extent.any():
            return best
        distances, share = _sampled(points)
        ordered = np.sort(distances.ravel())

        def around(distance: float) -> float:
            """Points within a distance of one, on average."""
            return float(np.searchsorted(ordered, distance)) / (SAMPLE * share)

        # What a sum is, but for the nearest few: one close pair is not to stand for all.
        few = float(ordered[min(int(FEW * SAMPLE * share), ordered.size - 1)])
        size = float(np.median((np.maximum(distances, few) ** -power).sum(axis=1))) / share
        widest = float(np.hypot(*extent))
        for reach in (widest * 2.0 ** (-0.25 * np.arange(1, 80))).tolist():
            if (near := around(reach)) < 2:
                break
            if (pairs := PAIR_COST * n * near / 2) > least:
                continue
            for order in ORDERS:
                kernel = Softened(power, order, reach)
                spacing = reach / (2.0 * order)
                for _ in range(4):
                    counted = 1.8 * around(reach + kernel.sway(spacing))
                    near_error = kernel.pair_error(spacing) * counted / size
                    excess = max(near_error, kernel.far_error(spacing)) / tolerance
                    spacing *= excess ** (-1.0 / order)
                if not spacing * order < widest:
                    continue
                nodes = float(np.prod(extent / spacing + 1.5 * order))
                block = _block(order, nodes / n)
                row = block + order - 1
                cost = pairs + NODE_COST * nodes + ROW_COST * n * (row * row + 100)
                if cost < least:
                    best, least = cls(kernel, float(spacing), block), cost
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


def _block(order: int, nodes_per_point: float) -> int:
    """Some tens of points to a block, but no row of the interpolation too empty."""
    wanted = int(np.ceil(np.sqrt(48.0 * nodes_per_point)))
    return int(np.clip(wanted, order // 2, 2 * order))


def _sampled(points: Array) -> tuple[Array, float]:
    """Distances from some of the points to more of them, and what share of all those are."""
    chosen = np.random.default_rng(0).permutation(len(points))
    some, more = points[np.resize(chosen, SAMPLE)], points[chosen[-MORE:]]
    squares = np.subtract.outer(some[:, 0], more[:, 0]) ** 2
    squares += np.subtract.outer(some[:, 1], more[:, 1]) ** 2
    return np.sqrt(squares), len(more) / len(points)
