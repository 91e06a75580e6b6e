"""Gradients along load paths, from weighted sums of energies V and approaches D0 at total loads L.

docs/theory/gradients.md, "Along a path", explains the method. Q_k are the shear forces of the path,
f is the coefficient of friction. The path is compared, in exact arithmetic, with a shifted path, on
which some loads P_k, or some T_k = Q_k / f, differ by at most SHIFT. V and D0 at the levels of the
shifted path are expanded about the levels of the original path, with S = dD0/dL.
"""

from __future__ import annotations

from bisect import bisect, insort
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball, stacked
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve, Piece
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.walk import Walk
from convexrough.gradients.parts import ZERO, Moves, Part

#: The shift of P_k or T_k, and the distance below which levels of the two paths correspond, both
#: divided by the largest load. SHIFT is below any relative difference of unequal float64 numbers.
SHIFT, NEAR = Fraction(1, 2**6000), Fraction(1, 2**3000)

#: Coordinates of memory curves that differ by less than this part of the largest load may be a tie
#: (docs/theory/gradients.md, "Along a path") that rounded decimals miss.
ROUNDED = Fraction(1, 2**46)

#: One-sided derivatives are compared at this distance from a near tie, divided by the largest load.
#: They count as equal if their relative difference is at most AGREES.
PAST, AGREES = Fraction(1, 2**36), 2.0**-20

#: A difference of one-sided derivatives below this part of the largest derivative is neglected.
NEGLIGIBLE = 2.0**-40

#: Rational numbers: the weights (3,) of V, D0 and S at a level, or P and T (m, 2) at m points.
Exact: TypeAlias = NDArray[np.object_]

#: For each segment: index of its end point, weight of its loss, weight of the final displacement.
Steps: TypeAlias = Sequence[tuple[int, Fraction, Fraction]]


#: The value of a derivative that does not exist or is infinite.
NONE = Ball(Pair.exact(np.nan), np.asarray(np.inf))


class Sums(dict[Fraction, Exact]):
    """The weights of V, D0 and S at each level."""

    def add(self, level: Fraction, *weights: Fraction) -> None:
        """Add weights of V, D0 and, if given, S."""
        padded = np.array((*weights, Fraction(0))[:3])
        self[level] = self[level] + padded if level in self else padded

    def add_loss(self, piece: Piece, weight: Fraction) -> None:
        """Add the loss (1 - c th) I on a piece times a weight; I is (4) of docs/theory/losses.md.

        c is the sign of the piece, th its slope.

        I = (P0 - L0) D0(L0) - (P1 - L1) D0(L1) + (2 - b) (V(L0) - V(L1)) - (L0 - L1) M, with
        b = (P0 - P1) / (L0 - L1) and the mean M of D0 over loads from P1 to P0. P is the load, L
        the level of the slip front; 0 marks the start of the piece and 1 its end.
        """
        weight *= 1 - piece.sign * piece.slope
        high, low, before, after = piece[2:]
        run, fall = weight * (high - low), before - after
        energy = weight * (2 - fall / (high - low))
        self.add(high, energy, weight * (before - high))
        self.add(low, -energy, weight * (low - after))
        if fall == 0:
            self.add(before, Fraction(0), -run)
        else:
            self.add(before, -run / fall, Fraction(0))
            self.add(after, run / fall, Fraction(0))

    def gather(self, others: Sums, reach: Fraction) -> None:
        """Add other weights, expanded about the nearest level here if it is within `reach`."""
        places = sorted(self)
        for level, (V, D, S) in others.items():
            k = bisect(places, level)
            around = places[max(k - 1, 0) : k + 1]
            place = min(around, key=lambda each: abs(each - level), default=level)
            if abs(off := level - place) > reach or not around:
                place, off = level, Fraction(0)
                insort(places, level)
            self.add(place, V, D + V * off, S + D * off + V * off * off / 2)


