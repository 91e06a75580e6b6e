"""Friction states and energy losses, from solutions under normal load; both assume order.

States are sums of solutions, weighted by the changes of slope of the memory curve: (1) of
docs/theory/paths.md. The sum for the displacement X of the bodies, with the indentations of an
asperity in place of the approach, gives the own deflection plus drift of this asperity.

Losses (docs/theory/losses.md) are divided by c_t f^2. While the total load is P and the slip front
falls through the level L, the loss per unit of L is (1 - c th) (-dB/dL), with the slope th of the
memory curve at L and the direction c of slip, 1 or -1. B is the sum of the B_i(P, L) of (2).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import chain, pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arithmetic.balls import Ball, joined, of_rows, stacked, where
from convexrough.arrays import Array, Indices, frozen
from convexrough.friction.curve import MemoryCurve, Piece
from convexrough.friction.levels import FrictionLevels, exactly, rounded
from convexrough.friction.order import Order
from convexrough.normal.level import Level, Rows, energies
from convexrough.normal.levels import NUMBERS
from convexrough.roundoff import SAFETY
from convexrough.sphere import mindlin

#: The load P and the level L of the front at one moment, or one of them at two moments [force].
Loads: TypeAlias = tuple[Fraction, Fraction]


class States(NamedTuple):
    """m states of n asperities in the scene's units, with errors; infinite without a proof."""

    displacements: Ball  # (m,) X, tangential displacement of one body relative to the other
    forces: Ball  # (m, n) Q_i, shear forces of the asperities
    asperity_displacements: Ball  # (m, n) own deflection plus drift
    drifts: Ball  # (m, n) displacements of asperities, open ones too, along the opposite surface


class LevelSums(NamedTuple):
    """Sums over the levels of each of m memory curves, weighted by changes of slope."""

    used: list[Fraction]  # the k total loads of the levels of all curves, sorted
    places: Indices  # (m, j) the levels of each curve, as indices into `used`
    weights: Ball  # (m, j) slope below minus slope above; 0 beyond a curve's levels

    @classmethod
    def of(cls, curves: Sequence[MemoryCurve]) -> LevelSums:
        bends = [[(load, bend) for load, bend in curve.bends if bend] for curve in curves]
        used = sorted({load for each in bends for load, _ in each} or {curves[0].load})
        place, flat = {load: k for k, load in enumerate(used)}, [*chain(*bends)]
        counts = np.array([[len(each)] for each in bends])
        filled = np.arange(counts.max(initial=0)) < counts
        at = np.where(filled, filled.cumsum().reshape(filled.shape), 0)
        places = np.array([0, *(place[load] for load, _ in flat)])[at]
        weights = exactly([Fraction(0), *(bend for _, bend in flat)])[at]
        return cls(used, places, weights)

    def total(self, values: Ball) -> Ball:
        """(m, ...) for each curve the weighted sum of values (k, ...) at the levels `used`."""
        wide = (slice(None),) + (None,) * (len(values.shape) - 1)
        total = Ball.exact(np.zeros((len(self.places), *values.shape[1:])))
        for j in range(self.places.shape[1]):
            total = total + self.weights[:, j][wide] * values[self.places[:, j]]
        return total


def displacements_of(levels: FrictionLevels, sums: LevelSums) -> Ball:
    """(m,) [length] the displacement X of each curve."""
    approaches = stacked([levels.at(load).approach for load in sums.used])
    return sums.total(approaches) * levels.travel_unit


def states_of(
    levels: FrictionLevels, curves: Sequence[MemoryCurve], which: Indices | slice = slice(None)
) -> States:
    """The states of these curves, for the candidates `which` in this order; default all."""
    sums = LevelSums.of(curves)
    levels.prepare(sums.used)
    solved, travel = [levels.at(load) for load in sums.used], levels.travel_unit
    loads = stacked([level.loads[which] for level in solved])
    moved = stacked([level.indentation[which] for level in solved])
    return States(
        displacements_of(levels, sums),
        sums.total(loads) * levels.force_unit,
        sums.total(moved) * travel,
        -sums.total((-moved).positive_part()) * travel,
    )


def statuses_of(levels: FrictionLevels, curve: MemoryCurve, order: Order) -> NDArray[np.str_]:
    """(N,) the status of each asperity, from what is proved at the curve's load and its front."""
    here = levels.at(curve.load)
    if order == "fails":
        return by_status(levels, here)
    if curve.front is None:
        return by_status(levels, here, stuck=here.touching)
    front = levels.at(curve.front)
    sliding = here.touching & front.open
    return by_status(levels, here, partial=here.touching & front.touching, sliding=sliding)


