"""Hertz's law of one sphere on an elastically similar half-space.

Functions return load, indentation, contact radius, pressure or surface displacement. Arguments are
scalars or arrays in consistent units: load P, contact modulus E*, relative radius R, contact radius
a. The indentation delta is the approach of distant points of the two bodies.
Source: Johnson, Contact Mechanics (1985), chapters 3 and 4.
"""

from __future__ import annotations

from math import factorial

import numpy as np

from convexrough.arrays import Number

#: Coefficients of the power series of (x - sin x) / x^3 in powers of -x^2, highest power first.
LESS_SINE = tuple(1.0 / factorial(m) for m in range(19, 1, -2))


def local_coefficient(contact_modulus: Number, radius: Number) -> Number:
    """The coefficient k = (9 / (16 E*^2 R))^(1/3) of the local law  indentation = k load^(2/3)."""
    return _cube_root(9.0 / (16.0 * contact_modulus**2 * radius))


def indentation(load: Number, coefficient: Number) -> Number:
    """The indentation k P^(2/3)."""
    return coefficient * np.cbrt(load) ** 2


def load(indentation: Number, coefficient: Number) -> Number:
    """The load (max(delta, 0) / k)^(3/2); 0 if the sphere is separated from the half-space."""
    ratio = np.maximum(indentation, 0.0) / coefficient
    return ratio * np.sqrt(ratio)


def contact_radius(load: Number, contact_modulus: Number, radius: Number) -> Number:
    """The contact radius (3 P R / (4 E*))^(1/3)."""
    return _cube_root(3.0 * load * radius / (4.0 * contact_modulus))


def _cube_root(value: Number) -> Number:
    """The cube root. On every machine the result for 8 x is exactly twice the result for x."""
    mantissa, exponent = np.frexp(value)
    thirds, rest = np.divmod(exponent, 3)
    return np.ldexp(np.cbrt(np.ldexp(mantissa, rest)), thirds)


def peak_pressure(contact_radius: Number, contact_modulus: Number, radius: Number) -> Number:
    """The peak pressure p0 = 2 E* a / (pi R), the same as (6 P E*^2 / (pi^3 R^2))^(1/3)."""
    return 2.0 * contact_modulus * contact_radius / (np.pi * radius)


def pressure(distance: Number, contact_radius: Number, peak_pressure: Number) -> Number:
    """The pressure p0 sqrt(1 - r^2 / a^2) inside the contact, 0 outside, at a distance r."""
    ratio = np.divide(distance, contact_radius)
    return peak_pressure * np.sqrt(np.maximum(1.0 - ratio**2, 0.0))


def surface_displacement(distance: Number, contact_radius: Number, radius: Number) -> Number:
    """The sum of both surfaces' normal displacements at a distance r from the axis (Johnson, 3.42).

    It is a^2/R - r^2/(2R) inside the contact. Outside it is (1/(pi R)) [(2 a^2 - r^2) asin(a/r) +
    a sqrt(r^2 - a^2)], which equals r^2 (sin 2s / 2 - s cos 2s) / (pi R) with s = asin(a/r).
    """
    r, a, R = np.broadcast_arrays(np.asarray(distance, np.float64), contact_radius, radius)
    displacement, outside = np.asarray(a**2 / R - r**2 / (2 * R)), r > a
    outer = r[outside]
    s = np.arcsin(a[outside] / outer)
    twice = 2.0 * s * np.sin(s) ** 2 - less_sine(2.0 * s) / 2.0  # no cancellation
    displacement[outside] = outer**2 * twice / (np.pi * R[outside])
    return displacement


def less_sine(angle: Number) -> Number:
    """The difference x - sin(x); for x < 1, the sum of its power series."""
    small = np.square(np.minimum(angle, 1.0))
    series = LESS_SINE[0]
    for coefficient in LESS_SINE[1:]:
        series = coefficient - small * series
    return np.where(angle < 1.0, series * (angle * angle * angle), angle - np.sin(angle))