@dataclass(frozen=True)
class Along:
    """A path through points, with weights of its losses and displacements."""

    known: FrictionLevels
    start: Fraction  # [force] load at which the path begins, without shear
    steps: Steps
    points: Exact  # (m, 2) [force] P and T

    @property
    def unit(self) -> Fraction:
        """[force] the largest load."""
        return Fraction(self.points[:, 0].max())

    @cached_property
    def walk(self) -> Walk:
        points = [(*self.points[k],) for k, _, _ in self.steps]
        return Walk(self.known, MemoryCurve.pressed(self.start), points)

    @cached_property
    def sums(self) -> tuple[Sums, Sums]:
        """Weights at each level, in the sum of losses and in the sum of displacements.

        The sums are divided by c_t f^2 and by c_t f, with c_t = tangential / normal compliance.
        """
        lost, moved = Sums(), Sums()
        for step, curve, pieces in zip(self.steps, self.walk.curves, self.walk.pieces, strict=True):
            _, loss, displacement = step
            if loss:
                for piece in pieces:
                    lost.add_loss(piece, loss)
            if displacement:
                for level, bend in curve.bends:
                    if bend:
                        moved.add(level, Fraction(0), displacement * bend)
        return lost, moved

    def parts(self, moves: Moves) -> tuple[list[Part], list[Part]]:
        """The parts of the weighted sum of losses, and those of the sum of displacements.

        moves : derivatives of the total load of every level with respect to parameters, at fixed T
        """
        (lost, moved), at, force = self.sums, self.known.at, self.known.units.force
        unit, travel = self.known.loss_unit, self.known.travel_unit
        return [
            Part(at(level), unit * Ball.exact(V), unit / force * Ball.exact(D), moves=moves)
            for level, (V, D, _) in lost.items()
        ], [
            Part(at(level), approach=travel * Ball.exact(D), moves=moves)
            for level, (_, D, _) in moved.items()
        ]

    @cached_property
    def nearly_tied(self) -> bool:
        """True if unequal P, P + T or P - T of vertices along the path differ by under ROUNDED."""
        vertices = {
            vertex for it in self.walk.curves for vertex in zip(it.levels, it.heights, strict=True)
        }
        least = ROUNDED * self.unit
        along = ({P + turn * T for P, T in vertices} for turn in (-1, 0, 1))
        return any(b - a < least for each in along for a, b in pairwise(sorted(each)))

    def _one_side(self, shift: Exact, sign: int, times: Ball, off: Fraction = Fraction(0)) -> Ball:
        """`times` times the derivative from above (sign 1) or below (-1), along this shift.

        off : [force] distance by which the path is first shifted to the same side; the error bound
            does not include the effect of this shift
        """
        unit, force = self.unit, self.known.units.force
        scale = Fraction(sign) / (abs(shift).max() or 1)
        by = scale * SHIFT * unit
        try:
            origin = replace(self, points=self.points + off * scale * shift) if off else self
            moved = replace(origin, points=origin.points + by * shift)
            both = origin.sums, moved.sums
        except InputError:  # |T| > P, or a negative load
            return NONE
        total = ZERO
        factors = self.known.loss_unit, self.known.travel_unit * force
        for mine, base, there, factor in zip(self.sums, *both, factors, strict=True):
            slopes = _slopes(base, there, unit, by)
            if off:
                slopes, near = Sums({level: 0 * it for level, it in mine.items()}), slopes
                slopes.gather(near, 4 * off)
            for level, (V, D, S) in slopes.items():
                if not (V or D or S):
                    continue
                unloaded = level <= NEAR * unit
                if unloaded and S:
                    return NONE
                here = self.known.at(Fraction(0) if unloaded else level)
                each = Ball.exact(V) * here.energy + Ball.exact(D) / force * here.approach
                if S:
                    each = each + Ball.exact(S) / (force * force) * here.tangent.approach
                total = total + factor * each
        return total * times

    def slopes(self, shifts: Exact, factor: Ball) -> tuple[Ball, Array]:
        """(k,) the derivatives along k shifts, times `factor`; (k, 2) those from below and above.

        A derivative is the mean of its one-sided values if these agree within their error bounds.
        It is nan if they differ or one does not exist. If the path is nearly tied, one-sided
        values at the distance PAST are computed, too; if they differ, they are the result.

        shifts : (k, m, 2) changes of P and T at m points per unit of a parameter
        """

        def sides(off: Fraction = Fraction(0)) -> list[list[Ball]]:
            return [[self._one_side(it, sign, factor, off) for sign in (-1, 1)] for it in shifts]

        def floats(of: list[list[Ball]]) -> Array:
            return np.array([[float(side.value) for side in both] for both in of])

        exact = sides()
        found, values = [_one(*both) for both in exact], floats(exact)
        if self.nearly_tied:
            past = floats(sides(PAST * self.unit))
            past = np.where(np.isnan(past), values, past)  # where a side does not exist
            below, above = past.T
            size = np.fmax.reduce(np.abs(past), axis=None, initial=0.0)
            allowed = AGREES * np.fmax(np.abs(below), np.abs(above)) + NEGLIGIBLE * size
            tied = np.abs(above - below) > allowed
            for k in np.flatnonzero([float(each.error) > AGREES * size for each in found] | tied):
                near, fine, values[k] = past[k].mean(), found[k], past[k]
                known = Ball.around(near, float(fine.error) + abs(float(fine.value) - near))
                found[k] = NONE if tied[k] or np.isnan(fine.value) else known
        return stacked(found), values


def _one(below: Ball, above: Ball) -> Ball:
    apart = below - above
    if np.isnan(below.value + above.value) or apart.positive or apart.negative:
        return NONE
    return Ball.around((below + above).mid, apart.size) * 0.5 if apart.size else below


def _slopes(base: Sums, moved: Sums, unit: Fraction, by: Fraction) -> Sums:
    """(moved - base) / by, as weights of V, D0 and S at levels of the original path.

    unit : the largest load; weights that are tiny in this unit are neglected
    """
    slopes = Sums({level: -weights for level, weights in base.items()})
    slopes.gather(moved, NEAR * unit)
    powers = by * np.array([Fraction(1), unit, unit**2])
    least = NEAR * max((abs(weights / powers).max() for weights in slopes.values()), default=0)
    for level, weights in slopes.items():
        slopes[level] = np.where(abs(weights / powers) > least, weights / by, 0 * weights)
    return slopes
