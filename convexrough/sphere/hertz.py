"""One sphere on an elastically similar half-space: Hertz's law and its relatives.

Scalars or arrays alike; any consistent units. E* is the contact modulus, R the relative radius.
Displacements are those of two deep points, one in each body, towards each other.
Source: Johnson, Contact Mechanics (1985), chapters 3 and 4.
"""

from __future__ import annotations

from math import factorial
from typing import Any

import numpy as np

from convexrough.sphere import mindlin

Number = Any  # float or float64 array; the result has the shape of the arguments


def local_coefficient(contact_modulus: Number, radius: Number) -> Number:
    """k of the local law  indentation = k load^(2/3),  k = (9 / (16 E*^2 R))^(1/3)."""
    return np.cbrt(9.0 / (16.0 * contact_modulus**2 * radius))


def indentation(load: Number, coefficient: Number) -> Number:
    """delta = k P^(2/3)."""
    return coefficient * np.cbrt(load) ** 2


def load(indentation: Number, coefficient: Number) -> Number:
    """P = (max(delta, 0) / k)^(3/2): a sphere that is pulled away carries nothing."""
    ratio = np.maximum(indentation, 0.0) / coefficient
    return ratio * np.sqrt(ratio)


def contact_radius(load: Number, contact_modulus: Number, radius: Number) -> Number:
    """a = (3 P R / (4 E*))^(1/3)."""
    return np.cbrt(3.0 * load * radius / (4.0 * contact_modulus))


def peak_pressure(contact_radius: Number, contact_modulus: Number, radius: Number) -> Number:
    """p0 = 2 E* a / (pi R), the same as (6 P E*^2 / (pi^3 R^2))^(1/3)."""
    return 2.0 * contact_modulus * contact_radius / (np.pi * radius)


def pressure(distance: Number, contact_radius: Number, peak_pressure: Number) -> Number:
    """p(r) = p0 sqrt(1 - r^2 / a^2) inside the contact, 0 outside."""
    ratio = np.divide(distance, contact_radius)
    return peak_pressure * np.sqrt(np.maximum(1.0 - ratio**2, 0.0))


def surface_displacement(distance: Number, contact_radius: Number, radius: Number) -> Number:
    """Normal displacement of both surfaces at a distance r from the axis.

    a^2/R - r^2/(2R) inside the contact and (1/(pi R)) [(2 a^2 - r^2) asin(a/r) + a sqrt(r^2 - a^2)]
    outside (Johnson, 3.42), which is r^2 (sin 2s / 2 - s cos 2s) / (pi R) with s = asin(a/r).
    """
    a, r = contact_radius, np.asarray(distance, dtype=np.float64)
    outer = np.maximum(r, a)
    s = np.arcsin(a / outer)
    outside = outer**2 * (2.0 * s * np.sin(s) ** 2 - less_sine(2.0 * s) / 2.0)  # no cancellation
    return np.where(r < a, a**2 / radius - r**2 / (2 * radius), outside / (np.pi * radius))


def less_sine(angle: Number) -> Number:
    """x - sin(x), by its series for small x."""
    small = np.square(np.minimum(angle, 1.0))
    series = np.zeros_like(small)
    for m in range(19, 1, -2):
        series = 1.0 / factorial(m) - small * series
    return np.where(angle < 1.0, series * angle**3, angle - np.sin(angle))


# The tangential law of one sphere (Cattaneo-Mindlin) at constant normal load P. With t = Q / (f P)
# and the largest deflection ceiling = k P^(2/3), everything is a function of t alone, times
# c_t f ceiling (displacements) or c_t f^2 P ceiling (energies); c_t is `mindlin_ratio`. Each
# function below is accurate relative to its own value, also where that is of third order in t:
# they are the positive polynomials of `annulus`.


def mindlin_ratio(poisson_ratio: Number) -> Number:
    """c_t = (2 - nu) / (2 (1 - nu)): tangential over normal compliance."""
    return (2.0 - poisson_ratio) / (2.0 * (1.0 - poisson_ratio))


def deflection(t: Number) -> Number:
    """phi(t) = 1 - (1 - t)^(2/3), of either sign: phi(-t) = -phi(t)."""
    return np.copysign(mindlin.deflection(mindlin.width_under(t)), t)


def force(deflection: Number) -> Number:
    """t = 1 - (1 - phi)^(3/2), the inverse of `deflection`; all that friction can bear beyond 1."""
    return np.copysign(mindlin.force(mindlin.width_at(deflection)), deflection)


def potential(t: Number) -> Number:
    """Integral of phi from 0 to t:  t - (3/5) [1 - (1 - t)^(5/3)]."""
    return mindlin.potential(mindlin.width_under(t))


def loss(t: Number) -> Number:
    """e(t) = 1 - (1 - t)^(5/3) - (5 t / 6) [1 + (1 - t)^(2/3)], of third order in t.

    A cycle between +-Q costs (9 (2 - nu) f^2 P^2 / (5 G a)) e(Q / (f P)), which is
    (24/5) c_t f^2 P ceiling e: equation (16) of the source, for both bodies.
    """
    return mindlin.loss(mindlin.width_under(t))