def by_status(levels: FrictionLevels, here: Level, **proved: NDArray[np.bool_]) -> NDArray[np.str_]:
    """(N,) for each asperity the last status in `proved` whose mask is true for this asperity, or
    "open" if it is proved to be open, or "undecided".
    """
    found = np.full(len(levels.scene), "open", dtype="<U12")
    some = np.full(len(levels.candidates), "undecided", dtype="<U12")
    some[here.open] = "open"
    for status, which in proved.items():
        some[which] = status
    found[levels.candidates] = some
    return frozen(found)


def stick_radii(levels: FrictionLevels, level: Level) -> tuple[Array, Array]:
    """(N,) [length] contact radii 3 P_i^(1/3) / (4 k_i E*) at a level, and their error bounds."""
    modulus = Ball.exact(levels.scene.material.contact_modulus)
    root = 2.0 ** round(np.log2(levels.units.force) / 3)  # the force unit is a power of eight
    radii = level.loads.cbrt() / level.problem.exact.coefficients / modulus
    return rounded(of_rows(levels.to_scene, radii * (0.75 * root * levels.units.local)))


def asperity_losses(high: Rows, low: Rows) -> tuple[Ball, Ball]:
    """(k, n) the parts of B_i due to partial slip and those due to sliding, for k moments."""
    nothing = Ball.exact(np.zeros(high.loads.shape))
    loaded = high.loads.value > 0
    P = where(loaded, high.loads, 1.0 + nothing)
    own, gaps = high.indentation.positive_part(), (-low.indentation).positive_part()
    s = (low.loads / P).cbrt()
    x = (P - low.loads) / P / (1.0 + s + s * s)
    slip, slide = P * own * mindlin.loss_at(x) * Fraction(6, 5), P * gaps
    doubtful = ~high.touching & ~high.open & np.isfinite(high.loads.upper)
    if doubtful.any():
        most = Ball.between(nothing.value, high.loads.upper)
        slip = where(doubtful, most * own * Fraction(1, 5), slip)
        slide = where(doubtful, most * gaps, slide)
    moved = (loaded | doubtful) & ((high.load - low.load).size > 0)[:, None]
    return where(moved, slip, nothing), where(moved, slide, nothing)


def losses(levels: FrictionLevels, costs: Sequence[Sequence[Piece]]) -> Ball:
    """(m,) the loss on each of m segments of a path, from the pieces of each segment."""
    pieces = [piece for each in costs for piece in each]
    levels.prepare(load for piece in pieces for load in piece[2:])
    still = np.array([piece.load_constant for piece in pieces], dtype=bool)
    front = front_integrals(levels, [piece for piece in pieces if not piece.load_constant])
    fallen = joined([_at_constant_load(levels, [p for p in pieces if p.load_constant]), front])
    integrals = fallen[np.argsort(np.argsort(~still, kind="stable"))]  # of -dB/dL
    found = exactly([1 - p.sign * p.slope for p in pieces]) * integrals
    ends = np.cumsum([0, *map(len, costs)]).tolist()
    return stacked([found[start:stop].sum() for start, stop in pairwise(ends)])


