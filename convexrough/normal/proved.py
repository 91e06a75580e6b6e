"""The proof that a solution exists near trial loads, and bounds on its distance.

The steps: choose a box of loads on which the energy is convex (`boxes`); apply the theorem of
`convex.theorem` on it; apply the theorem again on the smaller box that the result proves to hold
the solution; bound the approach and the indentations; and bound the loads again through the
indentations. Symbols are those of docs/theory/certificate.md: loads P, approach D0, compliance
operator A, local Hessian H; a star marks the solution.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.convex.theorem import distance
from convexrough.influence.coupling import Coupling, error_reach
from convexrough.normal.boxes import Box, box_of_touching, crowded, tried
from convexrough.normal.problem import NormalProblem
from convexrough.normal.refine import Trial
from convexrough.numbers.balls import Ball
from convexrough.numbers.pairs import Pair
from convexrough.roundoff import SAFETY

#: Number of boxes of touching asperities that are tried, and the factor by which a box exceeds the
#: last error bounds. Each is larger than the last, or has more asperities. Heuristics.
ATTEMPTS, ROOM = 6, 2.0

#: Relative error above which loads are also bounded through their indentations.
POOR = 2.0**-60

NONE = np.zeros(0, dtype=np.intp)

CROWDED = "their discs overlap so far that the energy is not known to be convex"
POORLY_KNOWN = "their loads are not known well enough to stay in a box where the energy is convex"
NOT_OPEN = "they are fixed open, but their gaps are not proved"


class Obstacle(NamedTuple):
    """The reason why nothing is proved, and the indices of the candidates that cause it."""

    reason: str
    which: Indices


@dataclass(frozen=True, eq=False)
class Proved:
    """A proved solution, as balls over the n candidates (asperities that may touch), in own units.

    trial     : the loads P from which it was proved
    box       : a box of loads that holds exactly one solution
    distance  : bound on || P - P* ||_H
    stiffness : (n,) diagonal of H
    loads     : (n,) the loads of the solution
    indentation : (n,) its indentations; negative values are gaps
    approach  : its approach
    """

    problem: NormalProblem
    trial: Trial
    box: Box
    distance: float
    stiffness: Array
    loads: Ball
    indentation: Ball
    approach: Ball

    @cached_property
    def touching(self) -> NDArray[np.bool_]:
        """(n,) True where an asperity is proved to carry a load."""
        return self.indentation.positive | self.loads.positive

    @cached_property
    def open(self) -> NDArray[np.bool_]:
        """(n,) True where an asperity is proved to have a gap."""
        return self.indentation.negative

    @property
    def total(self) -> Ball:
        """The sum of the loads, with an error bound by Cauchy's inequality."""
        trial = Ball.exact(self.trial.loads).sum()
        spread = self.distance * math.sqrt(float((1.0 / self.stiffness).sum())) * (1 + SAFETY)
        return Ball.around(trial.mid, trial.radius + spread + float(self.trial.missing.size))

    def moves(self, coupling: Coupling) -> Array:
        """(m,) bounds on |A (P - P*)| at the targets of a coupling."""
        missing = self.trial.missing.size * self.problem.largest_entry
        reach = error_reach(coupling, self.problem.influence.scale, 1.0 / self.stiffness)
        return np.asarray((self.distance * reach + missing) * (1 + SAFETY))


def proved(
    problem: NormalProblem, state: Trial, boxes: Iterator[Box] | None = None
) -> Proved | Obstacle:
    """The solution in the first box that is proved to hold it, or the obstacle to a proof.

    boxes : boxes of all candidates to try first; default `boxes.tried`. If none of them is proved
        to hold the solution, boxes with only the touching candidates are tried, others fixed open
    """
    loads = state.loads.high
    for box in boxes or tried(problem, loads, state.product.value):
        found = _in_box(problem, box, state)
        if isinstance(found, Proved) and not (
            box.fixed_open.any() and (box.fixed_open & ~found.open).any()
        ):
            return found
    touching, room, obstacle = state.inside, np.zeros(len(loads)), Obstacle("", NONE)
    for _ in range(ATTEMPTS):
        fixed = box_of_touching(problem, loads, touching, room)
        if fixed is None:
            break
        found = _in_box(problem, fixed, state)
        if not isinstance(found, Proved):
            obstacle = Obstacle(POORLY_KNOWN, np.flatnonzero(loads + found >= fixed.faces))
            room = np.maximum(room, ROOM * found)
            continue
        doubtful = fixed.fixed_open & ~found.open
        if not doubtful.any():
            return found
        obstacle = Obstacle(NOT_OPEN, np.flatnonzero(doubtful))
        touching, room = touching | doubtful, np.maximum(room, ROOM * found.loads.radius)
    return obstacle if obstacle.reason else Obstacle(CROWDED, crowded(problem, loads))


