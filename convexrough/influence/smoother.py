"""An approximate inverse of I + W A W, to precondition conjugate gradients.

A is the compliance operator and W is diagonal. The approximate inverse is the matrix
M = I - v G (I - (I + b A)^-1) G v of docs/theory/newton.md, "The preconditioner". Here G^2 takes
means with Gaussian weights, v is W / d^(1/2) with a local mean d of W^2, and b is the median of d.
The Gaussian is as wide as a window of cells. Cells are those of the asperities' lattice, or
squares. The code computes M on blocks of m x m cells, which are smaller than a window, with the
mean of A over pairs of blocks. The constants are heuristics: they change the number of steps of
conjugate gradients, not the answer.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arrays import Array, Indices
from convexrough.influence.convolution import through_waves
from convexrough.influence.coupling import Smoother

Single = NDArray[np.float32]

#: Windows are chosen so large that the mean of W^2 over a window has about this relative variance.
SCATTER = 0.04

#: Width of the Gaussian that averages over as many cells as a window has, divided by the side of
#: the window.
WIDTH = 1.0 / np.sqrt(8.0 * np.pi)

#: Side of a window divided by the side of a block, so that blocks resolve the waves that the
#: Gaussian passes.
FINE = 3.5

#: Least side of a window. Its blocks have 2 x 2 cells, which cost a third of blocks of one cell.
LEAST_WINDOW = 2 * FINE

#: Side, in cells, of the windows on which the scatter of W^2 is measured.
WINDOW = 8

#: The side of cells is halved while the mean, over all points, of the number of points in the same
#: cell exceeds MOST_SHARING, but there are never more than MOST_CELLS cells per point. If
#: successive rows or columns with points are more than WIDEST_GAP cells apart, this distance is
#: shortened to WIDEST_GAP.
MOST_SHARING, MOST_CELLS, WIDEST_GAP = 4.0, 32, 8

#: Smaller eigenvalues of I + b A are set to this: A has negative eigenvalues for short waves.
LEAST = 0.2


def smoother_of_points(points: Array, scale: float, root: Array) -> Smoother:
    """M for asperities at arbitrary points, on square cells with about one asperity on average.

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
    return block_smoother(cells, np.eye(2), scale / side, root)


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


