"""What slip costs along a load path, in closed form: docs/theory/load-paths.md, "Energy".

A front that runs down through a layer of slope th, from L0 to L1, while the load goes in proportion
from P0 to P1, costs c_t f^2 (1 - c th) I with

    I = integral from L1 to L0 of [(P - L) D0'(L) - (D0(P) - D0(L))] dL
      = (P0 - L0) D0(L0) - (P1 - L1) D0(L1) + (2 - b) (V(L0) - V(L1)) - (L0 - L1) M,

b = (P0 - P1) / (L0 - L1) and M the mean of D0 between P1 and P0.
"""

from __future__ import annotations

from collections.abc import Iterable

from convexrough.paths.levels import Level, Levels
from convexrough.paths.memory import Piece
from convexrough.paths.state import Friction
from convexrough.roundoff import ROUNDOFF, SAFETY


def loss(levels: Levels, pieces: Iterable[Piece]) -> tuple[float, float]:
    """The energy that pieces cost, and a bound on its error [force length]."""
    f, travel = Friction.of(levels)
    total = error = 0.0
    for piece in pieces:
        value, doubt = _integral(levels, piece)
        weight = f * travel * float(1 - piece.sign * piece.slope)
        total += weight * value
        error += weight * doubt
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
    error = over * top.approach_error + under * bottom.approach_error + run * mean_error
    error += abs(twice) * (top.energy_error + bottom.energy_error)
    return sum(terms), error + 8 * ROUNDOFF * sum(map(abs, terms))


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