def _at_constant_load(levels: FrictionLevels, pieces: Sequence[Piece]) -> Ball:
    """(k,) integrals of -dB/dL over pieces at constant load, which are differences of B."""
    moments = [(piece.load_after, front) for piece in pieces for front in piece[2:4]]
    slipped = [each for each in dict.fromkeys(moments) if each[0] != each[1]]  # B(P, P) = 0
    place, found = {each: k for k, each in enumerate(slipped)}, list[Ball]()
    for some in threads.chunks(len(slipped), max(1, NUMBERS // (1 + len(levels.candidates)))):
        slip, slide = _at_moments(levels, slipped[some])
        found.append((slip + slide).sum())
    lost = joined([*found, Ball.exact(np.zeros(1))])[[place.get(each, -1) for each in moments]]
    return lost[1::2] - lost[0::2]


def _at_moments(levels: FrictionLevels, moments: Sequence[Loads]) -> tuple[Ball, Ball]:
    """`asperity_losses` at k moments."""
    loads = sorted({load for each in moments for load in each})
    rows, place = levels.rows(loads), {load: k for k, load in enumerate(loads)}
    high, low = (np.array([place[each[end]] for each in moments]) for end in (0, 1))
    return asperity_losses(rows.at(high), rows.at(low))


def front_integrals(levels: FrictionLevels, pieces: Sequence[Piece]) -> Ball:
    """(k,) integrals I of -dB/dL, (4) of docs/theory/losses.md, over pieces with a varying load."""
    if not pieces:
        return Ball.exact(np.zeros(0))
    ends = list(zip(*(piece[2:] for piece in pieces), strict=True))  # L0, L1, P0, P1
    over, run, fall = (
        exactly([a - b for a, b in zip(*both, strict=True)]).scaled(1.0 / levels.units.force)
        for both in ((ends[2], ends[0]), ends[:2], ends[2:])
    )
    loads = sorted({load for end in ends for load in end})
    known, place = [levels.at(load) for load in loads], {x: k for k, x in enumerate(loads)}
    every, approach = energies(known), stacked([level.approach for level in known])
    which = [[place[load] for load in end] for end in ends]
    (V0, V1, V2, V3), (D0, D1, D2, D3) = ([x[k] for k in which] for x in (every, approach))
    stiffness = np.array([_stiffest(known[k]) for k in which[1]])
    with np.errstate(divide="ignore"):
        most = run.upper / stiffness * (1 + SAFETY)
    D = _sharper(D0 - D1, Ball.between(np.zeros(len(run)), most))
    m = _sharper((V0 - V1) / run - D1, _hull(D * 0.5, D))
    first, last = D2 - D1, D3 - D1
    larger = where(fall.value >= 0.0, first, last)
    M = _sharper((V2 - V3) / fall - D3 + last, _hull((first + last) * 0.5, larger))
    found = over * D - fall * m + run * (m * 2.0 - M)
    if not levels.proved:
        return found
    least = Ball.between(np.zeros(len(run)), np.maximum(found.upper, 0.0))
    return where(found.lower >= 0.0, found, _sharper(found, least))


def _stiffest(level: Level) -> float:
    """A lower bound on 2 E* a, with the largest contact radius a: dD0/dL <= 1 / (2 E* a)."""
    k = level.problem.exact.coefficients.upper
    stiffness = 1.5 * np.cbrt(np.maximum(level.loads.lower, 0.0)) / k
    return float(stiffness.max(initial=0.0)) * (1 - SAFETY)


def _hull(a: Ball, b: Ball) -> Ball:
    return Ball.between(np.minimum(a.lower, b.lower), np.maximum(a.upper, b.upper))


def _sharper(a: Ball, b: Ball) -> Ball:
    """Of two balls that enclose the same numbers, the one with the smaller radius."""
    return where(a.radius <= b.radius, a, b)


def shared(levels: FrictionLevels, pieces: Sequence[Piece], cells: int) -> tuple[Ball, Ball]:
    """(N,) [force length] losses at each asperity, due to partial slip and to sliding.

    Pieces with a varying load are cut into `cells` cells, more where front and load change more.
    The loss in one lies between the losses at the loads of its ends (docs/theory/losses.md, "A
    front while the load changes"); the results are sums of the means. Their relative errors are
    about cells^-2, the bounds about 1 / cells.
    """
    sizes = [it.top - it.bottom + abs(it.load_after - it.load_before) for it in pieces]
    run = sum(sizes, Fraction(0))
    parts = list[tuple[Fraction, Loads, Loads]]()  # weight; P and front at both ends of a cell
    for piece, size in zip(pieces, sizes, strict=True):
        part = 0.0 if piece.load_constant else float(size / run)
        cut = max(1, round(cells * part))
        top, bottom, before, after = piece[2:]
        fronts, loads = (
            [start + (end - start) * Fraction(k, cut) for k in range(cut + 1)]
            for start, end in ((top, bottom), (before, after))
        )
        weight = 1 - piece.sign * piece.slope
        parts += [(weight, *both) for both in zip(pairwise(loads), pairwise(fronts), strict=True)]
    levels.prepare(load for _, *both in parts for ends in both for load in ends)
    totals = [Ball.exact(np.zeros(len(levels.candidates)))] * 2
    for chunk in threads.chunks(len(parts), max(1, NUMBERS // (4 + 4 * len(levels.candidates)))):
        some = parts[chunk]
        moments = [(P, min(L, P)) for _, loads, fronts in some for P in loads for L in fronts]
        weights = exactly([weight for weight, _, _ in some])
        same = np.array([P == R for _, (P, R), _ in some])[:, None]
        for k, values in enumerate(_at_moments(levels, moments)):
            one, other = values[1::4] - values[0::4], values[3::4] - values[2::4]
            lost = weights[:, None] * where(same, one, _hull(one, other))
            totals[k] = totals[k] + of_rows(np.transpose, lost).sum()
    slip, slide = (each * levels.loss_unit for each in totals)
    return slip, slide
