"""Sums over pairs of arbitrary points: distant pairs by a mesh, near pairs one by one.

1 / r^q is the sum of a smooth part L (`softened`) and a rest S, which is 0 for distances above the
"reach". The matrix of L is approximated by W G W^T: W interpolates from the nodes of a square mesh,
and G, which has the values of L between nodes, is applied by Fourier transforms. S is a sparse
matrix. docs/theory/operators-mesh.md derives the method and the error bounds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import NDArray

from convexrough import checks, threads
from convexrough.arithmetic.pairs import CHUNK, Pair, two_sum
from convexrough.arrays import Array, Indices
from convexrough.influence.convolution import Kernel, SiteBox
from convexrough.influence.coupling import Rounding
from convexrough.influence.softened import WEIGHT_ROUNDOFFS, Softened, lebesgue, twofold_lagrange
from convexrough.influence.splitting import Splitting
from convexrough.roundoff import ROUNDOFF

#: Memory [bytes] per near neighbour of a point while S is assembled, and number of points whose
#: near neighbours are counted first, to estimate this memory.
BYTES, SAMPLE = 24, 1000

#: Largest number of points in a patch of a `Mesh`: sums stay short, and fit in the cache.
BLOCK = 256

#: Number of points whose weights are computed together: they fit in the cache.
PLACES = 2**12

#: Number of pairs whose slopes are computed together.
PAIRS = 2**22


@dataclass(frozen=True, eq=False)
class Mesh:
    """Points, sorted by the block of mesh cells that contains them, with the interpolation W."""

    splitting: Splitting
    places: Indices  # (n,) original indices of the sorted points
    points: Array  # (n, 2) [length] the sorted points
    tails: Array | None  # (n, 2) [length] exact minus rounded coordinates; None if they are 0
    cells: Indices  # (n, 2) mesh cell of each sorted point
    shares: Array  # (n, 2) position of each sorted point in its cell, from 0 to 1, rounded once
    crowded: float  # largest number of points in a block
    #: For each group of consecutive points in one block: the first point, the point after the last,
    #: and the indices i and j of the first node.
    patches: list[tuple[int, int, int, int]]
    box: SiteBox  # the nodes
    dtype: Any

    @classmethod
    def of(cls, points: Array, splitting: Splitting, dtype: Any, tails: Array | None) -> Mesh:
        away, block = Pair(*two_sum(points, -points.min(axis=0))), splitting.block
        if tails is not None:
            away += Pair.exact(tails)
        away /= Pair.exact(splitting.spacing)
        corners = np.floor(away.high)
        corners -= (away.high == corners) & (away.low < 0)
        corners = np.maximum(corners, 0.0)
        cells, shares = corners.astype(np.intp), (away.high - corners) + away.low

        blocks = cells // block
        rows, columns = (blocks.max(axis=0, initial=0) + 1).tolist()
        key = blocks[:, 0] * columns + blocks[:, 1]
        places = np.argsort(key, kind="stable")
        keys, starts = np.unique(key[places], return_index=True)
        edges = pairwise([*starts.tolist(), len(points)])
        patches = [
            (first, min(first + BLOCK, stop), k // columns * block, k % columns * block)
            for k, (start, stop) in zip(keys.tolist(), edges, strict=True)
            for first in range(start, stop, BLOCK)
        ]
        extra, spacing = splitting.kernel.order - 1, splitting.spacing
        box = SiteBox((rows * block + extra, columns * block + extra), spacing * np.eye(2))
        crowded = float(np.diff(starts, append=len(points)).max())
        tails = None if tails is None else tails[places]
        sorted_ = splitting, places, points[places], tails, cells[places], shares[places]
        return cls(*sorted_, crowded, patches, box, dtype)

    @cached_property
    def weights(self) -> tuple[Pair, Pair]:
        """(n, width) weights in x and in y; each entry of W is the product of one of each.

        Their low parts, in single precision, serve only sharp products (`sharp_sums`).
        """
        size, order = (len(self.points), self.splitting.width), self.splitting.kernel.order
        x, y = (Pair(np.zeros(size, self.dtype), np.zeros(size, np.float32)) for _ in (0, 1))
        for some in threads.chunks(size[0], PLACES):
            for k, factor in enumerate((x, y)):
                columns = (self.cells[some, k] % self.splitting.block)[:, None] + np.arange(order)
                exactly = twofold_lagrange(self.shares[some, k], order)
                for whole, part in zip(factor, exactly, strict=True):
                    np.put_along_axis(whole[some], columns, part, axis=1)
        return x, y

    def to_nodes(self, loads: NDArray[Any], absolute: bool = False) -> NDArray[Any]:
        """W^T P for loads P (n,) as a field of the box, or |W|^T P if `absolute`."""
        field, column, width = self.box.field(loads.dtype), loads[:, None], self.splitting.width
        for start, stop, i, j in self.patches:
            mine = slice(start, stop)
            x, y = (each.high[mine] for each in self.weights)
            if absolute:
                x, y = np.abs(x), np.abs(y)
            field[i : i + width, j : j + width] += x.T @ (column[mine] * y)
        return field

    def from_nodes(self, field: NDArray[Any]) -> NDArray[Any]:
        """(n,) W times a field of values at the nodes of the mesh."""
        (x, _), (y, _) = self.weights
        result, width = np.empty(len(x), dtype=field.dtype), self.splitting.width
        for start, stop, i, j in self.patches:
            mine = slice(start, stop)
            along = x[mine] @ field[i : i + width, j : j + width]
            np.einsum("ij,ij->i", along, y[mine], out=result[mine])
        return result

    def back(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (n, ...) at the sorted points, in the original order."""
        result = np.empty_like(values)
        result[self.places] = values
        return result


