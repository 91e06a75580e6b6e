"""What slip costs along a load path, in closed form: docs/theory/load-path-proofs.md, "Energy".

A front that runs down through a layer of slope th, from L0 to L1, while the load goes in proportion
from P0 to P1, costs c_t f^2 (1 - c th) I with

    I = integral from L1 to L0 of [(P - L) D0'(L) - (D0(P) - D0(L))] dL
      = (P0 - L0) D0(L0) - (P1 - L1) D0(L1) + (2 - b) (V(L0) - V(L1)) - (L0 - L1) M,

b = (P0 - P1) / (L0 - L1) and M the mean of D0 between P1 and P0.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np

from convexrough.arrays import Array
from convexrough.paths.levels import Level, Levels
from convexrough.paths.memory import Piece
from convexrough.paths.state import Friction
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.sphere import mindlin


def loss(levels: Levels, pieces: Iterable[Piece]) -> tuple[float, float]:
    """The energy that pieces cost, and a bound on its error [force length]."""
    f, travel = Friction.of(levels)
    total = error = 0.0
    for piece in pieces:
        value, doubt = _integral(levels, piece)
        weight = f * travel * float(1 - piece.sign * piece.slope)
        total += weight * value
        error += _times(weight, doubt)
    return total, error * (1 + SAFETY)


def _integral(levels: Levels, piece: Piece) -> tuple[float, float]:
    """I, and a bound on its error."""
    top, bottom = levels.at(piece.top), levels.at(piece.bottom)
    before, after = levels.at(piece.load_before), levels.at(piece.load_after)
    run = float(piece.top - piece.bottom)
    twice = float(2 - (piece.load_before - piece.load_after) / (piece.top - piece.bottom))
    over, under = float(piece.load_before - piece.top), float(piece.load_after - piece.bottom)
    mean, mean_error = _mean(before, after, float(piece.load_before - piece.load_after))
    terms = (
        over * top.approach,
        -under * bottom.approach,
        twice * top.energy,
        -twice * bottom.energy,
        -run * mean,
    )
    error = _times(over, top.approach_error) + _times(under, bottom.approach_error)
    error += _times(run, mean_error)
    error += _times(abs(twice), top.energy_error + bottom.energy_error)
    return sum(terms), error + 8 * ROUNDOFF * sum(map(abs, terms))


def _times(share: float, error: float) -> float:
    """Nothing of an error is nothing, also where that is infinite."""
    return share * error if share else 0.0


def _mean(high: Level, low: Level, apart: float) -> tuple[float, float]:
    """The mean of D0 between two loads, by V where they are far apart, and its error.

    D0 rises with the load, so the middle of its two values is off by no more than half of what they
    differ by.
    """
    middle = (high.approach + low.approach) / 2
    doubt = max(high.approach_error, low.approach_error)
    near = abs(high.approach - low.approach) / 2 + doubt
    if apart == 0.0:
        return middle, near
    far = (high.energy_error + low.energy_error) / abs(apart)
    if far > near:
        return middle, near
    return (high.energy - low.energy) / apart, far


def shares(levels: Levels, pieces: Sequence[Piece], cells: int) -> Array:
    """(n,) what the pieces cost at each asperity [force length].

    Exact at constant load. Else the rule of the middle: each piece is cut into cells, by its part
    of what all fronts run through, and the load is held at its value in the middle of each. The
    error falls as cells^-2; no closed form is known.
    """
    f, travel = Friction.of(levels)
    run = sum((piece.top - piece.bottom for piece in pieces), Fraction(0))
    lost = np.zeros(len(levels.scene))
    for piece in pieces:
        weight = f * travel * float(1 - piece.sign * piece.slope)
        cut = 1
        if piece.load_before != piece.load_after:
            cut = max(1, round(cells * float((piece.top - piece.bottom) / run)))
        for k in range(cut):
            load = _along(piece.load_before, piece.load_after, Fraction(2 * k + 1, 2 * cut))
            high, low = (
                _along(piece.top, piece.bottom, Fraction(part, cut)) for part in (k, k + 1)
            )
            lost += weight * (_bregman(levels, load, low) - _bregman(levels, load, high))
    return lost


def _along(start: Fraction, end: Fraction, part: Fraction) -> Fraction:
    return start + part * (end - start)


def _bregman(levels: Levels, load: Fraction, front: Fraction) -> Array:
    """(n,) B_i(P, L), of which all together fall with L at the rate of the integrand of I.

    (6/5) P_i delta_i e(1 - P_i(L) / P_i) in partial slip, and P_i g_i(L) more in sliding.
    """
    here, there = levels.at(load), levels.at(front)
    loaded = here.loads > 0
    left = np.divide(there.loads, here.loads, out=np.ones_like(here.loads), where=loaded)
    own, gap = np.maximum(here.indentations, 0.0), np.maximum(-there.indentations, 0.0)
    return np.asarray(here.loads * (1.2 * own * mindlin.loss(1.0 - np.minimum(left, 1.0)) + gap))
