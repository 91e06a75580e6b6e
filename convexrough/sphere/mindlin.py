"""The tangential law of one sphere at constant normal load (Cattaneo and Mindlin).

With t = Q / (f P) and the largest deflection threshold = k P^(2/3), everything is a function of t
alone, times c_t f threshold (displacements) or c_t f^2 P threshold (energies); c_t is `ratio`. Each
function is accurate relative to its own value, also where that is of third order in t: they are the
positive polynomials of `annulus`.
Source: Johnson, Contact Mechanics (1985), chapter 7.
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Number
from convexrough.sphere import annulus


def ratio(poisson_ratio: Number) -> Number:
    """c_t = (2 - nu) / (2 (1 - nu)): tangential over normal compliance."""
    return (2.0 - poisson_ratio) / (2.0 * (1.0 - poisson_ratio))


def deflection(t: Number) -> Number:
    """phi(t) = 1 - (1 - t)^(2/3), of either sign: phi(-t) = -phi(t)."""
    return np.copysign(annulus.deflection(annulus.width_under(t)), t)


def force(deflection: Number) -> Number:
    """t = 1 - (1 - phi)^(3/2), the inverse of `deflection`; all that friction can bear beyond 1."""
    return np.copysign(annulus.force(annulus.width_at(deflection)), deflection)


def potential(t: Number) -> Number:
    """Integral of phi from 0 to t:  t - (3/5) [1 - (1 - t)^(5/3)]."""
    return annulus.potential(annulus.width_under(t))


def loss(t: Number) -> Number:
    """e(t) = 1 - (1 - t)^(5/3) - (5 t / 6) [1 + (1 - t)^(2/3)], of third order in t.

    A cycle between +-Q costs (9 (2 - nu) f^2 P^2 / (5 G a)) e(Q / (f P)), which is
    (24/5) c_t f^2 P threshold e: equation (16) of the source, for both bodies.
    """
    return annulus.loss(annulus.width_under(t))
