"""Pixels of a map: maxima and their prominences, moments, holes, and implausible heights.

A hill consists of all pixels whose steepest way up ends at the same maximum. The rank of a pixel is
its place in ascending order of heights. For the method see docs/theory/surfaces.md, "Pruning".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array, diags_array
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.sparse.linalg import spsolve

from convexrough.arrays import Array, Indices
from convexrough.record import Record

#: Steps (row, column) from a pixel to four of its eight neighbours: they find each pair once.
PAIRS = ((0, 1), (1, 0), (1, 1), (1, -1))

#: Steps (row, column) from a pixel to the four neighbours with which it shares a side.
SIDES = ((0, 1), (1, 0), (0, -1), (-1, 0))

#: Standard deviations, estimated from the quartiles, by which a spike differs from the median.
OUTLYING = 6.0

#: Least ratio of the second difference at a spike to those at the other pixels of AROUND. At the
#: four nearest of them a spike causes a quarter of its own.
ALONE = 3.0
AROUND = np.arange(25).reshape(5, 5) != 12

#: A warning is given if at least this fraction of the rows equal the row before. At 1 the map is a
#: profile.
MANY_COPIED = 0.25

#: Approximate number of pixels in the sample in which `repeated` counts heights.
SAMPLE = 2**17


def centres(shape: tuple[int, ...], pixel: tuple[float, float]) -> tuple[Array, Array]:
    """[length] x of each column and y of each row of a map, measured from its middle."""
    y, x = (np.arange(count, dtype=np.float64) - (count - 1) / 2 for count in shape)
    return x * pixel[0], y * pixel[1]


class Hills(NamedTuple):
    """The maxima of a map, the tallest first."""

    pixels: Indices  # (n, 2) row and column
    #: (n,) [length] height above the highest pass to a taller maximum; of the tallest, above the
    #: lowest pixel of the map
    prominences: Array


def hills(heights: Array) -> Hills:
    """The pixels that are higher than all eight neighbours, and their prominences."""
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
    return Hills(pixels, prominences[prominent])


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
    # The passes are edges of the spanning tree that Kruskal's algorithm builds from the highest
    # crossing down.
    crossings = [_crossings(ranks, owners, step) for step in PAIRS]
    first, second, rank = (np.concatenate(each) for each in zip(*crossings, strict=True))
    highest_first = np.argsort(-rank)
    pairs, new = np.unique((first * count + second)[highest_first], return_index=True)
    weights = (ranks.size - rank[highest_first[new]]).astype(np.float64)  # from 1: 0 is no edge
    ends = np.array(np.divmod(pairs, count), dtype=np.intc)  # scipy < 1.17.1 accepts no other type
    graph = coo_array((weights, tuple(ends)), shape=(count, count))
    tree = minimum_spanning_tree(graph.tocsr()).tocoo()

    passes = np.zeros(count, dtype=np.intp)
    leader = list(range(count))  # for each hill, itself or a taller hill of its group

    def tallest(hill: int) -> int:
        while leader[hill] != hill:
            leader[hill] = leader[leader[hill]]
            hill = leader[hill]
        return hill

    down = np.argsort(tree.data, kind="stable")
    edges = zip(tree.row[down].tolist(), tree.col[down].tolist(), tree.data[down], strict=True)
    for one, other, weight in edges:
        taller, lower = sorted((tallest(one), tallest(other)))
        leader[lower] = taller
        passes[lower] = ranks.size - int(weight)
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
    """(m, 2) row and column of outlying pixels of which at most one neighbour differs from them by
    less than half of their difference from the median; and of pixels at which the second difference
    is outlying, and ALONE times as large as at other pixels nearby. Holes (nan) are neither, and
    single steps of quantised heights are no spikes."""
    bent = np.abs(ndimage.laplace(heights, mode="mirror"))
    unknown = np.where(np.isnan(bent), np.inf, bent)
    others = ndimage.maximum_filter(unknown, footprint=AROUND, mode="constant")
    least = max(OUTLYING * np.sqrt(np.nanmean(bent**2)), 6.0 * step(heights[~np.isnan(heights)]))
    alone = (bent > least) & (bent > ALONE * others)
    low, middle, high = np.nanquantile(heights, (0.25, 0.5, 0.75))
    away = np.abs(heights - middle)
    found = np.argwhere(away > OUTLYING * (high - low) / 1.349)
    padded = np.pad(heights, 1, mode="reflect")
    alike = np.zeros(len(found), dtype=int)
    for shift in np.ndindex(3, 3):
        apart = np.abs(padded[tuple((found + shift).T)] - heights[tuple(found.T)])
        alike += apart < away[tuple(found.T)] / 2  # this also counts the pixel itself
    alone[tuple(found[alike <= 2].T)] = True
    return np.argwhere(alone)


def flaws(heights: Array) -> Iterator[str]:
    """Warnings about heights that look wrong. Holes are nan."""
    known = heights[~np.isnan(heights)]
    if many := clipped(known):
        yield (
            f"the highest {many:,} pixels have exactly the same height: the map seems to be cut "
            "off at the top, where asperities touch, and their tip radii are wrong"
        )
    if many := repeated(known):
        yield (
            f"{many:,} pixels had exactly the same height in the data, many more than have any "
            "other height: if these are missing values, make them nan"
        )
    if MANY_COPIED <= (part := copied(heights)) < 1:
        yield (
            f"{part:.0%} of the rows or columns equal the one before: the map seems to be enlarged "
            "by repeating pixels, and tip radii are wrong; use the map as measured"
        )


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


def step(heights: Array) -> float:
    """[length] the distance of the values that heights take, as of grey levels, or 0: in a sample,
    each value occurs ten times on average, and nine in ten differences are about multiples of it.
    """
    sample = heights.ravel()[:: 1 + heights.size // SAMPLE]
    apart = np.diff(np.unique(sample))
    if not 0 < 10 * len(apart) < len(sample):
        return 0.0
    size = float(np.median(apart))
    return size if np.mean(np.abs(apart / size - np.rint(apart / size)) <= 0.1) >= 0.9 else 0.0


def copied(heights: Array) -> float:
    """The fraction of rows, not flat, that equal the row before; or that of columns if larger."""

    def part(lines: Array) -> float:
        equal = (lines[1:] == lines[:-1]).all(axis=1) & (np.ptp(lines[1:], axis=1) > 0)
        return float(equal.mean()) if len(equal) else 0.0

    return max(part(heights), part(heights.T))


def filled(heights: Array) -> Array:
    """The map with filled holes (nan): each is the mean of the pixels that share a side with it.

    So no filled pixel is higher than all pixels around it, except by rounding on a plateau. At
    least one pixel must have a height.
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
