"""Shells: imagined spheres, one around each asperity, which do not overlap.

Let their radii be s_i. Then A + diag(1 / (pi E* s_i)) is positive semidefinite, with the compliance
operator A and the modulus E*: docs/theory/convexity.md, "Why (2) is not convex as it stands".
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Array, evenly
from convexrough.influence.coupling import Influence
from convexrough.roundoff import SAFETY


def shells(influence: Influence) -> Array:
    """(n,) 1 / (pi E* s_i), where s_i is half the distance to the nearest neighbour.

    A value is 0 for a single asperity, and infinite for points that may coincide.
    """
    separations = influence.separations()
    with np.errstate(divide="ignore"):
        return evenly(lambda apart: 2.0 * influence.scale / apart, separations)


def fitted_shells(influence: Influence, radii: Array, share: float) -> Array:
    """(n,) 1 / (pi E* s_i), where the shell radii s_i are adapted to contact radii a_i = `radii`.

    s_i = share a_i / c + (1 - share) d_i / 2, where c is the largest (a_i + a_j) / r_ij, and d_i
    the distance to the nearest neighbour: docs/theory/certificate.md, "Choice of the box", 3.
    """
    crowding = influence.crowding(radii) * (1.0 + SAFETY + 2.0 * influence.entry_error)
    s = (1.0 - share) * influence.separations() / 2.0
    if 0 < crowding < np.inf:
        s = s + share * (radii / crowding)
    with np.errstate(divide="ignore"):
        return np.asarray(influence.scale / s)
