"""Maxima and prominences against the words of the standard, taken literally on small maps."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from convexrough.surface.hills import hills

Map = NDArray[np.float64]
EIGHT = np.ones((3, 3))


def maxima(heights: Map) -> list[tuple[int, int]]:
    """Pixels above all of their eight neighbours, those of the edge included."""
    walled = np.pad(heights, 1, constant_values=-np.inf)
    return [
        (i, j)
        for i, j in np.ndindex(heights.shape)
        if (np.delete(walled[i : i + 3, j : j + 3].ravel(), 4) < heights[i, j]).all()
    ]


def flooded(heights: Map, peak: tuple[int, int]) -> float:
    """Height above the highest level at which the land about a maximum holds a taller one."""
    for level in np.sort(heights, axis=None)[::-1]:
        land, _ = ndimage.label(heights >= level, structure=EIGHT)
        if land[peak] and heights[land == land[peak]].max() > heights[peak]:
            return float(heights[peak] - level)
    return float(heights[peak] - heights.min())


def wolf(heights: Map, threshold: float) -> set[tuple[int, int]]:
    """Wolf pruning as the standard says it: the least high hill goes, and once more."""
    peaks = maxima(heights)
    hill = np.full(heights.shape, -1)
    for start in np.ndindex(heights.shape):
        i, j = start
        while (i, j) not in peaks:
            near = [
                (a, b)
                for a in range(max(i - 1, 0), min(i + 2, heights.shape[0]))
                for b in range(max(j - 1, 0), min(j + 2, heights.shape[1]))
            ]
            i, j = max(near, key=lambda place: heights[place])
        hill[start] = peaks.index((i, j))
    top = {n: heights[peak] for n, peak in enumerate(peaks)}
    while len(top) > 1:
        saddles: dict[int, tuple[float, int]] = {}
        for i, j in np.ndindex(heights.shape):
            for a, b in ((i, j + 1), (i + 1, j), (i + 1, j + 1), (i + 1, j - 1)):
                if 0 <= b < heights.shape[1] and a < heights.shape[0] and hill[i, j] != hill[a, b]:
                    level = min(heights[i, j], heights[a, b])
                    for one, other in ((hill[i, j], hill[a, b]), (hill[a, b], hill[i, j])):
                        saddles[one] = max(saddles.get(one, (-np.inf, -1)), (level, other))
        least = min(top, key=lambda n: top[n] - saddles[n][0])
        if top[least] - saddles[least][0] >= threshold:
            break
        hill[hill == least] = saddles[least][1]
        del top[least]
    return {peaks[n] for n in top}


def rough(seed: int, shape: tuple[int, int] = (14, 17), smooth: float = 0.7) -> Map:
    noise = np.random.default_rng(seed).standard_normal(shape)
    return np.asarray(ndimage.gaussian_filter(noise, smooth))


@pytest.mark.sample(3)
@pytest.mark.parametrize("seed", range(8))
def test_maxima_and_prominences(seed: int) -> None:
    heights = rough(seed, smooth=0.3 * (seed % 4))
    found = hills(heights)
    peaks = [(int(i), int(j)) for i, j in found.pixels]
    assert sorted(peaks) == sorted(maxima(heights))
    assert [heights[peak] for peak in peaks] == sorted(heights[tuple(found.pixels.T)])[::-1]
    np.testing.assert_array_equal(found.prominences, [flooded(heights, peak) for peak in peaks])


@pytest.mark.sample(3)
@pytest.mark.parametrize("seed", range(8))
def test_pruning_is_wolf_pruning(seed: int) -> None:
    heights = rough(100 + seed)
    found = hills(heights)
    for part in (0.01, 0.05, 0.2, 0.5, 0.9):
        threshold = part * np.ptp(heights)
        kept = {(int(i), int(j)) for i, j in found.pixels[found.prominences >= threshold]}
        assert kept == wolf(heights, threshold)


def test_a_plateau_is_one_hill() -> None:
    heights = np.zeros((9, 9))
    heights[2:4, 2:7] = heights[2:7, 5:7] = 1.0  # an L
    heights[6, 1] = 0.5
    found = hills(heights)
    assert found.prominences.tolist() == [1.0, 0.5]
    assert heights[tuple(found.pixels[0])] == 1.0
    assert found.pixels[1].tolist() == [6, 1]
