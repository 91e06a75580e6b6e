"""An approximate inverse of I + W A W, to precondition conjugate gradients.

A is the compliance operator and W is diagonal. The approximate inverse is the matrix
M = I - v G (I - (I + b A)^-1) G v of docs/theory/newton.md, "The preconditioner". Here G^2 takes
means with Gaussian weights, v is W / d^(1/2) with d = G^2 W^2, and b is the median of d. Cells are
those of the asperities' lattice, or squares. The code computes M on blocks of 2 x 2 cells, with the
mean of A over pairs of blocks. The constants are heuristics: they change the number of steps of
conjugate gradients, not the answer.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arrays import Array, Indices
from convexrough.influence.convolution import through_waves
from convexrough.influence.coupling import Smoother

Single = NDArray[np.float32]

#: The Gaussian averages over as many cells as a square window with this side, in cells. A wider
#: Gaussian would be better where W varies more.
WINDOW = 9.0

#: Side of a block in cells. Blocks resolve the waves that the Gaussian passes.
BLOCK = 2

#: The side of cells is halved while the mean, over all points, of the number of points in the same
#: cell exceeds MOST_SHARING, but there are never more than MOST_CELLS cells per point. If
#: successive rows or columns with points are more than WIDEST_GAP cells apart, this distance is
#: shortened to WIDEST_GAP.
MOST_SHARING, MOST_CELLS, WIDEST_GAP = 4.0, 32, 8

#: Smaller eigenvalues of I + b A are set to this: A has negative eigenvalues for short waves.
LEAST = 0.2


def blocks_of_points(points: Array, scale: float) -> Blocks:
    """Blocks of square cells with about one asperity on average, for arbitrary points (n, 2).

    If points are in clusters, cells are smaller, and wide empty strips are left out.
    """
    away, n = points - points.min(axis=0), len(points)
    width, height = away.max(axis=0).tolist()
    side = max(np.sqrt(width * height / n), (width + height) / n)
    cells = _packed_cells(away / side)
    while _mean_sharing(cells) > MOST_SHARING:
        finer = _packed_cells(away / (0.5 * side))
        if np.prod(finer.max(axis=1) + 1) > MOST_CELLS * n:
            break
        side, cells = 0.5 * side, finer
    return Blocks.of(cells, np.eye(2), scale / side)


def _packed_cells(places: Array) -> Indices:
    """(2, n) row and column of the cell of each place (n, 2) [cell]; wide gaps are shortened."""
    cells = []
    for axis in places.T:
        used, which = np.unique(axis.astype(np.int64), return_inverse=True)
        cells.append(np.minimum(np.diff(used, prepend=used[0]), WIDEST_GAP).cumsum()[which])
    return np.array(cells)


def _mean_sharing(cells: Indices) -> float:
    """The mean, over all points, of the number of points in the same cell."""
    counts = np.bincount(cells[0] * (cells[1].max() + 1) + cells[1])
    return float(counts @ counts / cells.shape[1])


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of BLOCK x BLOCK cells with asperities, and what M needs of them for any W."""

    block: Indices  # (n,) index of the block of each asperity in a `field`
    shape: tuple[int, int]  # numbers of rows and columns of blocks
    size: tuple[int, int]  # size of the transforms
    scale: float  # the product A_ij r_ij, with the distances r_ij in cells
    passed: Single  # factors by which G^2 multiplies waves
    spectrum: Single  # transform of the mean of 1 / r over pairs of different blocks
    own: float  # mean of 1 / r over two different asperities of one block

    @classmethod
    def of(cls, cells: Iterable[Indices], basis: Array, scale: float) -> Blocks:
        """For asperities in these cells of a lattice: (n,) rows and (n,) columns.

        basis : reduced, with a shorter vector of length 1
        scale : the product A_ij r_ij, with the distances r_ij in the unit of `basis`
        """
        from scipy.fft import next_fast_len

        i, j = (each // BLOCK for each in cells)
        rows, columns = int(i.max()) + 1, int(j.max()) + 1
        size = next_fast_len(rows, real=True), next_fast_len(columns, real=True)
        block = i * _stride(size) + j
        spectrum, own = _block_spectrum(size, basis)
        return cls(block, (rows, columns), size, scale, _low_pass(size, basis), spectrum, own)

    def _sums(self, values: NDArray[Any]) -> Single:
        """The field of the sums of values (n,) over each block."""
        rows, stride = self.shape[0], _stride(self.size)
        sums = np.bincount(self.block, values, rows * stride)
        return sums.astype(np.float32).reshape(rows, stride)

    def smoother(self, root: Array) -> Smoother:
        """M for the diagonal `root` (n,) of W."""
        size, workers = self.size, threads.worthwhile(4 * math.prod(self.shape))
        passed, block = self.passed, self.block
        total = self._sums(root * root)  # W^2 summed over each block
        touching = total > 0
        counts = self._sums(root > 0)[touching].astype(np.float64)

        def average(waves: list[NDArray[Any]], each: slice) -> list[NDArray[Any]]:
            waves[0] *= passed[:, each]
            return waves

        mean = through_waves([total], size, workers, average)[0]
        least = np.float32(1e-3) * mean[:, : self.shape[1]].max()
        mean = np.maximum(mean, least)  # d; rounding may make it negative
        w = root.astype(np.float32)
        q = w / np.sqrt(mean.take(block))

        middle = np.float32(np.sqrt(np.median(mean[touching])))
        own = self.own * max(0.0, 1.0 - 1.0 / float(counts.mean()))
        # b^(1/2) A, for each wave:
        displacement = np.float32(self.scale) * middle * (self.spectrum + np.float32(own))
        removed = 1.0 - 1.0 / np.maximum(1.0 + middle * displacement, np.float32(LEAST))
        removed *= passed

        def remove(waves: list[NDArray[Any]], each: slice) -> list[NDArray[Any]]:
            waves[0] *= removed[:, each]
            return waves

        def smooth(values: NDArray[Any]) -> NDArray[Any]:
            field = through_waves([self._sums(q * values)], size, workers, remove)[0]
            averages = field.take(block)
            averages *= q
            np.subtract(values, averages, out=averages)
            return averages

        return smooth


def _stride(size: tuple[int, int]) -> int:
    return 2 * (size[1] // 2 + 1)  # as in a `SiteBox.field`


def _low_pass(size: tuple[int, int], basis: Array) -> Single:
    """The factors by which G^2 multiplies waves."""
    dual = 2.0 * np.pi * np.linalg.inv(BLOCK * basis).T
    i, j = np.fft.fftfreq(size[0])[:, None], np.fft.rfftfreq(size[1])
    x, y = (i * dual[0, k] + j * dual[1, k] for k in (0, 1))
    passed: Array = np.exp(-(x * x + y * y) * (WINDOW**2 / (8.0 * np.pi)))
    return passed.astype(np.float32)


def _block_spectrum(size: tuple[int, int], basis: Array) -> tuple[Single, float]:
    """The spectrum of the mean of 1 / r over pairs of different blocks, about; and this mean over
    pairs of cells in one block."""
    from scipy import fft

    i, j = (BLOCK * np.fft.ifftshift(np.arange(n) - n // 2) for n in size)
    x, y = (np.add.outer(i * basis[0, k], j * basis[1, k]) for k in (0, 1))
    x[0, 0] = np.inf
    mean = (1.0 / np.hypot(x, y)).astype(np.float32)
    a, b = basis
    sides, diagonals = np.hypot(*basis.T), np.hypot(*np.transpose([a + b, a - b]))
    spectrum: Any = fft.rfft2(mean).real
    own = ((2.0 / sides).sum() + (1.0 / diagonals).sum()) / 6.0  # six pairs of cells
    return np.ascontiguousarray(spectrum), float(own)
