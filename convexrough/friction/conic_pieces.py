"""The elastic energy of one asperity after a step, in pieces that cones represent exactly.

The energy W(T) is the integral of the deflection of the asperity over its shear force T. It is
convex and consists of one stuck piece, and of a slipping piece for each direction of slip and each
layer of the old memory curve in which the slip front may end: docs/theory/without-order.md,
"The step as one cone program".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.sphere import hertz

#: A piece has LIFT variables: its weight, y1, ..., y5 and z. Y3, Y5, Z are the places of y3, y5, z.
LIFT, Y3, Y5, Z = 7, 3, 5, 6

#: Layers thinner than this fraction of the load are omitted; the solver's error is larger.
THIN = 1e-9


class ConePiece(NamedTuple):
    """A piece of W(T). Forces are divided by the load N of the asperity, lengths by k N^(2/3).

    On a slipping piece the level L of the slip front runs from `low` to `high`. There
    T = force - rate L,  the deflection is  own - rate L^(2/3),  and
    W = own T + (3/5) rate^2 L^(5/3) + energy. On a stuck piece  rate = 0,  |T - force| <= high  and
    W = own (T - force) + (T - force)^2 softness / 2 + energy.
    """

    low: float
    high: float
    rate: float
    force: float
    own: float
    energy: float
    softness: float = 0.0

    def forces(self) -> tuple[float, float]:
        """The smallest and the largest force on the piece."""
        if self.rate == 0.0:
            return self.force - self.high, self.force + self.high
        ends = self.force - self.rate * self.low, self.force - self.rate * self.high
        return min(ends), max(ends)

    def deflection(self, force: float) -> float:
        if self.rate == 0.0:
            return self.own + self.softness * (force - self.force)
        level = max((self.force - force) / self.rate, 0.0)
        return self.own - self.rate * float(np.cbrt(level)) ** 2

    def distance(self, force: float) -> float:
        """The distance of a force from the range of forces of the piece; 0 inside the range."""
        low, high = self.forces()
        return max(low - force, force - high, 0.0)

    def objective(self, shift: float) -> Array:
        """(LIFT,) coefficients of W - shift T^2 / 2 in the variables of a piece."""
        found = np.zeros(LIFT)
        found[0] = self.energy - shift * self.force**2 / 2.0
        if self.rate == 0.0:
            found[Y3] = self.own - shift * self.force
            found[Y5] = (self.softness - shift) / 2.0
            return found
        found[0] += self.own * self.force
        found[Y3] = self.rate * (shift * self.force - self.own)
        found[Y5] = self.rate**2 * (0.6 - shift / 2.0)
        found[Z] = self.rate**2 * shift / 2.0
        return found

    def cost(self, force: float) -> float:
        """W at this force, minus the constant `energy`."""
        if self.rate == 0.0:
            return (self.own + 0.5 * self.softness * (force - self.force)) * (force - self.force)
        level = max((self.force - force) / self.rate, 0.0)
        return self.own * force + 0.6 * self.rate**2 * float(np.cbrt(level)) ** 5


def pieces_of(levels: Array, heights: Array, own: float, k: float) -> list[ConePiece]:
    """The pieces of the energy of an asperity, from its memory curve before the step.

    levels, heights : (m,) vertices of this curve; no level exceeds `own`
    own : indentation of the asperity after the step, positive
    k   : coefficient of the asperity in Hertz's law
    """
    distinct = np.diff(levels, prepend=-1.0) > 0
    s, base = levels[distinct], float(levels[-1])
    load = float(hertz.load(own, k))
    N, xi = hertz.load(s, k) / load, heights[distinct] / own
    slopes = (np.diff(heights[distinct]) / np.diff(s)).tolist()
    T = np.concatenate(([0.0], np.cumsum(np.array(slopes) * np.diff(N))))
    top, moved = float(N[-1]), float(xi[-1])
    found = []
    start = {1: (float(T[-1]), 0.0), -1: (float(T[-1]), 0.0)}  # force and energy reached so far
    if own > base * (1 + THIN):
        softness = (1.0 - base / own) / (1.0 - top)
        stuck = ConePiece(0.0, 1.0 - top, 0.0, float(T[-1]), moved, 0.0, softness)
        found.append(stuck)
        for sign, end in zip((-1, 1), stuck.forces(), strict=True):
            start[sign] = end, stuck.cost(end)
    for sign in (1, -1):
        force, energy = start[sign]
        for j in reversed(range(len(slopes))):
            low, high = float(N[j]), float(N[j + 1])
            rate = sign - slopes[j]  # c (1 - c th)
            if high - low <= THIN or abs(rate) <= THIN:
                continue
            level = float(T[j]) - slopes[j] * low + sign
            reached = float(xi[j]) - slopes[j] * low ** (2 / 3) + sign
            piece = ConePiece(low, high, rate, level, reached, 0.0)
            piece = piece._replace(energy=energy - piece.cost(force))
            found.append(piece)
            force = piece.forces()[1 if sign > 0 else 0]
            energy = piece.cost(force) + piece.energy
    return found
