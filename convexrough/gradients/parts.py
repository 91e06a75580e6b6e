"""A scalar result as a sum of parts, one for each load level, and the derivatives of the parts.

Parts and derivatives are balls (numbers with error bounds). A level is the normal solution at a
total load L (`normal.level`): loads P, approach D0, indentations n (minus the gap of an open
asperity), and energy V, in scaled units. A level depends on the offsets d, the coefficients k of
Hertz's law and the compliance matrix A. Its derivatives are (1), (2) and (4) of
docs/theory/gradients.md. The names v, w and lambda in this module are those of (4).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from convexrough.arithmetic.balls import Ball, where
from convexrough.errors import InputError
from convexrough.normal.level import Level

ZERO = Ball.exact(0.0)

#: Derivatives of a level's total load (in scaled units), by the names of the parameters.
Moves: TypeAlias = Mapping[str, Ball]


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
        return level.approach + level.problem.exact.offsets - level.indentation

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
        local = (own * 3.0 / 5.0 - moved) * level.indentation.positive_part()
        return Slopes(lifted - own, local, own * 0.5 - lifted, by_load)


def product(level: Level, weights: Ball) -> Ball:
    """A times weights. Radii count as if all entries of A were the largest one."""
    coupled = level.problem.product(weights.mid)
    if not weights.radius.any():
        return coupled
    spread = weights.radius.sum() * level.problem.largest_entry
    return Ball.around(coupled.mid, coupled.radius + spread)
