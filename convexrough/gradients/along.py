"""Gradients along load paths, from weighted sums of energies V and approaches D0 at load levels.

docs/theory/gradients.md, "Along a path", explains the method. The path is compared with a path on
which one load P_k, or one T_k = Q_k / f, is shifted by SHIFT; Q_k is a shear force, f the
coefficient of friction, and the arithmetic is exact. Let L be a load level of the shifted path, l
the corresponding level of the original path, and S = dD0/dL. To first order in the shift

    V(L) = V(l) + D0(l) (L - l) + S(l) (L - l)^2 / 2,    D0(L) = D0(l) + S(l) (L - l).
"""

from __future__ import annotations

from bisect import bisect, insort
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve, Piece
from convexrough.friction.levels import FrictionLevels, height_at
from convexrough.gradients.pulled import ZERO, Moves, Part

#: The shift of P_k or T_k, and the distance below which levels of the two paths correspond, both
#: divided by the largest load. SHIFT is less than any difference of two float64 numbers.
SHIFT, NEAR = Fraction(1, 2**6000), Fraction(1, 2**3000)

#: The weights of V, D0 and S at one level in a weighted sum.
Weights: TypeAlias = tuple[Fraction, ...]
NOTHING: Weights = (Fraction(0),) * 3

#: For each segment: index of its end point, weight of its loss, weight of the final displacement.
Steps: TypeAlias = Sequence[tuple[int, Fraction, Fraction]]

#: The changes of P and of T at all points of a path, per unit of a parameter.
Direction: TypeAlias = tuple[Sequence[Fraction], Sequence[Fraction]]

#: The value of a derivative that does not exist or is infinite.
NONE = Ball(Pair.exact(np.nan), np.asarray(np.inf))


class LevelWeights(NamedTuple):
    """Weights of V, D0 and S at each level, for losses / (c_t f^2) and displacements / (c_t f).

    f is the coefficient of friction, c_t Mindlin's ratio.
    """

    losses: dict[Fraction, Weights]
    displacements: dict[Fraction, Weights]

    def lose(self, piece: Piece, weight: Fraction) -> None:
        """Add the loss (1 - c th) I on a piece (`friction.loss`), multiplied by a weight.

        I = (P0 - L0) D0(L0) - (P1 - L1) D0(L1) + (2 - b) (V(L0) - V(L1)) - (L0 - L1) M, with
        b = (P0 - P1) / (L0 - L1) and the mean M of D0 over loads from P1 to P0. P is the load, L
        the level of the slip front; 0 marks the start of the piece and 1 its end.
        """
        weight *= 1 - piece.sign * piece.slope
        high, low, before, after = piece[2:]
        run, fall = high - low, before - after
        add = self._adder(self.losses, weight)
        add(high, 2 - fall / run, before - high)
        add(low, fall / run - 2, low - after)
        if fall == 0:
            add(before, Fraction(0), -run)
        else:
            add(before, -run / fall, Fraction(0))
            add(after, run / fall, Fraction(0))

    def move(self, curve: MemoryCurve, weight: Fraction) -> None:
        """Add the displacement of the state with this memory curve, multiplied by a weight."""
        add = self._adder(self.displacements, weight)
        for level, bend in curve.bends:
            add(level, Fraction(0), bend)

    @staticmethod
    def _adder(
        found: dict[Fraction, Weights], weight: Fraction
    ) -> Callable[[Fraction, Fraction, Fraction], None]:
        def add(level: Fraction, energy: Fraction, approach: Fraction) -> None:
            V, D, S = found.get(level, NOTHING)
            found[level] = (V + weight * energy, D + weight * approach, S)

        return add


