"""The tangential law of one sphere, as polynomials of the width of its slip annulus.

Let s = c / a be the stick radius divided by the contact radius, x = 1 - s the width of the annulus,
t = |Q| / (f P) the shear force divided by the friction limit, and phi the deflection divided by its
largest value. In partial slip

    t = 1 - s^3,    phi = 1 - s^2,

and the energies of `mindlin` are polynomials of x. The code writes them with s = 1 - x as sums of
positive terms, so that each keeps its relative accuracy down to x = 0. The sphere slides at x = 1.
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Number


def width_under(force: Number) -> Number:
    """The width x under a force t of either sign; 1 for |t| >= 1."""
    size = np.minimum(np.abs(force), 1.0)
    return width_between(size, 1.0 - size)


def width_between(force: Number, left: Number) -> Number:
    """The width x under a force t >= 0; `left` is 1 - t, given to full relative accuracy."""
    s = np.cbrt(np.maximum(left, 0.0))
    return np.minimum(force, 1.0) / (1.0 + s + s * s)


def force(x: Number) -> Number:
    """The shear force t = 1 - s^3."""
    s = 1.0 - x
    return x * (1.0 + s * (1.0 + s))


def deflection(x: Number) -> Number:
    """The deflection phi = 1 - s^2."""
    return x * (2.0 - x)


def potential(x: Number) -> Number:
    """The integral of phi over t from 0."""
    s = 1.0 - x
    return x * x * (0.4 + s * (0.8 + s * (1.2 + s * 0.6)))


def loss(x: Number) -> Number:
    """The loss e(t) = 1 - (1 - t)^(5/3) - (5 t / 6) [1 + (1 - t)^(2/3)] of `mindlin.loss`."""
    s = 1.0 - x
    return x * x * x * (1.0 + s * (3.0 + s)) / 6.0
