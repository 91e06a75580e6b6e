"""Maxima and prominences against the words of the standard, taken literally on small maps."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from convexrough.surface.pixels import hills

Map = NDArray[np.float64]
Place = tuple[int, int]


def around(heights: Map, place: Place) -> list[Place]:
    """The pixel and its up to eight neighbours."""
    ranges = [
        range(max(i - 1, 0), min(i + 2, n)) for i, n in zip(place, heights.shape, strict=True)
    ]
    return [(i, j) for i in ranges[0] for j in ranges[1]]


def wolf(heights: Map) -> dict[Place, float]:
    """Wolf pruning as the standard says it: the least high hill goes, and once more."""
    summit = {}  # of the hill of each pixel: the way up from it ends there
    for start in np.ndindex(heights.shape):
        place, above = start, max(around(heights, start), key=heights.item)
        while above != place:
            place, above = above, max(around(heights, above), key=heights.item)
        summit[start] = place
    left, gone = set(summit.values()), {}
    while len(left) > 1:
        saddles: dict[Place, tuple[float, Place]] = {}
        for one in np.ndindex(heights.shape):
            for other in around(heights, one):
                if summit[one] != summit[other]:
                    saddle = min(heights[one], heights[other]), summit[other]
                    saddles[summit[one]] = max(saddles.get(summit[one], saddle), saddle)
        least = min(left, key=lambda peak: heights[peak] - saddles[peak][0])
        level, taken_by = saddles[least]
        gone[least] = float(heights[least] - level)
        left.remove(least)
        summit = {place: taken_by if it == least else it for place, it in summit.items()}
    assert list(gone.values()) == sorted(gone.values())  # so a threshold keeps the rest of them
    (last,) = left
    return gone | {last: float(heights[last] - heights.min())}


@pytest.mark.sample(6)
@pytest.mark.parametrize("seed", range(16))
def test_pruning_is_wolf_pruning(seed: int) -> None:
    noise = np.random.default_rng(seed).standard_normal((14, 17))
    heights = np.asarray(ndimage.gaussian_filter(noise, 0.3 * (seed % 4)))
    found = hills(heights)
    peaks = [(int(i), int(j)) for i, j in found.pixels]
    assert dict(zip(peaks, found.prominences.tolist(), strict=True)) == wolf(heights)
    assert [heights[peak] for peak in peaks] == sorted(heights[tuple(found.pixels.T)])[::-1]


def test_a_plateau_is_one_hill() -> None:
    heights = np.zeros((9, 9))
    heights[2:4, 2:7] = heights[2:7, 5:7] = 1.0  # an L
    heights[6, 1] = 0.5
    found = hills(heights)
    assert found.prominences.tolist() == [1.0, 0.5]
    assert heights[tuple(found.pixels[0])] == 1.0
    assert found.pixels[1].tolist() == [6, 1]
