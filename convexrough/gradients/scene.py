"""How offsets d, coefficients k of Hertz's law and the compliance matrix A depend on a scene.

The derivatives of docs/theory/gradients.md, "Derivatives by the data of a scene", as balls (numbers
with error bounds). They follow from

    d = z - (x^2 bx + y^2 by) / 2,    k^3 = (9/16) (1/R + 1/rho) / E*^2,
    A_ij = 1 / (pi E* |c_i - c_j|).

An asperity has the summit r = (x, y) at the height z and the tip radius rho. The pressed body has a
curvature 1/R along each axis; in k, 1/R is the mean of both. In the geometry "summit" the effective
curvatures are b = 1/R and the contact points c = r. In "closest" they are b = 1 / (R + rho) and
c = r / (1 + rho/R).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from convexrough.arithmetic.balls import Ball, joined, of_rows, where
from convexrough.arrays import Array, Indices
from convexrough.normal.problem import NormalProblem
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.base import along

#: Largest number of loaded asperities for which sums over asperities are computed with balls.
IN_BALLS = 1000

#: Number of terms whose balls are computed together.
BLOCK = 2**16


class Bending(NamedTuple):
    """Changes of n asperities: (n,) dd [length], (n,) d(log k) and (n, 2) dc [length]."""

    offsets: Ball
    local: Ball
    points: Ball


@dataclass(frozen=True)
class Geometry:
    """The geometry of n asperities, in the scene's units, as balls."""

    problem: NormalProblem
    points: Ball  # (n, 2) r
    tips: Ball  # (n,) rho
    curvature: Ball  # (2,) 1/R along x and y
    share: Ball  # (n, 2) c / r

    @classmethod
    def of(cls, problem: NormalProblem, which: Indices) -> Geometry:
        """The geometry of the asperities `which` of the scene."""
        asperities, radii = problem.scene.asperities, np.array(along(problem.scene.sphere_radius))
        r, rho = asperities.positions[which], Ball.exact(asperities.tip_radii[which])
        bent = np.isfinite(radii)
        inverse = 1.0 / Ball.exact(np.where(bent, radii, 1.0))
        curvature = where(bent, inverse, Ball.exact(np.zeros(2)))
        share = Ball.exact(np.ones(r.shape))
        if problem.scene.geometry == "closest":
            share = 1.0 / (1.0 + rho[:, None] * curvature)
        return cls(problem, Ball.exact(r), rho, curvature, share)

    @property
    def closest(self) -> bool:
        return self.problem.scene.geometry == "closest"

    @cached_property
    def bend(self) -> Ball:
        """(n, 2) b."""
        return self.share * self.curvature

    @cached_property
    def relative(self) -> Ball:
        """(n,) 1 / (1/R + 1/rho)."""
        return 1.0 / (self.curvature.sum() * 0.5 + 1.0 / self.tips)

    @cached_property
    def by_tip(self) -> Bending:
        r, local = self.points, -self.relative / (3.0 * self.tips * self.tips)
        if not self.closest:
            return Bending(0.0 * local, local, 0.0 * r)
        outwards = r * self.share * self.share * self.curvature
        return Bending((r * r * self.bend * self.bend).sum() * 0.5, local, -outwards)

    @cached_property
    def by_radius(self) -> Bending:
        squared = self.curvature[0] * self.curvature[0]
        flatter = self.points * self.share * self.share * squared
        outwards = flatter * self.tips[:, None] if self.closest else 0.0 * flatter
        local = -self.relative * squared / 3.0
        return Bending((self.points * flatter).sum() * 0.5, local, outwards)

    def bent(self, heights: Ball, tips: Ball, moved: Ball, radius: Ball) -> Bending:
        """Changes due to those of z and rho (n,), of r (n, 2), and of the radius of a sphere."""
        a, b, sunk = self.by_tip, self.by_radius, (self.points * self.bend * moved).sum()
        return Bending(
            heights - sunk + tips * a.offsets + radius * b.offsets,
            tips * a.local + radius * b.local,
            self.share * moved + tips[:, None] * a.points + radius * b.points,
        )

    def slopes(self, loads: Sequence[Ball], which: Indices) -> list[Ball]:
        """(m, 2) for each vector P, the sums  -scale sum_j (c_i - c_j) P_j / |c_i - c_j|^3.

        scale is 1 / (pi E*) in scaled units. The P are loads (m,) of the asperities `which`. For
        more than IN_BALLS asperities the sums are computed in float64, and the error bounds are
        infinite if no compliance matrix is stored.
        """
        if len(which) <= IN_BALLS:
            return self._in_balls(loads, which)
        A, found = self.problem.influence.restricted(which), []
        for P in loads:
            size: Array | float = np.inf
            if A.name == "dense":
                off = (len(which) + 16) * ROUNDOFF + 4.0 * A.entry_error
                size = A.falloff(np.abs(P.value) * off + P.error, 2) * A.scale * (1 + SAFETY)
                size = size[:, None]
            found.append(Ball.around(A.slopes(P.value), size))
        return found

    def _in_balls(self, loads: Sequence[Ball], which: Indices) -> list[Ball]:
        points = (self.points * self.share if self.closest else self.points)[which]  # c
        scale, n = self.problem.exact.scale, len(which)
        found: list[list[Ball]] = [[] for _ in loads]
        rows = max(1, BLOCK // max(1, n))
        for start in range(0, n, rows):
            some = np.arange(start, min(start + rows, n))
            itself = (np.arange(len(some)), some)
            x, y = (points[some, k][:, None] - points[None, :, k] for k in (0, 1))
            squares = x * x + y * y
            apart = np.ones(squares.shape, dtype=bool)
            apart[itself] = False
            squares = where(apart, squares, 1.0 + 0.0 * squares)
            falloff = where(apart, -scale / (squares * squares.sqrt()), 0.0 * squares)
            x, y = x * falloff, y * falloff
            for kept, P in zip(found, loads, strict=True):
                sums = (x * P[None, :]).sum(), (y * P[None, :]).sum()
                kept.append(of_rows(lambda *each: np.stack(each, axis=-1), *sums))
        return [joined(each) for each in found]
