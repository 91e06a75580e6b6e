"""Candidates for the convexity argument of a proof: boxes of contact radii, and shells.

They are computed in floating point and need not be valid. The checker verifies each in exact
arithmetic; if it refuses one, the next is tried. docs/theory/proof-file-steps.md, "Convexity on the
box", defines box, shells and convexity number.
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

#: Two numbers for boxes that contain every solution: the relative distance of their upper ends from
#: bounds on the radii, and the smallest upper end divided by the largest. The first pair of numbers
#: is for accurate radii, the second for inaccurate ones.
ROOM = ((1e-6, 1e-2), (5e-2, 3e-1))

#: Relative room for rounding in this module.
ROUNDING = 1e-9

#: Convexity numbers tried with overlapping shells, and with Cholesky factorisation.
CROWDED = (0.9, 0.99, 0.999, 0.9999)

#: Radii of overlapping shells, divided by the smallest radii that are enough without overlap.
WIDTHS = (2.0, 4.0, 8.0)

#: Relative distance from the radii to the upper ends of a box in which all asperities that do not
#: touch are fixed open: for radii with thirty digits, float64 numbers, and less accurate ones.
LEEWAY = (1e-12, 1e-6, 1e-2)


class Argument(NamedTuple):
    """The claim that the energy is strongly convex for contact radii 0 <= a <= box.

    box     : (n,) [length] 0 for asperities that are fixed open
    shells  : (n,) [length] radii of shells; None for a Cholesky factorisation
    ceiling : [length] a number above all (A P)_i; None if the approach is prescribed
    """

    box: Array
    convexity_number: float
    shells: Array | None
    ceiling: float | None


@dataclass(frozen=True, eq=False)
class TrialState:
    """Contact radii (n,) [length] near a solution, and the prescribed approach or load / E*."""

    scene: Scene
    radii: Array
    approach: float | None
    load: float | None

    @cached_property
    def apart(self) -> Array:
        """(n, n) [length] distances, with infinity on the diagonal."""
        distances: Array = cdist(self.scene.contact_points, self.scene.contact_points)
        np.fill_diagonal(distances, np.inf)
        return distances

    @cached_property
    def loads(self) -> Array:
        """(n,) loads / E*, scaled to the prescribed total."""
        loads: Array = 4 * self.radii**3 / (3 * self.scene.relative_radii)
        return loads if self.load is None else loads * (self.load / loads.sum())

    @cached_property
    def local(self) -> Array:
        """(n,) [length] indentations a^2 / R by the asperities' own loads."""
        return self.radii**2 / self.scene.relative_radii

    @cached_property
    def pushed(self) -> Array:
        """(n,) [length] displacements A P by the loads on other asperities."""
        return (1 / self.apart) @ self.loads / np.pi

    @cached_property
    def best_approach(self) -> float:
        """[length] the prescribed approach, or the one that fits the touching asperities best."""
        if self.approach is not None:
            return self.approach
        wanted = self.local + self.pushed - self.scene.offsets
        return float(self.radii @ wanted / self.radii.sum())

    @cached_property
    def ceiling(self) -> tuple[float | None, float]:
        """`Argument.ceiling`, and an upper bound [length] on the approach of every solution.

        The bound follows from the ceiling; if the approach is prescribed, they are None and D0.
        """
        if self.approach is not None:
            return None, self.approach
        loaded = self.loads > 0
        p, w, R = self.loads[loaded], self.pushed[loaded], self.scene.relative_radii[loaded]
        share = p / p.sum()
        least, most = self.pushed.max(), (2 / 3 * self.local + self.pushed).max()
        tops = [least + (most - least) * 0.75**k for k in range(12)]
        bounds = [top + float(share @ ((p / (top - w)) ** 2 / (12 * R))) for top in tops]
        best, bound = min(zip(tops, bounds, strict=True), key=lambda each: each[1])
        drop = float(share @ self.scene.offsets[loaded])
        return float(best), bound - drop + ROUNDING * (bound + abs(drop))

    def arguments(self) -> Iterator[Argument]:
        """The arguments that are valid in floating point, the most general first."""
        for beyond, least in ROOM:
            yield from self._on(self._box(beyond, least))
        for beyond in LEEWAY:
            yield from self._on(self.radii * (1 + beyond))

    def _on(self, box: Array) -> Iterator[Argument]:
        """At most two arguments on a box: by shells that do not overlap, and one for crowds."""
        shells, able = self._room(box) * (1 - ROUNDING), box > 0
        least = float((2 * box[able] / (np.pi * shells[able])).max(initial=ROUNDING))
        if (number := least * (1 + ROUNDING)) < 1:
            yield Argument(box, number, shells, self.ceiling[0])
        if crowded := self._crowded(box):
            yield crowded

    def _room(self, box: Array) -> Array:
        """(n,) [length] half the distances to the nearest asperity in the box; 0 for others."""
        able = box > 0
        nearest = self.apart[able].min(axis=0, initial=4 * box.max(initial=0.0))
        return np.where(able, nearest / 2, 0.0)

    def _box(self, beyond: float, least: float) -> Array:
        """(n,) [length] upper bounds on the radii of every solution; 0 where none can touch."""
        R, offsets = self.scene.relative_radii, self.scene.offsets
        deepest = self.ceiling[1] + offsets
        size = np.abs(offsets) + abs(self.ceiling[1])
        box: Array = np.sqrt(R * np.maximum(deepest, 0.0)) * (1 + beyond)
        box = np.maximum(box, least * max(box.max(), self.radii.max()))
        box[(deepest < -ROUNDING * size) & (self.radii == 0)] = 0.0
        return box

    def _crowded(self, box: Array) -> Argument | None:
        """An argument by overlapping shells, or if none is found by Cholesky's method."""
        able = np.flatnonzero(box)
        apart = self.apart[np.ix_(able, able)]
        for number in CROWDED:
            least = 2 * box[able] / (np.pi * number)  # t_i of docs/theory/proof-file-steps.md, (3)
            for width in WIDTHS:
                s = width * least
                over = np.maximum(s[:, None] + s - apart, 0.0)
                overlaps = (over**2 / (4 * apart)).sum(axis=1) * (1 + ROUNDING)
                if (overlaps < s * (width - 1)).all():
                    shells = np.zeros(len(box))
                    shells[able] = s * (1 + ROUNDING)
                    return Argument(box, number, shells, self.ceiling[0])
        root = np.sqrt(2 * box[able])
        scaled = root[:, None] / (np.pi * apart) * root
        for number in CROWDED:
            np.fill_diagonal(scaled, number - ROUNDING)
            try:
                cholesky(scaled, lower=True, check_finite=False)
            except LinAlgError:
                continue
            return Argument(box, number, None, self.ceiling[0])
        return None
