"""The compliance operator as a stored matrix, for up to some thousands of asperities."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.influence.coupling import (
    ENTRY_ROUNDOFFS,
    Kind,
    Rounding,
    Smoother,
    cubed,
    inverse_distances,
    known,
    squared_distances,
)
from convexrough.influence.sliced_matrix import MatrixSums
from convexrough.roundoff import ROUNDOFF

#: A matrix of 1 / r between asperities and other points is cached if it has at most this many
#: entries; for larger matrices a cache saves no time.
KEPT = 2**16


def fits_densely(count: int) -> None:
    """Raise InputError if memory cannot hold the matrix of `count` asperities and its copies."""
    checks.fits_in_memory("asperities that could touch", count, 5 * 8, power=2)


def dense_matrix(points: Array, scale: float) -> Array:
    """The matrix (n, n) of A_ij = scale / r_ij, with zeros on the diagonal."""
    fits_densely(len(points))
    matrix = inverse_distances(points, points)
    matrix *= scale
    return matrix


def entry_error(point_error: float, nearest: float) -> float:
    """Bound on the relative error of a computed scale / r, for distances r >= `nearest`."""
    x = 2.0 * np.sqrt(2.0) * point_error / nearest if point_error > 0 else 0.0
    moved = x / (1.0 - x) if x < 1 else np.inf
    return 1.01 * (ENTRY_ROUNDOFFS * ROUNDOFF + moved)


def by_pairs(points: Array, values: Array) -> Array:
    """(n, 2) sums over j of (c_i - c_j) v_j / r_ij^3 for points c and values v."""
    total = np.empty_like(points)
    rows = max(1, 2**22 // max(1, len(points)))
    for start in range(0, len(points), rows):
        some = points[start : start + rows]
        weights = cubed(squared_distances(some, points)) * values
        for k in (0, 1):
            apart = np.subtract.outer(some[:, k], points[:, k])
            total[start : start + rows, k] = (weights * apart).sum(axis=1)
    return total


@dataclass(frozen=True, eq=False)
class DenseInfluence:
    """The compliance operator as a stored matrix; see `coupling.Influence`.

    point_error : [length] bound on the error of each coordinate of the points
    entry_error : bound on the relative error of each A_ij
    """

    points: Array
    scale: float
    matrix: Array
    point_error: float
    entry_error: float
    sums: MatrixSums

    name: ClassVar[Kind] = "dense"
    stored: ClassVar[bool] = True
    cheap_sums: ClassVar[bool] = False

    @classmethod
    def assemble(
        cls, points: Array, scale: float, point_error: float = 0.0, tails: Array | None = None
    ) -> DenseInfluence:
        sums = MatrixSums(*known(points, tails, point_error))
        return cls.of(points, scale, dense_matrix(points, scale), sums, point_error)

    @classmethod
    def of(
        cls,
        points: Array,
        scale: float,
        matrix: Array,
        sums: MatrixSums,
        point_error: float = 0.0,
    ) -> DenseInfluence:
        """The operator from its matrix (n, n), which the caller has computed."""
        largest = float(matrix.max(initial=0.0))
        nearest = scale / largest if largest > 0 else np.inf
        return cls(points, scale, matrix, point_error, entry_error(point_error, nearest), sums)

    def __len__(self) -> int:
        return len(self.points)

    def apply(self, loads: Array) -> Array:
        """A P, in blocks of sqrt(n) terms (at least 64), so that rounding grows as sqrt(n)."""
        size = self._block
        if len(self) <= size:
            return np.asarray(self.matrix @ loads)
        total: Array = self.matrix[:, :size] @ loads[:size]
        for start in range(size, len(self), size):
            total += self.matrix[:, start : start + size] @ loads[start : start + size]
        return total

    def rounding(self, loads: Array) -> Rounding:
        """Bounds for `apply`, which sums in blocks: Higham, Accuracy and Stability, section 4.2."""
        terms = self._block + -(-len(self) // self._block) + 1
        return Rounding(1.01 * (terms * ROUNDOFF + self.entry_error), 0.0)

    def falloff(self, strengths: Array, power: int) -> Array:
        inverse = self.matrix / self.scale  # 1 / r, because powers of the scale may underflow
        raised = inverse * inverse
        for _ in range(power - 2):
            raised *= inverse
        total: Array = raised @ strengths
        return total * (1.0 + self._loss(power))

    def submatrix(self, which: Indices) -> Array:
        return self.matrix.take(which, axis=0).take(which, axis=1)

    def restricted(self, which: Indices) -> DenseInfluence:
        if len(which) == len(self) and (which[1:] > which[:-1]).all():
            return self
        return replace(
            self,
            points=self.points[which],
            matrix=self.submatrix(which),
            sums=self.sums.restricted(which),
        )

    def onto(self, points: Array) -> DenseCoupling:
        return DenseCoupling(self.points, points, self.scale, self.point_error)

    def slopes(self, loads: Array) -> Array:
        return -self.scale * by_pairs(self.points, loads)

    def separations(self) -> Array:
        if len(self) < 2:
            return np.full(len(self), np.inf)
        nearest: Array = self.scale / self.matrix.max(axis=1) * (1.0 - ENTRY_ROUNDOFFS * ROUNDOFF)
        return np.asarray(np.maximum(nearest - 3.0 * self.point_error, 0.0))

    def crowding(self, radii: Array) -> float:
        if len(radii) < 2:
            return 0.0
        return float((np.add.outer(radii, radii) * self.matrix).max()) / self.scale

    def semidefinite_with(self, radius: float) -> bool:
        return False

    def smoother(self, root: Array) -> Smoother | None:
        return None

    @cached_property
    def _block(self) -> int:
        return max(64, int(np.ceil(np.sqrt(len(self)))))

    def _loss(self, power: int) -> float:
        """Bound on the relative error of a sum over j of strengths_j / r_ij^power."""
        return 1.01 * ((len(self) + 6) * ROUNDOFF + power * self.entry_error)


@dataclass(frozen=True, eq=False)
class DenseCoupling:
    """The map from loads at `points` (n, 2) to displacements at `targets` (m, 2) [length]."""

    points: Array
    targets: Array
    scale: float
    point_error: float

    def apply(self, loads: Array) -> Array:
        total = np.empty(len(self.targets))
        for block, inverse in self._rows():
            total[block] = inverse @ loads
        return self.scale * total

    def rounding(self, loads: Array) -> Rounding:
        terms = len(self.points) + 1
        return Rounding(1.01 * (terms * ROUNDOFF + self._entry_error), 0.0)

    def falloff(self, strengths: Array, power: int) -> Array:
        total = np.empty(len(self.targets))
        for block, inverse in self._rows():
            total[block] = inverse**power @ strengths
        loss = (len(self.points) + 3) * ROUNDOFF + power * self._entry_error
        return total * (1.0 + 1.01 * loss)

    @cached_property
    def _whole(self) -> Array:
        return inverse_distances(self.targets, self.points)

    def _rows(self) -> Iterator[tuple[slice, Array]]:
        """Blocks of rows of the matrix 1 / r, each with its slice; a small matrix is one block."""
        if len(self.points) * len(self.targets) <= KEPT:
            yield slice(None), self._whole
            return
        rows = max(1, 2**22 // max(1, len(self.points)))
        for start in range(0, len(self.targets), rows):
            block = slice(start, min(start + rows, len(self.targets)))
            yield block, inverse_distances(self.targets[block], self.points)

    @cached_property
    def _entry_error(self) -> float:
        if self.point_error == 0:
            return entry_error(0.0, np.inf)
        closest = max((float(inverse.max(initial=0.0)) for _, inverse in self._rows()), default=0.0)
        return entry_error(self.point_error, 1.0 / closest if closest > 0 else np.inf)
