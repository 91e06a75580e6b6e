"""A friction state to twice the digits: docs/theory/gradient-bounds-twice.md."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.gradients.adjoint import Friction
from convexrough.gradients.bounds import Known, above
from convexrough.gradients.doubts import near_of
from convexrough.gradients.sharp import SHARP, STEPS, Pressed, balanced, rounded
from convexrough.gradients.system import System
from convexrough.gradients.widths import Widths
from convexrough.normal.sup_norm import SupNorm
from convexrough.roundoff import SAFETY
from convexrough.shearing.judgement import StateErrors
from convexrough.twofold import Twofold, whole

#: An asperity that sticks with at least this part of its slope bounds the rise.
DEEP = 1e-2

ONE = whole(1.0)


class Sheared(NamedTuple):
    """A friction state to twice the digits; state and near : of its first halves.

    known : that of the pressed state, with how far each increment can be off
    """

    pressed: Pressed
    known: Known
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
        known = pressed.known._replace(apart=_one_by_one(pressed, found, residual + closer.rise))
        return cls(pressed, known, sign, eta, x, slopes, found, closer)

    @property
    def system(self) -> System:
        return System(self.pressed.problem, self.state.slopes)


def _one_by_one(pressed: Pressed, found: Friction, residual: Array) -> Array | None:
    """(n,) bounds on |u* - t P*|, by docs/theory/sup-norm.md."""
    known, x, u = pressed.known, found.widths, np.abs(found.increments)
    sup = SupNorm.of(known.influence, 1.0 / known.slopes)
    if sup is None:
        return None
    swayed = x * known.errors + SHARP * u
    apart = residual + above(known.influence, swayed)
    return sup.load_errors(apart, float(apart.max())) + swayed + u / known.loads * known.errors


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


def sheared(pressed: Pressed, state: Friction, force: Fraction) -> Sheared | None:
    """That of a float64 state; force : [force] f T, exactly."""
    near = near_of(pressed.given, state)
    return None if near is None else Sheared.of(pressed, state, near, force)
