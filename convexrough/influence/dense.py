"""The compliance operator as a stored matrix, for up to some thousands of asperities."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.influence import coupling
from convexrough.influence.sliced_matrix import MatrixSums
from convexrough.roundoff import ROUNDOFF


@dataclass(frozen=True, eq=False)
class DenseInfluence(coupling.Influence):
    """The compliance operator as a stored matrix; see `coupling.Influence`."""

    points: Array
    scale: float
    entries: Array  # the matrix
    sums: MatrixSums
    point_error: float = 0.0

    name: ClassVar[coupling.Kind] = "dense"
    stored: ClassVar[bool] = True

    @classmethod
    def assemble(
        cls, points: Array, scale: float, point_error: float = 0.0, tails: Array | None = None
    ) -> DenseInfluence:
        sums = MatrixSums(*coupling.known(points, tails, point_error))
        return cls(points, scale, coupling.dense_matrix(points, scale), sums, point_error)

    @property
    def matrix(self) -> Array:
        return self.entries

    def apply(self, loads: Array) -> Array:
        """A P, in blocks of sqrt(n) terms (at least 64), so that rounding grows as sqrt(n)."""
        size = self._block
        if len(self) <= size:
            return np.asarray(self.entries @ loads)
        total: Array = self.entries[:, :size] @ loads[:size]
        for start in range(size, len(self), size):
            total += self.entries[:, start : start + size] @ loads[start : start + size]
        return total

    def rounding(self, loads: Array) -> coupling.Rounding:
        """Bounds for `apply`, which sums in blocks: Higham, Accuracy and Stability, section 4.2."""
        terms = self._block + -(-len(self) // self._block) + 1
        return coupling.Rounding(1.01 * (terms * ROUNDOFF + self.entry_error), 0.0)

    def falloff(self, strengths: Array, power: int) -> Array:
        inverse = self.entries / self.scale  # 1 / r, because powers of the scale may underflow
        raised = inverse
        for _ in range(power - 1):
            raised = raised * inverse
        loss = 1.01 * ((len(self) + 6) * ROUNDOFF + power * self.entry_error)
        return np.asarray((raised @ strengths) * (1.0 + loss))

    def submatrix(self, which: Indices) -> Array:
        return self.entries.take(which, axis=0).take(which, axis=1)

    def restricted(self, which: Indices) -> DenseInfluence:
        if len(which) == len(self) and (which[1:] > which[:-1]).all():
            return self
        entries, sums = self.submatrix(which), self.sums.restricted(which)
        return replace(self, points=self.points[which], entries=entries, sums=sums)

    @property
    def _nearest(self) -> Array:
        lower = 1.0 - coupling.ENTRY_ROUNDOFFS * ROUNDOFF
        return np.asarray(self.scale / self.entries.max(axis=1) * lower)

    def crowding(self, radii: Array) -> float:
        if len(radii) < 2:
            return 0.0
        return float((np.add.outer(radii, radii) * self.entries).max()) / self.scale

    @cached_property
    def _block(self) -> int:
        return max(64, int(np.ceil(np.sqrt(len(self)))))