def block_smoother(cells: Indices, basis: Array, scale: float, root: Array) -> Smoother:
    """M for asperities in these cells (2, n) of a lattice, with the diagonal `root` (n,) of W.

    scale : the product A_ij r_ij, with the distances r_ij in the unit of `basis`
    """
    (i, j), (rows, columns) = cells, (cells.max(axis=1) + 1).tolist()
    squares = np.bincount(i * columns + j, root * root, minlength=rows * columns)
    window = _window(squares.reshape(rows, columns))
    m = int(window / FINE)
    shape = rows, columns = -(-rows // m), -(-columns // m)
    block = i // m * columns + j // m
    workers = threads.worthwhile(4 * rows * columns)

    def sums(values: NDArray[Any]) -> Single:
        """The sum of values (n,) over each block."""
        return np.bincount(block, values, rows * columns).astype(np.float32).reshape(shape)

    total = sums(root * root)  # W^2 summed over each block
    touching = total > 0
    counts = sums(root > 0)[touching].astype(np.float64)
    count, sharing = float(counts.mean()), float(counts @ counts / counts.sum())
    # In blocks with many asperities, this estimates A W r within a block for r of random signs.
    rough = scale / m * np.sqrt(np.pi * sharing * np.log(max(0.5 * sharing / (m * m), 1.0)))
    size, spectrum = _block_spectrum(shape, basis, m, count, workers)
    w = root.astype(np.float32)
    touched = (w > 0).astype(np.float32)
    passed = _low_pass(size, basis * m, WIDTH * window / m)
    mean = _local_mean(total, touching, size, passed, workers)
    q = np.divide(w, np.sqrt(mean).ravel()[block], out=np.zeros_like(w), where=w > 0)

    middle = np.float32(np.sqrt(np.median(mean[touching])))
    displacement = np.float32(scale) * middle * spectrum  # b^(1/2) A, for each wave
    removed = 1.0 - 1.0 / np.maximum(1.0 + middle * displacement, np.float32(LEAST))
    removed *= passed
    energies = displacement * displacement
    energies[:, 1 : (size[1] + 1) // 2] *= 2  # each wave stands for its conjugate, too
    energies *= np.float32(m * m / (size[0] * size[1]))

    def smooth(values: NDArray[Any]) -> tuple[NDArray[Any], float]:
        left = np.zeros(removed.shape[1])

        def remove(waves: list[NDArray[Any]], each: slice) -> list[NDArray[Any]]:
            power = np.square(waves[0].real)
            power += np.square(waves[0].imag)
            left[each] = np.einsum("ij,ij->j", power, energies[:, each])
            waves[0] *= removed[:, each]
            return waves

        field = through_waves([sums(q * values)], size, workers, remove)[0]
        averages = np.ascontiguousarray(field[:, :columns]).ravel()[block]
        averages *= q
        np.subtract(values, averages, out=averages)
        averages *= touched
        waves, inner = np.sqrt(left.sum()), rough * np.linalg.norm(w * values) if rough else 0.0
        return averages, float(np.hypot(waves, inner))

    return smooth


def _window(squares: NDArray[Any]) -> float:
    """The side of windows over which the mean of W^2 has the relative variance `SCATTER`."""
    m = WINDOW
    rows, columns = (max(1, length // m) for length in squares.shape)
    inside = squares[: rows * m, : columns * m]
    height, width = (min(m, length) for length in inside.shape)
    windows = inside.reshape(rows, height, columns, width)
    mean = windows.mean(axis=(1, 3), dtype=np.float64)
    variance = (windows * windows).mean(axis=(1, 3), dtype=np.float64) - mean * mean
    if not mean.any():
        return LEAST_WINDOW
    scatter = float(variance.sum() / (mean * mean).sum())
    return max(LEAST_WINDOW, float(np.sqrt(scatter / SCATTER)))


def _low_pass(size: tuple[int, int], basis: Array, width: float) -> Single:
    """The factors by which G^2 multiplies waves, for a Gaussian of this width [spacing]."""
    dual = 2.0 * np.pi * np.linalg.inv(basis).T
    i, j = (np.fft.fftfreq(n) for n in size)
    i, j = i[:, None], np.abs(j[: size[1] // 2 + 1])
    squares = np.full(np.broadcast(i, j).shape, np.inf)
    for a in (-1, 0, 1):  # of waves with equal values at all sites, the longest counts
        for b in (-1, 0, 1):
            x, y = ((i + a) * dual[0, k] + (j + b) * dual[1, k] for k in (0, 1))
            np.minimum(squares, x * x + y * y, out=squares)
    step = width * float(np.hypot(*basis.T).min())
    return np.exp(-squares * step**2).astype(np.float32)


def _local_mean(
    sums: Single, touching: NDArray[np.bool_], size: tuple[int, int], passed: Single, workers: int
) -> Single:
    """The field d for which the local mean of `sums` / d is about 1 wherever asperities touch.

    passed : the factor of G^2 for each wave
    """

    def average(waves: list[NDArray[Any]], each: slice) -> list[NDArray[Any]]:
        waves[0] *= passed[:, each]
        return waves

    mean = np.ones_like(sums)
    for power in (1.0, 0.5, 0.5, 0.5):  # like scaling a symmetric matrix to row sums of 1
        parts = np.where(touching, sums / mean, np.float32(0))
        local = through_waves([parts], size, workers, average)[0][:, : sums.shape[1]]
        mean *= np.maximum(local, np.float32(1e-3) * local.max()) ** np.float32(power)
    return mean


def _block_spectrum(
    blocks: tuple[int, int], basis: Array, m: int, count: float, workers: int
) -> tuple[tuple[int, int], Single]:
    """The size of a periodic box, and the spectrum of the mean of 1 / r over pairs of its blocks.

    count : mean number of touching asperities in a block
    """
    from scipy import fft

    rows, columns = (fft.next_fast_len(length, real=True) for length in blocks)
    i, j = differences(rows), differences(columns)
    x = np.add.outer(i * (m * basis[0, 0]), j * (m * basis[1, 0]))
    y = np.add.outer(i * (m * basis[0, 1]), j * (m * basis[1, 1]))
    x[0, 0] = np.inf
    mean = (1.0 / np.hypot(x, y)).astype(np.float32)
    site = np.stack(np.meshgrid(np.arange(m), np.arange(m)), axis=-1).reshape(-1, 2)
    pairs = (site[:, None] - site).reshape(-1, 2)
    for a in range(-min(2, (rows - 1) // 2), min(2, (rows - 1) // 2) + 1):
        for b in range(-min(2, (columns - 1) // 2), min(2, (columns - 1) // 2) + 1):
            r = np.hypot(*((pairs + np.array([a * m, b * m])) @ basis).T)
            apart = r > 0
            mean[a, b] = float((1.0 / r[apart]).sum()) / int(apart.sum())
    mean[0, 0] *= max(0.0, 1.0 - 1.0 / count)
    spectrum: Any = fft.rfft2(mean, workers=workers).real
    return (rows, columns), np.ascontiguousarray(spectrum)


def differences(length: int) -> NDArray[np.int64]:
    """The array 0, 1, ..., -2, -1: index differences modulo `length`, those nearest to 0."""
    i = np.arange(length)
    return np.where(i <= (length - 1) // 2, i, i - length)
