"""Shells about asperities that do not overlap: what makes the coupling positive semidefinite.

The lemma is proved in docs/theory/convexity.md, "Why (2) is not convex as it stands".
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Array, evenly
from convexrough.influence.coupling import Influence
from convexrough.roundoff import SAFETY


def shells(influence: Influence) -> Array:
    """(n,) 1 / (pi E* s_i) of radii s_i with s_i + s_j <= r_ij: half the nearest distances.

    With them A + diag(shells) is positive semidefinite (docs/theory/convexity.md). A single
    asperity has no neighbour; infinite where rounding leaves no shell.
    """

    def about(separations: Array) -> Array:
        with np.errstate(divide="ignore"):
            return np.asarray(2.0 * influence.scale / separations)

    return evenly(about, influence.separations())


def fitted_shells(influence: Influence, radii: Array, share: float) -> Array:
    """`shells` that fit contact radii a (n,) [length] where neighbours differ in size.

    docs/theory/certificate.md, "Which box", 3:

    s_i = share a_i / c + (1 - share) d_i / 2  with c the crowding, the largest (a_i + a_j) / r_ij,
    and d_i the distance to the nearest neighbour: each part keeps s_i + s_j <= r_ij, so their
    mean does. Then every a_i / s_i is at most c / share.
    """
    crowding = influence.crowding(radii) * (1.0 + SAFETY + 2.0 * influence.entry_error)
    s = (1.0 - share) * influence.separations() / 2.0
    if 0 < crowding < np.inf:
        s = s + share * (radii / crowding)
    with np.errstate(divide="ignore"):
        values: Array = influence.scale / s
    return values
