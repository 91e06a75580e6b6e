"""Paraboloids where they are exact, and the elliptic contact by quadrature."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from convexrough.sphere.ellipse import load_ratio
from convexrough.surface.summits import fit_tips

PIXEL = (0.5, 0.3)


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


@pytest.mark.parametrize("axes", [0.9, 0.5, 0.1, 0.01])
def test_the_elliptic_contact_by_quadrature(axes: float) -> None:
    """Displacements under p0 sqrt(1 - x^2/a^2 - y^2/b^2), from the integrals of the potential."""
    b = axes

    def integral(power_a: float, power_b: float) -> float:
        def at(t: float) -> float:  # s = t^2
            return 2 * (1 + t * t) ** -(0.5 + power_a) * (b * b + t * t) ** -(0.5 + power_b)

        return sum(quad(at, *ends, epsrel=1e-11)[0] for ends in ((0, b), (b, 1), (1, np.inf)))

    scale = b / 2  # p0 = E* = 1
    indentation, k2, k1 = (scale * integral(*p) for p in ((0, 0), (1, 0), (0, 1)))
    k1, k2 = 2 * k1, 2 * k2
    load = 2 / 3 * np.pi * b
    sphere = 4 / 3 * np.sqrt(1 / np.sqrt(k1 * k2)) * indentation**1.5
    assert_allclose(load_ratio(k1 / k2), load / sphere, rtol=1e-8)
