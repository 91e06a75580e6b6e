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


def shell_radii(points: Array) -> Array:
    """(n,) [length] radii s_i with s_i + s_j <= r_ij: half the distance to the nearest neighbour.

    With them A + diag(1 / (pi E* s_i)) is positive semidefinite (docs/theory/convexity.md).
    A single asperity has no neighbour and an infinite shell.
    """
    if len(points) < 2:
        return np.full(len(points), np.inf)
    return nearest_distances(points) / 2.0


@dataclass(frozen=True, eq=False)
class DenseInfluence:
    """The coupling A as a stored matrix: exact, for some thousands of asperities.

    points      : (n, 2) [length]
    scale       : 1 / (pi E*) in the problem's units: A_ij = scale / r_ij
    point_error : [length] bound on the error of each coordinate of the points
    """

    points: Array
    scale: float
    matrix: Array
    entry_error: float

    @classmethod
    def assemble(cls, points: Array, scale: float, point_error: float = 0.0) -> DenseInfluence:
        matrix = inverse_distances(points, points)
        # Moving both ends by point_error sqrt(2) each changes 1/r by at most this, relatively.
        moved = 2.0 * np.sqrt(2.0) * point_error * float(matrix.max(initial=0.0))
        matrix *= scale
        return cls(points, scale, matrix, 1.01 * (ENTRY_ROUNDOFFS * ROUNDOFF + moved))

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

    def elsewhere(self, points: Array) -> Iterator[tuple[slice, Array]]:
        """Rows of the coupling from these asperities to other points, in blocks of rows."""
        rows = max(1, 2**22 // max(1, len(self)))
        for start in range(0, len(points), rows):
            block = slice(start, min(start + rows, len(points)))
            yield block, self.scale * inverse_distances(points[block], self.points)

    @property
    def _block(self) -> int:
        return max(64, int(np.ceil(np.sqrt(len(self)))))
