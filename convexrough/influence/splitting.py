"""The choice of the splitting of 1 / r^q into L + S, and of the mesh for the smooth part L.

S is 0 for distances r above the reach a. L is interpolated from p x p nodes of a mesh with the
spacing h. docs/theory/operators-mesh.md, "Choice of p, h and a", explains the choice. All numbers
here are heuristics: they affect the time, and how close the error is to its target, the tolerance.
The bounds on the error hold for any choice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.influence.coupling import squared_distances
from convexrough.influence.softened import Softened

#: The values of p that are tried: numbers of nodes for interpolation in each direction.
ORDERS = range(4, 30, 2)

#: Sums over all points are estimated: at SAMPLE of the points, by sums over at most MORE points.
SAMPLE, MORE = 32, 2**15

#: In these sums, very near points count as if they were at a certain distance: the one within which
#: a point has this many neighbours on average.
NEAREST = 8

#: Estimated times [ns] on two cores: of the transforms per node, of a product per near pair, and of
#: interpolation per point and node of a block.
NODE_COST, PAIR_COST, ROW_COST = 60.0, 6.0, 0.3


@dataclass(frozen=True)
class Splitting:
    """A splitting of 1 / r^q into L + S, and a mesh for L."""

    kernel: Softened  # the softened kernel, which has q, p and a
    spacing: float  # [length] spacing h of the mesh
    block: int  # side of the blocks that are interpolated together, in mesh cells

    @classmethod
    def choose(cls, points: Array, power: int, tolerance: float) -> Splitting | None:
        """The fastest splitting with about this relative error; None if a matrix is faster."""
        n = len(points)
        if n < 2 or not (extent := np.ptp(points, axis=0)).any():
            return None
        sums, widest = _Sums.of(points, power), float(np.hypot(*extent))
        best: Splitting | None = None
        least = PAIR_COST * n * n / 2
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
                # A block has some tens of points, and a side of p / 2 to 2 p mesh cells.
                wanted = int(np.ceil(np.sqrt(48.0 * nodes / n)))
                block = int(np.clip(wanted, order // 2, 2 * order))
                found = cls(kernel, float(spacing), block)
                cost = pairs + NODE_COST * nodes + ROW_COST * n * (found.width**2 + 100)
                if cost < least:
                    best, least = found, cost
        return best

    @property
    def cut(self) -> float:
        """[length] the distance up to which a pair of points is a near pair, with an entry in S."""
        return self.kernel.cut(self.spacing)

    @property
    def width(self) -> int:
        """The number of nodes in each direction from which the points of one block interpolate."""
        return self.block + self.kernel.order - 1


class _Sums(NamedTuple):
    """Data of a sample of pairs of points, from which sums over all points are estimated."""

    distances: Array  # of the pairs in the sample, sorted
    share: float  # number of pairs in the sample, divided by the number of points
    size: float  # median of the sums of 1 / r^q

    @classmethod
    def of(cls, points: Array, power: int) -> _Sums:
        chosen = np.random.default_rng(0).permutation(len(points))
        some, more = points[np.resize(chosen, SAMPLE)], points[chosen[-MORE:]]
        distances, share = np.sqrt(squared_distances(some, more)), len(more) / len(points)
        ordered = np.sort(distances.ravel())
        # Nearer pairs count as if at this distance: no single pair shall decide the estimate.
        nearest = float(ordered[min(int(NEAREST * SAMPLE * share), ordered.size - 1)])
        sums = (np.maximum(distances, nearest) ** -power).sum(axis=1)
        return cls(ordered, SAMPLE * share, float(np.median(sums)) / share)

    def around(self, distance: float) -> float:
        """The estimated mean number of points that lie within this distance of a point."""
        return float(np.searchsorted(self.distances, distance)) / self.share


def _spacing(kernel: Softened, sums: _Sums, tolerance: float) -> float:
    """The spacing h [length] at which the larger of two interpolation errors is the tolerance.

    The errors are those of near pairs, by (1) of docs/theory/operators-mesh.md, and distant pairs.
    """
    spacing = kernel.reach / (2.0 * kernel.order)
    for _ in range(4):
        counted = 1.8 * sums.around(kernel.reach + kernel.sway(spacing))
        near_error = kernel.pair_error(spacing) * counted / sums.size
        excess = max(near_error, kernel.far_error(spacing)) / tolerance
        spacing *= excess ** (-1.0 / kernel.order)
    return spacing
