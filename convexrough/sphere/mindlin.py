"""The tangential law of one sphere at constant normal load (Cattaneo and Mindlin).

The argument t is Q / (f P), the shear force divided by the friction limit. The indentation is
n = k P^(2/3), by Hertz's law; c_t is the ratio of tangential to normal compliance (`ratio`).
Displacements are in units of c_t f n, and the potential energy is in units of c_t f^2 P n. In
partial slip, with the stick radius c and the contact radius a, the ratio s = c / a gives the force
t and the tangential deflection phi:

    t = 1 - s^3,    phi = 1 - s^2.

All results are polynomials of the width x = 1 - s of the slip annulus; the sphere slides at x = 1.
The code writes them as sums of positive terms, so that they keep their relative accuracy down to
x = 0.
Source: Johnson, Contact Mechanics (1985), chapter 7.
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Number


def ratio(poisson_ratio: Number) -> Number:
    """Mindlin's ratio c_t = (2 - nu) / (2 (1 - nu)) of tangential to normal compliance."""
    return (2.0 - poisson_ratio) / (2.0 * (1.0 - poisson_ratio))


def width(force: Number) -> Number:
    """The width x under a force t of either sign; 1 for |t| >= 1."""
    size = np.minimum(np.abs(force), 1.0)
    return width_between(size, 1.0 - size)


def width_between(force: Number, left: Number) -> Number:
    """The width x under a force t >= 0; `left` is 1 - t, given to full relative accuracy."""
    s = np.cbrt(np.maximum(left, 0.0))
    return np.minimum(force, 1.0) / (1.0 + s + s * s)


def deflection(t: Number) -> Number:
    """The deflection phi(t) = 1 - (1 - t)^(2/3) for t >= 0; phi(-t) = -phi(t)."""
    return np.copysign(deflection_at(width(t)), t)


def deflection_at(x: Number) -> Number:
    """The deflection phi = 1 - s^2 for the width x."""
    return x * (2.0 - x)


def potential(t: Number) -> Number:
    """The integral of phi from 0 to t:  t - (3/5) [1 - (1 - t)^(5/3)]  for t >= 0."""
    x = width(t)
    s = 1.0 - x
    return x * x * (0.4 + s * (0.8 + s * (1.2 + s * 0.6)))


def loss(t: Number) -> Number:
    """The loss e(t) = 1 - (1 - t)^(5/3) - (5 t / 6) [1 + (1 - t)^(2/3)]  for t >= 0.

    For small t, e is proportional to t^3. A cycle between Q and -Q loses W0 e(Q / (f P)) in both
    bodies, with the `energy_scale` W0 of `SmoothSphere`.
    """
    return loss_at(width(t))


def loss_at(x: Number) -> Number:
    """The loss e for the width x."""
    s = 1.0 - x
    return x * x * x * (1.0 + s * (3.0 + s)) / 6.0
