"""Boxes of contact radii, and why the energy is convex on them: chosen in floating point.

Nothing here has to be right. The checker recomputes what it needs and refuses what does not hold;
then the next one is tried.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cholesky
from scipy.spatial.distance import cdist

from convexrough.arrays import Array
from convexrough.scene.scene import Scene

#: How far, relatively, boxes end beyond what a solution can reach, and their least radius in parts
#: of the largest: room for the bounds. First for radii to all digits, then for rough ones.
ROOM = ((1e-6, 1e-2), (5e-2, 3e-1))

#: Relative room for rounding in what is computed here.
ROUNDING = 1e-9

#: Convexity numbers to try by Cholesky factorisation.
BY_CHOLESKY = (0.9, 0.99, 0.999)

#: The part of the room between neighbours that fitted shells share out by size.
FITTED = 0.9


class Argument(NamedTuple):
    """On the box 0 <= a <= box the Hessian is at least 1 - convexity_number of its local part.

    shells : (n,) [length] radii of spheres that do not overlap, or None: by Cholesky
    """

    box: Array
    convexity_number: float
    shells: Array | None


@dataclass(frozen=True, eq=False)
class Trial:
    """Contact radii (n,) [length] near a solution, and the approach or the load over E*."""

    scene: Scene
    radii: Array
    approach: float | None
    load: float | None

    @cached_property
    def apart(self) -> Array:
        """(n, n) [length] distances, infinite from an asperity to itself."""
        distances: Array = cdist(self.scene.contact_points, self.scene.contact_points)
        np.fill_diagonal(distances, np.inf)
        return distances

    @cached_property
    def loads(self) -> Array:
        """(n,) loads over E*, of the right total."""
        loads: Array = 4 * self.radii**3 / (3 * self.scene.relative_radii)
        return loads if self.load is None else loads * (self.load / loads.sum())

    @cached_property
    def local(self) -> Array:
        return self.radii**2 / self.scene.relative_radii

    @cached_property
    def pushed(self) -> Array:
        """(n,) [length] A P."""
        return (1 / self.apart) @ self.loads / np.pi

    @cached_property
    def best_approach(self) -> float:
        """Prescribed, or the one that fits the touching asperities best."""
        if self.approach is not None:
            return self.approach
        wanted = self.local + self.pushed - self.scene.offsets
        return float(self.radii @ wanted / self.radii.sum())

    @cached_property
    def ceiling(self) -> float:
        """A bound on the approach of every solution: (4) of docs/theory/proof-file.md."""
        if self.approach is not None:
            return self.approach
        share = self.loads / self.loads.sum()
        highest = float((2 / 3 * self.local + self.pushed).max())
        mean = float(share @ self.local / 3), -float(share @ self.scene.offsets)
        terms = np.array([highest, *mean])
        return float(terms.sum() + ROUNDING * np.abs(terms).sum())

    def arguments(self) -> Iterator[Argument]:
        """The most general first; those that fail already in floating point are left out."""
        for beyond, least in ROOM:
            box = self._box(beyond, least)
            able = box > 0
            room = np.where(able, self.apart[able].min(axis=0, initial=4 * box.max()) / 2, 0.0)
            yield from _by_shells(box, room)
            yield from self._by_cholesky(box)
            yield from self._local(box, room)
            yield from self._local(box, self._fitted(room))

    def _box(self, beyond: float, least: float) -> Array:
        """(n,) [length] radii that hold every solution; 0 where none can touch."""
        R, offsets = self.scene.relative_radii, self.scene.offsets
        deepest = self.ceiling + offsets
        size = np.abs(offsets) + abs(self.ceiling)
        box: Array = np.sqrt(R * np.maximum(deepest, 0.0)) * (1 + beyond)
        box = np.maximum(box, least * max(box.max(), self.radii.max()))
        box[(deepest < -ROUNDING * size) & (self.radii == 0)] = 0.0
        return box

    def _by_cholesky(self, box: Array) -> Iterator[Argument]:
        able = np.flatnonzero(box)
        root = np.sqrt(2 * box[able])
        scaled = root[:, None] / (np.pi * self.apart[np.ix_(able, able)]) * root
        for number in BY_CHOLESKY:
            np.fill_diagonal(scaled, number - ROUNDING)
            try:
                cholesky(scaled, lower=True, check_finite=False)
            except LinAlgError:
                continue
            yield Argument(box, number, None)
            return

    def _fitted(self, room: Array) -> Array:
        """Shells by size: s = 0.9 a / c + 0.1 room, with c the largest (a_i + a_j) / r_ij."""
        able = np.flatnonzero(room)
        a = self.radii[able]
        crowding = float(((a[:, None] + a) / self.apart[np.ix_(able, able)]).max(initial=0.0))
        if crowding == 0:
            return room
        return np.where(room > 0, FITTED * self.radii / crowding + (1 - FITTED) * room, 0.0)

    def _local(self, box: Array, shells: Array) -> Iterator[Argument]:
        """A box that ends half-way between these radii and where convexity ends."""
        end = np.pi / 2 * shells
        number = float((self.radii[box > 0] / end[box > 0]).max(initial=0.0))
        if number < 1:
            yield from _by_shells(np.minimum(box, (1 + number) / 2 * end), shells)


def _by_shells(box: Array, shells: Array) -> Iterator[Argument]:
    able = box > 0
    shells = shells * (1 - ROUNDING)
    number = float((2 * box[able] / (np.pi * shells[able])).max(initial=ROUNDING)) * (1 + ROUNDING)
    if number < 1:
        yield Argument(box, number, shells)
