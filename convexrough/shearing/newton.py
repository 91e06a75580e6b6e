"""Friction states of many asperities, one after the other, by Newton's method.

Each is started from those already known, as the curves eta(T) are smooth, and found by
`convex.newton` with the steps of `convex.newton_step`, which keep the sum of the increments.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.convex import newton
from convexrough.convex.newton_step import correct
from convexrough.progress import Announce
from convexrough.roundoff import SAFETY
from convexrough.shearing.energy import TangentialEnergy
from convexrough.shearing.normal_map import (
    States,
    elastic_deflections,
    evaluate,
    gradients,
    gross_sliding,
    slips,
)

#: A state is accurate where its residual is below this part of the rise.
ACCURATE = 1e-12

MOST_STEPS = 100

#: States nearer to each other than this part of T are one for the curve through them, which is
#: followed no farther than to so many times the largest T: it magnifies their errors. Heuristic.
NEAR, FAR = 1e-4, 3.0


def solve_in_turn(
    energy: TangentialEnergy,
    totals: Array,
    first: Callable[[float], Array],
    known: States | None = None,
    announce: Announce | None = None,
) -> States:
    """States at 0 <= T <= sum P of many asperities, by increasing T.

    first : (n,) deflections to start from at some T where nothing is known
    known : states to start from, besides
    """
    m, n = len(totals), len(energy)
    states = States(totals, np.zeros((m, n)), np.zeros((m, n)), np.zeros(m), np.zeros((m, n)))
    curve = _Curve(known)
    for done, i in enumerate(np.argsort(totals, kind="stable")):
        total = float(totals[i])
        if total == 0.0:
            continue
        eta, u, rise, residual = _state_at(energy, totals[i : i + 1], curve, first)
        states.deflections[i], states.increments[i], states.rises[i] = eta, u, rise
        states.slips[i] = slips(energy, eta)
        curve.add(total, states.deflections[i])
        if announce is not None:
            sliding = int(np.count_nonzero(states.slips[i]))
            part = residual / rise if rise > 0 else 0.0
            announce(
                f"state {done + 1} of {m}: residual {part:.0e} of the displacement, "
                f"{sliding:,} sliding"
            )
    return states


def _state_at(
    energy: TangentialEnergy, total: Array, curve: _Curve, first: Callable[[float], Array]
) -> tuple[Array, Array, float, float]:
    """eta, u, the rise and the residual at one T (1,), not 0."""
    if energy.at_limit(total)[0]:
        return *gross_sliding(energy), 0.0
    if energy.elastically(total)[0]:
        found = _State.at(energy, elastic_deflections(energy, total)[0], total)
    else:
        law = _Shearing(energy, total)
        start = curve.at(float(total[0]))
        state = law.evaluate(first(float(total[0])) if start is None else start)
        stopping = newton.Stopping(ACCURATE, 0.0, MOST_STEPS)
        before = state.scale * float(np.sqrt(len(energy)))
        found, _ = newton.solve(law, state, stopping, before=before)
    return found.unknown, found.forces, found.scale, found.residual


class _State(NamedTuple):
    """One state, as `convex.newton` sees it; in the order of `Iterates`."""

    unknown: Array  # (n,) eta
    forces: Array  # (n,) u
    coupling: Array  # (n,) A u
    slopes: Array  # (n,) c
    defect: Array  # (n,) F
    scale: float  # the rise
    energy: float
    residual: float  # max |F|

    @classmethod
    def at(cls, energy: TangentialEnergy, eta: Array, total: Array) -> _State:
        """The state at eta (n,), moved to the total (1,)."""
        return cls(*(field[0] for field in evaluate(energy, eta[None], total)))


@dataclass(frozen=True)
class _Shearing:
    """The law of friction at one total, for `convex.newton`; total : (1,) T."""

    problem: TangentialEnergy
    total: Array

    solver: ClassVar[str] = "shear"
    unit: ClassVar[str] = "the displacement"

    def evaluate(self, unknown: Array) -> _State:
        return _State.at(self.problem, unknown, self.total)

    def direction(self, state: _State, left: float) -> Array:
        return correct(
            self.problem.influence,
            self.problem.shells,
            np.sqrt(state.slopes),
            state.defect,
            balanced=True,
            tolerance=left,
        )

    def gradient(self, state: _State) -> Array:
        return gradients(self.problem, state.unknown, state.coupling, state.scale)

    def energy_rounding(self, state: _State) -> float:
        return SAFETY * state.energy

    def noise(self, state: _State) -> float:
        return self.problem.influence.rounding(state.forces).negligible(state.coupling)

    def advice(self, state: _State) -> str:
        return advice(self.problem, float(self.total[0]))


def advice(energy: TangentialEnergy, total: float) -> str:
    """What a user might try where no state is found at a total increment."""
    place = f"this was at {total / energy.limit:.6g} of gross sliding"
    number = float((energy.shells * energy.stiffest).max())
    if number < 1:
        return f"{place}; try a shear force a little smaller"
    return (
        f"{place}, of a contact so crowded that the energy need not be convex (convexity number "
        f"{number:.3g}, convex below 1): press less hard, or on sharper tips"
    )


class _Curve:
    """eta(T) through the states known so far; it starts from 0."""

    def __init__(self, known: States | None) -> None:
        self.totals: list[float] = []
        self.deflections: list[Array] = []
        if known is not None:
            for total, eta in zip(known.totals.tolist(), known.deflections, strict=True):
                self.add(total, eta)

    def add(self, total: float, deflections: Array) -> None:
        """One more state, unless there is one so near that no line should go through both."""
        place = bisect_left(self.totals, total)
        near = [0.0, *self.totals[max(place - 1, 0) : place + 1]]
        if min(abs(total - other) for other in near) > NEAR * total:
            self.totals.insert(place, total)
            self.deflections.insert(place, deflections)

    def at(self, total: float) -> Array | None:
        """On the parabola through the three nearest states, of which 0 may be one; None if far."""
        if not self.totals or total > FAR * self.totals[-1]:
            return None
        place = bisect_left(self.totals, total)
        low = max(0, min(place - 2, len(self.totals) - 3))
        points = list(zip(self.totals[low : low + 3], self.deflections[low : low + 3], strict=True))
        zeros = [] if len(points) == 3 else [0.0]
        eta = np.zeros_like(self.deflections[0])
        for here, values in points:
            others = np.array([there for there, _ in points if there != here] + zeros)
            eta += float(np.prod((total - others) / (here - others))) * values
        return eta
