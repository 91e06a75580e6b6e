"""Maps, what is removed and what is no map; summits, their tips, and Gaussian statistics."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy import ndimage

import convexrough as cr
from convexrough.surface.pixels import filled, flaws, hills, spikes
from convexrough.surface.summits import fit_tips

RNG = np.random.default_rng(5)
NOISE = 1e-3 * RNG.standard_normal((40, 60))
PIXEL = (0.5, 0.7)
Y, X = np.mgrid[-19.5:20, -29.5:30] * np.reshape(PIXEL[::-1], (2, 1, 1))
MADE = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=128).heights + 50.0


def test_a_plane_is_removed_and_said() -> None:
    plane = cr.surface.Surface(3 + 0.2 * X - 0.1 * Y + NOISE, PIXEL).detrend()
    (removed,) = plane.removed
    assert (removed.kind, removed.radius) == ("plane", np.inf)
    assert_allclose(removed.slopes, (0.2, -0.1), atol=1e-4)
    assert_allclose(removed.height, 3.0, atol=1e-3)
    for term in (np.ones_like(X), X, Y):  # a least-squares fit leaves nothing of its terms
        assert abs(np.vdot(plane.heights, term)) < 1e-9
    assert_allclose(plane.rms_height, NOISE.std(), rtol=1e-2)
    with pytest.raises(cr.InputError, match="detrend: found 'cone', expected \"plane\", "):
        plane.detrend("cone")  # type: ignore[arg-type]


@pytest.mark.parametrize("radius", [25.0, -25.0, 400.0])
def test_a_sphere_is_removed_and_said(radius: float) -> None:
    """A deep cap, half as steep as it can be, off the middle; a bowl; and nearly a plane."""
    cap = np.sign(radius) * np.sqrt(radius**2 - (X - 2) ** 2 - (Y + 1) ** 2)
    exact = cr.surface.Surface(cap + 1e-9 * NOISE, PIXEL).detrend("sphere")
    removed = exact.removed[0]
    assert_allclose(removed.radius, radius, rtol=1e-9)
    assert_allclose(removed.height, cap[19:21, 29:31].mean(), rtol=1e-3)
    assert exact.max_height < 2e-11
    rough = cr.surface.Surface(cap + NOISE, PIXEL).detrend("sphere")
    assert_allclose(rough.removed[0].radius, radius, rtol=5e-3)
    assert_allclose(rough.rms_height, NOISE.std(), rtol=1e-2)


def test_no_map() -> None:
    square, diagonal = NOISE[:5, :5], np.eye(5) > 0
    changed: dict[str, Any]
    for changed, message in (
        ({"heights": np.where(diagonal, np.nan, square)}, r"5 holes \(nan\) in 25 pixels"),
        ({"heights": np.where(diagonal, np.inf, square)}, "inf in row 1, column 1"),
        ({"heights": NOISE[0]}, r"shape \(60,\), expected rows and columns"),
        ({"heights": [["a", "b"], ["c", "d"]]}, "expected numbers"),
        ({"heights": NOISE * 1j}, "expected numbers"),
        *(({"unit": unit}, f"^unit: found .?{unit}") for unit in ("parsec", None)),
        ({"filled_pixels": np.zeros((20, 20))}, "^filled_pixels: found"),
        ({"pixel": np.ones((3, 2))}, "^pixel: found"),
    ):
        with pytest.raises(cr.InputError, match=message):
            cr.surface.Surface(**{"heights": NOISE, "pixel": 1.0} | changed)


def test_a_paraboloid_of_a_turned_cylinder() -> None:
    across = 0.8 * X + 0.6 * Y
    surface = cr.surface.Surface(0.1 * X - across**2 / 500 + NOISE, PIXEL, "mm")
    (removed,) = surface.detrend("paraboloid").removed
    assert_allclose(removed.curvatures, (1 / 250, 0.0), atol=1e-5)
    assert_allclose(removed.angle, np.degrees(np.arctan2(0.6, 0.8)), atol=0.5)
    assert_allclose(removed.slopes, (0.1, 0.0), atol=1e-3)
    metres = surface.detrend("paraboloid").to_unit("m")
    assert_allclose(metres.removed[0].curvatures, np.multiply(1e3, removed.curvatures))


def test_a_trend_that_explains_most_is_named() -> None:
    ball, tilt = -(X**2 + Y**2) / 400, 0.3 * X
    spheres = [(each, "sphere") for each in (ball, ball + tilt / 10, -ball)]
    for trend, kind in ((tilt, "plane"), (-(X**2) / 300 + tilt, "paraboloid"), *spheres):
        surface = cr.surface.Surface(trend + NOISE, PIXEL)
        said = f'explains 100 % of the variance of the heights: detrend="{kind}"'
        assert said in str(surface.warnings)
        assert "warning" in repr(surface)
        assert surface.detrend(kind).warnings == ()
    assert surface.detrend("plane").warnings[0].startswith("a sphere of radius -2")
    assert cr.surface.Surface(NOISE, 1.0).warnings == ()
    for seed in range(3):
        assert cr.surface.self_affine(0.8, 0.1, 256.0, seed).warnings == ()


def test_a_ridge_has_no_top() -> None:
    """The Hessian of the fitted paraboloid is singular, and positive by rounding."""
    heights = np.full((7, 7), -9.0)
    heights[2:5, 2:5] = [[-1, -3, 0], [-2, 1, -3], [-2, -1, -1]]
    with pytest.raises(cr.InputError, match="without a fitted maximum"):
        cr.surface.Surface(heights, 1.0).summits()


def test_a_map_pressed_whole_is_hertz_where_it_is_smooth() -> None:
    """Oblong pixels; load and area, and the half axes on an ellipsoid."""
    flat = cr.surface.Surface(1e-9 * RNG.standard_normal((201, 161)), (1.0, 1.2))

    def scene(surface: cr.surface.Surface, radius: float | tuple[float, float] = 1e4) -> cr.Scene:
        single = cr.surface.Summits([[0.0, 0.0]], 1e9, 0.0, origin=surface.summits().origin)
        return cr.Scene(radius, single, cr.Material(2.0, 0.3))

    contact = cr.press(scene(flat), approach=0.1)
    whole = cr.surface.press_whole(flat, contact)
    assert_allclose(whole.load, contact.load, rtol=5e-4)
    assert_allclose(whole.area, np.pi * 1e3, rtol=0.02)
    assert (whole.pieces, whole.resolution < 2e-3) == (1, True)
    assert_allclose(whole.loads.sum(), whole.load, rtol=1e-12)
    assert "of the asperities" in repr(whole)
    ellipsoid = cr.press(scene(flat, (1e4, 1.2e4)), approach=0.1)
    across = np.argwhere(cr.surface.press_whole(flat, ellipsoid).pressures > 0)
    height, width = np.ptp(across, axis=0) + 1
    assert_allclose(1.2 * height / width, 1.2 ** (2 / 3), rtol=0.04)  # Johnson 1985, eq. 4.28
    low = cr.surface.Surface(flat.heights - 1e-6, (1.0, 1.2))
    for approach, said in ((3.0, "edge of the map.*or no --whole"), (1e-12, "no pixel that")):
        with pytest.raises(cr.InputError, match=said):
            cr.surface.press_whole(low, cr.press(scene(low), approach=approach))


def test_holes_become_soap_films() -> None:
    """A harmonic map comes back as it was, and no filled pixel is a maximum."""
    saddle = X**2 / 0.25 - Y**2 / 0.49  # harmonic for the pixels, too
    holed = saddle.copy()
    holed[10:20, 5:30] = holed[30, 40] = np.nan
    assert_allclose(filled(holed), saddle, atol=1e-8 * np.ptp(saddle))
    rough = RNG.standard_normal((30, 30))
    rough[RNG.random((30, 30)) < 0.4] = np.nan
    rough[:6, :6] = np.nan  # a corner, where neighbours are missing
    mended = filled(rough)
    at = cr.surface.Surface(mended, 1.0).summits(0.0).pixels
    assert not np.isnan(rough[tuple(at.T)]).any()
    assert np.nanmin(rough) <= mended.min() <= mended.max() <= np.nanmax(rough)
    assert_allclose(mended[~np.isnan(rough)], rough[~np.isnan(rough)], rtol=0)


def test_spikes_and_drop_outs_are_named() -> None:
    """Single pixels and pairs; no feature of the map, not even a groove one pixel wide."""
    grooved = MADE.copy()
    grooved[40] -= 30.0
    grooved[60:70, 60:70] += 30.0
    assert cr.surface.Surface(grooved, 10.0).warnings == ()
    (steep,) = cr.surface.Surface(grooved, 1.0).warnings
    assert steep.startswith("rms slope 4.05: surfaces steeper than 1 are rare")
    (flat,) = cr.surface.Surface(1e-3 * MADE, 1.0).warnings
    assert flat.startswith("rms slope 9.95e-05: surfaces flatter than 0.0003 are rare")
    grooved[7, 9:11] = 0.0
    grooved[90, 0] = 80.0
    (said,) = cr.surface.Surface(grooved, 10.0).warnings
    assert said.startswith("spikes or drop-outs: 3 pixels far from their neighbours, the first in")
    assert "in row 8, column 10; make them nan and use fill=True, or --fill" in said
    places = np.array([[3, 0], [20, 30], [50, 50], [70, 10], [99, 99]])
    for seed in range(5):
        rng = np.random.default_rng(seed)
        smooth = ndimage.gaussian_filter(rng.normal(size=(100, 100)), 3.0)
        holed = np.where(rng.random(smooth.shape) < 0.1, np.nan, smooth)
        for steps in (1, 4, 100):
            assert len(spikes(np.rint(steps * smooth / smooth.std()))) == 0
        assert len(spikes(smooth)) == len(spikes(holed)) == 0
        smooth[tuple(places.T)] += 3 * smooth.std() * np.array([1, -1, 1, -1, 1])
        assert (spikes(smooth) == places).all()


def test_equal_heights_are_named() -> None:
    """Missing values, flat tops, coarse steps and repeated pixels; also without a plane."""
    missing = np.where(RNG.random(MADE.shape) < 0.02, MADE.min() - 1.0, MADE)
    cut = np.minimum(MADE, np.quantile(MADE, 0.999))
    few = MADE.copy()
    few.flat[::500] = 0.0
    for heights in (missing, cut, few):
        count = (heights == (heights.max() if heights is cut else heights.min())).sum()
        for surface in (at := cr.surface.Surface(heights, 10.0), at.detrend("plane")):
            assert f"{count:,} pixels had exactly the same height" in str(surface.warnings)
    enlarged = (np.kron(MADE, np.ones((2, 1))), MADE[:, np.arange(150) * 2 // 3])
    steps = [np.rint(MADE / np.ptp(MADE) * levels) for levels in (40, 100, 250)]
    for heights in (*enlarged, *steps[:2]):
        assert "most of the highest maxima are plateaus" in "".join(flaws(heights))
    y, x = np.mgrid[-40:41, -40:41]
    for heights in (MADE, steps[2], -0.01 * (x**2 + y**2), np.sqrt(1e4 - x**2 - y**2)):
        assert [*flaws(heights)] == []
    holed = cr.surface.Surface(filled(np.where(y > x, np.nan, steps[0][:81, :81])), 10.0, "µm",
                               filled_pixels=y > x)  # fmt: skip
    assert "plateaus" in str(holed.detrend().to_unit("nm").warnings)


def test_a_form_is_fitted_to_measured_pixels() -> None:
    """A ball measured near its top, a tilt of which columns are missing, and almost no map."""
    y, x = np.mgrid[-40:41, -40:41] * 2.0
    ball = np.sqrt(500.0**2 - x**2 - y**2)
    for form, missing, kind in ((ball, np.hypot(x, y) > 60, "sphere"), (0.05 * x, x > 26, "plane")):
        heights = np.where(missing, np.nan, form + np.resize(NOISE, x.shape))
        made = cr.surface.Surface(filled(heights), 2.0, filled_pixels=missing)
        left = made.detrend(kind)  # type: ignore[arg-type]
        (removed,) = left.removed
        if kind == "sphere":
            assert_allclose(removed.radius, 500.0, rtol=1e-2)
            assert any("57% of the pixels were holes" in each for each in made.warnings)
        else:
            assert_allclose(removed.slopes, (0.05, 0.0), atol=1e-4)
        assert f'detrend="{kind}"' in made.warnings[0]
        assert left.max_height < 0.02  # also on filled pixels
        assert not any("spikes" in each for each in left.warnings)
    one = np.where(x == 0, ball, np.nan)
    column = cr.surface.Surface(filled(one), 2.0, filled_pixels=np.isnan(one))
    with pytest.raises(cr.InputError, match="detrend: found too few heights for this form"):
        column.detrend("plane")


MAP = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=256)
Map = NDArray[np.float64]
Place = tuple[int, int]


def test_summits_are_asperities_that_know_their_map() -> None:
    summits = MAP.summits(prune=0.05)
    assert isinstance(summits, cr.Asperities)
    at = summits.origin
    assert (at.source, at.prune, at.fit, at.shape) == (MAP.source, 0.05, 3, (256, 256))
    assert len(summits) + at.pruned + at.at_edge + at.without_top == at.maxima
    heights = MAP.heights[tuple(summits.pixels.T)]
    assert (np.diff(heights) < 0).all()
    assert (summits.prominences >= 0.05 * MAP.max_height).all()
    product = summits.largest_curvatures * summits.smallest_curvatures
    assert_allclose(summits.tip_radii, 1 / np.sqrt(product), rtol=1e-14)
    ratio = summits.smallest_curvatures / summits.largest_curvatures
    assert_allclose(1 - summits.eccentricities**2, ratio, rtol=1e-10)
    assert_allclose(summits.positions, summits.pixels[:, ::-1] - 127.5, rtol=0, atol=1.0)
    assert_allclose(summits.heights, heights, rtol=0, atol=0.05 * MAP.rms_height)
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
        slopes = (np.roll(surface.heights, -1, axis=1) - np.roll(surface.heights, 1, axis=1)) / 2
        assert np.mean(slopes**2) < exact.m2  # differences see less than derivatives


def test_summits_are_as_a_gaussian_surface_has_them() -> None:
    """Density, curvature and heights of all maxima against Nayak's theory."""
    options: Any = dict(hurst=0.8, rms_slope=0.1, rolloff=64.0, pixels=512, cutoff=16.0)
    exact = cr.surface.self_affine_moments(**options)
    maps = [cr.surface.self_affine(seed=seed, **options) for seed in range(12)]
    found = [each.summits(0.0).statistics for each in maps]
    theory = exact.density, exact.mean_curvature, exact.mean_height, exact.height_std
    assert (np.abs(np.mean(found, axis=0) / theory - 1) < [0.02, 0.04, 0.02, 0.03]).all()


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
    for place in sorted(np.ndindex(heights.shape), key=heights.item, reverse=True):
        summit[place] = summit.get(max(around(heights, place), key=heights.item), place)
    gone: dict[Place, float] = {}
    while len(left := set(summit.values())) > 1:
        saddles: dict[Place, tuple[float, Place]] = {}
        for one in np.ndindex(heights.shape):
            for other in around(heights, one):
                if summit[one] != summit[other]:
                    saddle = min(heights[one], heights[other]), summit[other]
                    saddles[summit[one]] = max(saddles.get(summit[one], saddle), saddle)
        least = min(left, key=lambda peak: heights[peak] - saddles[peak][0])
        level, taken_by = saddles[least]
        gone[least] = float(heights[least] - level)
        summit = {place: taken_by if it == least else it for place, it in summit.items()}
    assert list(gone.values()) == sorted(gone.values())  # so a threshold keeps the rest of them
    (last,) = left
    return gone | {last: float(heights[last] - heights.min())}


