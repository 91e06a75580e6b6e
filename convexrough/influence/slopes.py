"""The slope of the surface at each asperity: the derivative of displacement by position.

If the point c_i of asperity i is moved, the displacement there changes with the derivative

    d(A P)_i / dc_i = -scale sum_j (c_i - c_j) P_j / r_ij^3.

Its two components are sums with odd kernels. They are computed on the boxes and meshes of the
compliance operator, without error bounds. On a mesh, 1 / r has a smooth part L (module `softened`).
The smooth part of the odd kernels is -grad L, the distance vector times the softened 1 / r^3 whose
order is one less.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.influence.convolution import Kernel, SiteBox
from convexrough.influence.pair_sums import Product
from convexrough.influence.softened import Softened

#: Number of pairs processed together.
BLOCK = 2**22


def pulls(box: SiteBox, over_cube: Callable[[Array], Array]) -> list[Kernel]:
    """The odd kernels x / r^3 and y / r^3 for all differences (x, y) of two sites of a box.

    over_cube : 1 / r^3, or the softened 1 / r^3, as a function of squared distances
    """

    def values(i: Indices, j: Indices, squares: Array) -> list[Array]:
        weights = over_cube(squares)
        x, y = (np.add.outer(i * box.basis[0, k], j * box.basis[1, k]) for k in (0, 1))
        return [weights * x, weights * y]

    return box.kernels(values, np.float64, odd=True)


def by_mesh(product: Product, smooth: list[Kernel], values: Array) -> Array:
    """(n, 2) the sums over j of (c_i - c_j) v_j / r_ij^3 for arbitrary points c and `values` v."""
    ordered = values[product.order.places]
    total = _nearby(product, ordered)
    if product.weights is not None:
        field = product.weights.to_nodes(ordered)
        for k, pull in enumerate(smooth):
            on_mesh = product.mesh.convolve(field, 1j * pull.spectrum)
            total[:, k] += product.weights.from_nodes(on_mesh)
    result = np.empty_like(total)
    result[product.order.places] = total
    return result


def mesh_pulls(product: Product) -> list[Kernel]:
    """The two odd kernels of the smooth part of a product; empty if it has no smooth part."""
    return [] if product.weights is None else pulls(product.mesh, _softer(product).smooth)


def _softer(product: Product) -> Softened:
    kernel = product.splitting.kernel
    return Softened(3, kernel.order - 1, kernel.reach)


def _nearby(product: Product, ordered: Array) -> Array:
    """(n, 2) the part of the sums by near pairs, for sorted points: 1 / r^3 minus its smooth part.

    ordered : (n,) the values v_j at the sorted points
    """
    upper, points, kernel = product.near.upper, product.order.points, _softer(product)
    total, n = np.zeros_like(points), len(points)
    edges = np.searchsorted(upper.indptr, np.arange(0, upper.nnz + BLOCK, BLOCK))
    edges = np.unique(np.append(np.minimum(edges, n), (0, n)))
    for first, last in pairwise(edges):
        counts = np.diff(upper.indptr[first : last + 1])
        here = np.repeat(np.arange(first, last), counts)
        there = upper.indices[upper.indptr[first] : upper.indptr[last]]
        apart = points[here] - points[there]
        weights = kernel.local((apart**2).sum(axis=1))
        for k in (0, 1):
            pull = weights * apart[:, k]
            total[:, k] += np.bincount(here, pull * ordered[there], minlength=n)
            total[:, k] -= np.bincount(there, pull * ordered[here], minlength=n)
    return total
