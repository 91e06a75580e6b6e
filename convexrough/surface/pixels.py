"""Pixels of a map: maxima and their prominences, moments, holes, and implausible heights.

A hill consists of all pixels whose steepest way up ends at the same maximum. The rank of a pixel is
its place in ascending order of heights. For the method see docs/theory/surfaces.md, "Pruning".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import spsolve

from convexrough.arrays import Array, Indices
from convexrough.record import Record

#: Steps (row, column) from a pixel to four of its eight neighbours: they find each pair once.
PAIRS = ((0, 1), (1, 0), (1, 1), (1, -1))

#: Steps (row, column) from a pixel to the four neighbours with which it shares a side.
SIDES = ((0, 1), (1, 0), (0, -1), (-1, 0))

#: Difference, over the rms difference of neighbours, by which a spike differs from its neighbours.
OUTLYING = 5.0

#: A warning is given if more than this part of the TALLEST maxima have a neighbour of equal height.
PLATEAUS, TALLEST = 0.67, 100


def centres(shape: tuple[int, ...], pixel: tuple[float, float]) -> tuple[Array, Array]:
    """[length] x of each column and y of each row of a map, measured from its middle."""
    y, x = (np.arange(count, dtype=np.float64) - (count - 1) / 2 for count in shape)
    return x * pixel[0], y * pixel[1]


def hills(heights: Array) -> tuple[Indices, Array]:
    """(n, 2) row and column of the pixels that are higher than all eight neighbours, the tallest
    first, and (n,) [length] their prominences, as in `Summits`."""
    # Pixels of equal height are ordered by position. So all maxima of a plateau but one have the
    # prominence 0, and are omitted.
    order = np.argsort(heights, axis=None, kind="stable")
    ranks: Indices = np.empty(heights.shape, dtype=np.intp)
    ranks.ravel()[order] = np.arange(heights.size)
    peaks, owners = _ascents(ranks, order)
    flat = heights.ravel()
    prominences = flat[peaks] - flat[order[_passes(ranks, owners, len(peaks))]]
    prominent = prominences > 0
    pixels = np.column_stack(np.unravel_index(peaks[prominent], heights.shape))
    return pixels, prominences[prominent]


def _ascents(ranks: NDArray[np.intp], order: Indices) -> tuple[Indices, Indices]:
    """The maxima, the tallest first; and for each pixel the number of the maximum of its hill."""
    highest = ndimage.maximum_filter(ranks, size=3, mode="nearest")
    above = order[highest.ravel()]
    while (further := above[above]).size and (further != above).any():
        above = further
    peaks = order[::-1][above[order[::-1]] == order[::-1]]
    names = np.empty(ranks.size, dtype=np.intp)
    names[peaks] = np.arange(len(peaks))
    return peaks, names[above].reshape(ranks.shape)


def _passes(ranks: NDArray[np.intp], owners: Indices, count: int) -> Indices:
    """(count,) rank of the highest pass from each maximum to a taller one; 0 for the tallest."""
    crossings = [_crossings(ranks, owners, step) for step in PAIRS]
    first, second, rank = (np.concatenate(each) for each in zip(*crossings, strict=True))
    highest_first = np.argsort(-rank)
    _, new = np.unique((first * count + second)[highest_first], return_index=True)
    kept = highest_first[np.sort(new)]  # the highest crossing of each pair of hills

    passes = np.zeros(count, dtype=np.intp)
    leader = list(range(count))  # for each hill, itself or a taller hill of its group

    def tallest(hill: int) -> int:
        while leader[hill] != hill:
            leader[hill] = leader[leader[hill]]
            hill = leader[hill]
        return hill

    # Kruskal's algorithm, from the highest crossing down, builds a spanning tree of the passes.
    edges = [each[kept].tolist() for each in (first, second, rank)]
    for one, other, level in zip(*edges, strict=True):
        taller, lower = sorted((tallest(one), tallest(other)))
        if taller != lower:
            leader[lower] = taller
            passes[lower] = level
    return passes


def _crossings(
    ranks: NDArray[np.intp], owners: Indices, step: tuple[int, int]
) -> tuple[Indices, Indices, Indices]:
    """For neighbouring pixels in different hills: the hills in order, and the lower rank."""
    (rows, columns), (down, right) = ranks.shape, step
    here = np.s_[: rows - down, max(0, -right) : columns - max(0, right)]
    there = np.s_[down:, max(0, right) : columns - max(0, -right)]
    apart = owners[here] != owners[there]
    one, other = owners[here][apart], owners[there][apart]
    rank = np.minimum(ranks[here][apart], ranks[there][apart])
    return np.minimum(one, other), np.maximum(one, other), rank


def spikes(heights: Array) -> Indices:
    """(m, 2) row and column of pixels that differ by more than OUTLYING times the rms difference of
    unequal neighbours from all of their neighbours, or from all but one. Holes are nan."""
    rows, columns = heights.shape
    around = np.pad(heights, 1, mode="reflect")
    nearest, second = np.full((2, *heights.shape), np.inf)
    squares = np.zeros(2)  # sum and number of squared differences
    for down, right in np.ndindex(3, 3):
        apart = np.abs(around[down : down + rows, right : right + columns] - heights)
        if (down, right) != (1, 1):
            squares += np.nansum(apart**2), np.count_nonzero(apart > 0)
            apart[np.isnan(apart)] = np.inf
            second = np.minimum(second, np.maximum(nearest, apart))
            nearest = np.minimum(nearest, apart)
    least = OUTLYING * np.sqrt(squares[0] / squares[1])
    return np.argwhere((second > least) & np.isfinite(second))


def flaws(heights: Array) -> Iterator[str]:
    """Warnings about heights that look wrong. Holes are nan."""
    _, counts = np.unique(heights[~np.isnan(heights)], return_counts=True)
    many, others = counts.max(), np.delete(counts, np.argmax(counts)).max(initial=1)
    if many >= max(10, 5 * others):
        yield (
            f"{many:,} pixels had exactly the same height in the data, many more than have any "
            "other height: if these are missing values, make them nan; if they are the highest, "
            "the map is cut off where asperities touch, and tip radii are wrong"
        )
    known = np.where(np.isnan(heights), -np.inf, heights)
    ring = np.arange(9).reshape(3, 3) != 4
    around = ndimage.maximum_filter(known, footprint=ring, mode="constant", cval=-np.inf)
    tops = np.flatnonzero(known >= around)
    tallest = tops[np.argsort(known.ravel()[tops])[-TALLEST:]]
    if np.mean(known.ravel()[tallest] == around.ravel()[tallest]) > PLATEAUS:
        yield (
            "most of the highest maxima are plateaus of pixels with equal heights (rounded to "
            "coarse steps, cut off, or repeated): summits and tip radii are wrong; use heights as "
            "measured, or try fit=5, or --fit 5"
        )


def filled(heights: Array) -> Array:
    """The map, which must have a height, with filled holes (nan): each is the mean of the pixels
    that share a side with it."""
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


@dataclass(frozen=True, repr=False)
class Moments(Record):
    """Moments of the profiles of a surface, and statistics of summits that follow from them.

    m0 : [length^2] variance of the heights
    m2 : mean square slope of profiles, averaged over profiles along x and along y
    m4 : [1/length^2] mean square second derivative of profiles, averaged likewise
    slope_ratio : rms slope along y divided by rms slope along x; 1 if the surface has no preferred
        direction

    The formulas (Nayak 1971, McCool 1987) hold for all maxima, without pruning, of an isotropic
    Gaussian surface that its pixels resolve.

    >>> moments = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=256).moments
    >>> print(f"{moments.bandwidth:.3g} {moments.m2:.4f}")
    3.96 0.0049
    """

    _shown = ("bandwidth", "density", "mean_curvature", "mean_height", "height_std")

    m0: float
    m2: float
    m4: float
    slope_ratio: float = 1.0

    @property
    def bandwidth(self) -> float:
        """Nayak's alpha = m0 m4 / m2^2: 1.5 for one wavelength, more for a broad spectrum."""
        return self.m0 * self.m4 / self.m2**2

    @property
    def density(self) -> float:
        """[1/length^2] number of maxima per area, m4 / (6 pi sqrt(3) m2)."""
        return float(self.m4 / (6 * np.pi * np.sqrt(3) * self.m2))

    @property
    def mean_curvature(self) -> float:
        """[1/length] mean curvature (k1 + k2) / 2 of the maxima, (8/3) sqrt(m4 / pi)."""
        return float(8 / 3 * np.sqrt(self.m4 / np.pi))

    @property
    def mean_height(self) -> float:
        """[length] mean height of the maxima above the mean plane, 4 sqrt(m0 / (pi alpha))."""
        return float(4 * np.sqrt(self.m0 / (np.pi * self.bandwidth)))

    @property
    def height_std(self) -> float:
        """[length] standard deviation of the maxima's heights, sqrt((1 - 0.8968 / alpha) m0)."""
        return float(np.sqrt(max(1 - 0.8968 / self.bandwidth, 0.0) * self.m0))


def moments_of(heights: Array, pixel: tuple[float, float]) -> Moments:
    """The moments of a map, from differences of neighbours, too small for waves of a few pixels."""
    across = [(1, pixel[0]), (0, pixel[1])]
    slopes = [np.mean((np.diff(heights, axis=axis) / step) ** 2) for axis, step in across]
    bends = [np.mean((np.diff(heights, 2, axis=axis) / step**2) ** 2) for axis, step in across]
    return Moments(
        m0=float(np.var(heights)),
        m2=float(np.mean(slopes)),
        m4=float(np.mean(bends)),
        slope_ratio=float(np.sqrt(slopes[1] / slopes[0])) if slopes[0] else float("inf"),
    )
