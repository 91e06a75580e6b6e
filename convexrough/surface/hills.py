"""The hills of a map: where its maxima are, and how far each stands above the way to a taller one.

Wolf pruning (ISO 25178-2, ISO 16610-85) joins the hill that is least high above its highest saddle
to the hill beyond that saddle, and begins again, until every hill left is high enough. The least
high hill always has a taller one beyond its saddle, as that saddle bounds the other hill, too.
Hence a hill falls exactly if its maximum is less than the threshold above the highest pass on any
way to a taller maximum: its *prominence*. That is one number per maximum, whatever the threshold,
and one sort of the passes gives all of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import minimum_spanning_tree

from convexrough.arrays import Array, Indices

#: A pixel and half of its eight neighbours: every pair of neighbours once, as (row, column) steps.
PAIRS = ((0, 1), (1, 0), (1, 1), (1, -1))


class Hills(NamedTuple):
    """The maxima of a map, tallest first.

    pixels      : (n, 2) row and column
    prominences : (n,) [length] above the highest pass to a taller one; of the tallest, above the
        lowest pixel of the map
    """

    pixels: Indices
    prominences: Array


def hills(heights: Array) -> Hills:
    """The pixels that are higher than all eight neighbours, and their prominences.

    Pixels of equal height are told apart by their places, so that a plateau is one hill: of its
    maxima all but one have prominence 0, and these are left out.
    """
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
    """Maxima, tallest first, and which of them the steepest way up leads to from each pixel."""
    highest = ndimage.maximum_filter(ranks, size=3, mode="nearest")
    above = order[highest.ravel()]
    while (further := above[above]).size and (further != above).any():
        above = further
    peaks = order[::-1][above[order[::-1]] == order[::-1]]
    names = np.empty(ranks.size, dtype=np.intp)
    names[peaks] = np.arange(len(peaks))
    return peaks, names[above].reshape(ranks.shape)


def _passes(ranks: NDArray[np.intp], owners: Indices, count: int) -> Indices:
    """(count,) rank of the highest pass from each maximum to a taller one; 0 for the tallest.

    A way between two maxima crosses from hill to hill at pairs of neighbours, and inside a hill it
    can keep above where it enters. So the hills and the highest crossing of each two are enough,
    and of these a tree that spans them (Kruskal).
    """
    crossings = [_crossings(ranks, owners, step) for step in PAIRS]
    first, second, rank = (np.concatenate(each) for each in zip(*crossings, strict=True))
    highest_first = np.lexsort((-rank, second, first))
    first, second, rank = first[highest_first], second[highest_first], rank[highest_first]
    new = np.append(True, (np.diff(first) != 0) | (np.diff(second) != 0))[: len(first)]
    weights = (ranks.size - rank[new]).astype(np.float64)  # at least 1: none counts as missing
    graph = coo_array((weights, (first[new], second[new])), shape=(count, count))
    tree = minimum_spanning_tree(graph.tocsr()).tocoo()

    passes = np.zeros(count, dtype=np.intp)
    leader = list(range(count))  # of each joined group the tallest, which has the least number

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
    """Pairs of neighbours in two hills: the lower number, the higher, and the lower rank."""
    (rows, columns), (down, right) = ranks.shape, step
    here = np.s_[: rows - down, max(0, -right) : columns - max(0, right)]
    there = np.s_[down:, max(0, right) : columns - max(0, -right)]
    apart = owners[here] != owners[there]
    one, other = owners[here][apart], owners[there][apart]
    rank = np.minimum(ranks[here][apart], ranks[there][apart])
    return np.minimum(one, other), np.maximum(one, other), rank
