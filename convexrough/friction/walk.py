"""A path of (P, T = Q / f) with its levels, states and losses: the basis of all friction results.

P is the load, Q the shear force, f the coefficient of friction; a level is the normal solution at
one load. States are sums over the levels of the memory curve. Losses are integrals over the pieces
of each segment (`curve.Piece`). If an indentation falls as the load rises, general steps compute
the results, without proofs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import TINY, UP, Ball
from convexrough.arithmetic.pairs import PAIR_ROUNDOFF, Pair
from convexrough.arrays import Array, frozen
from convexrough.friction.curve import MemoryCurve, Piece
from convexrough.friction.general_step import SteppedPath, Stepper, followed
from convexrough.friction.levels import FrictionLevels, rounded
from convexrough.friction.loss import losses
from convexrough.friction.order import Order
from convexrough.friction.state import Point, States, states_of, statuses_of, used_by
from convexrough.roundoff import SAFETY


@dataclass(frozen=True, eq=False)
class Walk:
    """A path from a memory curve through m points, with straight segments between them.

    levels  : the normal solutions of the contact
    start   : the memory curve before the first segment
    points  : the m points (P, T)
    steps   : number of general steps per segment; None takes general steps only if order fails
    stepper : solver of the general steps
    """

    levels: FrictionLevels
    start: MemoryCurve
    points: Sequence[Point]
    steps: int | None = None
    stepper: type[Stepper] = Stepper

    @cached_property
    def _followed(self) -> tuple[list[MemoryCurve], list[list[Piece]]]:
        return follow(self.start, self.points)

    @property
    def curves(self) -> list[MemoryCurve]:
        return self._followed[0]

    @property
    def pieces(self) -> list[list[Piece]]:
        return self._followed[1]

    @cached_property
    def needed(self) -> set[Fraction]:
        return levels_needed(self.curves, self.pieces)

    @cached_property
    def order(self) -> Order:
        """What is proved about order, from the lowest of the needed loads to the contact's load."""
        return self.levels.order(self.needed)

    @cached_property
    def general(self) -> SteppedPath | None:
        """Results of general steps, if these are requested or order fails; else None."""
        if self.steps is None and (self.order != "fails" or not self.levels.proved):
            return None
        return followed(self.levels, self.start, self.points, self.steps, self.stepper)

    def states(self) -> States:
        if self.general is not None:
            return self.general.states
        found = states_of(self.levels, self.curves)
        return found.unproved() if self.order == "fails" else found

    def status(self) -> NDArray[np.str_]:
        """(m, N) the statuses at each point."""
        if self.general is not None:
            return self.general.status
        return frozen(
            np.array([statuses_of(self.levels, each, self.order) for each in self.curves])
        )

    def losses(self) -> tuple[Array, Array]:
        """(m,) [force length] energy lost since the start, and proved bounds on the errors."""
        unknown = frozen(np.full(len(self.points), np.inf))
        if self.general is not None:
            return self.general.losses, unknown
        each = losses(self.levels, self.pieces)
        spent, errors = rounded(_cumulated(each) * self.levels.loss_unit)
        return spent, errors if self.order == "proved" else unknown


def follow(
    curve: MemoryCurve, points: Iterable[Point]
) -> tuple[list[MemoryCurve], list[list[Piece]]]:
    """The memory curve after each point, and the pieces of the loss on each segment."""
    curves: list[MemoryCurve] = []
    costs: list[list[Piece]] = []
    for load, height in points:
        curve, pieces = curve.go(load, height)
        curves.append(curve)
        costs.append(pieces)
    return curves, costs


def levels_needed(curves: Sequence[MemoryCurve], costs: Iterable[Iterable[Piece]]) -> set[Fraction]:
    """The loads of all levels needed for the states of these curves and for these losses."""
    return used_by(curves) | {load for pieces in costs for piece in pieces for load in piece[2:]}


def _cumulated(each: Ball) -> Ball:
    """(m,) the cumulative sums of m balls."""
    total, error, sums = Pair(0.0, 0.0), 0.0, []
    for high, low, radius in zip(
        *(part.tolist() for part in (*each.mid, each.radius)), strict=True
    ):
        total = total + Pair(high, low)
        error += radius + PAIR_ROUNDOFF * abs(total.high) + TINY
        sums.append((*total, error * UP))
    found = np.array(sums).reshape(-1, 3).T
    return Ball(Pair(found[0], found[1]), found[2] * (1 + SAFETY))
