"""The compliance operator of arbitrary points, by a mesh and a sparse matrix, with error bounds.

`pair_sums` implements the method, which docs/theory/operators-mesh.md derives.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.influence import coupling
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.pair_sums import Product
from convexrough.influence.sharp_sums import MeshSums
from convexrough.influence.sliced_matrix import MatrixSums
from convexrough.influence.smoother import Blocks, blocks_of_points
from convexrough.influence.splitting import Splitting

#: Target of the relative error that interpolation causes in a product. It is the largest part of
#: the error of `sums`, about 1e-16.
TOLERANCE = 5e-17

#: The same target for loads in single precision, and for `falloff` with each power.
SINGLE_TOLERANCE, FALLOFF_TOLERANCE = 1e-5, {1: 1e-4, 2: 5e-3, 3: 5e-3}

#: Up to this number of asperities, `sums` uses a matrix, which is faster and gives 27 digits.
FEW = 1500

#: A restricted operator uses the mesh of the whole operator for products in double precision if it
#: has at least this part of the asperities. Affects speed only.
SHARED = 0.25

#: If at most this many asperities or other points are given, or if a mesh would not save time,
#: `onto` computes pair by pair. Affects speed only.
FEW_ONTO = 2500


@dataclass(frozen=True, eq=False)
class ScatteredInfluence(coupling.Influence):
    """The compliance operator of asperities at arbitrary points; see `coupling.Influence`.

    For few points, or points in dense clusters, a matrix takes the place of the mesh.

    tails : (n, 2) [length] the exact points minus `points`, or None if all differences are 0 or
        unknown; see `Scene.contact_tails`
    """

    points: Array
    scale: float
    point_error: float = 0.0
    tails: Array | None = None
    #: The operator from which this one is restricted, and its asperities there. Its mesh serves for
    #: products in double precision; None if this would not save time.
    whole: tuple[ScatteredInfluence, Indices] | None = None

    name: ClassVar[coupling.Kind] = "scattered"

    def apply(self, loads: Array) -> Array:
        single = loads.dtype == np.float32
        if self.whole and not single:
            A, which = self.whole
            return A.apply(among_zeros(loads, which, len(A)))[which]
        dtype: Any = np.float32 if single else np.float64
        product = self._product(1, SINGLE_TOLERANCE, dtype) if single else self._double
        if product is None:
            return self._dense.apply(loads.astype(np.float64, copy=False)).astype(dtype, copy=False)
        found = product.apply(loads.astype(dtype, copy=False))
        found *= dtype(self.scale)
        return found

    def rounding(self, loads: Array) -> coupling.Rounding:
        if self.whole:
            A, which = self.whole
            return A.rounding(among_zeros(loads, which, len(A)))
        if self._double is None:
            return self._dense.rounding(loads)
        rounding = self._double.rounding(loads)
        points = coupling.entry_error(self._unknown, self._double.near.nearest)
        interpolated = float(self._double.interpolation(np.abs(loads)).max(initial=0.0))
        each = 1.01 * self.scale * (rounding.each + interpolated)
        return coupling.Rounding(1.01 * (rounding.relative + points), each)

    def falloff(self, strengths: Array, power: int) -> Array:
        product = self._product(power, FALLOFF_TOLERANCE[power], np.float64)
        if product is None:
            return self._dense.falloff(strengths, power)
        moved = coupling.entry_error(self._unknown, product.near.nearest)
        return product.above(strengths) * float((1.0 + moved) ** power) * (1.0 + 1e-6)

    def restricted(self, which: Indices) -> ScatteredInfluence:
        tails = None if self.tails is None else self.tails[which]
        whole = (self, which) if len(which) >= SHARED * len(self) else None
        return replace(self, points=self.points[which], tails=tails, whole=whole)

    def onto(self, points: Array) -> coupling.Coupling:
        together = np.concatenate((points, self.points))
        few = min(len(points), len(self)) <= FEW_ONTO
        if few or Splitting.choose(together, 1, TOLERANCE) is None:
            return super().onto(points)
        joint = replace(self, points=together, tails=None, whole=None)
        return coupling.JointCoupling(joint, len(points))

    def slopes(self, loads: Array) -> Ball:
        if self._double is None:
            return super().slopes(loads)
        return Ball.around(-self.scale * self._double.slopes(loads), np.inf)

    def sums(self, loads: Pair) -> Ball:
        found = self._sums(loads)
        if isinstance(self._sums, MatrixSums) or self._unknown == 0.0:
            return found
        # If distances have an error of at most `moved`, 1 / r has one of about `moved` / r^2.
        moved = 2.0 * math.sqrt(2.0) * self._unknown
        off = 1.01 * moved * self.falloff(np.abs(loads.high), 2)
        return Ball.around(found.mid, found.radius + off)

    @cached_property
    def _sums(self) -> MatrixSums | MeshSums:
        if len(self) > FEW and self._double is not None:
            return MeshSums(self._double)
        return MatrixSums(*coupling.known(self.points, self.tails, self.point_error))

    def smoother(self, root: Array) -> coupling.Smoother:
        return self._blocks.smoother(root)

    @cached_property
    def _blocks(self) -> Blocks:
        return blocks_of_points(self.points, self.scale)

    @property
    def _double(self) -> Product | None:
        return self._product(1, TOLERANCE, np.float64)

    @cached_property
    def _dense(self) -> DenseInfluence:
        """The operator as a matrix; used if a mesh costs more."""
        return DenseInfluence.assemble(self.points, self.scale, self.point_error, self.tails)

    @cached_property
    def _products(self) -> dict[tuple[int, float], Product | None]:
        return {}

    def _product(self, power: int, tolerance: float, dtype: Any) -> Product | None:
        """The map from loads P_j to the sums over j of P_j / r_ij^power; None without a mesh."""
        if (power, tolerance) not in self._products:
            splitting = Splitting.choose(self.points, power, tolerance)
            found = splitting and Product.assemble(self.points, splitting, dtype, self.tails)
            self._products[power, tolerance] = found or None
        return self._products[power, tolerance]

    @cached_property
    def _unknown(self) -> float:
        """[length] bound on the error of each coordinate of `points` plus `tails`."""
        return coupling.known(self.points, self.tails, self.point_error)[1]
