"""States of a load path: the memory curve read off at certified normal solutions.

With bends c_k of the curve at levels s_k (`MemoryCurve.bends`), the state is a sum over levels,

    Q_i = f sum c_k P_i(s_k),   X = c_t f sum c_k D0(s_k),   own + drift = c_t f sum c_k n_i(s_k),

n_i the indentation, or minus the gap. Derived in docs/theory/load-paths.md, "The state".
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.paths.levels import Level, Levels
from convexrough.paths.memory import MemoryCurve, Piece
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.sphere import mindlin


class States(NamedTuple):
    """States after m vertices, in the scene's units; as in `LoadPath`."""

    displacements: Array
    displacement_errors: Array
    forces: Array
    force_errors: Array
    asperity_displacements: Array
    drifts: Array


class Friction(NamedTuple):
    """f, and c_t f: what tangential displacements are counted in."""

    coefficient: float
    travel: float

    @classmethod
    def of(cls, levels: Levels) -> Friction:
        f = checks.friction(levels.scene.friction)
        return cls(f, f * float(mindlin.ratio(levels.scene.material.poisson_ratio)))


def levels_of(curve: MemoryCurve, pieces: Sequence[Piece]) -> set[Fraction]:
    """Everything that must be pressed to know a state and what it cost."""
    asked: set[Fraction] = set(curve.levels)
    if curve.front is not None:
        asked.add(curve.front)
    for piece in pieces:
        asked.update((piece.top, piece.bottom, piece.load_before, piece.load_after))
    return asked


def states_of(levels: Levels, curves: Sequence[MemoryCurve]) -> States:
    """The states of these curves."""
    f, travel = Friction.of(levels)
    used = sorted({float(level) for curve in curves for level in curve.levels})
    place = {level: k for k, level in enumerate(used)}
    bends = np.zeros((len(curves), len(used)))
    for row, curve in zip(bends, curves, strict=True):
        for level, bend in curve.bends:
            row[place[float(level)]] += float(bend)
    solved = [levels.at(level) for level in used]

    def summed(values: list[Array] | list[float]) -> Array:
        return np.asarray(bends @ np.array(values))

    def bounded(errors: list[Array] | list[float], values: list[Array] | list[float]) -> Array:
        """The errors of a sum, with what adding it up loses."""
        lost = (len(used) + 4) * ROUNDOFF * (np.abs(bends) @ np.abs(np.array(values)))
        return np.asarray((np.abs(bends) @ np.array(errors) + lost) * (1 + SAFETY))

    approaches, loads = [each.approach for each in solved], [each.loads for each in solved]
    travelled = summed([each.indentations for each in solved])
    own = summed([np.maximum(each.indentations, 0.0) for each in solved])
    return States(
        displacements=frozen(travel * summed(approaches)),
        displacement_errors=frozen(
            travel * bounded([each.approach_error for each in solved], approaches)
        ),
        forces=frozen(f * summed(loads)),
        force_errors=frozen(f * bounded([each.load_errors for each in solved], loads)),
        asperity_displacements=frozen(travel * travelled),
        drifts=frozen(travel * (travelled - own)),
    )


def words(levels: Levels, curve: MemoryCurve) -> NDArray[np.str_]:
    """(n,) "open", "sliding", "partial", "stuck" or "undecided", from the proofs at P and at L.

    Proved where the indentations are ordered at these levels.
    """
    here = levels.at(curve.load)
    if curve.front is None:
        return worded(here, stuck=here.touching)
    front = levels.at(curve.front)
    return worded(here, partial=front.touching, sliding=here.touching & front.open)


def worded(here: Level, **proved: NDArray[np.bool_]) -> NDArray[np.str_]:
    """(n,) "open" where open here, and each word where that is proved; else "undecided"."""
    found = np.full(len(here.open), "undecided", dtype="<U12")
    found[here.open] = "open"
    for word, which in proved.items():
        found[which] = word
    return frozen(found)
