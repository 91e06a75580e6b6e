"""Friction states as weighted sums of solutions under normal load.

The weights are the changes of slope of the memory curve. Equation (1) of docs/theory/paths.md gives
the shear forces Q_i of the asperities and the displacement X of the bodies. The sum for X, with the
indentations of an asperity in place of the approach, gives the own deflection plus drift of this
asperity. Equation (1) of docs/theory/states.md is the special case of first loading.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball, of_rows
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, Indices, frozen
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.levels import FrictionLevels, rounded
from convexrough.friction.order import Order
from convexrough.normal.level import Level


class States(NamedTuple):
    """m states of N asperities in the scene's units, with errors; infinite without a proof."""

    displacements: Ball  # (m,) X, tangential displacement of one body relative to the other
    forces: Ball  # (m, N) Q_i, shear forces of the asperities
    asperity_displacements: Ball  # (m, N) own deflection plus drift
    drifts: Ball  # (m, N) displacements of asperities, open ones too, along the opposite surface


class LevelSums(NamedTuple):
    """Sums over the levels of each of m memory curves, weighted by changes of slope."""

    used: list[Fraction]  # the k total loads of the levels of all curves, sorted
    places: Indices  # (m, j) the levels of each curve, as indices into `used`
    weights: Ball  # (m, j) slope below minus slope above; rows of curves with fewer levels: 0

    @classmethod
    def of(cls, curves: Sequence[MemoryCurve]) -> LevelSums:
        bends = [[(load, bend) for load, bend in curve.bends if bend] for curve in curves]
        used = sorted({load for each in bends for load, _ in each} or {curves[0].load})
        place = {load: k for k, load in enumerate(used)}
        places = np.zeros((len(bends), max((len(each) for each in bends), default=0)), np.intp)
        high, low = np.zeros(places.shape), np.zeros(places.shape)
        for row, each in enumerate(bends):
            for column, (load, bend) in enumerate(each):
                places[row, column] = place[load]
                high[row, column], low[row, column] = Pair.nearest(bend)
        return cls(used, places, Ball.around(Pair(high, low), 2.0**-98 * np.abs(high)))

    def total(self, values: Ball) -> Ball:
        """(m, ...) for each curve the weighted sum of values (k, ...) at the levels `used`."""
        wide = (slice(None),) + (None,) * (len(values.shape) - 1)
        total = Ball.exact(np.zeros((len(self.places), *values.shape[1:])))
        for j in range(self.places.shape[1]):
            total = total + self.weights[:, j][wide] * values[self.places[:, j]]
        return total


def displacements_of(levels: FrictionLevels, sums: LevelSums) -> Ball:
    """(m,) [length] the displacement X of each curve."""
    approaches = Ball.stacked([levels.at(load).approach for load in sums.used])
    return sums.total(approaches) * levels.travel_unit


def states_of(
    levels: FrictionLevels, curves: Sequence[MemoryCurve], which: Indices | None = None
) -> States:
    """The states of these curves, for the asperities `which` in this order; default all."""
    sums, some = LevelSums.of(curves), slice(None) if which is None else which
    levels.prepare(sums.used)
    solved, travel = [levels.at(load) for load in sums.used], levels.travel_unit
    loads = Ball.stacked([of_rows(levels.to_scene, level.loads)[some] for level in solved])
    moved = Ball.stacked([levels.indentations(level)[some] for level in solved])
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
