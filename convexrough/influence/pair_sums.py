"""Sums over pairs of arbitrary points: distant pairs by a mesh, near pairs one by one.

1 / r^q is the sum of a smooth part L (`softened`) and a rest S, which is 0 for distances above the
"reach". For L, the code uses W G W^T: W interpolates from the nodes of a square mesh, and Fourier
transforms multiply by G, which has the values of L between nodes. S is a sparse matrix.
docs/theory/operators-mesh.md derives the method and the error bounds.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array
from convexrough.influence.convolution import Kernel, SiteBox
from convexrough.influence.coupling import Rounding
from convexrough.influence.mesh import BLOCK, Interpolation
from convexrough.influence.near_pairs import NearPairs, Order
from convexrough.influence.softened import WEIGHT_ROUNDOFFS, lebesgue
from convexrough.influence.splitting import Splitting
from convexrough.roundoff import ROUNDOFF


@dataclass(frozen=True, eq=False)
class Product:
    """The map from loads P_j to the sums over j of P_j / r_ij^q, with bounds on its errors.

    splitting, order : the choice of L and of the mesh; the points sorted by blocks of mesh cells
    near, weights : the matrix S, and the interpolation W; None if there is no mesh
    mesh, kernel : the box of the nodes, and L on it, which multiplies by G
    """

    splitting: Splitting
    order: Order
    near: NearPairs
    weights: Interpolation | None
    mesh: SiteBox
    kernel: Kernel

    @classmethod
    def assemble(
        cls, points: Array, splitting: Splitting, dtype: Any, tails: Array | None = None
    ) -> Product:
        order = Order.of(points, splitting, tails)
        near = NearPairs.assemble(order, splitting, dtype)
        if not splitting.meshed:
            nothing = Kernel(np.empty((0, 0)), 0.0)
            return cls(splitting, order, near, None, SiteBox((1, 1), np.eye(2)), nothing)
        weights = Interpolation.assemble(order, splitting, dtype)
        mesh = SiteBox(weights.shape, splitting.spacing * np.eye(2))
        size = float(mesh.padded[0]) * mesh.padded[1]
        checks.fits_in_memory("asperities that could touch", len(points), 32 * size / len(points))
        (kernel,) = mesh.kernels(lambda i, j, r2: [splitting.kernel.smooth(r2)], np.float64)
        kernel = Kernel(kernel.spectrum.astype(dtype, copy=False), kernel.norm)
        return cls(splitting, order, near, weights, mesh, kernel)

    def apply(self, loads: NDArray[Any]) -> NDArray[Any]:
        """(n,) the sums; a second thread computes the product with S, as both parts release the
        GIL.
        """
        ordered = loads[self.order.places]
        if self.weights is None:
            total = self.near.apply(ordered)
        else:
            with ThreadPoolExecutor(1) as other:
                near = other.submit(self.near.apply, ordered)
                total = self.smooth(ordered)
                total += near.result()
        result = np.empty_like(total)
        result[self.order.places] = total
        return result

    def smooth(self, ordered: NDArray[Any]) -> NDArray[Any]:
        """(n,) the part of the sums that is computed on the mesh, W G W^T P, for sorted loads P."""
        assert self.weights is not None
        field = self.mesh.convolve(self.weights.to_nodes(ordered), self.kernel.spectrum)
        return self.weights.from_nodes(field)

    def interpolation(self, strengths: Array) -> Array:
        """(n,) bounds on the interpolation error of near pairs in sums of `strengths` (n,) >= 0.

        Pairs within the reach plus the `sway` of the stencils count as near. The relative error of
        other pairs is part of `rounding`.
        """
        kernel, spacing = self.splitting.kernel, self.splitting.spacing
        if not self.splitting.meshed:
            return np.zeros(len(strengths))
        points, ordered = self.order.points, strengths[self.order.places]
        near = within(points, ordered, kernel.reach + kernel.sway(spacing))
        bounds = np.empty_like(near)
        bounds[self.order.places] = kernel.pair_error(spacing) * near
        return bounds

    def above(self, strengths: Array) -> Array:
        """(n,) upper bounds on the sums over j of strengths_j / r_ij^q, for `strengths` >= 0."""
        total = self.apply(strengths)
        rounding = self.rounding(strengths)
        total += rounding.of(total) + self.interpolation(strengths)
        return total / (1.0 - rounding.relative) if rounding.relative < 1 else total + np.inf

    @cached_property
    def _rounding(self) -> tuple[float, float]:
        """Bounds on errors except those of `_weighing` and of transforms.

        The first is relative to the sums, the second to the largest load.
        """
        kernel = self.splitting.kernel
        relative = (self.near.terms + kernel.beyond_roundoffs + kernel.roundoffs + 10) * ROUNDOFF
        relative += kernel.moved(2.0 * ROUNDOFF * self.splitting.spacing)
        relative += kernel.far_error(self.splitting.spacing)
        own = (kernel.roundoffs + 8) * ROUNDOFF * kernel.centre
        return 1.01 * relative, 1.01 * own

    def rounding(self, loads: Array) -> Rounding:
        """Bound on the error of `apply` in float64, without the bound of `interpolation`.

        docs/theory/operators-mesh.md, "Errors".
        """
        relative, own = self._rounding
        each = own * float(np.abs(loads).max(initial=0.0))
        if self.weights is not None:
            ordered = loads[self.order.places]
            field = float(np.linalg.norm(self.weights.to_nodes(ordered)))
            sizes = float(np.linalg.norm(self.weights.to_nodes(np.abs(ordered), absolute=True)))
            kernel, soft = self.kernel, self.splitting.kernel
            to_mesh, from_mesh = self._weighing
            from_mesh += max(soft.roundoffs, soft.beyond_roundoffs) * ROUNDOFF  # of each L
            # Cauchy's inequality for a row of G, and the sum of a row of |W|.
            transforms = self.mesh.bound(kernel, ROUNDOFF) + from_mesh * kernel.norm
            growth = lebesgue(soft.order) ** 2
            each += growth * (transforms * field + to_mesh * kernel.norm * sizes)
        return Rounding(relative, 1.01 * each)

    @property
    def _weighing(self) -> tuple[float, float]:
        """Bounds on the relative rounding errors of products with W^T, and with W."""
        order, width = self.splitting.kernel.order, self.splitting.width
        weights = 2.0 * WEIGHT_ROUNDOFFS + 2.0
        overlaps = (-(-width // self.splitting.block)) ** 2
        crowded = float(np.diff(self.order.starts).max())
        to_mesh = min(crowded, BLOCK) + overlaps * np.ceil(crowded / BLOCK)
        return (weights + float(to_mesh)) * ROUNDOFF, (weights + 2.0 * order) * ROUNDOFF


def within(points: Array, strengths: Array, distance: float) -> Array:
    """(n,) for each point an upper bound on the sum of `strengths` at points within `distance`."""
    parts = 4
    side = distance * (1.0 + 1e-9) / parts
    cells = np.floor((points - points.min(axis=0)) / side).astype(np.int64)
    rows, columns = (cells.max(axis=0) + 1).tolist()
    if rows * columns > 16 * len(points) + 10**6:
        return np.full(len(points), float(strengths.sum()))
    place = cells[:, 0] * columns + cells[:, 1]
    sums = np.zeros((rows + 1, columns + 1))
    total = np.bincount(place, strengths, minlength=rows * columns).reshape(rows, columns)
    sums[1:, 1:] = total.cumsum(axis=0).cumsum(axis=1)
    low_i, high_i = (np.clip(np.arange(rows) + s, 0, rows) for s in (-parts, parts + 1))
    low_j, high_j = (np.clip(np.arange(columns) + s, 0, columns) for s in (-parts, parts + 1))
    boxes = sums[np.ix_(high_i, high_j)] - sums[np.ix_(low_i, high_j)]
    boxes += sums[np.ix_(low_i, low_j)] - sums[np.ix_(high_i, low_j)]
    slack = 1e-12 * sums[-1, -1]  # rounding of the differences
    bounds: Array = boxes.ravel()[place] + slack
    return bounds
