"""Derivatives by heights to twice the digits, and how far those can still be off.

docs/theory/gradient-bounds-twice.md: the difference from what was computed is most of its error.
Everything is that of `adjoint`, in twofold numbers; the bounds are those of `doubts`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array, among_zeros
from convexrough.contact import Contact
from convexrough.gradients.adjoint import Excess
from convexrough.gradients.bounds import FEW, Off, above
from convexrough.gradients.doubts import (
    Doubt,
    GivenDoubt,
    LossDoubt,
    StateDoubt,
    Weights,
    through_pressing,
)
from convexrough.gradients.gross import GrossDoubt
from convexrough.gradients.sharp import SHARP, STEPS, Pressed, rounded
from convexrough.gradients.sharp_state import sheared
from convexrough.gradients.system import Solution, System
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.judgement import LOCAL
from convexrough.twofold import Twofold, whole

TWO, THREE, SIX, HALF = (whole(value) for value in (2.0, 3.0, 6.0, 0.5))


class Solved(NamedTuple):
    """Y, and y = b + c Y, of a linear system; with the first halves, and what they are off."""

    values: Twofold
    forces: Twofold
    solution: Solution
    off: Off


def solve(
    pressed: Pressed,
    system: System,
    slopes: Twofold,
    start: Solution,
    *,
    extra: Twofold,
    right: Twofold,
    total: float | None,
) -> Solved:
    """Y + A (b + c Y) = g + beta by steps from what was computed, the residual in twofold numbers.

    extra : b;  right : g;  total : sum y, or None for beta = 0
    """
    Y, beta = whole(start.values), whole(start.shift)
    for step in range(STEPS):
        y = extra + slopes * Y
        moved, off = pressed.coupling.apply(y)
        defect = Y + moved + -(right + beta)
        missing = 0.0 if total is None else rounded(y.total() + whole(-total))
        if step == STEPS - 1 or (np.abs(defect.high) <= off).all():
            break
        more = system.solve(-defect.high, None if total is None else -missing)
        Y, beta = Y + whole(more.values), beta + whole(more.shift)
    sizes = np.abs(Y.high) + np.abs(moved.high) + np.abs(right.high) + abs(beta.high)
    shared = np.abs(extra.high) + np.abs(slopes.high * Y.high)
    missed = 0.0 if total is None else abs(missing) + SHARP * (float(shared.sum()) + abs(total))
    solution = Solution(Y.high, float(beta.high), defect.high)
    each = off + SHARP * (sizes + above(pressed.known.influence, shared))
    return Solved(Y, y, solution, Off(each, 0.0, missed))


def of_loss(doubt: LossDoubt, pressed: Pressed) -> tuple[Twofold, Weights] | None:
    """omega, and what it is off by."""
    found = sheared(pressed, doubt.state, doubt.force)
    if found is None or doubt.beyond.solution is None:
        return None
    x, P, C = found.widths, pressed.loads, pressed.ceilings
    b = HALF * found.signs * P * x * x * (THREE + -x)
    nothing = whole(np.zeros(len(pressed.problem)))
    solved = solve(
        pressed,
        found.system,
        found.slopes,
        doubt.beyond.solution,
        extra=b,
        right=nothing,
        total=0.0,
    )
    beyond = Excess(solved.forces.high, solved.values.high, solved.solution.shift, solved.solution)
    slip = found.signs * found.deflections + -C
    slip = Twofold(*(np.where(found.state.slides, part, 0.0) for part in slip))
    omega = -(C * x * x * x).over(SIX) + HALF * (slip + found.signs * x * solved.values)
    judged = replace(doubt, factor=1.0, state=found.state, beyond=beyond)
    return omega, judged.judged(found.known, pressed.problem, found.near, solved.off)


def of_state(doubt: StateDoubt, pressed: Pressed) -> tuple[Twofold, Weights] | None:
    """sigma x zeta - (2 / 3) sigma e C / P, and what that is off by."""
    found = sheared(pressed, doubt.state, doubt.force)
    if found is None:
        return None
    problem, known = pressed.problem, found.known
    e = np.where(found.state.slides, doubt.slips, 0.0)
    felt, off = pressed.coupling.apply(whole(e))
    solved = solve(
        pressed,
        found.system,
        found.slopes,
        doubt.solution,
        extra=whole(np.zeros(len(problem))),
        right=whole(doubt.increments) + -felt,
        total=doubt.total,
    )
    # Weights were rounded when they were put into own units; one alone is a common factor.
    given = np.abs(doubt.increments) + above(known.influence, np.abs(e))
    summed = abs(doubt.total) + 2.0 * float(np.abs(e).sum()) if given.any() else 0.0
    rounding = Off(
        solved.off.each + off + FEW * ROUNDOFF * given,
        0.0,
        solved.off.missing + (FEW + len(e)) * ROUNDOFF * summed,
    )
    own = TWO * (whole(e) * pressed.ceilings).over(THREE * pressed.loads)
    weights = found.signs * (found.widths * solved.values + -own)
    judged = replace(
        doubt, factor=1.0, state=found.state, solution=solved.solution, slips=e
    ).judged(known, problem, found.near, rounding)
    return weights, judged._replace(dual=judged.dual + FEW * ROUNDOFF * known.dual(own.high))


def _gross_loss(
    pressed: Pressed, levels: Twofold, last: int, only: Array, wide: Array, errors: Array
) -> tuple[Twofold, Array]:
    """omega = -C / 6 + slip / 2 + Y / 2, and T / 2 c0 more at the last, Y = -A (P - T e)."""
    P, C, influence = pressed.loads, pressed.ceilings, pressed.known.influence
    total = P.total()
    y = P + -(total * whole(only))
    Y, off = pressed.coupling.apply(-y)
    slip = Twofold(levels.high[last], levels.low[last]) + -levels
    more = (total * whole(only)).over(TWO * pressed.stiffest)
    omega = -C.over(SIX) + HALF * (slip + Y) + more
    each = wide + wide[last] + off + LOCAL * errors / pressed.known.slopes
    each += above(influence, errors + float(errors.sum()) * only)
    relative = float(errors.sum()) / float(total.high) + errors / P.high
    each += more.high * relative + SHARP * (C.high + np.abs(levels.high) + more.high)
    each += SHARP * (levels.high[last] + above(influence, np.abs(y.high)))
    return omega, each


def _gross_state(
    pressed: Pressed, doubt: GrossDoubt, increments: Array, slips: Array, only: Array
) -> tuple[Twofold, Array]:
    """u_b - u_b of the last + (2 / 3) C o / P + A o, with o = (r + sum of slips) e - slips."""
    P, C, last = pressed.loads, pressed.ceilings, doubt.last
    own = (doubt.rise + float(slips.sum())) * only - slips
    felt, off = pressed.coupling.apply(whole(own))
    softer = TWO * (C * whole(own)).over(THREE * P)
    weights = whole(increments) + whole(np.full(len(own), -increments[last])) + softer + felt
    # Weights were rounded when they were put into own units.
    size = (abs(doubt.rise) + float(np.abs(slips).sum())) * only + np.abs(slips)
    sizes = np.abs(increments) + abs(increments[last]) + size * C.high / P.high
    sizes += above(pressed.known.influence, size)
    each = (FEW + len(own)) * ROUNDOFF * sizes + off
    return weights, each + np.abs(softer.high) * pressed.known.errors / P.high


def of_gross_sliding(doubt: GrossDoubt, pressed: Pressed) -> tuple[Twofold, Weights] | None:
    """As `gross`: all of it is explicit in P. None where it is not sure who slides last."""
    known, C, errors, last = pressed.known, pressed.ceilings, pressed.known.errors, doubt.last
    moved, off = pressed.coupling.apply(pressed.loads)
    levels = C + moved
    wide = LOCAL * errors / known.slopes + above(known.influence, errors) + off
    wide += SHARP * (C.high + np.abs(moved.high))
    behind = (Twofold(levels.high[last], levels.low[last]) + -levels).high
    if (np.delete(behind - wide - wide[last], last) <= 0).any():
        return None
    only = among_zeros(np.ones(1), np.array([last]), len(errors))
    if doubt.increments is None or doubt.slips is None:
        weights, each = _gross_loss(pressed, levels, last, only, wide, errors)
    else:
        weights, each = _gross_state(pressed, doubt, doubt.increments, doubt.slips, only)
    return weights, Weights(known.dual(each), np.zeros(len(errors)))


def of_loads(doubt: GivenDoubt, pressed: Pressed) -> tuple[Twofold, Weights]:
    """Those that were given."""
    return whole(doubt.loads), doubt.weights(pressed.known, pressed.problem)


def weights_of(doubt: Doubt, pressed: Pressed) -> tuple[Twofold, Weights] | None:
    """Weights on loads, times the factor of a doubt; None where no more digits are to be had."""
    if isinstance(doubt, GivenDoubt):
        return of_loads(doubt, pressed)
    if isinstance(doubt, GrossDoubt):
        of = of_gross_sliding(doubt, pressed)
    else:
        of = of_loss(doubt, pressed) if isinstance(doubt, LossDoubt) else of_state(doubt, pressed)
    if of is None:
        return None
    weights, doubtful = whole(doubt.factor) * of[0], abs(doubt.factor) * of[1].dual
    # The factor is a product of units, rounded.
    rounding = FEW * ROUNDOFF * pressed.known.dual(weights.high)
    return weights, Weights(doubtful * (1 + SAFETY) + rounding, of[1].unsure)


def refined_errors(
    contact: Contact, doubts: Sequence[Doubt], pressing: Solution, total: float | None
) -> Array:
    """(n,) bounds on dJ/dd of the asperities of the scene, as `doubts.height_errors`."""
    infinite, pressed = np.full(len(contact.scene), np.inf), Pressed.of(contact)
    if pressed is None:
        return infinite
    problem, known = pressed.given, pressed.known
    found = [weights_of(each, pressed) for each in doubts]
    if None in found:
        return infinite
    weights, dual = whole(np.zeros(len(problem))), 0.0
    for part, doubt in (each for each in found if each is not None):
        weights, dual = weights + part, dual + doubt.dual
    slopes, nothing = pressed.stiffest, whole(np.zeros(len(problem)))
    system = System(problem, problem.stiffest)
    solved = solve(pressed, system, slopes, pressing, extra=nothing, right=weights, total=total)
    doubt = Weights(dual, nothing.high)
    left = through_pressing(known, solved.solution, solved.forces.high, solved.off, doubt, total)
    errors = np.zeros(len(contact.scene))
    computed = whole(problem.stiffest * pressing.values)
    errors[known.places] = np.abs((computed + -solved.forces).high) * (1 + SAFETY) + left
    return errors
