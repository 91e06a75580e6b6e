"""The hills of a map, with positions and prominences of their maxima.

A hill consists of all pixels whose steepest way up ends at the same maximum. The rank of a pixel is
its place in ascending order of heights. For the method see docs/theory/surfaces.md, "Pruning".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import minimum_spanning_tree

from convexrough.arrays import Array, Indices

#: Steps (row, column) from a pixel to four of its eight neighbours: they find each pair once.
PAIRS = ((0, 1), (1, 0), (1, 1), (1, -1))


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
    highest_first = np.lexsort((-rank, second, first))
    first, second, rank = first[highest_first], second[highest_first], rank[highest_first]
    new = np.append(True, (np.diff(first) != 0) | (np.diff(second) != 0))[: len(first)]
    weights = (ranks.size - rank[new]).astype(np.float64)  # at least 1, because 0 means no edge
    graph = coo_array((weights, (first[new], second[new])), shape=(count, count))
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
