"""Friction states judged by their largest residual, however many asperities there are.

docs/theory/shear-sup-norm.md. A state is carried over to the true loads P* = P + p as
x = u + lambda p. The theorem of docs/theory/sup-norm.md holds for v = x - u*, because

    f_i = hbar_i v_i + (A v)_i  <=  r_i + beta  where v_i > 0,   >=  where v_i < 0,

with r the residual of x under the rise Delta, and beta what that is off by. Two choices of lambda
are tried (`images`). Where contacts are too crowded for the theorem, a norm is bounded instead.
Arrays are (n,), of one state. The letters, and the names here:

    lambda, r, beta           Image.shares, residual, beta
    hbar                      at least _Near.softest
    h, tau, q, F              stiffness, size, packing, firmness of SupNorm
    K                         potential
    mu, M                     Weights
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.bounds import OWN_ROUNDOFFS, SHARE_ROUNDOFFS, Given
from convexrough.shearing.images import Image, images
from convexrough.shearing.loss_errors import Nearness
from convexrough.shearing.pressed_fit import PressedFit, softness
from convexrough.shearing.riding_weights import Weights

#: Part of what is left to full slip that must be sure, for an asperity to have a weight. Heuristic.
ROOM = 0.25


class _Near(NamedTuple):
    """One state, and what is known of u* already."""

    row: int
    softest: Array  # the least stiffness between x and u*, infinite where not sure
    slides: NDArray[np.bool_]  # proved to slide as it does here: v is 0
    weights: Weights


class _Residual(NamedTuple):
    """How far the law is from holding for an image."""

    each: Array  # bounds on |r|, or on what the law lacks where u is P, less a remainder; or 0
    component: float  # bound on each component of that
    remainder: float  # and on its 2-norm
    mean: float  # bound on |sum mu r| / sum mu
    uncertainty: Array  # of Delta - A u
    shift: float  # the best rise less Delta, for which this is


class _Bound(NamedTuple):
    """Bounds on beta, |v| and |A v|."""

    rise: float
    forces: Array
    moved: Array


class _Found(NamedTuple):
    """Bounds on one state."""

    increments: Array
    shares: Array  # |u* - t P*|
    slips: Array
    rise: float


def by_largest(given: Given, near: Nearness, increments: Array) -> tuple[Nearness, Array]:
    """The smaller of these bounds and those given, one by one."""
    pressed = PressedFit.of(given.problem)
    near = near._replace(**{name: getattr(near, name).copy() for name in IMPROVED})
    increments, sure = increments.copy(), given.known.sure
    for row in range(len(increments)):
        here = _near(given, near, increments[row], row)
        if not here.weights.total > 0:
            continue
        for image in images(given, pressed, row):
            found = _found(given, pressed, here, image)
            for bound, value in (
                (increments, found.increments),
                (near.each, found.shares),
                (near.errors, found.slips),
            ):
                np.minimum(bound[row], value, out=bound[row], where=sure)
            near.rises[row] = min(near.rises[row], found.rise)
            beyond = np.abs(given.available[row]) - given.problem.ceilings
            near.sliding[row] |= sure & (beyond > found.slips)
            near.partial[row] |= sure & (-beyond > found.slips)
    return near, increments


#: What of `Nearness` may get better.
IMPROVED = ("each", "errors", "rises", "sliding", "partial")


def _near(given: Given, near: Nearness, apart: Array, row: int) -> _Near:
    """All between x and u* is within `swing` of u: that bounds the stiffness there."""
    problem, known, u = given.problem, given.known, given.states.increments[row]
    P, size, soft = problem.loads, np.abs(u), softness(problem)
    swing = np.maximum(apart, known.errors) * (1 + SAFETY)
    least = np.maximum(size - swing, 0.0)
    softest = np.where(known.sure, soft / np.cbrt(P + known.errors - least), np.inf)
    room = P - known.errors - size - swing
    firm = known.sure & near.partial[row] & (room > ROOM * (P - size))
    stiffest = np.divide(soft, np.cbrt(room), out=np.full(len(P), np.inf), where=firm)
    slides = known.sure & near.sliding[row] & (size == P) & (u * given.available[row] > 0)
    return _Near(row, softest, slides, Weights.of(problem, softest, stiffest))


def _found(given: Given, pressed: PressedFit, here: _Near, image: Image) -> _Found:
    """beta by the weights, and with it all else."""
    problem, b = given.problem, given.known.errors
    residual = _residual(given, here, image)
    missing = image.missing + _missing(given, here.row)
    bound = _by_theorem(given, pressed, here, residual, missing)
    if bound is None:
        bound = _by_norm(given, here, residual, missing)
    u = given.states.increments[here.row]
    unknown = abs(residual.shift) + bound.rise + bound.moved + residual.uncertainty
    slips = unknown + image.slips + OWN_ROUNDOFFS * ROUNDOFF * problem.ceilings
    if image.turned is not None:
        forwards = given.available[here.row] > image.turned + slips
        slips = np.where(forwards, slips, 3.0 * slips + 2.0 * image.turned)
    shares = np.abs(image.shares - u / problem.loads) * b + bound.forces
    return _Found(
        increments=(np.abs(image.shares) * b + bound.forces) * (1 + SAFETY),
        shares=shares * (1 + SAFETY) + SHARE_ROUNDOFFS * ROUNDOFF * np.abs(u),
        slips=slips * (1 + SAFETY),
        rise=(abs(residual.shift) + bound.rise + image.rise) * (1 + SAFETY),
    )


def _by_theorem(
    given: Given, pressed: PressedFit, here: _Near, residual: _Residual, missing: float
) -> _Bound | None:
    """By |v_j| <= (1 + 1 / F) (max |r| + |beta|) / margin_j; None where the theorem is silent."""
    known, mu, sup = given.known, here.weights, pressed.sup
    if sup is None:
        return None
    each = residual.each + residual.component
    largest = float(each.max(initial=0.0, where=known.sure & ~here.slides))
    least = np.where(known.sure & ~here.slides, here.softest, np.inf)
    with np.errstate(invalid="ignore"):
        margin = least - sup.packing / sup.size * sup.stiffness
    margin[np.isinf(least)] = np.inf
    left = (1.0 + 1.0 / sup.firmness) * float(mu.off @ (1.0 / margin)) / mu.total * (1 + SAFETY)
    if not left < 1:
        return None
    beta = (residual.mean + missing / mu.total + left * largest) / (1.0 - left) * (1 + SAFETY)
    potential = (largest + beta) / sup.firmness
    return _Bound(beta, (each + beta + potential) / margin, pressed.moves * (largest + beta))


def _by_norm(given: Given, here: _Near, residual: _Residual, missing: float) -> _Bound:
    """Where the theorem is silent: "In a norm".

    With X = || v ||_H:  (1 - theta) X^2 <= R X + |beta| |sum v|  and  |beta| <= a + c X.
    """
    known, mu = given.known, here.weights
    h = np.where(here.slides, np.inf, known.stiffness)
    R = float(np.sqrt((residual.each**2 / h).sum())) + residual.remainder / np.sqrt(float(h.min()))
    a = residual.mean + missing / mu.total
    c = float(np.sqrt((mu.off**2 / h).sum())) / mu.total
    theta, slope = known.convexity_number, R + c * missing
    root = math.sqrt(slope**2 + 4.0 * (1.0 - theta) * a * missing)
    X = (slope + root) / (2.0 * (1.0 - theta)) * (1 + SAFETY)
    return _Bound((a + c * X) * (1 + SAFETY), X / np.sqrt(h), X * known.reach)


def _residual(given: Given, here: _Near, image: Image) -> _Residual:
    problem, known, row, mu = given.problem, given.known, here.row, here.weights
    u, available = given.states.increments[row], given.available[row]
    own = problem.deflections(u)
    r = own - available + image.residual
    uncertainty = given.rounding[row] + known.stray_effect + known.loose_effect
    blur = uncertainty + image.blur
    blur += ROUNDOFF * (OWN_ROUNDOFFS * np.abs(own) + 4 * (np.abs(r) + np.abs(own)))
    blur[~known.sure] = 0.0
    shift = mu.mean(r)
    r = r - shift
    component = given.each[row] + image.component
    remainder = given.remainder[row] + image.remainder
    mean = abs(mu.mean(r)) + len(u) * ROUNDOFF * mu.mean(np.abs(r)) + mu.mean(blur)
    each = np.where(np.abs(u) < problem.loads, np.abs(r), np.maximum(np.sign(u) * r, 0.0))
    each = np.where(known.sure & ~here.slides, each + blur, 0.0)
    mean = (mean + min(component, remainder * mu.norm)) * (1 + SAFETY)
    uncertainty = uncertainty + given.each[row]
    return _Residual(each, component, remainder, mean, uncertainty, shift)


def _missing(given: Given, row: int) -> float:
    """What u misses the total by, with what those not sure may carry."""
    problem, known, u = given.problem, given.known, given.states.increments[row]
    size = np.abs(u)
    loose = np.where(known.sure, 0.0, problem.loads + known.errors + size)
    off = abs(math.fsum(u) - float(given.states.totals[row]))
    off += 2 * ROUNDOFF * float(size.sum()) + float(loose.sum()) + known.stray
    return off * (1 + SAFETY)