@pytest.mark.sample(6)
@pytest.mark.parametrize("seed", range(16))
def test_pruning_is_wolf_pruning(seed: int) -> None:
    noise = np.random.default_rng(seed).standard_normal((14, 17))
    heights = np.asarray(ndimage.gaussian_filter(noise, 0.3 * (seed % 4)))
    pixels, prominences = hills(heights)
    peaks = [(int(i), int(j)) for i, j in pixels]
    assert dict(zip(peaks, prominences.tolist(), strict=True)) == wolf(heights)
    assert [heights[peak] for peak in peaks] == sorted(heights[tuple(pixels.T)])[::-1]


def test_a_plateau_is_one_hill() -> None:
    heights = np.zeros((9, 9))
    heights[2:4, 2:7] = heights[2:7, 5:7] = 1.0  # an L
    heights[6, 1] = 0.5
    pixels, prominences = hills(heights)
    assert prominences.tolist() == [1.0, 0.5]
    assert heights[tuple(pixels[0])] == 1.0
    assert pixels[1].tolist() == [6, 1]


@pytest.mark.parametrize("across", [3, 5, 7])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_a_paraboloid_is_found_exactly(across: int, scale: float) -> None:
    """Whatever the unit: top, height and both principal curvatures, of a turned paraboloid."""
    dx, dy = 0.5 * scale, 0.3 * scale
    x, y = np.meshgrid(np.arange(-5, 6) * dx, np.arange(-4, 5) * dy)
    x0, y0, angle, k1, k2 = 0.3 * dx, -0.4 * dy, 0.7, 3.0 / scale, 0.4 / scale
    u = np.cos(angle) * (x - x0) + np.sin(angle) * (y - y0)
    v = np.cos(angle) * (y - y0) - np.sin(angle) * (x - x0)
    heights = 2.0 * scale - k1 * u**2 / 2 - k2 * v**2 / 2
    whole, tips = fit_tips(heights, np.array([[4, 5]]), (dx, dy), across)
    assert whole.all()
    assert_allclose(tips["positions"][0], [x0, y0], rtol=1e-11)
    assert_allclose(tips["heights"], 2.0 * scale, rtol=1e-13)
    curvatures = tips["largest_curvatures"], tips["smallest_curvatures"]
    assert_allclose(np.ravel(curvatures), [k1, k2], rtol=1e-10)
    reach = across // 2
    near = np.s_[4 - reach : 5 + reach, 5 - reach : 6 + reach]
    sphere = 2.0 * scale - np.sqrt(k1 * k2) * ((x - x0) ** 2 + (y - y0) ** 2) / 2
    deviation = np.sqrt(np.mean((heights - sphere)[near] ** 2))
    assert_allclose(tips["deviations"], deviation, rtol=1e-10)
