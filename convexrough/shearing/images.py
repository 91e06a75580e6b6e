"""Friction states carried over to the true loads P* = P + p, as x = u + lambda p.

docs/theory/shear-images.md. Arrays are (n,), of one state; p is known by its bounds
b, and from how well the loads fit the law of contact.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.roundoff import SAFETY
from convexrough.shearing.bounds import Given
from convexrough.shearing.load_errors import couple_above
from convexrough.shearing.pressed_fit import PressedFit, softness

#: Part of all asperities that stay where they are in the second image. Heuristic.
MOST_KEPT = 0.99


class Image(NamedTuple):
    """A choice of lambda, and bounds on what it adds."""

    shares: Array  # lambda, of the sign of u where that matters
    residual: Array  # what it adds to the residual
    blur: Array  # bounds on the error of that, less a remainder
    remainder: float  # bound on the 2-norm of that
    component: float  # and on each component of it
    missing: float  # of the total
    slips: Array  # to what is not known of a slip
    turned: (
        Array | None
    )  # and how far ceilings change, if slips are those of points pulled forwards
    rise: float  # and of the rise


def images(given: Given, pressed: PressedFit, row: int) -> Iterator[Image]:
    """Both, each where it can be of use."""
    for image in (_carried(given, pressed, row), _kept(given, pressed, row)):
        if image is not None:
            yield image


def _carried(given: Given, pressed: PressedFit, row: int) -> Image | None:
    """lambda = 1: the loads that are left, P - u, stay what they are.

    Forwards their own deflections do, too, and the gap of P is all that is added. Backwards, where
    x < 0, own deflections turn the other way. None where one is so near to sliding backwards that
    x might exceed its load.
    """
    known, P, u = given.known, given.problem.loads, given.states.increments[row]
    b = np.where(known.sure, known.errors, 0.0)
    elsewhere = known.stray_effect + known.loose_effect
    back = (b > 0) & (u < b)
    farther = _over(np.where(back, 3.0 * b - u, 0.0), P + u - 2.0 * b)
    if np.isinf(farther).any():
        return None
    backwards = 2.0 * softness(given.problem) * b / np.cbrt(P + b) * grown(farther)
    return Image(
        shares=np.ones(len(u)),
        residual=-pressed.gap,
        blur=pressed.rounding + elsewhere + backwards,
        remainder=pressed.remainder,
        component=pressed.component,
        missing=pressed.total,
        slips=np.abs(pressed.gap) + pressed.rounding + pressed.component + elsewhere,
        turned=pressed.local,
        rise=pressed.approach,
    )


def _kept(given: Given, pressed: PressedFit, row: int) -> Image | None:
    """lambda = 0, but for the few whose own deflections would change most; None where many would.

    Those are carried over by the width of their slip annulus, which leaves second order only, and
    the last before full slip by 1.
    """
    problem, known, u = given.problem, given.known, given.states.increments[row]
    P, size, b = problem.loads, np.abs(u), np.where(known.sure, known.errors, 0.0)
    farther = _over(np.where(b > 0, size, 0.0), P - b - size)
    kept = softness(problem) * b / np.cbrt(P - b) * grown(farther)
    most = np.quantile(kept, MOST_KEPT, method="lower")
    if most == np.inf:
        return None
    width = problem.widths(u)
    left = P * (1.0 - width) ** 2
    some = kept > most
    by_width = some & (left > 2.0 * b)
    part = np.divide(b, left, out=np.zeros(len(u)), where=by_width)
    sizes = np.where(by_width, width, np.where(some, 1.0, 0.0))
    bent = softness(problem) * b / np.cbrt(P) * grown(part / (1.0 - part))
    moved = couple_above(problem, sizes * b)
    return Image(
        shares=np.copysign(sizes, u),
        residual=np.zeros(len(u)),
        blur=np.where(by_width, bent, np.where(some, pressed.local, kept)) + moved,
        remainder=0.0,
        component=0.0,
        missing=float(sizes @ b) * (1 + SAFETY),
        slips=moved + pressed.local,
        turned=None,
        rise=0.0,
    )


def _over(values: Array, room: Array) -> Array:
    """Values over the room for them, infinite where there is none; 0 of 0."""
    over = np.where(values == 0, 0.0, np.inf)
    return np.divide(values, room, out=over, where=(values != 0) & (room > 0))


def grown(part: Array) -> Array:
    """(1 + x)^(1/3) - 1."""
    return np.asarray(np.expm1(np.log1p(part) / 3.0) * (1 + SAFETY))
