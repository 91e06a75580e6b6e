"""The load at which an asperity first touches, enclosed by two proofs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Indices
from convexrough.paths.levels import Levels

#: Distances from the root, relative to it, at which proofs are tried, the closest first.
TRIED = tuple(10.0**-k for k in range(12, 3, -1))


class Onset(NamedTuple):
    """A load [force], proved to be between two others."""

    load: float
    lower: float  # the asperity is proved open there
    upper: float  # and to touch there


def onset(levels: Levels, asperity: int, below: float) -> Onset:
    """Of an asperity that touches at the load `below`: by Brent's method on its indentation.

    Where no proof is found the bounds are 0 and `below`.
    """
    from scipy.optimize import brentq  # 0.1 s to import: only when asked

    def indentation(load: float) -> float:
        return float(levels.at(load).indentations[asperity])

    levels.at(below)
    high = min(each.load for each in levels.known if each.indentations[asperity] > 0)
    low = max(
        each.load for each in levels.known if each.load < high and each.indentations[asperity] <= 0
    )
    root = low if indentation(low) == 0 else brentq(indentation, low, high, xtol=1e-16 * high)
    if root == 0:
        above = (below * part for part in TRIED)
        return Onset(0.0, 0.0, next((s for s in above if levels.at(s).touching[asperity]), below))
    lower = next(
        (load for part in TRIED if _open(levels, asperity, load := root * (1 - part))), 0.0
    )
    above = (root * (1 + part) for part in TRIED if root * (1 + part) < below)
    upper = next((load for load in above if levels.at(load).touching[asperity]), below)
    return Onset(float(root), lower, upper)


def _open(levels: Levels, asperity: int, load: float) -> bool:
    return bool(levels.at(load).open[asperity])


def onsets(levels: Levels, which: Iterable[int], below: float) -> dict[int, Onset]:
    """Those of some asperities that touch at the load `below`."""
    return {asperity: onset(levels, asperity, below) for asperity in which}


def last_to_touch(levels: Levels, below: float) -> tuple[int, Onset]:
    """The asperity with the highest onset of those that touch at a load."""
    here = levels.at(below)
    touching: Indices = np.flatnonzero(here.loads)
    last = int(touching[np.argmin(here.indentations[touching])])
    while True:
        found = onset(levels, last, below)
        there = levels.at(found.load).indentations[touching]
        farthest = int(touching[np.argmin(there)])
        if farthest == last or there.min() >= -4 * levels.at(found.load).indentation_errors.max():
            return last, found
        last = farthest
