"""Derivatives by heights to twice the digits, and how far those can still be off.

docs/theory/gradient-bounds-twice.md: the difference from what was computed is most of its error.
Everything is that of `adjoint`, in twofold numbers; the bounds are those of `doubts`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.gradients.adjoint import Excess, Friction
from convexrough.gradients.bounds import FEW, Known, Off, above
from convexrough.gradients.doubts import (
    Doubt,
    GivenDoubt,
    LossDoubt,
    StateDoubt,
    Weights,
    near_of,
    through_pressing,
)
from convexrough.gradients.sharp import SHARP, STEPS, Pressed, balanced, rounded
from convexrough.gradients.system import Solution, System
from convexrough.gradients.widths import Widths
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.judgement import StateErrors
from convexrough.twofold import Twofold, whole

#: An asperity that sticks with at least this part of its slope bounds the rise.
DEEP = 1e-3

ONE, TWO, THREE, SIX, HALF = (whole(value) for value in (1.0, 2.0, 3.0, 6.0, 0.5))


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


class Sheared(NamedTuple):
    """A friction state to twice the digits; state and near : of its first halves."""

    pressed: Pressed
    signs: Twofold
    deflections: Twofold
    widths: Twofold
    slopes: Twofold
    state: Friction
    near: StateErrors

    @classmethod
    def of(
        cls, pressed: Pressed, state: Friction, near: StateErrors, force: Fraction
    ) -> Sheared | None:
        """None where an asperity is not proved to slide or not to."""
        problem, slides = pressed.problem, state.slides
        if not (near.sliding | near.partial).all() or (near.sliding != slides).any():
            return None
        total = Twofold.nearest(force / Fraction(problem.friction) / Fraction(problem.units.force))
        system, sign = System(problem, state.slopes), whole(state.signs)
        eta, rise = whole(state.deflections), whole(state.rise)
        for step in range(STEPS):
            law = _law(pressed, sign * eta, slides)
            if law is None:
                return None
            x, u = law
            u = sign * u
            moved, off = pressed.coupling.apply(u)
            left = eta + moved + -rise
            missing = rounded(u.total() + -total)
            if step == STEPS - 1 or (np.abs(left.high) <= off).all():
                break
            more = system.solve(-left.high, -missing)
            eta, rise = eta + whole(more.values), rise + whole(more.shift)
        sizes = np.abs(eta.high) + np.abs(moved.high) + abs(rise.high)
        residual = np.abs(left.high) + off + SHARP * sizes
        slopes = pressed.stiffest * (ONE + -x)
        found = Friction(float(total.high), eta.high, u.high, float(rise.high), x.high, slopes.high)
        shift = near.rise + abs(rounded(rise + whole(-state.rise)))
        known = Known.of(pressed.given)
        assert known is not None  # there is `pressed`
        softest = Widths.of(known, state, near).softest
        closer = _closer(pressed, found, near, softest, residual, abs(missing), shift)
        return cls(pressed, sign, eta, x, slopes, found, closer)

    @property
    def system(self) -> System:
        return System(self.pressed.problem, self.state.slopes)


def _law(
    pressed: Pressed, size: Twofold, slides: NDArray[np.bool_]
) -> tuple[Twofold, Twofold] | None:
    """x and |u| of deflections |eta|: x = phi / (1 + (1 - phi)^(1/2)), u = P (1 - (1 - x)^3)."""
    share = size.over(pressed.ceilings)
    share = Twofold(*(np.where(slides, 0.0, part) for part in share))
    left = ONE + -share
    if not (left.high > 0).all():
        return None
    x = share.over(ONE + left.root())
    x = Twofold(np.where(slides, 1.0, x.high), np.where(slides, 0.0, x.low))
    s = ONE + -x
    return x, pressed.loads * x * (ONE + s * (ONE + s))


def _closer(
    pressed: Pressed,
    found: Friction,
    near: StateErrors,
    softest: Array,
    residual: Array,
    missing: float,
    shift: float,
) -> StateErrors:
    """How near the state found is: the page's "The friction state"."""
    known, P = pressed.known, pressed.known.loads
    x, u = found.widths, np.abs(found.increments)
    size = float(np.sqrt(np.sum(u**2 / known.slopes)))
    swayed = float(x.max()) * known.distance + SHARP * size  # || u(eta; P*) - u ||_h
    missing += SHARP * (found.total + float(u.sum()))
    missing += swayed * float(np.sqrt(known.slopes.sum()))
    deep = (1.0 - x > DEEP) & (softest > 0)
    with np.errstate(divide="ignore"):  # 0.99 for C* in place of C
        least = np.minimum(0.99 * found.slopes, softest)
        own = np.where(deep, 1.0 / (least * np.sqrt(known.slopes)), np.inf)
    felt = known.dual(residual) + known.coupling * swayed
    each = residual + pressed.reach * swayed
    distance, rise = balanced(known, felt, each, missing, shift, own + pressed.reach)
    share = float((u / P).max())
    distance += (float(x.max()) + share) * known.distance + SHARP * size
    return near._replace(
        distance=distance * (1 + SAFETY),
        carried=share * known.distance,
        shifts=np.zeros(len(x)),
        uncertainty=residual,
        rise=rise,
    )


def of_loss(doubt: LossDoubt, pressed: Pressed) -> tuple[Twofold, Weights] | None:
    """omega, and what it is off by."""
    found = _sheared(pressed, doubt.state, doubt.force)
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
    return omega, judged.judged(pressed.known, pressed.problem, found.near, solved.off)


def of_state(doubt: StateDoubt, pressed: Pressed) -> tuple[Twofold, Weights] | None:
    """sigma x zeta - (2 / 3) sigma e C / P, and what that is off by."""
    found = _sheared(pressed, doubt.state, doubt.force)
    if found is None:
        return None
    problem, known = pressed.problem, pressed.known
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


def of_loads(doubt: GivenDoubt, pressed: Pressed) -> tuple[Twofold, Weights]:
    """Those that were given."""
    return whole(doubt.loads), doubt.weights(pressed.known, pressed.problem)


def weights_of(doubt: Doubt, pressed: Pressed) -> tuple[Twofold, Weights] | None:
    """Weights on loads, times the factor of a doubt; None where no more digits are to be had."""
    if isinstance(doubt, GivenDoubt):
        return of_loads(doubt, pressed)
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


def _sheared(pressed: Pressed, state: Friction, force: Fraction) -> Sheared | None:
    near = near_of(pressed.given, state)
    return None if near is None else Sheared.of(pressed, state, near, force)
