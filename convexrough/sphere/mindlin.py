"""The tangential law of one sphere at constant normal load (Cattaneo and Mindlin).

The argument t is Q / (f P), the shear force divided by the friction limit. The indentation is
n = k P^(2/3), by Hertz's law, and `ratio` gives c_t. Displacements are in units of c_t f n, and the
potential energy is in units of c_t f^2 P n. The polynomials of `annulus` keep the relative accuracy
of each result, even where it is small and proportional to t^3.
Source: Johnson, Contact Mechanics (1985), chapter 7.
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Number
from convexrough.sphere import annulus


def ratio(poisson_ratio: Number) -> Number:
    """Mindlin's ratio c_t = (2 - nu) / (2 (1 - nu)) of tangential to normal compliance."""
    return (2.0 - poisson_ratio) / (2.0 * (1.0 - poisson_ratio))


def deflection(t: Number) -> Number:
    """The deflection phi(t) = 1 - (1 - t)^(2/3) for t >= 0; phi(-t) = -phi(t)."""
    return np.copysign(annulus.deflection(annulus.width_under(t)), t)


def potential(t: Number) -> Number:
    """The integral of phi from 0 to t:  t - (3/5) [1 - (1 - t)^(5/3)]  for t >= 0."""
    return annulus.potential(annulus.width_under(t))


def loss(t: Number) -> Number:
    """The loss e(t) = 1 - (1 - t)^(5/3) - (5 t / 6) [1 + (1 - t)^(2/3)]  for t >= 0.

    For small t, e is proportional to t^3. A cycle between Q and -Q loses
    (9 (2 - nu) f^2 P^2 / (5 G a)) e(Q / (f P)) in both bodies, with the shear modulus G and the
    contact radius a.
    """
    return annulus.loss(annulus.width_under(t))
