"""Derivatives of a number at one load level, as balls in the scaled units of the level.

A level is the normal solution at a total load L (`normal.level`): loads P, approach D0,
indentations n (minus the gap where open), and energy V. It depends on the offsets d, the
coefficients k of Hertz's law and the compliance matrix A. (1), (2) and (4) of
docs/theory/gradients.md give its derivatives; the names v, w and lambda in this module are those
of (4).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import numpy as np

from convexrough.arithmetic.balls import Ball, where
from convexrough.errors import InputError
from convexrough.normal.level import Level

ZERO = Ball.exact(0.0)

#: Derivatives of a level's total load (in scaled units), by the names of the parameters.
Moves: TypeAlias = Mapping[str, Ball]


@dataclass(frozen=True)
class Part:
    """The part of a number that comes from one level: a weighted sum of V, D0, P and n.

    energy, approach : weights of V and D0
    loads, indentations : (n,) weights of P and n
    All weights turn scaled units of the level into the unit of the number.
    moves : derivatives of the level's total load by parameters of the number
    """

    level: Level
    energy: Ball = ZERO
    approach: Ball = ZERO
    loads: Ball | None = None
    indentations: Ball | None = None
    moves: Moves = field(default_factory=dict)

    @property
    def value(self) -> Ball:
        level = self.level
        total = self.approach * level.approach
        if self.energy.size > 0.0:
            total = total + self.energy * level.energy
        if self.loads is not None:
            total = total + self.loads.dot(level.loads)
        if self.indentations is not None:
            total = total + self.indentations.dot(level.indentation)
        return total

    @property
    def length(self) -> Ball:
        """The part of the value that is a sum of lengths and so does not scale with forces."""
        far = self.approach * self.level.approach
        if self.indentations is not None:
            far = far + self.indentations.dot(self.level.indentation)
        return far


class Pulled(NamedTuple):
    """The derivative  offsets'dd + local'd log k + left'dA P + load dL  of a `Part`.

    offsets, local, left : (n,) coefficients in this derivative
    load  : coefficient of the change dL of the total load L
    loads, coupled : (n,) P and A P
    total : L
    steep : weight of D0 if L = 0, where the derivative dD0/dL is infinite
    """

    offsets: Ball
    local: Ball
    left: Ball
    load: Ball
    loads: Ball
    coupled: Ball
    total: Ball
    steep: Ball = ZERO

    @classmethod
    def of(cls, part: Part) -> Pulled:
        level, v, w = part.level, part.indentations, part.loads
        weight = part.approach if v is None else part.approach + v.sum()
        P, zero = level.loads, Ball.exact(np.zeros(len(level.problem)))
        coupled = level.approach + level.problem.exact.offsets - level.indentation
        own = part.energy * P
        by_load = part.energy * level.approach
        if level.trial is None:
            moved, jump = _first_touch(level, weight, w)
            lifted = moved if v is None else moved + v
            return cls(lifted, zero, zero, by_load + jump, zero, zero, level.load, weight)
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
        local = (own * 3.0 / 5.0 - moved) * level.indentation.positive_part()
        return cls(lifted - own, local, own * 0.5 - lifted, by_load, P, coupled, level.load)

    def times(self, factor: Ball) -> Pulled:
        return self._replace(
            offsets=factor * self.offsets,
            local=factor * self.local,
            left=factor * self.left,
            load=factor * self.load,
            steep=factor * self.steep,
        )


def _first_touch(level: Level, weight: Ball, w: Ball | None) -> tuple[Ball, Ball]:
    """Coefficients of dd and dL at the load 0: there D0 is -d_i of the first asperity to touch."""
    offsets = level.problem.exact.offsets
    first = offsets.upper >= offsets.lower.max()
    if np.count_nonzero(first) > 1:
        expected = "a force below f P: where several asperities slide last there is no derivative"
        raise InputError("force", found="gross sliding", expected=expected)
    zero = Ball.exact(np.zeros(len(offsets)))
    moved = where(first, zero - weight, zero)
    return moved, ZERO if w is None else w[int(np.argmax(first))]


def product(level: Level, weights: Ball) -> Ball:
    """A times weights, with error bounds: the sum of their radii times the largest entry of A."""
    problem = level.problem
    coupled = problem.product(weights.mid)
    if weights.radius.any():
        coupled = Ball.around(
            coupled.mid, coupled.radius + weights.radius.sum() * problem.largest_entry
        )
    return coupled


def value_of(parts: Iterable[Part]) -> Ball:
    return sum((part.value for part in parts), start=ZERO)
