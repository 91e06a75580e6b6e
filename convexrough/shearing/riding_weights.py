"""Weights that a common shift of all residuals is read off with: docs/theory/shear-sup-norm.md.

For a residual f = M v, M = diag(h) + A, and any weights mu >= 0,

    sum v = sum mu f + sum_j v_j (1 - (M mu)_j).

The better mu solves M mu = 1, the less is left of the last sum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.energy import TangentialEnergy

#: What conjugate gradients may leave of M mu = 1. Heuristic: what is left is part of the bound.
LEFT = 1e-4

#: Roundoffs of a stiffness and of the sums that it is in.
OFF_ROUNDOFFS = 40


class Weights(NamedTuple):
    """mu, and what it leaves of M mu = 1 for every h in a range."""

    values: Array  # (n,) mu
    total: float  # sum mu; 0 where there are none
    off: Array  # (n,) bounds on |(M mu)_j - 1|

    @classmethod
    def of(cls, energy: TangentialEnergy, softest: Array, stiffest: Array) -> Weights:
        """Of asperities of a stiffness (n,) in this range; 0 where it has no upper end."""
        A, ends = energy.influence, np.isfinite(stiffest)
        slopes = np.divide(1.0, softest, out=np.zeros_like(softest), where=ends)
        mu = _riding(energy, slopes)
        own, coupled = np.where(ends, softest, 0.0) * mu, A.apply(mu)
        off = np.abs(own + coupled - 1.0) + (np.where(ends, stiffest, 0.0) * mu - own)
        off += A.rounding(mu).of(coupled) + OFF_ROUNDOFFS * ROUNDOFF * (own + np.abs(coupled) + 1.0)
        return cls(mu, float(mu.sum()) * (1 - SAFETY), off * (1 + SAFETY))

    def mean(self, values: Array) -> float:
        """sum mu x / sum mu, as computed."""
        return float(self.values @ np.where(self.values > 0, values, 0.0)) / self.total

    @property
    def norm(self) -> float:
        """|| mu ||_2 / sum mu: the most that a vector of 2-norm 1 can have as its mean."""
        return float(np.linalg.norm(self.values)) / self.total * (1 + SAFETY)


def _riding(energy: TangentialEnergy, slopes: Array) -> Array:
    """(n,) about what the forces gain as the deep points move: M mu = 1 where there is a slope."""
    if not slopes.any():
        return slopes
    defect = np.full(len(slopes), -1.0)
    try:
        change = correct(
            energy.influence,
            energy.shells,
            np.sqrt(slopes),
            defect,
            balanced=False,
            tolerance=LEFT,
        )
    except SolverError:  # hopelessly crowded: any weights will do, and prove little
        return slopes
    weights: Array = slopes * np.maximum(change, 0.0)
    return weights if weights.any() else slopes
