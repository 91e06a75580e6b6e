"""Derivatives of results by the loads of levels, and by the data of a scene.

Derivatives are balls (numbers with error bounds). A level is the normal solution at a total load L
(`normal.level`): loads P, approach D0, indentations n (minus the gap of an open asperity), and
energy V, in scaled units. It depends on the offsets d, the coefficients k of Hertz's law and the
compliance matrix A. A result is a sum of parts, one for each level. (1), (2) and (4) of
docs/theory/gradients.md are the derivatives of a part, with the names v, w and lambda. Its section
"Derivatives by the data of a scene" derives those of d, k and A, which follow from

    d = z - (x^2 bx + y^2 by) / 2,    k^3 = (9/16) (1/R + 1/rho) / E*^2,
    A_ij = 1 / (pi E* |c_i - c_j|).

An asperity has the summit r = (x, y) at the height z and the tip radius rho. The pressed body has a
curvature 1/R along each axis; in k, 1/R is the mean of both. In the geometry "summit" the effective
curvatures are b = 1/R and the contact points c = r. In "closest" they are b = 1 / (R + rho) and
c = r / (1 + rho/R).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from convexrough import threads
from convexrough.arithmetic.balls import Ball, added, joined, of_rows, where
from convexrough.arrays import Indices
from convexrough.errors import InputError
from convexrough.normal.level import Level
from convexrough.normal.problem import NormalProblem
from convexrough.roundoff import SAFETY
from convexrough.scene.base import along

ZERO = Ball.exact(0.0)

#: Derivatives of a level's total load (in scaled units), by the names of the parameters.
Moves: TypeAlias = Mapping[str, Ball]

#: Largest number of loaded asperities for which sums over asperities are computed with balls.
IN_BALLS = 1000

#: Number of terms whose balls are computed together.
BLOCK = 2**16


class Slopes(NamedTuple):
    """The derivative of a `Part`:  offsets^T dd + local^T dlog k + left^T dA P + load dL.

    At the total load L = 0 the term of D0 is left out of `load`, because dD0/dL is infinite there.
    """

    offsets: Ball  # this and the following two are (n,)
    local: Ball
    left: Ball
    load: Ball


@dataclass(frozen=True)
class Part:
    """The part of a result that belongs to one level: a weighted sum of V, D0, P and n.

    The weights include the conversion from the scaled units of the level to the unit of the result.
    """

    level: Level
    energy: Ball = ZERO  # weight of V
    approach: Ball = ZERO  # weight of D0
    loads: Ball | None = None  # (n,) weights of P
    indentations: Ball | None = None  # (n,) weights of n
    moves: Moves = field(default_factory=dict)  # of this level

    @property
    def scaled(self) -> Ball:
        """The terms with V and P, which are proportional to the modulus if forces are, too."""
        total = self.energy * self.level.energy if self.energy.size > 0.0 else ZERO
        return total if self.loads is None else total + self.loads.dot(self.level.loads)

    @property
    def value(self) -> Ball:
        """The weighted sum."""
        total = self.scaled + self.approach * self.level.approach
        if self.indentations is not None:
            total = total + self.indentations.dot(self.level.indentation)
        return total

    @property
    def weight(self) -> Ball:
        """The weight of D0 in total, as D0 is also part of the indentations D0 + d - A P."""
        v = self.indentations
        return self.approach if v is None else self.approach + v.sum()

    @property
    def coupled(self) -> Ball:
        """(n,) A P."""
        level = self.level
        return added(level.problem.exact.offsets, level.approach, -level.indentation)

    @cached_property
    def slopes(self) -> Slopes:
        """The derivative of the weighted sum.

        Raises InputError at the load 0 if several asperities may touch first.
        """
        level, v, w, weight = self.level, self.indentations, self.loads, self.weight
        zero = Ball.exact(np.zeros(len(level.problem)))
        own, by_load = self.energy * level.loads, self.energy * level.approach
        if level.trial is None:  # the load 0, where D0 is -d_i of the first asperity to touch
            offsets = level.problem.exact.offsets
            first = offsets.upper >= offsets.lower.max()
            if np.count_nonzero(first) > 1:
                expected = "a force below f P, as several asperities slide last, at the same force"
                raise InputError("force", found="gross sliding", expected=expected)
            moved = where(first, zero - weight, zero)
            lifted = moved if v is None else moved + v
            jump = ZERO if w is None else w[int(np.argmax(first))]
            return Slopes(lifted, zero, zero, by_load + jump)
        moved = zero  # lambda - weight q
        if w is not None or v is not None:
            right = zero if w is None else w
            if v is not None:
                right = right - product(level, v)
            moved = level.response(right, ZERO).loads
            by_load = by_load + right.dot(level.tangent.loads)
        if weight.size > 0.0:
            moved = moved - weight * level.tangent.loads
            by_load = by_load + weight * level.tangent.approach
        lifted = moved if v is None else moved + v
        local = (own * Fraction(3, 5) - moved) * level.indentation.positive_part()
        return Slopes(lifted - own, local, own.scaled(0.5) - lifted, by_load)


def product(level: Level, weights: Ball) -> Ball:
    """A times weights. Radii count as if all entries of A were the largest one."""
    coupled = level.problem.product(weights.mid)
    spread = weights.radius.sum() * level.problem.largest_entry
    return Ball.around(coupled.mid, coupled.radius + spread)


class Bending(NamedTuple):
    """Changes of n asperities: (n,) dd [length], (n,) d(log k) and (n, 2) dc [length]; the number 0
    may stand for an array of zeros."""

    offsets: Ball
    local: Ball
    points: Ball


@dataclass(frozen=True)
class Geometry:
    """The geometry of n asperities, in the scene's units, as balls."""

    problem: NormalProblem
    points: Ball  # (n, 2) r
    tips: Ball  # (n,) rho, or (1,) in "summit" if all are equal
    curvature: Ball  # (2,) 1/R along x and y
    share: Ball  # (n, 2) c / r, or the number 1

    @classmethod
    def of(cls, problem: NormalProblem, which: Indices) -> Geometry:
        """The geometry of the asperities `which` of the scene."""
        asperities, radii = problem.scene.asperities, np.array(along(problem.scene.sphere_radius))
        r, rho = asperities.positions[which], asperities.tip_radii[which]
        bent = np.isfinite(radii)
        inverse = 1.0 / Ball.exact(np.where(bent, radii, 1.0))
        curvature = where(bent, inverse, Ball.exact(np.zeros(2)))
        closest = problem.scene.geometry == "closest"
        tips = Ball.exact(rho[:1] if not closest and (rho == rho[:1]).all() else rho)
        share = 1.0 / (1.0 + tips[:, None] * curvature) if closest else Ball.exact(1.0)
        return cls(problem, Ball.exact(r), tips, curvature, share)

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
            return Bending(ZERO, local, ZERO)
        outwards = r * self.share * self.share * self.curvature
        return Bending((r * r * self.bend * self.bend).sum() * 0.5, local, -outwards)

    @cached_property
    def by_radius(self) -> Bending:
        squared = self.curvature[0] * self.curvature[0]
        local = -self.relative * squared / 3.0
        if not self.closest:
            return Bending((self.points * self.points).sum() * (squared * 0.5), local, ZERO)
        flatter = self.points * (self.share * self.share * squared)
        return Bending((self.points * flatter).sum() * 0.5, local, flatter * self.tips[:, None])

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
        more than IN_BALLS asperities the compliance operator computes them.
        """
        if len(which) <= IN_BALLS:
            return self._in_balls(loads, which)
        A, found = self.problem.influence.restricted(which), []
        for P in loads:
            slopes, errors = A.slopes(P.value), np.full(len(which), np.inf)
            if np.isfinite(P.error).all():
                errors = A.falloff(P.error, 2) * A.scale
            found.append(Ball.around(slopes.mid, slopes.radius + errors[:, None] * (1 + SAFETY)))
        return found

    def _in_balls(self, loads: Sequence[Ball], which: Indices) -> list[Ball]:
        points = (self.points * self.share if self.closest else self.points)[which]  # c
        scale, every = self.problem.exact.scale, np.arange(len(which))
        found: list[list[Ball]] = [[] for _ in loads]
        for some in threads.chunks(len(which), max(1, BLOCK // max(1, len(which)))):
            x, y = (points[some, k][:, None] - points[None, :, k] for k in (0, 1))
            squares, apart = x * x + y * y, every[some, None] != every
            squares = where(apart, squares, 1.0 + 0.0 * squares)
            falloff = where(apart, -scale / (squares * squares.sqrt()), 0.0 * squares)
            x, y = x * falloff, y * falloff
            for kept, P in zip(found, loads, strict=True):
                sums = (x * P[None, :]).sum(), (y * P[None, :]).sum()
                kept.append(of_rows(lambda *each: np.stack(each, axis=-1), *sums))
        return [joined(each) for each in found]
