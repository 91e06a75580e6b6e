"""Directions of one linear system of Newton's method, used again in the next.

The systems (I + W A W) y = r of successive steps have nearly the same matrix. Conjugate gradients
know A v for the load changes v = W p that they have made, whatever W is in the next step: there
p = v / W, and K p = p + W A v. With P and Q = K P of some former directions, G = P'Q, and M an
approximate inverse,

    H  =  P G^-1 P'  +  (I - P G^-1 Q') M (I - Q G^-1 P')

is the exact inverse on the range of P and as good as M beside it: symmetric and positive definite,
as M is, and G (Gratton, Sartenaer and Tshimanga, SIAM J. Optim. 21 (2011) 912). What few directions
made M slow are gone. docs/theory/newton.md, "Many".
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.influence.coupling import Smoother

Values = NDArray[Any]  # of single or double precision

#: So many directions are kept, the first there are: a heuristic. More cost more than they save.
MOST = 6

#: Directions that depend on the others but for this part say nothing, in single precision.
DEPENDENT = 1e-3


class Recycled:
    """Load changes v = W p, scaled so that p'K p = 1, and A v."""

    def __init__(self) -> None:
        self.changes: list[Values] = []
        self.displacements: list[Values] = []

    @property
    def full(self) -> bool:
        return len(self.changes) >= MOST

    def add(self, change: Values, displacement: Values, curvature: float) -> None:
        factor = change.dtype.type(1.0 / np.sqrt(curvature))
        self.changes.append(change * factor)
        self.displacements.append(displacement * factor)

    def deflated(self, smooth: Smoother, w: Values) -> Smoother:
        """H for the W of now; M as long as nothing is kept."""
        if not self.changes:
            return smooth
        bare = np.divide(1, w, out=np.zeros_like(w), where=w > 0)
        changes, displacements = np.stack(self.changes), np.stack(self.displacements)
        changes *= w > 0  # those that have opened since
        p = changes * bare
        gram = (p @ p.T + changes @ displacements.T).astype(np.float64)
        values, vectors = np.linalg.eigh((gram + gram.T) / 2.0)
        sound = values > DEPENDENT * values[-1]
        inverse = ((vectors[:, sound] / values[sound]) @ vectors[:, sound].T).astype(w.dtype)
        q = displacements * w
        q += p

        def smoothed(residual: Values) -> tuple[Values, float]:
            along = inverse @ (p @ residual)
            z, left = smooth(residual - along @ q)
            z += (along - inverse @ (q @ z)) @ p
            return z, left

        return smoothed
