"""Summits: hills and their prominences, fitted tips, asperities, and Gaussian statistics."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy import ndimage

import convexrough as cr
from convexrough.sphere import ellipse
from convexrough.surface.pixels import hills
from convexrough.surface.summits import fit_tips

MAP = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=256)
PIXEL = (0.5, 0.3)
Map = NDArray[np.float64]
Place = tuple[int, int]


def test_summits_are_asperities_that_know_their_map() -> None:
    summits = MAP.summits(prune=0.05)
    assert isinstance(summits, cr.Asperities)
    origin = summits.origin
    assert origin.source == MAP.source
    assert (origin.prune, origin.fit, origin.shape) == (0.05, 3, (256, 256))
    counted = len(summits) + origin.pruned + origin.at_edge + origin.without_top
    assert counted == origin.maxima
    heights = MAP.heights[tuple(summits.pixels.T)]
    assert (np.diff(heights) < 0).all()
    assert (summits.prominences >= 0.05 * MAP.max_height).all()
    product = summits.largest_curvatures * summits.smallest_curvatures
    assert_allclose(summits.tip_radii, 1 / np.sqrt(product), rtol=1e-14)
    ratio = summits.smallest_curvatures / summits.largest_curvatures
    assert_allclose(1 - summits.eccentricities**2, ratio, rtol=1e-10)
    place = (summits.pixels[:, ::-1] - 127.5) * 1.0
    assert np.abs(summits.positions - place).max() <= 1.0
    assert np.abs(summits.heights - heights).max() < 0.05 * MAP.rms_height
    frame = summits.to_dataframe()
    np.testing.assert_array_equal(frame["tip_radius"], summits.tip_radii)
    assert frame.attrs == {"unit": ""}


def test_the_map_has_the_moments_of_its_spectrum() -> None:
    """Amplitudes are not random: variances are those of the waves to rounding, of every seed."""
    exact = cr.surface.self_affine_moments(0.8, 0.1, 32.0, pixels=256)
    assert_allclose(2 * exact.m2, 0.1**2, rtol=1e-13)
    for seed in range(3):
        surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed, pixels=256)
        assert_allclose(surface.moments.m0, exact.m0, rtol=1e-12)
        assert abs(surface.heights.mean()) < 1e-12
        around = np.pad(surface.heights, ((0, 0), (1, 1)), mode="wrap")
        slopes = np.gradient(around, axis=1)[:, 1:-1]
        assert np.mean(slopes**2) < exact.m2  # differences see less than derivatives


def test_summits_are_as_a_gaussian_surface_has_them() -> None:
    """Density, curvature and heights of all maxima against Nayak's theory."""
    options: Any = dict(hurst=0.8, rms_slope=0.1, rolloff=64.0, pixels=512, cutoff=16.0)
    exact = cr.surface.self_affine_moments(**options)
    maps = [cr.surface.self_affine(seed=seed, **options) for seed in range(12)]
    found = [each.summits(0.0).statistics for each in maps]
    density, curvature, height, spread = np.mean(found, axis=0)
    assert_allclose(density, exact.density, rtol=0.02)
    assert_allclose(curvature, exact.mean_curvature, rtol=0.04)
    assert_allclose(height, exact.mean_height, rtol=0.02)
    assert_allclose(spread, exact.height_std, rtol=0.03)


def test_round_tops_are_round_in_spite_of_rounding() -> None:
    """Many of these had curvatures in the wrong order, and a nan for their eccentricity."""
    x = np.arange(-3.0, 4.0)
    scales = np.random.default_rng(1).uniform(0.5, 2.0, 100)
    caps = np.hstack([-scale * (x**2 + x[:, None] ** 2) / 100 for scale in scales])
    summits = cr.surface.Surface(caps, 1.0).summits(0.0)
    assert len(summits) == 100
    assert (summits.eccentricities < 1e-6).all()
    assert (summits.elliptic_loads >= 1).all()


def around(heights: Map, place: Place) -> list[Place]:
    """The pixel and its up to eight neighbours."""
    rows, columns = (range(max(i - 1, 0), i + 2) for i in place)
    return [(i, j) for i in rows for j in columns if i < heights.shape[0] and j < heights.shape[1]]


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


@pytest.mark.parametrize("across", [3, 5, 7])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_a_paraboloid_is_found_exactly(across: int, scale: float) -> None:
    """Whatever the unit: top, height and both principal curvatures, of a turned paraboloid."""
    dx, dy = PIXEL[0] * scale, PIXEL[1] * scale
    x, y = np.meshgrid(np.arange(-5, 6) * dx, np.arange(-4, 5) * dy)
    x0, y0, angle, k1, k2 = 0.3 * dx, -0.4 * dy, 0.7, 3.0 / scale, 0.4 / scale
    u = np.cos(angle) * (x - x0) + np.sin(angle) * (y - y0)
    v = np.cos(angle) * (y - y0) - np.sin(angle) * (x - x0)
    heights = 2.0 * scale - k1 * u**2 / 2 - k2 * v**2 / 2
    tips = fit_tips(heights, np.array([[4, 5]]), (dx, dy), across)
    assert tips.whole.all()
    assert_allclose(tips.offsets[0], [x0, y0], rtol=1e-11)
    assert_allclose(tips.heights, 2.0 * scale, rtol=1e-13)
    assert_allclose(tips.curvatures[0], [k1, k2], rtol=1e-10)
    reach = across // 2
    near = np.s_[4 - reach : 5 + reach, 5 - reach : 6 + reach]
    sphere = 2.0 * scale - np.sqrt(k1 * k2) * ((x - x0) ** 2 + (y - y0) ** 2) / 2
    deviation = np.sqrt(np.mean((heights - sphere)[near] ** 2))
    assert_allclose(tips.deviations, deviation, rtol=1e-10)


@pytest.mark.parametrize("ratio", [1.001, 2.0, 40.0, 1e3])
def test_an_elliptic_contact_against_the_sphere_of_its_mean_radius(ratio: float) -> None:
    """At one approach; tests/sphere holds the approach against Legendre's integrals."""
    indentation = ellipse.approach(1.0, 1.0, ellipse.semi_axes(1.0, 1.0, (ratio, 1.0)))
    sphere = 4 / 3 * np.sqrt(np.sqrt(ratio)) * indentation**1.5
    assert_allclose(ellipse.load_ratio(ratio), 1 / sphere, rtol=1e-8)
