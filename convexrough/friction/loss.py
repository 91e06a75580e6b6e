"""What slip costs, in units of c_t f^2: by asperities, by the energy V, and along a path.

Where the front of slip is at the level L while the load is P, the loss grows with falling L at the
rate (1 - c th) of -dB/dL, with th the slope of the layer that it runs through, c the sign, and

    B = sum_i (6/5) P_i delta_i e(1 - P_i(L) / P_i) + P_i g_i(L)
      = 2 [V(P) - V(L)] - (P - L) [D0(P) + D0(L)]

wherever no indentation falls with the load (docs/theory/losses.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from convexrough.arrays import Array, frozen
from convexrough.friction.curve import Piece
from convexrough.friction.levels import FrictionLevels
from convexrough.normal.level import Level
from convexrough.numbers.balls import Ball, where
from convexrough.sphere import annulus


def asperity_losses(levels: FrictionLevels, load: Fraction, front: Fraction) -> tuple[Ball, Ball]:
    """(n,) the parts of B in partial slip and in sliding."""
    return levels.keep((asperity_losses, load, front), lambda: _parts(levels, load, front))


def _parts(levels: FrictionLevels, load: Fraction, front: Fraction) -> tuple[Ball, Ball]:
    high, low = levels.at(load), levels.at(front)
    nothing = Ball.exact(np.zeros(len(high.loads)))
    if load == front:
        return nothing, nothing
    loaded = high.loads.value > 0
    P = where(loaded, high.loads, Ball.exact(np.ones(len(loaded))))
    own, gaps = high.indentation.positive_part(), (-low.indentation).positive_part()
    s = (low.loads / P).cbrt()
    x = (P - low.loads) / P / (1.0 + s + s * s)
    slip, slide = P * own * annulus.loss(x) * Fraction(6, 5), P * gaps
    doubtful = ~high.touching & ~high.open & np.isfinite(high.loads.upper)
    if doubtful.any():
        most = Ball.between(np.zeros(len(loaded)), high.loads.upper)
        slip, slide = (
            where(doubtful, most * own * Fraction(1, 5), slip),
            where(doubtful, most * gaps, slide),
        )
        loaded = loaded | doubtful
    return where(loaded, slip, nothing), where(loaded, slide, nothing)


def trapezoid_loss(high: Level, low: Level) -> Ball:
    """B by the energy: twice the error of the trapezoid rule on D0 between two levels."""
    run = high.load - low.load
    return (high.energy - low.energy) * 2.0 - run * (high.approach + low.approach)


def losses(levels: FrictionLevels, costs: Sequence[Sequence[Piece]]) -> Ball:
    """(m,) what the pieces of each of m segments cost."""
    found = []
    for pieces in costs:
        total = Ball.exact(0.0)
        for piece in pieces:
            weight = Ball.exact(1 - piece.sign * piece.slope)
            total = total + weight * _integral(levels, piece)
        found.append(total)
    return Ball.stacked(found)


def _integral(levels: FrictionLevels, piece: Piece) -> Ball:
    """Of -dB/dL along a piece."""
    if piece.load_before != piece.load_after:
        return front_integral(levels, piece)
    ends = (asperity_losses(levels, piece.load_after, L) for L in (piece.bottom, piece.top))
    lost, before = ((slip + slide).sum() for slip, slide in ends)
    return lost - before


def front_integral(levels: FrictionLevels, piece: Piece) -> Ball:
    """The integral of -dB/dL along a front from L0 down to L1, the load going from P0 to P1.

    With run = L0 - L1, D = D0(L0) - D0(L1), and the means m of D0 on [L1, L0] and M on [P1, P0],
    both less D0(L1), it is

        I = (P0 - L0) D - (P0 - P1) m + run (2 m - M).

    D0 is concave, so m lies in [D/2, D], M between its trapezoid and D0(P0), and D in
    [0, run / (2 E* a(L1))]: of each the smaller enclosure counts, so that fronts that hardly run
    keep their digits.
    """
    unit = Fraction(levels.units.force)
    over, run, fall = (
        Ball.exact(value / unit)
        for value in (
            piece.load_before - piece.top,
            piece.top - piece.bottom,
            piece.load_before - piece.load_after,
        )
    )
    top, bottom = levels.at(piece.top), levels.at(piece.bottom)
    D = _sharper(top.approach - bottom.approach, _rise(bottom, run))
    m = _sharper(_mean(top, bottom, run), _hull(D * 0.5, D))
    before, after = levels.at(piece.load_before), levels.at(piece.load_after)
    last, first = after.approach - bottom.approach, before.approach - bottom.approach
    M = _sharper(_mean(before, after, fall) + last, _hull((first + last) * 0.5, first))
    found = over * D - fall * m + run * (m * 2.0 - M)
    if not levels.proved or float(found.lower) >= 0.0:
        return found
    return _sharper(found, Ball.between(np.zeros(()), np.maximum(found.upper, 0.0)))


def _mean(high: Level, low: Level, run: Ball) -> Ball:
    """The mean of D0 between two levels, less D0 of the lower."""
    return (high.energy - low.energy) / run - low.approach


def _rise(bottom: Level, run: Ball) -> Ball:
    """From 0 to run / (2 E* a) of the largest asperity, for which D0 is concave."""
    softness = bottom.loads.cbrt() * 1.5 / bottom.problem.exact.coefficients  # 2 E* a
    softest = float(softness.lower.max(initial=0.0))
    most = Ball.exact(run.upper) / softest if softest > 0 else Ball.around(0.0, np.inf)
    return Ball.between(np.zeros(()), np.asarray(most.upper))


def _hull(a: Ball, b: Ball) -> Ball:
    return Ball.between(np.minimum(a.lower, b.lower), np.maximum(a.upper, b.upper))


def _sharper(a: Ball, b: Ball) -> Ball:
    """Of two enclosures of one number, that with the smaller radius."""
    return a if float(a.radius) <= float(b.radius) else b


def shared(levels: FrictionLevels, pieces: Sequence[Piece], cells: int) -> tuple[Array, Array]:
    """(N,) what pieces cost at each asperity in partial slip and in sliding [force length].

    Exact at constant load. Else by the rule of the middle: each piece is cut into cells, by its
    part of what all fronts run through, and the load is held at its value in the middle of each.
    The error falls as cells^-2; no closed form is known.
    """
    run = sum((piece.top - piece.bottom for piece in pieces), Fraction(0))
    n = len(levels.candidates)
    totals = [Ball.exact(np.zeros(n)), Ball.exact(np.zeros(n))]
    for piece in pieces:
        cut = 1
        if piece.load_before != piece.load_after:
            cut = max(1, round(cells * float((piece.top - piece.bottom) / run)))
        for k in range(cut):
            load = _along(piece.load_before, piece.load_after, Fraction(2 * k + 1, 2 * cut))
            ends = [_along(piece.top, piece.bottom, Fraction(part, cut)) for part in (k, k + 1)]
            before, after = (asperity_losses(levels, load, each) for each in ends)
            weight = Ball.exact(1 - piece.sign * piece.slope)
            totals = [
                total + weight * (lost - spent)
                for total, spent, lost in zip(totals, before, after, strict=True)
            ]
    slip, slide = (levels.to_scene((each * levels.loss_unit).value) for each in totals)
    return frozen(slip), frozen(slide)


def _along(start: Fraction, end: Fraction, part: Fraction) -> Fraction:
    return start + part * (end - start)
