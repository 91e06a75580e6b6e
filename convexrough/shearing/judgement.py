"""Judge friction states: bounds on their forces and slips, and which asperities slide.

The proof is that of docs/theory/shear-proof.md, "Proof", by convexity in six steps; what it leaves
is judged by exhaustion. All bounds shrink with the shear force. Arrays are (m, n): m states of n
loaded asperities. In the letters of that page, all displacements over c_t f:

    loads P, errors b, ceilings k P^(2/3)     increments u, used t = |u| / P, totals T
    stiffness h of H, convexity_number theta  rises Delta, available Delta - A u
    shifts tau, coupled A |tau|               own k P^(2/3) phi(t), signed as u
    carried_norm || t (P* - P) ||_H           residual e, distance || d ||_H

What is known of the rounding of A u only in the 2-norm stays apart until it enters a norm, or a
single component.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.bounds import (
    OWN_ROUNDOFFS,
    SHARE_ROUNDOFFS,
    Bounds,
    Given,
    assess,
    bounds_of,
)
from convexrough.shearing.by_largest import by_largest
from convexrough.shearing.energy import TangentialEnergy
from convexrough.shearing.exhaustion import by_exhaustion
from convexrough.shearing.load_errors import couple_above
from convexrough.shearing.loss_errors import Nearness
from convexrough.shearing.normal_map import States
from convexrough.shearing.problem import TangentialProblem

#: Where P* is within a tenth of P, |ceiling* - ceiling| <= LOCAL h |P* - P|: 1.1 / 0.9^(1/3).
LOCAL = 1.15

#: Numbers of an array that are judged at once.
BLOCK = 2**20


def judge_states(problem: TangentialProblem, states: States) -> Bounds:
    """Bounds on friction states of a contact, whose loads are known to its certificate only."""
    parts = [bounds for _, bounds in judge_in_turn(problem, states)]
    if len(parts) == 1:
        return parts[0]
    return Bounds(*(np.concatenate(field) for field in zip(*parts, strict=True)))


def judge_in_turn(problem: TangentialProblem, states: States) -> Iterator[tuple[slice, Bounds]]:
    """`judge_states` in blocks of states, so that many asperities need no more memory than few."""
    size = max(1, BLOCK // len(problem))
    for start in range(0, max(1, len(states.totals)), size):
        block = slice(start, start + size)
        yield block, _judge(problem, states.take(block))


def _judge(problem: TangentialProblem, states: States) -> Bounds:
    if problem.certificate.scope == "none":
        return Bounds.unproved(*states.increments.shape)
    given = assess(problem, states)
    known, bounds = given.known, _by_convexity(given)
    others = np.flatnonzero(~bounds.proved)
    if len(others):
        near_gross = by_exhaustion(given.take(others))
        for field, values in zip(bounds, near_gross, strict=True):
            field[others] = values
    bounds.slips[:, ~known.sure] = np.inf
    bounds.slips[bounds.partial & (states.slips == 0)] = 0.0
    return bounds


class StateErrors(NamedTuple):
    """How near one state is to the solution, in norms: steps 1 to 5; own units, (n,).

    distance : || d ||_H;  carried : || t (P* - P) ||_H;  shifts : bounds on |tau|
    uncertainty : of the displacement left to each asperity, but for the distance;  rise : (,)
    """

    distance: float
    carried: float
    shifts: Array
    uncertainty: Array
    rise: float
    sliding: NDArray[np.bool_]
    partial: NDArray[np.bool_]


def state_errors(problem: TangentialProblem, state: States) -> StateErrors | None:
    """Of a single state (1,); None where convexity proves nothing of it."""
    if problem.certificate.scope == "none":
        return None
    given = assess(problem, state)
    if not given.known.convexity_number < 1 or not given.known.sure.any():
        return None
    image = _image(given)
    residual = _residual(given, image)
    distance = _distance(given, image, residual)
    bounds = _words(given, image, residual, distance)
    if not bounds.proved[0]:
        return None
    uncertainty = residual.uncertainty[0] + given.each[0]
    rise, words = float(bounds.rises[0]), (bounds.sliding[0], bounds.partial[0])
    carried = float(image.carried_norm[0])
    return StateErrors(float(distance[0]), carried, image.shifts[0], uncertainty, rise, *words)


def _by_convexity(given: Given) -> Bounds:
    """The steps of docs/theory/shear-proof.md, "Proof", in their order."""
    known = given.known
    if not known.convexity_number < 1 or not known.sure.any():
        return Bounds.unproved(*given.states.increments.shape)
    image = _image(given)
    residual = _residual(given, image)
    distance = _distance(given, image, residual)
    return _words(given, image, residual, distance)


class _Image(NamedTuple):
    """States carried over to the true loads, t P* + tau: steps 1 and 2."""

    carried_norm: Array  # (m,) bounds on || t (P* - P) ||_H
    restored: NDArray[np.bool_]  # (m,) whether shifts can restore the total
    shifts: Array  # (m, n) bounds on |tau|, 0 where they cannot
    coupled: Array  # (m, n) bounds on A |tau|


def _image(given: Given) -> _Image:
    """Steps 1 and 2: t P* misses the total by `missing`, and tau restores it where it sticks.

    The shifts are in proportion to du/deta, where |tau_i| < (P_i - |u_i|) / 2 leaves room for them.
    """
    problem, known, states = given.problem, given.known, given.states
    P, u, size = problem.loads, states.increments, np.abs(states.increments)
    used = np.where(known.sure, size / P, 0.0)  # t
    missing = known.distance * np.sqrt((used**2 / known.stiffness).sum(axis=1))
    missing = np.minimum((size * known.relative).sum(axis=1), missing)
    missing += np.where(known.sure, 0.0, P + known.errors + size).sum(axis=1)
    missing += np.abs(u.sum(axis=1) - states.totals)
    missing += len(P) * ROUNDOFF * size.sum(axis=1) + known.stray
    slopes = np.where(known.sure & (size < P), problem.slopes(states.deflections), 0.0)
    slopes[missing[:, None] * _parts(slopes) >= 0.25 * (P - size)] = 0.0  # no room
    shifts = missing[:, None] * _parts(slopes)
    restored = slopes.any(axis=1) & ((slopes == 0) | (shifts < 0.5 * (P - size))).all(axis=1)
    shifts[~restored] = 0.0
    norm = np.array([known.image_norm(each) for each in used])
    return _Image(norm, restored, shifts, couple_above(problem, shifts))


def _parts(weights: Array) -> Array:
    """(m, n) parts of 1, as the weights of each state; 0 where all are 0."""
    total = weights.sum(axis=1, keepdims=True)
    return weights / np.where(total > 0, total, 1.0)


class _Residual(NamedTuple):
    """How far the law is from holding for the image on the true loads: step 3."""

    own: Array  # (m, n) own deflections at u, not at the image
    uncertainty: Array  # (m, n) of `available`: rounding, and what asperities not sure do to it
    values: Array  # (m, n) bounds on |e|, less what `_distance` adds in norms


def _residual(given: Given, image: _Image) -> _Residual:
    """Step 3: |e| <= |Delta - A u - own|, or what Delta - A u lacks of the ceiling if t = 1.

    With rounding, and with what the shifts change in own deflections.
    """
    problem, known, u = given.problem, given.known, given.states.increments
    size, available, own = np.abs(u), given.available, problem.deflections(u)
    uncertainty = OWN_ROUNDOFFS * ROUNDOFF * np.abs(own)
    uncertainty += given.rounding + known.stray_effect + known.loose_effect
    change = own_change(problem, size, np.abs(own), image.shifts)
    beyond = available * np.sign(u) - problem.ceilings
    sticks = np.abs(available - own) + uncertainty + change
    values = np.where(size < problem.loads, sticks, np.maximum(uncertainty - beyond, 0.0))
    return _Residual(own, uncertainty, np.where(known.sure, values, 0.0))


def own_change(energy: TangentialEnergy, size: Array, own: Array, change: Array) -> Array:
    """Bounds on how far own deflections turn or grow if |u| or |q|, now `size`, change by so much.

    Step 3: phi' grows with t, and 1.5 is for P* in place of P while `change` is at most half of
    P - size. `own` are the lengths of the deflections now.
    """
    farther = np.minimum(size + change, energy.loads)
    bound: Array = 1.5 * (energy.deflections(farther) - own) + OWN_ROUNDOFFS * ROUNDOFF * own
    return bound


def _distance(given: Given, image: _Image, residual: _Residual) -> Array:
    """Step 4, (m,): || d ||_H, d from the image to the solution, with root^2 = 1 - theta,

        || d ||_H <= ((|| e ||_{H^-1} + || w ||_H) / root + || w ||_N) / root.

    Here w = t (P* - P) + tau, and || e || has LOCAL || t (P* - P) ||_H for ceiling* in it.
    """
    known, h, carried, tau = given.known, given.known.stiffness, image.carried_norm, image.shifts
    norm = np.sqrt((residual.values**2 / h).sum(axis=1)) + given.remainder / np.sqrt(h.min())
    squares = np.where(known.sure, h, 0.0) * tau**2  # || tau ||_H^2
    coupled = np.sqrt((squares + tau * image.coupled).sum(axis=1))  # || tau ||_N
    coupled = np.sqrt(1.0 + known.coupling) * carried + coupled
    norm += (1.0 + LOCAL) * carried + np.sqrt(squares.sum(axis=1))
    root = np.sqrt(1.0 - known.convexity_number)
    distance: Array = (norm / root + coupled) / root * (1 + SAFETY)
    return distance


def _words(given: Given, image: _Image, residual: _Residual, distance: Array) -> Bounds:
    """Steps 5 and 6: the rise, known at every asperity sure to stick; the slips; and who slides.

    |Delta - Delta*| <= |Delta - A u - own| + the changes of both, the least of those that stick;
    i slides if |Delta - A u| - ceiling exceeds its error, and does not if it falls short by that.
    """
    problem, known, u = given.problem, given.known, given.states.increments
    P, ceilings, size, own = problem.loads, problem.ceilings, np.abs(u), residual.own
    distances = distance[:, None] / np.sqrt(known.stiffness) + image.shifts  # u* from t P*
    uncertainty = residual.uncertainty + (
        np.abs(own) * known.relative + image.coupled + given.each[:, None]
    )
    uncertainty += (distance + image.carried_norm)[:, None] * known.reach * (1 + SAFETY)
    sticks = known.sure & (distances < 0.5 * (P - size))
    moved = distances + SHARE_ROUNDOFFS * ROUNDOFF * size
    change = own_change(problem, size, np.abs(own), moved)
    available = given.available
    at_each = np.where(sticks, np.abs(available - own) + uncertainty + change, np.inf)
    rise_errors = at_each.min(axis=1)
    slip_errors = uncertainty + rise_errors[:, None] + ceilings * known.relative
    sliding = known.sure & (np.abs(available) - ceilings > slip_errors)
    partial = known.sure & (sticks | (ceilings - np.abs(available) > slip_errors))
    shifts = image.shifts + moved - distances
    near = Nearness(distance, shifts, moved, available, slip_errors, rise_errors, sliding, partial)
    proved = image.restored & np.isfinite(rise_errors)
    increments = distances + known.image_distances(P, u)
    if proved.any():
        near, increments = by_largest(given, near, increments)
    return bounds_of(given, near, proved, increments)
