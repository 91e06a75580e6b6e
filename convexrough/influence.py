"""Elastic coupling between asperities, as an operator that knows its own rounding error.

A point force at one asperity moves another, at a distance r, by 1 / (pi E* r) (Boussinesq;
equation (3) of the source). The coupling has a zero diagonal: an asperity's own displacement is
Hertz's business.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from convexrough.checks import Array
from convexrough.scene import nearest_distances

#: Unit roundoff of float64.
ROUNDOFF = 2.0**-53

#: Relative error of one computed 1 / (pi E* r), in roundoffs, for exact points: differences 1,
#: squares 3, their sum 4, its root 3, then a product with pi and a division.
ENTRY_ROUNDOFFS = 8


def inverse_distances(points: Array, others: Array) -> Array:
    """(n, m) [1/length]  1 / r_ij, and 0 where the two points are one."""
    squares = np.subtract.outer(points[:, 0], others[:, 0]) ** 2
    squares += np.subtract.outer(points[:, 1], others[:, 1]) ** 2
    with np.errstate(divide="ignore"):
        inverse: Array = 1.0 / np.sqrt(squares)
    inverse[squares == 0] = 0.0
    return inverse


def shell_radii(points: Array, point_error: float = 0.0) -> Array:
    """(n,) [length] radii s_i with s_i + s_j <= r_ij: half the distance to the nearest neighbour.

    With them A + diag(1 / (pi E* s_i)) is positive semidefinite (docs/theory/convexity.md).
    A single asperity has no neighbour and an infinite shell. Coordinates may be off by point_error.
    """
    if len(points) < 2:
        return np.full(len(points), np.inf)
    return np.maximum(nearest_distances(points) / 2.0 - 1.5 * point_error, 0.0)


def _entry_error(point_error: float, inverse: Array) -> float:
    """Relative error of a computed scale / r, for the smallest of these distances r.

    Each end may be off by sqrt(2) point_error, the distance by x r: 1/r by up to x / (1 - x).
    """
    x = 2.0 * np.sqrt(2.0) * point_error * float(inverse.max(initial=0.0))
    moved = x / (1.0 - x) if x < 1 else np.inf
    return 1.01 * (ENTRY_ROUNDOFFS * ROUNDOFF + moved)


@dataclass(frozen=True, eq=False)
class DenseInfluence:
    """The coupling A as a stored matrix: exact, for some thousands of asperities.

    points      : (n, 2) [length]
    scale       : 1 / (pi E*) in the problem's units: A_ij = scale / r_ij
    point_error : [length] bound on the error of each coordinate of the points
    entry_error : bound on the relative error of each A_ij
    """

    points: Array
    scale: float
    matrix: Array
    point_error: float
    entry_error: float

    @classmethod
    def assemble(cls, points: Array, scale: float, point_error: float = 0.0) -> DenseInfluence:
        matrix = inverse_distances(points, points)
        entry_error = _entry_error(point_error, matrix)
        matrix *= scale
        return cls(points, scale, matrix, point_error, entry_error)

    def __len__(self) -> int:
        return len(self.points)

    def apply(self, loads: Array) -> Array:
        """A P, summed in blocks of about sqrt(n) so that rounding grows as sqrt(n), not n."""
        size = self._block
        total: Array = self.matrix[:, :size] @ loads[:size]
        for start in range(size, len(self), size):
            total += self.matrix[:, start : start + size] @ loads[start : start + size]
        return total

    @property
    def product_error(self) -> float:
        """Relative error of each component of `apply` for loads that are not negative.

        A sum of m terms in any order is off by at most m roundoffs of the sum of magnitudes
        (Higham, Accuracy and Stability of Numerical Algorithms, section 4.2).
        """
        terms = self._block + -(-len(self) // self._block) + 1
        return 1.01 * (terms * ROUNDOFF + self.entry_error)

    def spread(self, variances: Array) -> Array:
        """(n,)  sqrt(sum_j A_ij^2 v_j): how far an error of the loads moves each displacement."""
        return np.sqrt(self.matrix**2 @ variances)

    def elsewhere(self, points: Array) -> Iterator[tuple[slice, Array, float]]:
        """Rows of the coupling from these asperities to other points, in blocks of rows.

        With each block a bound on the relative error of its products with loads not negative.
        """
        rows = max(1, 2**22 // max(1, len(self)))
        for start in range(0, len(points), rows):
            block = slice(start, min(start + rows, len(points)))
            inverse = inverse_distances(points[block], self.points)
            entry_error = _entry_error(self.point_error, inverse)
            error = 1.01 * ((len(self) + 1) * ROUNDOFF + entry_error)
            yield block, self.scale * inverse, error

    @property
    def _block(self) -> int:
        return max(64, int(np.ceil(np.sqrt(len(self)))))
