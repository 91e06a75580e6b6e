"""Judge friction states: bounds on their forces and slips, and which asperities slide.

The normal loads are known only to their certified bounds b. A state u of the computed loads P is
carried over to the true ones P* at equal u_i / P_i, and its total mended where it sticks; that
changes its residual by terms of the order (b_i / P_i) u_i, which are added to it. From there the
argument is that of `convexrough.normal.certificate`: on |u| <= P* the energy is strictly convex
with H = diag(1 / (2 E* a_i)), so

    || u - u* ||_H  <=  || e ||_{H^-1} / (1 - theta),

and an asperity slides if the slip that A u* leaves it is proved positive. All bounds shrink with
the shear force. Arrays are (m, n): m states of n loaded asperities. What is known of the rounding
of A u only in the 2-norm stays apart until it enters a norm, or a single component.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.normal.judgement import SUM_ROUNDOFFS
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.load_errors import Known
from convexrough.shearing.problem import States, TangentialProblem

__all__ = ["Bounds", "Known", "judge_in_turn", "judge_states"]

#: Where P* is within a tenth of P, |ceiling* - ceiling| <= LOCAL h |P* - P|: 1.1 / 0.9^(1/3).
LOCAL = 1.15

#: Numbers of an array that are judged at once.
BLOCK = 2**20


class Bounds(NamedTuple):
    """Proved bounds on m states, in own units; infinite where nothing is proved."""

    proved: NDArray[np.bool_]  # (m,)
    increments: Array  # (m, n) |u - u*|
    slips: Array  # (m, n) |slip - slip*|
    rises: Array  # (m,)
    sliding: NDArray[np.bool_]  # (m, n)
    partial: NDArray[np.bool_]  # (m, n) proved not to slide


def judge_states(problem: TangentialProblem, contact: Contact, states: States) -> Bounds:
    """Bounds on friction states of a contact, whose loads are known to its certificate."""
    parts = [bounds for _, bounds in judge_in_turn(problem, contact, states)]
    if len(parts) == 1:
        return parts[0]
    return Bounds(*(np.concatenate(field) for field in zip(*parts, strict=True)))


def judge_in_turn(
    problem: TangentialProblem, contact: Contact, states: States
) -> Iterator[tuple[slice, Bounds]]:
    """`judge_states` in blocks of states, so that many asperities need no more memory than few."""
    size = max(1, BLOCK // len(problem))
    for start in range(0, max(1, len(states.totals)), size):
        block = slice(start, start + size)
        yield block, _judge(problem, contact, states.take(block))


def _judge(problem: TangentialProblem, contact: Contact, states: States) -> Bounds:
    if contact.certificate.scope == "none":
        return _nothing(states)
    known = Known.of(problem, contact)
    product = _product(problem, states)
    bounds = _by_convexity(problem, known, states, product)
    others = np.flatnonzero(~bounds.proved)
    if len(others):
        near_gross = _by_exhaustion(problem, known, states.take(others), product.take(others))
        for field, values in zip(bounds, near_gross, strict=True):
            field[others] = values
    bounds.slips[:, ~known.sure] = np.inf
    bounds.slips[bounds.partial & (states.slips == 0)] = 0.0
    # At Q = f P itself there is nothing to prove: |Q_i| <= f P_i leaves one state.
    bounds.sliding[:] |= problem.at_limit(states.totals)[:, None] & known.sure
    return bounds


class _Product(NamedTuple):
    """A u of m states, and its rounding."""

    displacement: Array  # (m, n) A u
    magnitude: Array  # (m, n) upper bounds on A |u|
    rounding: Array  # (m, n) bounds on the error of A u, less a remainder
    remainder: Array  # (m,) bounds on the 2-norm of that

    def take(self, rows: Indices) -> _Product:
        return _Product(*(field[rows] for field in self))


def _product(problem: TangentialProblem, states: States) -> _Product:
    u, A = states.increments, problem.influence
    displacement = problem.couple(u)
    noise = [A.rounding(each) for each in u]
    relative = np.array([each.relative for each in noise])[:, None]
    remainder = np.array([each.norm for each in noise])
    magnitude = displacement
    back = np.flatnonzero((u < 0).any(axis=1))  # A |u| is not A u
    if len(back):
        magnitude = displacement.copy()
        magnitude[back] = problem.couple(np.abs(u[back]))
    # The relative part is of the true product, which the computed one may miss by all of it.
    magnitude = (np.maximum(magnitude, 0.0) + remainder[:, None]) * (1.0 + 2.0 * relative)
    return _Product(displacement, magnitude, relative * magnitude, remainder)


def _couple_above(problem: TangentialProblem, values: Array) -> Array:
    """(m, n) upper bounds on A times values that are not negative."""
    product = np.maximum(problem.couple(values), 0.0)
    for row, each in zip(product, values, strict=True):
        row += problem.influence.rounding(each).of(row)
    return product


def _by_convexity(
    problem: TangentialProblem, known: Known, states: States, product: _Product
) -> Bounds:
    P, ceilings, h, theta = problem.loads, problem.ceilings, known.stiffness, known.convexity_number
    u, rises = states.increments, states.rises
    size = np.abs(u)
    if not theta < 1 or not known.sure.any():
        return _nothing(states)

    # The image on the true loads misses the total; a shift of eta where it sticks mends that.
    shares = np.where(known.sure, size / P, 0.0)
    missing = known.distance * np.sqrt((shares**2 / h).sum(axis=1))
    missing = np.minimum((size * known.relative).sum(axis=1), missing)
    missing += np.where(known.sure, 0.0, P + known.errors + size).sum(axis=1)
    missing += np.abs(u.sum(axis=1) - states.totals)
    missing += len(P) * ROUNDOFF * size.sum(axis=1) + known.stray
    slopes = np.where(known.sure & (size < P), problem.slopes(states.deflections), 0.0)
    slopes[missing[:, None] * _shares(slopes) >= 0.25 * (P - size)] = 0.0  # no room to mend
    mended = missing[:, None] * _shares(slopes)
    proved = slopes.any(axis=1) & ((slopes == 0) | (mended < 0.5 * (P - size))).all(axis=1)
    mended[~proved] = 0.0
    pushed = _couple_above(problem, mended)
    local = problem.deflections(u)
    bent = 1.5 * (problem.deflections(size + mended) - np.abs(local))  # 1.5: for P* in place of P

    # The residual of the mended image on the true loads, with rounding. What the loads' errors make
    # of the local law, and of A w with w the image less u, is said in the norms of H and H + A.
    asked = rises[:, None] - product.displacement  # the deflection left to each asperity
    unsure = SUM_ROUNDOFFS * ROUNDOFF * (np.abs(local) + product.magnitude + rises[:, None])
    unsure += product.rounding + known.stray_effect + known.loose_effect
    surplus = asked * np.sign(u) - ceilings
    residual = np.where(
        size < P, np.abs(asked - local) + unsure + bent, np.maximum(unsure - surplus, 0.0)
    )
    residual = np.where(known.sure, residual, 0.0)
    norm = np.sqrt((residual**2 / h).sum(axis=1)) + product.remainder / np.sqrt(h.min())
    scaled = np.array([known.scaled(each) for each in shares])
    own = np.where(known.sure, h, 0.0) * mended**2
    coupled = np.sqrt(1.0 + known.coupling) * scaled + np.sqrt((own + mended * pushed).sum(axis=1))
    norm += (1.0 + LOCAL) * scaled + np.sqrt(own.sum(axis=1))
    norm = (norm / np.sqrt(1.0 - theta) + coupled) / np.sqrt(1.0 - theta) * (1 + SAFETY)
    off = norm[:, None] / np.sqrt(h) + mended  # from the image

    # The rise, known at every asperity sure to stick; and from it the slips.
    unsure += np.abs(local) * known.relative + pushed + product.remainder[:, None]
    unsure += (norm + scaled)[:, None] * known.reach * (1 + SAFETY)
    held = known.sure & (off < 0.5 * (P - size))
    bent = 1.5 * (problem.deflections(np.minimum(size + off, P)) - np.abs(local))
    each = np.where(held, np.abs(asked - local) + unsure + bent, np.inf)
    rise_errors = each.min(axis=1)
    slip_errors = unsure + rise_errors[:, None] + ceilings * known.relative
    sliding = known.sure & (np.abs(asked) - ceilings > slip_errors)
    partial = known.sure & (held | (ceilings - np.abs(asked) > slip_errors))
    proved &= np.isfinite(rise_errors)
    increments = off + known.moved(P, u)
    return Bounds(proved, increments, slip_errors, rise_errors, sliding, partial)


def _shares(weights: Array) -> Array:
    """(m, n) parts of 1, as the weights of each state; 0 where all are 0."""
    total = weights.sum(axis=1, keepdims=True)
    return weights / np.where(total > 0, total, 1.0)


def _by_exhaustion(
    problem: TangentialProblem, known: Known, states: States, product: _Product
) -> Bounds:
    """Near gross sliding: |u| <= P and sum u = T leave each asperity within sum P - T of P.

    The last asperity to slide, i, then fixes the rise: it is at most k_i P_i^(2/3) + (A P)_i, and
    at least what u_i = P_i - (sum P - T) asks.
    """
    if known.stray > 0 or not known.sure.all():
        return _nothing(states)
    P, ceilings = problem.loads, problem.ceilings
    u, rises = states.increments, states.rises
    left = (P.sum() - states.totals + known.errors.sum())[:, None]
    left += 2 * len(P) * ROUNDOFF * P.sum()
    errors = left + known.errors + (P - u)
    asked = rises[:, None] - product.displacement
    blur = _couple_above(problem, errors) + product.rounding + product.remainder[:, None]
    blur += SUM_ROUNDOFFS * ROUNDOFF * (product.magnitude + ceilings + rises[:, None])
    blur += ceilings * known.relative
    lowest = ceilings * np.minimum(1.5 * left / P, 1.0) ** (2 / 3)
    last = np.argmin(asked - ceilings, axis=1)
    every = np.arange(len(rises))
    rise_errors = (np.abs(asked - ceilings) + lowest + blur)[every, last] + blur.max(axis=1)
    slip_errors = blur + rise_errors[:, None]
    sliding = asked - ceilings > slip_errors
    # Where all but one are sure to slide, and not all can, that one does not.
    short = P.sum() * (1 - 2 * len(P) * ROUNDOFF) - known.errors.sum() - states.totals > 0
    alone = short & (sliding.sum(axis=1) == len(P) - 1)
    proved = np.ones(len(rises), dtype=bool)
    return Bounds(proved, errors, slip_errors, rise_errors, sliding, ~sliding & alone[:, None])


def _nothing(states: States) -> Bounds:
    m, n = states.increments.shape
    unknown, no = np.full((m, n), np.inf), np.zeros((m, n), dtype=bool)
    nowhere, unproved = np.full(m, np.inf), np.zeros(m, dtype=bool)
    return Bounds(unproved, unknown, unknown.copy(), nowhere, no, no.copy())
