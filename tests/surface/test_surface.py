"""Maps: what is removed, what they are like, and what is no map."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import convexrough as cr
from convexrough.surface.holes import filled

RNG = np.random.default_rng(5)
NOISE = 1e-3 * RNG.standard_normal((40, 60))


def grid(shape: tuple[int, int] = (40, 60), pixel: tuple[float, float] = (0.5, 0.7)):  # type: ignore[no-untyped-def]
    y, x = np.mgrid[: shape[0], : shape[1]].astype(float)
    return (x - (shape[1] - 1) / 2) * pixel[0], (y - (shape[0] - 1) / 2) * pixel[1]


def test_a_plane_is_removed_and_said() -> None:
    x, y = grid()
    plane = cr.surface.Surface(3 + 0.2 * x - 0.1 * y + NOISE, (0.5, 0.7)).detrend()
    removed = plane.removed[0]
    assert removed.kind == "plane"
    assert_allclose(removed.slopes, (0.2, -0.1), atol=1e-4)
    assert_allclose(removed.height, 3.0, atol=1e-3)
    assert removed.radius == np.inf
    left = plane.heights
    for term in (np.ones_like(x), x, y):  # a least-squares fit leaves nothing of its terms
        assert abs(np.vdot(left, term)) < 1e-9
    assert_allclose(plane.rms_height, NOISE.std(), rtol=1e-2)
    with pytest.raises(cr.InputError, match="detrend: found 'cone', expected \"plane\", "):
        plane.detrend("cone")  # type: ignore[arg-type]


@pytest.mark.parametrize("radius", [25.0, -25.0, 400.0])
def test_a_sphere_is_removed_and_said(radius: float) -> None:
    """A deep cap, half as steep as it can be, off the middle; a bowl; and nearly a plane."""
    x, y = grid()
    cap = np.sign(radius) * np.sqrt(radius**2 - (x - 2) ** 2 - (y + 1) ** 2)
    exact = cr.surface.Surface(cap + 1e-9 * NOISE, (0.5, 0.7)).detrend("sphere")
    removed = exact.removed[0]
    assert_allclose(removed.radius, radius, rtol=1e-9)
    assert_allclose(removed.height, cap[19:21, 29:31].mean(), rtol=1e-3)
    assert exact.max_height < 2e-11
    rough = cr.surface.Surface(cap + NOISE, (0.5, 0.7)).detrend("sphere")
    assert_allclose(rough.removed[0].radius, radius, rtol=5e-3)
    assert_allclose(rough.rms_height, NOISE.std(), rtol=1e-2)


@pytest.mark.parametrize(
    ("heights", "message"),
    [
        (np.full((5, 5), 2.0), "found 2 everywhere, expected a rough surface"),
        (np.where(np.eye(5) > 0, np.nan, NOISE[:5, :5]), r"5 holes \(nan\) in 25 pixels"),
        (np.where(np.eye(5) > 0, np.inf, NOISE[:5, :5]), "inf in row 0, column 0"),
        (NOISE[0], r"shape \(60,\), expected rows and columns"),
        ([["a", "b"], ["c", "d"]], "expected numbers"),
        (NOISE * 1j, "expected numbers"),
    ],
)
def test_no_map(heights: object, message: str) -> None:
    with pytest.raises(cr.InputError, match=message):
        cr.surface.Surface(heights, 1.0)  # type: ignore[arg-type]


def test_a_map_pressed_whole_is_hertz_where_it_is_smooth() -> None:
    """Oblong pixels; load and area, and the half axes on an ellipsoid."""
    flat = cr.surface.Surface(1e-9 * RNG.standard_normal((201, 161)), (1.0, 1.2))
    single = cr.Asperities([[0.0, 0.0]], 1e9)
    contact = cr.press(cr.Scene(1e4, single, cr.Material(2.0, 0.3)), approach=0.1)
    whole = cr.surface.press_whole(flat, contact)
    assert_allclose(whole.load, contact.load, rtol=5e-4)
    assert_allclose(whole.area, np.pi * 1e3, rtol=0.02)
    assert (whole.pieces, whole.resolution < 2e-3) == (1, True)
    assert_allclose(whole.loads.sum(), whole.load, rtol=1e-12)
    assert "of the asperities" in repr(whole)
    ellipsoid = cr.press(cr.Scene((1e4, 1.2e4), single, cr.Material(2.0, 0.3)), approach=0.1)
    across = np.argwhere(cr.surface.press_whole(flat, ellipsoid).pressures > 0)
    height, width = np.ptp(across, axis=0) + 1
    assert_allclose(1.2 * height / width, 1.2 ** (2 / 3), rtol=0.04)  # Johnson 1985, eq. 4.28
    for approach, said in ((3.0, "contact at the edge of the map"), (1e-12, "no pixel that")):
        deep = cr.press(contact.scene, approach=approach)
        low = cr.surface.Surface(flat.heights - 1e-6, (1.0, 1.2))
        with pytest.raises(cr.InputError, match=said):
            cr.surface.press_whole(low, deep)


def test_holes_become_soap_films() -> None:
    """A harmonic map comes back as it was, and no filled pixel is a maximum."""
    x, y = grid()
    saddle = x**2 / 0.25 - y**2 / 0.49  # harmonic for the pixels, too
    holed = saddle.copy()
    holed[10:20, 5:30] = holed[30, 40] = np.nan
    assert_allclose(filled(holed), saddle, atol=1e-8 * np.ptp(saddle))
    rough = RNG.standard_normal((30, 30))
    rough[RNG.random((30, 30)) < 0.4] = np.nan
    rough[:6, :6] = np.nan  # a corner, where neighbours are missing
    mended = filled(rough)
    at = cr.surface.Surface(mended, 1.0).summits(0.0).pixels
    assert not np.isnan(rough[tuple(at.T)]).any()
    assert np.nanmin(rough) <= mended.min()
    assert mended.max() <= np.nanmax(rough)
    assert_allclose(mended[~np.isnan(rough)], rough[~np.isnan(rough)], rtol=0)