@dataclass(frozen=True, eq=False)
class NearPairs:
    """The matrix S, for pairs within the distance `Splitting.cut`."""

    upper: Any  # (n, n) sparse, the entries for pairs of sorted points i < j
    own: float  # the number on the diagonal: -L(0), because a point does not displace itself
    terms: int  # largest number of near neighbours of a point
    nearest: float  # [length] smallest distance between the points of a near pair, except 0

    @classmethod
    def assemble(cls, mesh: Mesh) -> NearPairs:
        points, splitting = mesh.points, mesh.splitting
        n, tree = len(points), scipy.spatial.cKDTree(points)
        some = points[:: max(1, n // SAMPLE)]
        near = np.sum(tree.query_ball_point(some, splitting.cut, return_length=True))
        checks.fits_in_memory("asperities that could touch", n, BYTES * near / max(len(some), 1))
        pairs = tree.query_pairs(splitting.cut, output_type="ndarray")
        places = tuple(np.ascontiguousarray(each, dtype=np.int32) for each in pairs.T)
        ones = scipy.sparse.coo_array((np.ones(len(pairs), dtype=mesh.dtype), places), shape=(n, n))
        ones.has_canonical_format = True  # no pair occurs twice, so rows need not be sorted
        del pairs, places  # saves memory
        upper, nearest = ones.tocsr(), [splitting.cut]
        terms = int(both_ways(upper, np.ones(n, dtype=mesh.dtype)).max(initial=0))

        def compute(rows: slice) -> None:
            some, here = entries(upper, rows)
            there = upper.indices[some]
            apart = points.take(here, axis=0)
            apart -= points.take(there, axis=0)
            if mesh.tails is not None:
                apart += mesh.tails.take(here, axis=0) - mesh.tails.take(there, axis=0)
            squares = np.einsum("ij,ij->i", apart, apart)
            upper.data[some] = splitting.kernel.local(squares)
            nearest.append(float(np.sqrt(squares[squares > 0].min(initial=np.inf))))

        threads.each(compute, row_parts(upper, CHUNK), threads.worthwhile(upper.nnz))
        return cls(upper, -splitting.kernel.centre, terms, min(nearest))

    def apply(self, loads: NDArray[Any]) -> NDArray[Any]:
        result = both_ways(self.upper, loads)
        result += loads.dtype.type(self.own) * loads
        return result


def row_parts(matrix: Any, size: int) -> Iterator[slice]:
    """Slices of rows of a sparse matrix (CSR) with about `size` entries each."""
    edges, start = matrix.indptr, 0
    while start < len(edges) - 1:
        end = int(np.searchsorted(edges, int(edges[start]) + size, "right")) - 1
        stop = max(start + 1, end)
        yield slice(start, stop)
        start = stop


def entries(matrix: Any, rows: slice) -> tuple[slice, Indices]:
    """The slice of the entries of a sparse matrix (CSR) in these rows, and the row of each."""
    edges = matrix.indptr[rows.start : rows.stop + 1]
    here = np.repeat(np.arange(rows.start, rows.stop), np.diff(edges))
    return slice(int(edges[0]), int(edges[-1])), here


def both_ways(upper: Any, loads: NDArray[Any]) -> NDArray[Any]:
    """The product of a symmetric matrix, of which `upper` has the entries above the diagonal."""
    result: NDArray[Any] = upper @ loads
    result += upper.T @ loads
    return result


@dataclass(frozen=True, eq=False)
class Product:
    """The map from loads P_j to the sums over j of P_j / r_ij^q, with bounds on its errors."""

    splitting: Splitting  # the choice of L and of the mesh
    mesh: Mesh  # the sorted points, and W
    near: NearPairs  # the matrix S
    kernel: Kernel  # the transform of L on the mesh, for products with G

    @classmethod
    def assemble(
        cls, points: Array, splitting: Splitting, dtype: Any, tails: Array | None = None
    ) -> Product:
        mesh = Mesh.of(points, splitting, dtype, tails)
        near = NearPairs.assemble(mesh)
        size = float(mesh.box.padded[0]) * mesh.box.padded[1]
        checks.fits_in_memory("asperities that could touch", len(points), 32 * size / len(points))
        (kernel,) = mesh.box.kernels(lambda i, j, r2: [splitting.kernel.smooth(r2)], np.float64)
        kernel = Kernel(kernel.spectrum.astype(dtype, copy=False), kernel.norm)
        return cls(splitting, mesh, near, kernel)

    def apply(self, loads: NDArray[Any]) -> NDArray[Any]:
        """(n,) the sums. A second thread computes the product with S at the same time."""
        ordered = loads[self.mesh.places]
        found: dict[bool, NDArray[Any]] = {}

        def part(far: bool) -> None:
            if far:
                field = self.mesh.box.convolve(self.mesh.to_nodes(ordered), self.kernel.spectrum)
                found[far] = self.mesh.from_nodes(field)
            else:
                found[far] = self.near.apply(ordered)

        threads.each(part, (True, False), 2)
        return self.mesh.back(found[True] + found[False])

    def interpolation(self, strengths: Array) -> Array:
        """(n,) bounds on errors of the sums of strengths_j / r_ij^q, for `strengths` (n,) >= 0.

        The errors are those by interpolation for pairs within the reach plus `Softened.sway`, and
        by entries left out of S. The relative error of farther pairs is part of `rounding`.
        """
        kernel, spacing = self.splitting.kernel, self.splitting.spacing
        points, ordered = self.mesh.points, strengths[self.mesh.places]
        near = within(points, ordered, kernel.reach + kernel.sway(spacing))
        return self.mesh.back(kernel.pair_error(spacing) * near)

    def above(self, strengths: Array) -> Array:
        """(n,) upper bounds on the sums over j of strengths_j / r_ij^q, for `strengths` >= 0."""
        total = self.apply(strengths)
        rounding = self.rounding(strengths)
        total += rounding.of(total) + self.interpolation(strengths)
        return total / (1.0 - rounding.relative) if rounding.relative < 1 else total + np.inf

    @cached_property
    def _rounding(self) -> tuple[float, float, float, float]:
        """Bounds on rounding errors except those of transforms.

        The first is a part of the sums, and the second is to be multiplied by the largest load. The
        others are relative errors of products with W^T, and with W.
        """
        kernel, spacing, width = self.splitting.kernel, self.splitting.spacing, self.splitting.width
        relative = (self.near.terms + kernel.beyond_roundoffs + kernel.roundoffs + 10) * ROUNDOFF
        relative += kernel.moved(2.0 * ROUNDOFF * spacing) + kernel.far_error(spacing)
        own = (kernel.roundoffs + 8) * ROUNDOFF * kernel.centre
        each = 2.0 * WEIGHT_ROUNDOFFS + 2.0
        overlaps = (-(-width // self.splitting.block)) ** 2
        crowded = self.mesh.crowded
        to_mesh = each + min(crowded, BLOCK) + float(overlaps * np.ceil(crowded / BLOCK))
        from_mesh = each + 2.0 * kernel.order
        from_mesh += max(kernel.roundoffs, kernel.beyond_roundoffs)  # of each L
        return 1.01 * relative, 1.01 * own, to_mesh * ROUNDOFF, from_mesh * ROUNDOFF

    def rounding(self, loads: Array) -> Rounding:
        """Bound on errors of `apply` except `interpolation` (docs/theory/operators-mesh.md)."""
        relative, own, to_mesh, from_mesh = self._rounding
        ordered, norm = loads[self.mesh.places], self.kernel.norm
        field = float(np.linalg.norm(self.mesh.to_nodes(ordered)))
        sizes = float(np.linalg.norm(self.mesh.to_nodes(np.abs(ordered), absolute=True)))
        # Cauchy's inequality for a row of G, and the sum of a row of |W|.
        growth = lebesgue(self.splitting.kernel.order) ** 2
        each = own * float(np.abs(loads).max(initial=0.0))
        each += growth * (self.mesh.box.bound(norm) + from_mesh * norm) * field
        each += growth * to_mesh * norm * sizes
        return Rounding(relative, 1.01 * each)

    def slopes(self, values: Array) -> Array:
        """(n, 2) the sums over j of (c_i - c_j) v_j / r_ij^3 for points c and `values` v.

        There are no error bounds. The smooth part of the kernel, -grad L, is the distance vector
        times a `Softened` kernel for 1 / r^3, whose order is one less than that of L.
        """
        ordered, points, kernel = values[self.mesh.places], self.mesh.points, self._softer
        total, n = np.zeros_like(points), len(points)
        for rows in row_parts(self.near.upper, PAIRS):
            some, here = entries(self.near.upper, rows)
            there = self.near.upper.indices[some]
            apart = points[here] - points[there]
            weights = kernel.local((apart**2).sum(axis=1))
            for k in (0, 1):
                pull = weights * apart[:, k]
                total[:, k] += np.bincount(here, pull * ordered[there], minlength=n)
                total[:, k] -= np.bincount(there, pull * ordered[here], minlength=n)
        for k, smooth in enumerate(self._pulls):
            field = self.mesh.to_nodes(ordered)
            total[:, k] += self.mesh.from_nodes(self.mesh.box.convolve(field, 1j * smooth.spectrum))
        return self.mesh.back(total)

    @cached_property
    def _pulls(self) -> list[Kernel]:
        return self.mesh.box.pulls(self._softer.smooth)

    @property
    def _softer(self) -> Softened:
        return Softened(3, self.splitting.kernel.order - 1, self.splitting.kernel.reach)


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
    return np.asarray(boxes.ravel()[place] + 1e-12 * sums[-1, -1])  # rounding of the differences
