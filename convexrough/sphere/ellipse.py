"""The contact of a smooth ellipsoid on a half-space (docs/theory/bodies.md).

Source: Johnson, Contact Mechanics (1985), 3.5 and 4.2; Carlson's integrals R_D, R_F: DLMF 19.16.
"""

from __future__ import annotations

import math

import numpy as np
import scipy  # its parts are imported when they are used

from convexrough.arrays import Number

#: Number of steps of the secant method, which reach the accuracy of float64.
STEPS = 5


def slenderness(ratio: Number) -> Number:
    """The ratio b / a <= 1 of the contact ellipse for radii with the ratio Rx / Ry >= 1, by the
    secant method in logarithms, in which Rx / Ry and b / a are nearly linear.
    """

    def radii(log: Number) -> Number:
        """The logarithm of Rx / Ry, given the logarithm of b / a."""
        q = np.exp(2.0 * log)
        return np.log(scipy.special.elliprd(0.0, 1.0, q) / scipy.special.elliprd(0.0, q, 1.0))

    wanted = np.log(ratio)
    before, log = -0.5 * wanted, -2.0 / 3.0 * wanted  # the second holds if Rx is nearly Ry
    value_before = radii(before)
    for _ in range(STEPS):
        value = radii(log)
        difference = np.where(value == value_before, 1.0, value - value_before)
        step = (wanted - value) * (log - before) / difference
        before, value_before, log = log, value, log + step
    return np.minimum(np.exp(log), 1.0)


def semi_axes(
    load: float, contact_modulus: float, radii: tuple[float, float]
) -> tuple[float, float]:
    """[length] the semi-axes of the contact ellipse, a along x and b along y."""
    largest = max(radii)
    q = float(slenderness(largest / min(radii)))
    a = math.cbrt(
        load * largest / (math.pi * contact_modulus) * float(scipy.special.elliprd(0.0, q * q, 1.0))
    )
    return (a, q * a) if radii[0] == largest else (q * a, a)


def approach(load: float, contact_modulus: float, axes: tuple[float, float]) -> float:
    """[length] the approach delta of distant points of the two bodies."""
    a, b = axes
    return (
        1.5 * load / (math.pi * contact_modulus) * float(scipy.special.elliprf(0.0, a * a, b * b))
    )


def load_ratio(ratio: Number) -> Number:
    """The load of an ellipsoid, divided by that of a sphere with the same approach.

    The radius of the sphere is sqrt(Rx Ry). From `semi_axes` and `approach`, P = pi E* sqrt(Rx R_D)
    (delta / (1.5 R_F))^(3/2) with R_D(0, q^2, 1), R_F(0, 1, q^2) and q = b / a. For the sphere,
    Hertz's law is P = (4/3) E* (Rx Ry)^(1/4) delta^(3/2).

    ratio : Rx / Ry >= 1
    """
    square = slenderness(ratio) ** 2
    shape = np.sqrt(np.sqrt(ratio) * scipy.special.elliprd(0.0, square, 1.0))
    return 0.75 * np.pi * shape / (1.5 * scipy.special.elliprf(0.0, 1.0, square)) ** 1.5
