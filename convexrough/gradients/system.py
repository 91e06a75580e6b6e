"""The linear system of every derivative: that of Newton's method at the state itself.

With slopes c >= 0 of a pressed contact or of a friction state, right side g and a shift beta,

    Y + A (c Y) = g + beta,      sum c Y = total,     or beta = 0 where no sum is prescribed.

c Y are forces and Y lengths, or their adjoints (docs/theory/gradients.md, "One system").
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.convex.newton_step import FACTORISED, correct
from convexrough.errors import SolverError
from convexrough.shearing.energy import TangentialEnergy

#: What is left of the defect of a system, in the norm of c, unless less is asked for. Matrices
#: leave rounding only.
TOLERANCE = 1e-9

#: What may be asked for: more is rounding, and less is no answer.
LEAST, MOST = 1e-16, 1e-2

#: What one call of conjugate gradients is asked for at most: single precision leaves 2e-6.
EACH = 1e-5

MOST_REFINEMENTS = 40

#: A defect that refinement cannot bring below this part of its first size is no rounding.
SOLVED = 1e-6


class Solution(NamedTuple):
    """Y; beta; and the defect that is left: Y + A (c Y) - g - beta, 0 where c is."""

    values: Array
    shift: float
    defect: Array


class System:
    """I + A diag(c) for the loaded asperities of a contact, own units.

    slopes    : (n,) c
    tolerance : of the defect, in the norm of c, over that at the start
    """

    def __init__(
        self, energy: TangentialEnergy, slopes: Array, tolerance: float = TOLERANCE
    ) -> None:
        self.energy, self.slopes = energy, slopes
        self.tolerance = checks.between("tolerance", tolerance, LEAST, MOST)

    def solve(self, right: Array, total: float | None = None) -> Solution:
        """By refinement against the true defect, until it is small or rounding.

        right : (n,) g;  total : sum c Y; None for beta = 0

        Raises SolverError where it does not fall: there the state has no derivative.
        """
        c, weight = self.slopes, float(self.slopes.sum())
        sticks = c > 0
        Y = np.zeros_like(right)
        if total is not None:
            Y += total / weight
        best, least, first = None, np.inf, 0.0
        for _ in range(MOST_REFINEMENTS):
            left = right - self.energy.couple(c * Y)
            beta = 0.0 if total is None else float(c @ (Y - left)) / weight
            # Where c is 0 nothing depends on Y: it takes what is left to it.
            Y = np.where(sticks, Y, left + beta)
            defect = Y - left - beta
            size = float(np.sqrt(c @ defect**2))
            first = max(first, size, float(np.sqrt(c @ right**2)))
            halved = size < 0.5 * least
            if size < least:
                best, least = Solution(Y, beta, defect), size
            if size == 0.0 or not halved or (not self._direct and size <= self.tolerance * first):
                break
            Y = Y + self._step(defect, total is not None, 0.5 * self.tolerance * first / size)
            if total is not None:
                Y += (total - float(c @ Y)) / weight
        if best is None or not least <= max(SOLVED, self.tolerance) * first:
            raise SolverError(
                "the state has no derivative: its linear system is singular, or nearly",
                solver="gradient",
                advice="the energy need not be convex there: press less hard",
            )
        return best

    @property
    def _direct(self) -> bool:
        return self.energy.influence.at_hand and len(self.energy) <= FACTORISED

    def _step(self, defect: Array, balanced: bool, enough: float) -> Array:
        """(n,) d of `convex.newton_step`."""
        energy, root = self.energy, np.sqrt(self.slopes)
        if not self._direct:
            left = max(EACH, enough)
            return correct(
                energy.influence, energy.shells, root, defect, balanced=balanced, tolerance=left
            )
        from scipy.linalg.lapack import dpotrs  # 0.2 s to import: only when solving

        touching, factor = self._factor
        w = root[touching]
        right = np.stack((w * defect[touching], w))
        y, border = dpotrs(factor, right.T, lower=1)[0].T
        shift = float(w @ y) / float(w @ border) if balanced else 0.0
        changes = np.zeros_like(defect)
        changes[touching] = w * (y - shift * border)
        step: Array = shift - defect + energy.couple(changes)
        return step

    @cached_property
    def _factor(self) -> tuple[Indices, Any]:
        """Where c is positive, and Cholesky's factor of I + W A W there, W = diag(c)^(1/2)."""
        from scipy.linalg.lapack import dpotrf

        touching = np.flatnonzero(self.slopes)
        w = np.sqrt(self.slopes[touching])
        matrix = self.energy.influence.submatrix(touching)
        matrix *= w
        matrix *= w[:, None]
        np.fill_diagonal(matrix, 1.0)
        factor, failed = dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
        if failed:
            raise SolverError(
                "the state has no derivative: the energy is not convex there",
                solver="gradient",
                advice="press less hard, or on sharper tips",
            )
        return touching, factor
