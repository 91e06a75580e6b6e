"""Holes of a map, filled by a harmonic function, and pixels with implausible heights."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import spsolve

from convexrough.arrays import Array, Indices

#: Steps (row, column) from a pixel to the four neighbours with which it shares a side.
SIDES = ((0, 1), (1, 0), (0, -1), (-1, 0))

#: Standard deviations, estimated from the quartiles, by which a spike differs from the median.
OUTLYING = 6.0

#: Approximate number of pixels in the sample in which `repeated` counts heights.
SAMPLE = 2**17


def spikes(heights: Array) -> Indices:
    """(m, 2) row and column of outlying pixels of which at most one neighbour differs from them by
    less than half of their difference from the median. Holes (nan) are neither."""
    low, middle, high = np.nanquantile(heights, (0.25, 0.5, 0.75))
    away = np.abs(heights - middle)
    found = np.argwhere(away > OUTLYING * (high - low) / 1.349)
    padded = np.pad(heights, 1, mode="reflect")
    alike = np.zeros(len(found), dtype=int)
    for step in np.ndindex(3, 3):
        apart = np.abs(padded[tuple((found + step).T)] - heights[tuple(found.T)])
        alike += apart < away[tuple(found.T)] / 2  # this also counts the pixel itself
    return found[alike <= 2]


def clipped(heights: Array) -> int:
    """Number of pixels with the largest height if they are ten, and more than just below; else 0.

    Just below are the pixels within 1 % of the range of heights, or those of the second largest.
    """
    top = heights.max()
    highest = int(np.count_nonzero(heights == top))
    following = heights.max(where=heights < top, initial=heights.min())
    near = int(np.count_nonzero(heights >= min(top - 0.01 * np.ptp(heights), following))) - highest
    return highest if highest >= 10 and highest > near else 0


def repeated(heights: Array) -> int:
    """The number of pixels with the most frequent height, below the largest, or 0 if it is not
    surprising: in a sample at least 20 times, and 5 times as often as any other height.
    """
    sample = heights.ravel()[:: 1 + heights.size // SAMPLE]
    values, counts = np.unique(sample, return_counts=True)
    most = int(np.argmax(counts))
    others = np.delete(counts, most).max(initial=1)
    if counts[most] < max(20, 5 * others) or values[most] == heights.max():
        return 0
    return int(np.count_nonzero(heights == values[most]))


def copied(heights: Array) -> float:
    """The fraction of rows, not flat, that equal the row before; or that of columns if larger."""

    def part(lines: Array) -> float:
        equal = (lines[1:] == lines[:-1]).all(axis=1) & (np.ptp(lines[1:], axis=1) > 0)
        return float(equal.mean()) if len(equal) else 0.0

    return max(part(heights), part(heights.T))


def filled(heights: Array) -> Array:
    """The map with filled holes (nan): each is the mean of the pixels that share a side with it.

    So no filled pixel becomes a summit. At least one pixel must have a height.
    """
    holes = np.isnan(heights)
    if (count := np.count_nonzero(holes)) == 0:
        return heights
    known, outside = -1, -2  # in the map of the numbers of holes
    number = np.full(heights.shape, known)
    number[holes] = np.arange(count)
    around = (np.argwhere(holes)[:, None] + 1 + SIDES).T  # in the padded maps
    neighbours = np.pad(number, 1, constant_values=outside)[*around].T
    sums = np.pad(np.where(holes, 0.0, heights), 1)[*around].sum(axis=0)
    row, side = np.nonzero(neighbours >= 0)
    between = coo_array((np.ones(len(row)), (row, neighbours[row, side])), shape=(count, count))
    own = diags_array((neighbours != outside).sum(axis=1, dtype=np.float64))
    mended = heights.copy()
    symmetric = (own - between).tocsc()
    mended[holes] = spsolve(symmetric, sums, permc_spec="MMD_AT_PLUS_A")  # twice as fast
    return mended