@dataclass(frozen=True)
class Along:
    """A path through points, with weights of its losses and displacements.

    known : the normal solutions of the contact
    start : [force] load at which the path begins, without shear
    steps : the segments and weights
    loads, heights : [force] P and T at the points
    """

    known: FrictionLevels
    start: Fraction
    steps: Steps
    loads: Sequence[Fraction]
    heights: Sequence[Fraction]

    @classmethod
    def of(
        cls, known: FrictionLevels, start: Fraction, steps: Steps, loads: Array, forces: Array
    ) -> Along:
        """The path through points with these loads P and shear forces Q."""
        pairs = list(zip(map(Fraction, loads.tolist()), forces.tolist(), strict=True))
        heights = [height_at(load, force, known.scene) for load, force in pairs]
        return cls(known, start, steps, [load for load, _ in pairs], heights)

    @cached_property
    def sums(self) -> LevelWeights:
        curve, found = MemoryCurve.pressed(self.start), LevelWeights({}, {})
        for point, lost, moved in self.steps:
            curve, pieces = curve.go(self.loads[point], self.heights[point])
            if lost:
                for piece in pieces:
                    found.lose(piece, lost)
            if moved:
                found.move(curve, moved)
        return found

    def parts(self, moves: Moves) -> tuple[list[Part], Ball, Ball]:
        """The `Part` of each level, the weighted sum of losses, and that of displacements.

        moves : derivatives of the load of every level, at fixed T
        """
        spent, far, weights = ZERO, ZERO, dict[Fraction, tuple[Ball, Ball]]()
        lost, force = self.known.loss_unit, self.known.units.force
        for level, (V, D, _) in self.sums.losses.items():
            each = lost * Ball.exact(V), lost / force * Ball.exact(D)
            weights[level] = each
            spent = spent + Part(self.known.at(level), *each).value
        for level, (_, D, _) in self.sums.displacements.items():
            energy, before = weights.get(level, (ZERO, ZERO))
            advance = self.known.travel_unit * Ball.exact(D)
            weights[level] = energy, before + advance
            far = far + advance * self.known.at(level).approach
        parts = [Part(self.known.at(level), *each, moves=moves) for level, each in weights.items()]
        return parts, spent, far

    def _one_side(
        self, loads: Sequence[Fraction], heights: Sequence[Fraction], sign: int, times: Ball
    ) -> Ball:
        unit, force = max(self.loads), self.known.units.force
        longest = max(map(abs, (*loads, *heights)))
        by = sign * SHIFT * unit / longest if longest else SHIFT
        try:
            moved = replace(
                self,
                loads=[load + by * each for load, each in zip(self.loads, loads, strict=True)],
                heights=[T + by * each for T, each in zip(self.heights, heights, strict=True)],
            ).sums
        except InputError:  # |T| > P, or a negative load
            return NONE
        total = ZERO
        for base, there, factor in (
            (self.sums.losses, moved.losses, self.known.loss_unit),
            (self.sums.displacements, moved.displacements, self.known.travel_unit * force),
        ):
            for level, (V, D, S) in _slopes(base, there, unit, by).items():
                if level == 0 and S:
                    return NONE
                here = self.known.at(level)
                each = Ball.exact(V) * here.energy + Ball.exact(D) / force * here.approach
                if S:
                    each = each + Ball.exact(S) / (force * force) * here.tangent.approach
                total = total + factor * each
        return total * times

    def slopes(self, directions: Sequence[Direction], factor: Ball) -> tuple[Ball, Array]:
        """(m,) the derivatives along m directions, times `factor`; (m, 2) their one-sided values.

        The one-sided values are those from below and from above. A derivative is the mean of both
        if they agree within their error bounds. It is nan if they differ or one does not exist.
        """
        sides = [[self._one_side(*each, sign, factor) for sign in (-1, 1)] for each in directions]
        found = [_one(below, above) for below, above in sides]
        return Ball.stacked(found), np.array([[float(s.value) for s in both] for both in sides])


def _one(below: Ball, above: Ball) -> Ball:
    apart = below - above
    if np.isnan(below.value + above.value) or apart.positive or apart.negative:
        return NONE
    return Ball.around((below + above).mid, apart.size) * 0.5 if apart.size else below


def _slopes(
    base: dict[Fraction, Weights], moved: dict[Fraction, Weights], unit: Fraction, by: Fraction
) -> dict[Fraction, Weights]:
    """(moved - base) / by, as weights of V, D0 and S at levels of the original path.

    unit : the largest load; weights that are small in this unit are neglected
    """
    places, found = sorted(base), dict[Fraction, Weights]()
    for sign, weights in ((-1, base), (1, moved)):
        for level, (V, D, _) in weights.items():
            near = bisect(places, level)
            around = [*places[max(near - 1, 0) : near + 1], level]
            at = next(each for each in around if abs(each - level) <= NEAR * unit)
            if at is level:  # no level of the original path corresponds
                insort(places, at)
            off = level - at
            before = found.get(at, NOTHING)
            more = (V, D + V * off, D * off + V * off * off / 2)
            found[at] = tuple(b + sign * m for b, m in zip(before, more, strict=True))
    slopes = {level: tuple(w / by for w in weights) for level, weights in found.items()}
    sizes = [abs(w) / unit**k for weights in slopes.values() for k, w in enumerate(weights)]
    least = NEAR * max(sizes, default=Fraction(0))
    nonzero = {
        level: tuple(w if abs(w) > least * unit**k else Fraction(0) for k, w in enumerate(weights))
        for level, weights in slopes.items()
    }
    return {level: weights for level, weights in nonzero.items() if any(weights)}
