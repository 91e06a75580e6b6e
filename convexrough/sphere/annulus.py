"""The tangential law of one sphere, as polynomials of the width of its slip annulus.

With s = c / a the stick radius over the contact radius and x = 1 - s, partial slip under the share
t = |Q| / (f P) of friction and at the share phi of the largest deflection is

    t = 1 - s^3,    phi = 1 - s^2,

and the energies of `mindlin` are polynomials. They are written so that no term is
subtracted from another: each keeps its relative accuracy down to x = 0. Sliding is x = 1.
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Number


def width_at(deflection: Number) -> Number:
    """x at a deflection phi of either sign, 1 from |phi| = 1 on."""
    size = np.minimum(np.abs(deflection), 1.0)
    return size / (1.0 + np.sqrt(1.0 - size))


def width_under(force: Number) -> Number:
    """x under a share t of friction, of either sign."""
    size = np.minimum(np.abs(force), 1.0)
    return width_between(size, 1.0 - size)


def width_between(force: Number, left: Number) -> Number:
    """x under a share t >= 0, of which `left` = 1 - t is known to digits of its own."""
    s = np.cbrt(np.maximum(left, 0.0))
    return np.minimum(force, 1.0) / (1.0 + s + s * s)


def force(x: Number) -> Number:
    """t = 1 - s^3."""
    s = 1.0 - x
    return x * (1.0 + s * (1.0 + s))


def deflection(x: Number) -> Number:
    """phi = 1 - s^2."""
    return x * (2.0 - x)


def excess_deflection(x: Number) -> Number:
    """phi - (2/3) t."""
    return x * x * (3.0 - 2.0 * x) / 3.0


def potential(x: Number) -> Number:
    """Integral of phi over t."""
    s = 1.0 - x
    return x * x * (0.4 + s * (0.8 + s * (1.2 + s * 0.6)))


def excess_potential(x: Number) -> Number:
    """Integral of phi - (2/3) t over t."""
    s = 1.0 - x
    return x * x * x * (1.0 + s * (3.0 + s * (6.0 + s * 5.0))) / 15.0


def loss(x: Number) -> Number:
    """e(t) = 1 - (1 - t)^(5/3) - (5 t / 6) [1 + (1 - t)^(2/3)], as in `mindlin.loss`."""
    s = 1.0 - x
    return x * x * x * (1.0 + s * (3.0 + s)) / 6.0