def _in_box(problem: NormalProblem, box: Box, state: Trial) -> Proved | Array:
    """The solution in this box, or (n,) bounds on load errors that are too large for the box."""
    loads = state.loads.high
    missing = float(state.missing.size)
    missing_effect, own = _of_missing(problem, state, missing)
    residual = np.where(box.fixed_open, 0.0, state.excess + missing_effect)
    if missing:
        residual[own[0]] += own[1]

    def errors_on(stiffness: Array, margin: float) -> tuple[float, Array]:
        within = distance(residual, stiffness, margin)
        errors = within / np.sqrt(stiffness) * (1 + SAFETY)
        if missing:
            errors[own[0]] += missing
        return within, errors

    _, errors = errors_on(box.stiffness, 1.0 - box.convexity_number)
    if (loads + errors >= box.faces).any() or not np.isfinite(errors).all():
        return errors
    near = np.minimum(box.loads, (loads + errors) * (1 + SAFETY))
    h = problem.stiffness(near)
    margin = 1.0 - min(box.convexity_number, box.problem.convexity_at(h))
    within, errors = errors_on(h, margin)
    # Bound A (P - P*) by Cauchy's inequality.
    softest = float(h.min(initial=np.inf))
    moved = (within / np.sqrt(softest) * problem.row_norm + missing_effect) * (1 + SAFETY)
    shift = _approach_error(problem, state, errors, moved)
    approach = Ball.around(state.approach.mid, shift)
    known = state.indentation
    indentation = Ball.around(known.mid, known.radius + (moved + shift))
    found = Ball.around(state.loads, np.where(indentation.negative, 0.0, errors))
    found = _sharpened(problem, found, indentation)
    return Proved(problem, state, box, within, h, found, indentation, approach)


def _sharpened(problem: NormalProblem, loads: Ball, indentation: Ball) -> Ball:
    """Loads, with poorly known ones also computed as (n / k)^(3/2) of their indentations n."""
    which = np.flatnonzero(loads.radius > POOR * loads.mid.high)
    if len(which) == 0:
        return loads
    k = problem.exact.coefficients
    ratio = indentation[which] / (k if len(k) == 1 else k[which])
    by_law = ratio.positive_part() * ratio.sqrt()
    better = by_law.radius < loads.radius[which]
    parts = np.array((*loads.mid, loads.radius))
    parts[:, which[better]] = np.array((*by_law.mid, by_law.radius))[:, better]
    return Ball(Pair(parts[0], parts[1]), parts[2])


def _of_missing(
    problem: NormalProblem, state: Trial, missing: float
) -> tuple[float, tuple[int, float]]:
    """Residuals due to a missing part of the total load, which is added to the largest load.

    The first is that of every asperity; then follow the index of the largest load and its own.
    """
    if missing == 0.0 or len(state.loads.high) == 0:
        return 0.0, (0, 0.0)
    j = int(np.argmax(state.loads.high))
    largest = float(state.loads.high[j])
    if not missing < largest / 2.0:
        return np.inf, (j, np.inf)
    steepest = 4.0 / 3.0 * float(state.local[j]) / largest * (1 + SAFETY)
    return missing * problem.largest_entry, (j, missing * steepest)


def _approach_error(problem: NormalProblem, state: Trial, errors: Array, moved: float) -> float:
    """Bound on |D0 - D0*| from D0* = k P*^(2/3) + (A P*) - d at asperities proved to touch.

    k is the local coefficient and d the offset of an asperity; `moved` bounds A (P - P*).
    """
    if problem.load is None:
        return float(state.approach.radius)
    least = state.loads.high - errors
    sure = least > 0
    if not sure.any():
        return np.inf
    # k P^(2/3) is concave: between least and P its slope is at most that at least.
    slope = problem.stiffness(least[sure], np.flatnonzero(sure))
    each = state.gap.size[sure] + slope * errors[sure] * (1 + SAFETY)
    return float(each.min() + moved) * (1 + SAFETY) + float(state.approach.radius)
