"""Radii of shells about asperities that do not overlap: with them the coupling is semidefinite.

The lemma is proved in docs/theory/convexity.md, "Why (2) is not convex as it stands".
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Array, evenly
from convexrough.influence.coupling import Influence
from convexrough.roundoff import SAFETY


def shells(influence: Influence) -> Array:
    """1 / (pi E* s_i) (n,) with s_i half the distance to the nearest neighbour: s_i + s_j <= r_ij.

    A + diag(shells) is positive semidefinite (docs/theory/convexity.md). A shell is 0 for a single
    asperity, and infinite where rounding leaves no distance.
    """

    def about(separations: Array) -> Array:
        with np.errstate(divide="ignore"):
            return np.asarray(2.0 * influence.scale / separations)

    return evenly(about, influence.separations())


def fitted_shells(influence: Influence, radii: Array, share: float) -> Array:
    """`shells` adapted to contact radii a (n,) [length] of neighbours that differ in size.

    docs/theory/certificate.md, "Which box", 3: the radii are
    s_i = share a_i / c + (1 - share) d_i / 2, where c is the crowding, the largest
    (a_i + a_j) / r_ij, and d_i the distance to the nearest neighbour. Both a_i / c and d_i / 2
    satisfy s_i + s_j <= r_ij, so their mean does. Every a_i / s_i is at most c / share.
    """
    crowding = influence.crowding(radii) * (1.0 + SAFETY + 2.0 * influence.entry_error)
    s = (1.0 - share) * influence.separations() / 2.0
    if 0 < crowding < np.inf:
        s = s + share * (radii / crowding)
    with np.errstate(divide="ignore"):
        values: Array = influence.scale / s
    return values
