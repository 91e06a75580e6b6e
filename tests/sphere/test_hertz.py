"""One sphere: each law against another way to say the same."""

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from convexrough.sphere import hertz

MODULUS, RADIUS, LOAD = 3.0, 0.7, 2e-5
A = float(hertz.contact_radius(LOAD, MODULUS, RADIUS))
P0 = float(hertz.peak_pressure(A, MODULUS, RADIUS))


def test_law_and_its_inverse() -> None:
    k = hertz.local_coefficient(MODULUS, RADIUS)
    depth = hertz.indentation(LOAD, k)
    assert depth == pytest.approx(A**2 / RADIUS, rel=1e-14)
    assert depth == pytest.approx((9 * LOAD**2 / (16 * MODULUS**2 * RADIUS)) ** (1 / 3), rel=1e-14)
    assert hertz.load(depth, k) == pytest.approx(LOAD, rel=1e-14)
    assert hertz.load(-depth, k) == 0


def test_pressure_carries_the_load() -> None:
    def ring(angle: float) -> float:  # r = A sin(angle) takes the root off the edge
        r = A * np.sin(angle)
        return float(2 * np.pi * r * hertz.pressure(r, A, P0) * A * np.cos(angle))

    assert quad(ring, 0, np.pi / 2, epsabs=0)[0] == pytest.approx(LOAD, rel=1e-12)
    assert pytest.approx((6 * LOAD * MODULUS**2 / (np.pi**3 * RADIUS**2)) ** (1 / 3)) == P0
    assert hertz.pressure(1.01 * A, A, P0) == 0


@pytest.mark.parametrize("distance", [1.2, 2.0, 7.0])
def test_displacement_outside_is_boussinesqs_integral(distance: float) -> None:
    r = distance * A

    def kernel(angle: float, tilt: float) -> float:  # at a distance s = A sin(tilt) from the axis
        s = A * np.sin(tilt)
        apart = np.sqrt(r**2 + s**2 - 2 * r * s * np.cos(angle))
        ring = hertz.pressure(s, A, P0) * s * A * np.cos(tilt)
        return float(ring / (np.pi * MODULUS * apart))

    integral = 2 * dblquad(kernel, 0, np.pi / 2, 0, np.pi, epsabs=0, epsrel=1e-10)[0]
    assert hertz.surface_displacement(r, A, RADIUS) == pytest.approx(integral, rel=1e-9)
