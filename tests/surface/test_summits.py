"""Summits as asperities, and the generator whose spectrum is known."""

import numpy as np
from numpy.testing import assert_allclose

import convexrough as cr

MAP = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=256)


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
    options = dict(hurst=0.8, rms_slope=0.1, rolloff=64.0, pixels=512, cutoff=16.0)
    exact = cr.surface.self_affine_moments(**options)  # type: ignore[arg-type]
    found = [
        cr.surface.self_affine(seed=seed, **options).summits(0.0).statistics  # type: ignore[arg-type]
        for seed in range(12)
    ]
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
