"""Interpolation between the nodes of a square mesh and points.

docs/theory/operators-mesh.md, "A mesh and near pairs", derives the weights.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.pairs import Pair
from convexrough.influence.near_pairs import Order
from convexrough.influence.softened import twofold_lagrange
from convexrough.influence.splitting import Splitting

#: Largest number of points in a patch: sums stay short, and a matrix product fits in the cache.
BLOCK = 256

#: Number of points whose weights are computed together: they fit in the cache.
PLACES = 2**12


@dataclass(frozen=True, eq=False)
class Interpolation:
    """The interpolation W from nodes to points.

    x, y    : (n, width) weights in each direction; an entry of W is the product of one of each
    patches : for each group of consecutive points in one block of mesh cells: the first point, the
        point after the last, and the indices i and j of the first node
    shape   : numbers of nodes of the mesh in both directions
    """

    x: NDArray[Any]
    y: NDArray[Any]
    patches: list[tuple[int, int, int, int]]
    shape: tuple[int, int]

    @classmethod
    def assemble(cls, order: Order, splitting: Splitting, dtype: Any) -> Interpolation:
        rows, columns = order.shape
        patches = []
        corners = np.stack((order.keys // columns, order.keys % columns), axis=1) * splitting.block
        for key, (i, j) in enumerate(corners.tolist()):
            start, stop = order.starts[key : key + 2].tolist()
            for first in range(start, stop, BLOCK):
                patches.append((first, min(first + BLOCK, stop), i, j))
        x, y = (np.empty((len(order.places), splitting.width), dtype=dtype) for _ in (0, 1))
        for start in range(0, len(x), PLACES):
            some = slice(start, start + PLACES)
            x[some], y[some] = (factor.high for factor in twofold_weights(order, splitting, some))
        extra = splitting.kernel.order - 1
        shape = (rows * splitting.block + extra, columns * splitting.block + extra)
        return cls(x, y, patches, shape)

    def to_nodes(self, loads: NDArray[Any], absolute: bool = False) -> NDArray[Any]:
        """W^T P at the nodes of the mesh for loads P (n,), or |W|^T P if `absolute`."""
        field = np.zeros(self.shape, dtype=loads.dtype)
        x, y = (np.abs(self.x), np.abs(self.y)) if absolute else (self.x, self.y)
        width = x.shape[1]
        column = loads[:, None]
        for start, stop, i, j in self.patches:
            mine = slice(start, stop)
            field[i : i + width, j : j + width] += x[mine].T @ (column[mine] * y[mine])
        return field

    def from_nodes(self, field: NDArray[Any]) -> NDArray[Any]:
        """(n,) W times a field of values at the nodes of the mesh."""
        result = np.empty(len(self.x), dtype=field.dtype)
        width = self.x.shape[1]
        for start, stop, i, j in self.patches:
            mine = slice(start, stop)
            along = self.x[mine] @ field[i : i + width, j : j + width]
            np.einsum("ij,ij->i", along, self.y[mine], out=result[mine])
        return result


def twofold_weights(order: Order, splitting: Splitting, some: slice) -> tuple[Pair, Pair]:
    """The double-double weights (m, width) of some points, in x and in y.

    They are 0 except at the nodes from which a point interpolates.
    """
    stencil = np.arange(splitting.kernel.order)
    factors = []
    for k in (0, 1):
        weights = twofold_lagrange(order.shares[some, k], len(stencil))
        rows = Pair(*(np.zeros((len(weights.high), splitting.width)) for _ in weights))
        columns = (order.cells[some, k] % splitting.block)[:, None] + stencil
        for row, values in zip(rows, weights, strict=True):
            np.put_along_axis(row, columns, values, axis=1)
        factors.append(rows)
    return factors[0], factors[1]
