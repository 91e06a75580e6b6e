"""The tangential law of one sphere at constant normal load (Cattaneo and Mindlin).

The argument t is Q / (f P), the shear force over the friction limit. With the indentation
n = k P^(2/3) and c_t from `ratio`, displacements are in units of c_t f n, and the potential energy
is in units of c_t f^2 P n. The polynomials of `annulus` keep the relative accuracy
of each result, also where it is of third order in t.
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
    """The deflection phi(t) = 1 - (1 - t)^(2/3), of either sign: phi(-t) = -phi(t)."""
    return np.copysign(annulus.deflection(annulus.width_under(t)), t)


def potential(t: Number) -> Number:
    """The integral of phi from 0 to t:  t - (3/5) [1 - (1 - t)^(5/3)]."""
    return annulus.potential(annulus.width_under(t))


def loss(t: Number) -> Number:
    """The loss e(t) = 1 - (1 - t)^(5/3) - (5 t / 6) [1 + (1 - t)^(2/3)], of third order in t.

    A cycle between Q and -Q loses (9 (2 - nu) f^2 P^2 / (5 G a)) e(Q / (f P)) in both bodies, with
    the shear modulus G and the contact radius a.
    """
    return annulus.loss(annulus.width_under(t))
