"""The coupling among asperities anywhere: by a mesh and a sparse matrix, with proved errors.

What happens on the mesh, and the bounds, are in `mesh`, `near`, `plan` and `softened`;
docs/theory/operators.md derives them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.influence.coupling import Coupling, Kind, Rounding, Smoother
from convexrough.influence.dense import DenseCoupling, dense_matrix, entry_error
from convexrough.influence.mesh import Product
from convexrough.influence.splitting import Plan
from convexrough.scene.neighbours import crowding, separations

#: Error of a product, relative to its own size, that is left to interpolation.
TOLERANCE = 1e-13

#: The same where loads are in single precision, and for sums that need not be sharp.
SINGLE_TOLERANCE, FALLOFF_TOLERANCE = 1e-5, 5e-3

#: Up to so many pairs (asperity, other point) are coupled one by one.
FEW_PAIRS = 10**8

#: Nodes of the coarse mesh that a smoother solves on, about; and too few touching points for one.
COARSE, FEW_TOUCHING = 1000, 200


@dataclass(frozen=True, eq=False)
class ScatteredInfluence:
    """The coupling among asperities anywhere.

    points      : (n, 2) [length]
    scale       : 1 / (pi E*) in the problem's units: A_ij = scale / r_ij
    point_error : [length] bound on the error of each coordinate of the points
    tolerance   : error of interpolation in a product, relative to its size
    """

    points: Array
    scale: float
    point_error: float
    tolerance: float

    name: ClassVar[Kind] = "scattered"
    single: ClassVar[bool] = True

    @classmethod
    def assemble(
        cls,
        points: Array,
        scale: float,
        point_error: float = 0.0,
        tolerance: float = TOLERANCE,
    ) -> ScatteredInfluence:
        return cls(points, scale, point_error, tolerance)

    def __len__(self) -> int:
        return len(self.points)

    def apply(self, loads: Array) -> Array:
        if loads.dtype == np.float32:
            product = self._single.apply(loads)
        else:
            product = self._double.apply(loads.astype(np.float64, copy=False))
        product *= product.dtype.type(self.scale)
        return product

    def rounding(self, loads: Array) -> Rounding:
        rounding = self._double.rounding(loads)
        points = entry_error(self.point_error, self._double.near.nearest)
        interpolation = self._double.interpolation_norm * float(np.linalg.norm(loads))
        each = float(self._double.interpolation(np.abs(loads)).max(initial=0.0))
        return Rounding(
            1.01 * (rounding.relative + points),
            1.01 * self.scale * (rounding.norm + interpolation),
            1.01 * self.scale * (rounding.each + each),
        )

    def falloff(self, strengths: Array, power: int) -> Array:
        """With bounds on the errors of a coarser mesh added."""
        product = self._square if power == 2 else self._cube
        return product.above(strengths) * self._stretched(power)

    @property
    def matrix(self) -> Array:
        return dense_matrix(self.points, self.scale)

    @property
    def entry_error(self) -> float:
        return entry_error(self.point_error, float(self.separations().min(initial=np.inf)))

    def among(self, which: Indices) -> ScatteredInfluence:
        return self.assemble(self.points[which], self.scale, self.point_error, self.tolerance)

    def onto(self, points: Array) -> Coupling:
        if len(points) * len(self) <= FEW_PAIRS:
            return DenseCoupling(self.points, points, self.scale, self.point_error)
        together = np.concatenate((self.points, points))
        return ScatteredCoupling(
            self.assemble(together, self.scale, self.point_error, self.tolerance), len(self)
        )

    def separations(self) -> Array:
        return separations(self.points, self.point_error)

    def crowding(self, radii: Array) -> float:
        return crowding(self.points, radii)

    def smoother(self, root: Array) -> Smoother | None:
        return coarse_inverse(self.points, self.scale, root)

    def _stretched(self, power: int) -> float:
        """How much higher 1 / r^q can be for what is known of the points."""
        moved = entry_error(self.point_error, self._double.near.nearest)
        return float((1.0 + moved) ** power) * (1.0 + 1e-6)

    @cached_property
    def _double(self) -> Product:
        return self._product(1, self.tolerance, np.float64)

    @cached_property
    def _single(self) -> Product:
        return self._product(1, max(self.tolerance, SINGLE_TOLERANCE), np.float32)

    @cached_property
    def _square(self) -> Product:
        return self._product(2, FALLOFF_TOLERANCE, np.float64)

    @cached_property
    def _cube(self) -> Product:
        return self._product(3, FALLOFF_TOLERANCE, np.float64)

    def _product(self, power: int, tolerance: float, dtype: Any) -> Product:
        plan = Plan.choose(self.points, power, tolerance)
        return Product.assemble(self.points, plan, dtype)


@dataclass(frozen=True, eq=False)
class ScatteredCoupling:
    """From the first asperities of an operator to all others."""

    joint: ScatteredInfluence
    sources: int

    def apply(self, loads: Array) -> Array:
        return self.joint.apply(self._all(loads))[self.sources :]

    def rounding(self, loads: Array) -> Rounding:
        return self.joint.rounding(self._all(loads))

    def falloff(self, strengths: Array, power: int) -> Array:
        return self.joint.falloff(self._all(strengths), power)[self.sources :]

    def _all(self, values: Array) -> Array:
        everywhere = np.zeros(len(self.joint), dtype=values.dtype)
        everywhere[: self.sources] = values
        return everywhere


def coarse_inverse(points: Array, scale: float, root: Array) -> Smoother | None:
    """(I + T K T^t)^-1, where T K T^t is W A W as seen from a coarse mesh.

    T = W S interpolates linearly to touching points from the nodes around them, and K is
    1 / (pi E* r) between nodes with shells of half the spacing on its diagonal, so that it is
    positive definite (docs/theory/convexity.md). So is the inverse then, whatever the points: by
    Woodbury's identity it is I - T (K^-1 + T^t T)^-1 T^t. In single precision.
    """
    from scipy.linalg.lapack import dpotrf, dpotri, spotrs
    from scipy.sparse import csr_array

    touching = np.flatnonzero(root > 0)
    if len(touching) < FEW_TOUCHING:
        return None
    spacing = _coarse_spacing(points[touching], min(COARSE, len(touching) // 6))
    nodes, weights, places = _linear(points[touching], spacing)
    weights *= root[touching, None]
    starts = np.arange(0, nodes.size + 1, 4)
    shape = (len(touching), len(places))
    T = csr_array((weights.ravel(), nodes.ravel(), starts), shape=shape)
    K = dense_matrix(places, scale)
    np.fill_diagonal(K, 2.0 * scale / spacing)
    factor, failed = dpotrf(K, lower=1)
    if failed:
        return None
    inverse = np.tril(dpotri(factor, lower=1)[0])
    factor, failed = dpotrf(inverse + (T.T @ T).toarray(), lower=1)
    if failed:
        return None
    small, coarse, coupling = (each.astype(np.float32) for each in (T, factor, K))
    w = root[touching].astype(np.float32)
    # A W r: its long waves by the nodes, and short ones as if signs were random within a cell.
    counts = np.bincount(nodes.ravel(), weights.ravel() / np.repeat(root[touching], 4))
    per_cell = max(len(touching) / len(places), 1.0)
    rough = scale / spacing * np.sqrt(np.pi * per_cell * np.log(per_cell))

    def smooth(values: Array) -> tuple[Array, float]:
        mine = values[touching].astype(np.float32, copy=False)
        loads = small.T @ mine
        field = coupling @ loads
        left = np.hypot(np.sqrt(counts @ (field * field)), rough * np.linalg.norm(w * mine))
        result: Any = np.zeros(len(values), dtype=np.float32)
        result[touching] = mine - small @ spotrs(coarse, loads, lower=1)[0]
        return result, float(left)

    return smooth


def _coarse_spacing(points: Array, most: int) -> float:
    """[length] of a square mesh of which about so many cells hold points."""
    low, widest = points.min(axis=0), float(np.ptp(points, axis=0).max())
    spacing = widest
    while True:
        finer = 0.8 * spacing
        cells = ((points - low) / finer).astype(np.int64)
        columns = int(cells[:, 1].max()) + 1
        if len(np.unique(cells[:, 0] * columns + cells[:, 1])) > most:
            return spacing
        spacing = finer


def _linear(points: Array, spacing: float) -> tuple[Indices, Array, Array]:
    """(n, 4) nodes around each point and weights of linear interpolation; (nodes, 2) [length]."""
    away = (points - points.min(axis=0)) / spacing
    cells = away.astype(np.intp)
    shares = away - cells
    columns = int(cells[:, 1].max()) + 2
    key = cells[:, 0] * columns + cells[:, 1]
    corners = key[:, None] + np.array([0, 1, columns, columns + 1])
    x = np.stack((1.0 - shares[:, 0], shares[:, 0]), axis=1)
    y = np.stack((1.0 - shares[:, 1], shares[:, 1]), axis=1)
    weights = (x[:, :, None] * y[:, None, :]).reshape(-1, 4)
    used, nodes = np.unique(corners, return_inverse=True)
    places = np.stack((used // columns, used % columns), axis=1) * spacing
    return nodes.reshape(-1, 4), weights, places
