"""Loads and displacements bounded in the sup norm: by the largest residual, whatever their number.

Proved in docs/theory/sup-norm.md. For a residual f = (diag(h) + A) v let asperity i be a shell of
radius t_i = tau scale / h_i that carries v_i, and q the packing of the shells, the largest
t_i / (r_ij - t_j). If q < 1, q < tau and F(q, tau) > 0, the potential of all shells is at most

    K = max |f| / F,     and     V_i = scale |v_i| / t_i <= (|f_i| + K) / (tau - q).

The letters, and the names here:

    tau, q, F, h    size, packing, firmness, stiffness
    K               potential
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.influence.coupling import Coupling, Influence
from convexrough.roundoff import SAFETY

#: Sizes tau of shells that are tried. Heuristic: any one proves what it says.
SIZES = (0.9, 1.0, 1.1, 1.2, 1.3)

#: A packing is taken to be no less than this, which loses nothing: so nothing cancels in F.
LEAST = 0.01

#: ... and F is lowered by this for rounding, and must then be more: below it nothing is proved.
FIRMNESS_ROUNDING, LEAST_FIRMNESS = 1e-12, 1e-3


class SupNorm(NamedTuple):
    """What a residual of at most 1 can do to loads whose difference has the stiffness h."""

    size: float  # tau
    packing: float  # q
    firmness: float  # F
    stiffness: Array  # h
    largest: float  # [length] the largest radius of a shell

    @classmethod
    def of(cls, influence: Influence, stiffness: Array) -> SupNorm | None:
        """For a stiffness (n,) that is at least that of the theorem; None where it is silent."""
        radii = influence.scale / stiffness * (1 + SAFETY)
        alone = influence.packing(radii)
        if not alone < 1:
            return None

        def of_equal_neighbours(size: float) -> float:
            return size * alone / (1.0 + alone - size * alone)

        def promise(size: float) -> tuple[float, float]:
            return _weakness(of_equal_neighbours(size), size), -size

        for size in sorted(SIZES, key=promise):
            packing = max(influence.packing(size * radii) * (1 + SAFETY), LEAST)
            if _weakness(packing, size) < np.inf:
                largest = size * float(radii.max(initial=0.0))
                return cls(size, packing, firmness(packing, size), stiffness, largest)
        return None

    def load_errors(self, residuals: Array, largest: float) -> Array:
        """(n,) bounds on |v|, from bounds on |f| and the largest of them."""
        potential = self._potential(largest)
        return np.asarray(self._each * (residuals + potential) / self.stiffness)

    @property
    def growth(self) -> float:
        """C: |v_i| <= C max |f| / h_i."""
        return self._each * (1.0 + 1.0 / self.firmness) * (1 + SAFETY)

    def moves(self, influence: Influence, largest: float) -> Array:
        """(n,) bounds on |(A v)_i|, |f| at most `largest`: K + q V_i within a shell of its own."""
        own = self._potential(largest) + self.packing * self._charge(largest)
        moved = np.full(len(self.stiffness), own)
        bare = np.isinf(self.stiffness)
        if bare.any():
            moved[bare] = self.moves_at(influence, largest)[bare]
        return moved

    def moves_at(self, coupling: Coupling, largest: float) -> Array:
        """(m,) bounds elsewhere: K, but within a shell, of which there is one at most, K + more."""
        with np.errstate(divide="ignore"):
            within = np.maximum(self.largest / coupling.clearances() - 1.0, 0.0)
        return np.asarray(self._potential(largest) + within * self._charge(largest))

    @property
    def _each(self) -> float:
        """Of |f_i| + K, over h_i, that |v_i| can be."""
        return self.size / (self.size - self.packing) * (1 + SAFETY)

    def _potential(self, largest: float) -> float:
        """K."""
        return largest / self.firmness * (1 + SAFETY)

    def _charge(self, largest: float) -> float:
        """The largest V_i."""
        return self.growth * largest / self.size


def firmness(packing: float, size: float) -> float:
    """F(q, tau) less its rounding; not positive where nothing follows.

    The least of x / kappa - 1 + 2 alpha over caps of the sphere: alpha the part of its area in the
    cap, 1 - x / 2 the harmonic measure of the cap at a distance q from the centre.
    """
    q = packing
    slope = (size - q) / (1.0 - q)  # 1 / kappa
    # w, to the cap's rim
    distance = min(max(math.cbrt((1.0 - q * q) * slope), 1.0 - q), 1.0 + q)
    height = (1.0 + q * q - distance * distance) / (2.0 * q)  # y, the cosine of its angle
    measure = (1.0 - q * q) / (2.0 * q) * (1.0 / (1.0 - q) - 1.0 / distance)  # omega
    return 2.0 * (1.0 - measure) * slope - height - FIRMNESS_ROUNDING


def _weakness(packing: float, size: float) -> float:
    """C, infinite where nothing is proved."""
    packing = max(packing, LEAST)
    if not packing < min(1.0, size):
        return np.inf
    if not (firm := firmness(packing, size)) > LEAST_FIRMNESS:
        return np.inf
    return size / (size - packing) * (1.0 + 1.0 / firm)
