"""The proof that a solution exists near trial loads, and bounds on the distance to it.

The theorem of docs/theory/one-theorem.md is applied twice: first on a box of loads on which the
energy is convex (module `boxes`), then on a smaller box, which contains the solution by the first
result (docs/theory/certificate.md). P are the trial loads, D0 the approach and A the compliance
operator. A star marks the solution. `h` is the diagonal of H, the local part of the Hessian at the
upper ends of a box.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from convexrough.arithmetic.balls import Ball, of_rows, replaced, where
from convexrough.arrays import Array, summed
from convexrough.convex.theorem import distance
from convexrough.normal.boxes import Box, box_of_touching, crowded, tried
from convexrough.normal.level import Level, Obstacle
from convexrough.normal.problem import NormalProblem
from convexrough.normal.refine import Trial
from convexrough.roundoff import SAFETY

#: Largest number of boxes of touching asperities that are tried; and the least distance of the
#: upper ends of the next such box from the loads, divided by the latest error bounds. Heuristics.
ATTEMPTS, ROOM = 6, 2.0

#: If the relative error of a load is above this, its indentation gives a second error bound.
POOR = 2.0**-60

NONE = np.zeros(0, dtype=np.intp)

CROWDED = "contact discs overlap so much that the energy is not proved to be convex"
POORLY_KNOWN = "loads, with error bounds, may lie outside the box where the energy is convex"
ELSEWHERE = "no given box is proved to contain the loads"
NOT_OPEN = "no gap is proved where the proof assumes one"


def proved(problem: NormalProblem, state: Trial, box: Box | None = None) -> Level:
    """The `Level` of the solution in `box`, or an unproved level whose `obstacle` says why not.

    The default is the box of `normal.boxes.tried` and, if this proves nothing, boxes in which
    asperities without a load are assumed to be open; later boxes drop this assumption for
    asperities whose gaps are not proved.
    """
    loads = state.loads.high
    if (first := box or tried(problem, loads, state.product)) is not None:
        inside, _, found = solution_in(problem, first, state)
        if inside and not (first.fixed_open & ~found.open).any():
            return found
    if box is not None:
        return Level.unproved(problem, state, Obstacle(ELSEWHERE, NONE))
    touching, room, obstacle = state.inside, np.zeros(len(loads)), Obstacle("", NONE)
    for _ in range(ATTEMPTS):
        fixed = box_of_touching(problem, loads, touching, room)
        if fixed is None:
            break
        inside, errors, found = solution_in(problem, fixed, state)
        if not inside:
            obstacle = Obstacle(POORLY_KNOWN, np.flatnonzero(loads + errors >= fixed.faces))
            room = np.maximum(room, ROOM * errors)
            continue
        doubtful = fixed.fixed_open & ~found.open
        if not doubtful.any():
            return found
        obstacle = Obstacle(NOT_OPEN, np.flatnonzero(doubtful))
        touching, room = touching | doubtful, np.maximum(room, ROOM * found.loads.radius)
    if not obstacle.reason:
        obstacle = Obstacle(CROWDED, crowded(problem, loads))
    return Level.unproved(problem, state, obstacle)


@np.errstate(all="ignore")
def solution_in(problem: NormalProblem, box: Box, state: Trial) -> tuple[Any, Array, Level]:
    """Three results on the solution near the trial loads: True if it is proved that the box
    contains the solution, (m,) for a stack (if False, the other two prove nothing); (n,) bounds on
    the errors of the trial loads; and the level, by the theorem on a smaller box."""
    trial, (extra, coupled, bent) = state.loads.high, _missing(problem, state)
    residual = np.where(box.fixed_open, 0.0, state.excess + bent)

    def theorem(h: Array, number: Any) -> tuple[Any, Array]:
        within = distance(residual, h, 1.0 - number)
        return within, np.asarray(within / np.sqrt(h) * (1 + SAFETY) + extra)

    _, at_first = theorem(box.compliance, box.convexity_number)
    within_faces = (trial + at_first < box.faces) & np.isfinite(at_first)
    inside = (within_faces & ~(box.fixed_open & (trial > 0))).all(axis=-1)
    h = problem.compliance(np.minimum(box.loads, (trial + at_first) * (1 + SAFETY)))
    within, errors = theorem(h, np.minimum(box.convexity_number, box.convexity_at(h)))
    # Bound A (P - P*) by Cauchy's inequality.
    softest = h.min(axis=-1, initial=np.inf, keepdims=h.ndim > 1)
    moved = (within / np.sqrt(softest) * problem.row_norm + coupled) * (1 + SAFETY)
    shift = _approach_error(problem, box, state, errors, moved)
    known = state.indentation
    indentation = Ball.around(known.mid, known.radius + (moved + shift))
    opened = indentation.negative
    loads = Ball.around(state.loads, np.where(opened, state.loads.high, errors))  # open: 0
    loads = _or_by_law(loads, indentation, problem.exact.coefficients)
    approach = Ball.around(state.approach.mid, shift)
    found = Level(problem, loads, indentation, approach, opened, state, box, within, h)
    return inside, at_first, found


def _missing(problem: NormalProblem, state: Trial) -> tuple[Any, Any, Any]:
    """(n,) bounds on |t| P, on |t| A P, and on the change of the residuals from P to (1 + t) P.

    The loads (1 + t) P have the prescribed total: docs/theory/one-theorem.md, "Pressing". The
    bounds are 0 if P has this total.
    """
    if not state.missing.size.any():
        return 0.0, 0.0, 0.0
    loads, coupled, local = state.loads.high, state.product.upper, state.local
    part = state.missing.size / summed(loads) * (1 + SAFETY)
    grows = coupled + 2.0 / 3.0 * local
    middle = summed(np.where(state.inside, grows, 0.0)) / summed(1.0 * state.inside)
    rest = np.abs(grows - middle) + 2 * state.product.radius + SAFETY * grows + part * local
    return part * loads, part * coupled, np.where(part <= 0.5, part * rest, np.inf)


def _or_by_law(P: Ball, n: Ball, k: Ball) -> Ball:
    """The loads P, or (n / k)^(3/2) with indentations n where P is inexact and this is a smaller
    ball."""
    which = P.radius > POOR * P.value
    if not which.any():
        return P
    # Where n is known well, the ball of (n / k)^(3/2) has a radius of about 1.5 P dn / n.
    which &= ~((n.value > 2.0 * n.radius) & (1.5 * P.value * n.radius > P.radius * n.value))
    k = of_rows(lambda part: np.broadcast_to(part, which.shape), k)
    ratio, given = n[which] / k[which], P[which]
    by_law = ratio.positive_part() * ratio.sqrt()
    best = where(by_law.radius < given.radius, by_law, given)
    return replaced(of_rows(np.copy, P), which, best)


def _approach_error(
    problem: NormalProblem, box: Box, state: Trial, errors: Array, moved: Any
) -> Any:
    """Bound on |D0 - D0*|, the error of the approach.

    At every touching asperity, D0* = k P*^(2/3) + A P* - d; at an open one, D0* is at most this
    right side. So if none is proved to touch, the least right side bounds D0* from above. The lower
    bound on D0* is -max d, the approach at which contact begins.
    """
    if problem.load is None:
        return state.approach.radius
    least, exact = state.loads.high - errors, problem.exact
    # k P^(2/3) is concave: its slope at the least load bounds its slope up to P
    slope = problem.compliance(np.where(least > 0, least, 1.0))
    each = np.where(least > 0, state.gap.size + slope * errors + moved, np.inf)
    across: Any = {"axis": -1, "initial": np.inf, "keepdims": each.ndim > 1}
    closest = each.min(**across)
    if np.isfinite(closest).all():
        return closest * (1 + 4 * SAFETY) + state.approach.radius
    above = state.gap.upper + exact.coefficients.upper * np.cbrt(errors) ** 2 + moved
    above = np.where(box.fixed_open, np.inf, above)
    below = state.approach.upper - (-exact.offsets.upper).min(**across)
    closest = np.minimum(closest, np.maximum(above.min(**across), below))
    return closest * (1 + 4 * SAFETY) + state.approach.radius
