"""Paths of load P and shear force Q, followed from one straight segment to the next.

With the coefficient of friction f, the points of a path are (P, T) with T = Q / f. The memory curve
(docs/theory/paths.md) stores the friction state: forces and displacements are sums over its
vertices, the loss along a segment a sum over `curve.Piece`. If order fails (`friction.order`), the
memory curve does not apply. Then `general_step` computes the states, without proofs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import accumulate, chain, pairwise

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arithmetic.balls import Ball, stacked
from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve, Piece, Point
from convexrough.friction.general_step import SteppedPath, Stepper, followed
from convexrough.friction.levels import FrictionLevels, rounded
from convexrough.friction.order import Order
from convexrough.friction.state import States, losses, states_of, statuses_of

#: Numbers of cycles that are followed by general steps until the loss of the last one changes by at
#: most STEADY of itself, or of a tenth of the first.
CYCLES, STEADY = (3, 6, 12), 1e-3

#: Largest total number of vertices of the memory curves along a path. A vertex takes 300 bytes.
MOST_VERTICES = 2 * 10**7


@dataclass(frozen=True, eq=False)
class Walk:
    """A path of straight segments from the friction state `start` through m points (P, T)."""

    levels: FrictionLevels
    start: MemoryCurve
    points: Sequence[Point]
    steps: int | None = None  # general steps per segment; None: none unless order fails
    stepper: type[Stepper] = Stepper

    @property
    def forces(self) -> Array:
        """(m,) [force] the shear force Q = f T at each point."""
        f = Fraction(checks.friction(self.levels.scene.friction))
        return frozen(np.array([float(f * T) for _, T in self.points]))

    @cached_property
    def _segments(self) -> tuple[list[MemoryCurve], list[list[Piece]]]:
        curves, costs, vertices = [self.start], list[list[Piece]](), 0
        for k, (load, height) in enumerate(self.points, 1):
            curve, pieces = curves[-1].go(load, height)
            curves.append(curve)
            costs.append(pieces)
            vertices += len(curve.levels)
            if vertices > MOST_VERTICES:
                found = f"{vertices:,} vertices of memory curves up to point {k:,}"
                expected = f"at most {MOST_VERTICES:,}: use fewer reversals within reversals"
                raise InputError("path", found=found, expected=expected)
        return curves[1:], costs

    @property
    def curves(self) -> list[MemoryCurve]:
        """The memory curve after each point."""
        return self._segments[0]

    @property
    def pieces(self) -> list[list[Piece]]:
        """The pieces of each segment; their losses add up to the loss of the segment."""
        return self._segments[1]

    @cached_property
    def needed(self) -> set[Fraction]:
        """The loads of all levels that states, statuses and losses need."""
        bent = {load for curve in self.curves for load, bend in curve.bends if bend}
        fronts = {curve.front for curve in self.curves if curve.front is not None}
        return bent | fronts | {x for piece in chain(*self.pieces) for x in piece[2:]}

    @cached_property
    def order(self) -> Order:
        """What is proved about order, from the lowest of the needed loads to the contact's load."""
        return self.levels.order(self.needed)

    @cached_property
    def general(self) -> SteppedPath | None:
        """Results of general steps. If `steps` is None, they are taken only if order fails and the
        normal solution of the contact is proved.
        """
        if self.steps is None and (self.order != "fails" or not self.levels.proved):
            return None
        return followed(self.stepper(self.levels), self.start, self.points, self.steps)

    def states(self, which: Indices | slice = slice(None)) -> States:
        """The states at the m points, for the candidates `which`, by default all."""
        if self.general is not None:
            moved, *each = self.general.states
            return States(moved, *(values[:, which] for values in each))
        found = states_of(self.levels, self.curves, which)
        if self.order == "fails":
            return States(*(Ball.around(each.mid, np.inf) for each in found))
        return found

    def status(self) -> NDArray[np.str_]:
        """(m, N) the statuses at each point."""
        if self.general is not None:
            return self.general.status
        each = [statuses_of(self.levels, curve, self.order) for curve in self.curves]
        return frozen(np.array(each))

    def losses(self) -> tuple[Array, Array]:
        """(m,) [force length] energy lost since the start, and proved bounds on the errors."""
        unknown = frozen(np.full(len(self.points), np.inf))
        if self.general is not None:
            return self.general.losses, unknown
        each = losses(self.levels, self.pieces)
        since_start = stacked([*accumulate(each[k] for k in range(len(each)))])
        spent, errors = rounded(since_start * self.levels.loss_unit)
        return spent, errors if self.order == "proved" else unknown


class Closed(Walk):
    """A closed path of m points. The memory curve follows it twice; the second cycle is the steady
    one. `general` repeats it until the loss settles.
    """

    @classmethod
    def around(cls, levels: FrictionLevels, start: MemoryCurve, points: Sequence[Point]) -> Closed:
        return cls(levels, start, [*points, *points, points[0]])

    @property
    def once(self) -> int:
        """The number m of points of one cycle."""
        return len(self.points) // 2

    @property
    def steady(self) -> list[MemoryCurve]:
        """The memory curve at each point of the second cycle."""
        return self.curves[self.once + 1 :]

    @property
    def cycles(self) -> tuple[list[Piece], list[Piece]]:
        """The pieces of the loss up to the end of the first cycle, and of each later cycle."""
        end = self.once + 1
        return [*chain(*self.pieces[:end])], [*chain(*self.pieces[end:])]

    @cached_property
    def general(self) -> SteppedPath | None:
        """Results of general steps (see `Walk.general`) along so many cycles that their loss
        settles, but at most the largest of `CYCLES`.
        """
        if self.order != "fails" or not self.levels.proved:
            return None
        points, found = list(self.points[: self.once]), None
        for count in CYCLES:
            found = followed(self.stepper(self.levels), self.start, [*points * count, points[0]])
            losses = self.losses_of(found)
            if np.isnan(losses[-2:]).any() or self.settled(losses):
                break
        return found

    def losses_of(self, path: SteppedPath) -> Array:
        """The loss of each cycle of a path of several cycles."""
        return np.diff(path.losses[self.once :: self.once], prepend=0.0)

    def settled(self, losses: Array) -> bool:
        """True if the losses of the cycles 1, 2, ... no longer change."""
        change, limit = abs(losses[-1] - losses[-2]), STEADY * max(losses[-1], 0.1 * losses[0])
        return bool(change <= limit)

    @cached_property
    def stuck(self) -> Point:
        """The point (L*, T*) through which the memory curve always passes from cycle 2 on."""
        plus, minus = min(p + t for p, t in self.points), min(p - t for p, t in self.points)
        return (plus + minus) / 2, (plus - minus) / 2

    @property
    def one_loop(self) -> bool:
        """True if, at constant load, the shear force rises and falls once in a cycle."""
        loads, heights = zip(*self.points[: self.once + 1], strict=True)
        rises = [b > a for a, b in pairwise(heights) if a != b]
        return len({*loads}) == 1 and sum(a != b for a, b in pairwise(rises)) <= 2

    @property
    def least(self) -> Fraction:
        return min(load for load, _ in self.points)

    @cached_property
    def needed(self) -> set[Fraction]:
        return super().needed | {self.stuck[0], self.least}
