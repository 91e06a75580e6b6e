"""Judge friction states: bounds on their forces and slips, and which asperities slide.

The proofs are those of docs/theory/shear-proof.md, "Proof" (by convexity, in six steps) and of
docs/theory/shear-errors.md, "Close to gross sliding" (by exhaustion). All bounds shrink with the
shear force. Arrays are (m, n): m states of n loaded asperities. In the letters of that page, all displacements over c_t f:

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

from convexrough.arrays import Array, Indices
from convexrough.normal.residual import SUM_ROUNDOFFS
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.energy import TangentialEnergy
from convexrough.shearing.load_errors import LoadErrors, couple_above
from convexrough.shearing.loss_errors import Nearness, loss_errors
from convexrough.shearing.normal_map import States
from convexrough.shearing.problem import TangentialProblem

#: Where P* is within a tenth of P, |ceiling* - ceiling| <= LOCAL h |P* - P|: 1.1 / 0.9^(1/3).
LOCAL = 1.15

#: Roundoffs of a share u / P that are counted apart: near full slip each changes the own deflection
#: by (2/3) (1 - t)^(-1/3), up to 1e5, roundoffs of its own.
SHARE_ROUNDOFFS = 4

#: Roundoffs, for each asperity, of sum P and of T, which is moved to sum P where it is that to
#: rounding (`TangentialEnergy.at_limit`): 2 (n - 1) and 2 (4 + log2 n), and a few of Q / f.
LIMIT_ROUNDOFFS = 12

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
    losses: Array  # (m,) |w - w*|, of what a cycle of this amplitude costs

    @classmethod
    def unproved(cls, m: int, n: int) -> Bounds:
        """Nothing is known of m states of n asperities."""
        unknown, no = np.full((m, n), np.inf), np.zeros((m, n), dtype=bool)
        nowhere, unproved = np.full(m, np.inf), np.zeros(m, dtype=bool)
        return cls(unproved, unknown, unknown.copy(), nowhere, no, no.copy(), nowhere.copy())


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
    given = _given(problem, states)
    known, bounds = given.known, _by_convexity(given)
    others = np.flatnonzero(~bounds.proved)
    if len(others):
        near_gross = _by_exhaustion(given.take(others))
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
    given = _given(problem, state)
    if not given.known.convexity_number < 1 or not given.known.sure.any():
        return None
    image = _image(given)
    residual = _residual(given, image)
    distance = _distance(given, image, residual)
    bounds = _words(given, image, residual, distance)
    if not bounds.proved[0]:
        return None
    uncertainty = residual.uncertainty[0] + given.remainder[0]
    rise, words = float(bounds.rises[0]), (bounds.sliding[0], bounds.partial[0])
    carried = float(image.carried_norm[0])
    return StateErrors(float(distance[0]), carried, image.shifts[0], uncertainty, rise, *words)


class _Given(NamedTuple):
    """What the proofs start from: m states, A u of each, and its rounding."""

    problem: TangentialProblem
    known: LoadErrors
    states: States
    displacement: Array  # (m, n) A u
    magnitude: Array  # (m, n) upper bounds on A |u|
    rounding: Array  # (m, n) bounds on the error of A u, less a remainder
    remainder: Array  # (m,) bounds on the 2-norm of that

    @property
    def available(self) -> Array:
        """(m, n) the displacement left to each asperity, its own deflection and its slip."""
        return self.states.rises[:, None] - self.displacement

    def take(self, rows: Indices) -> _Given:
        """Some of the states."""
        rest = (field[rows] for field in self[3:])
        return _Given(self.problem, self.known, self.states.take(rows), *rest)


def _given(problem: TangentialProblem, states: States) -> _Given:
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
    known, rounding = LoadErrors.of(problem), relative * magnitude
    return _Given(problem, known, states, displacement, magnitude, rounding, remainder)


def _by_convexity(given: _Given) -> Bounds:
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


def _image(given: _Given) -> _Image:
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


def _residual(given: _Given, image: _Image) -> _Residual:
    """Step 3: |e| <= |Delta - A u - own|, or what Delta - A u lacks of the ceiling if t = 1.

    With rounding, and with what the shifts change in own deflections.
    """
    problem, known, u = given.problem, given.known, given.states.increments
    size, available, own = np.abs(u), given.available, problem.deflections(u)
    sums = np.abs(own) + given.magnitude + given.states.rises[:, None]
    uncertainty = SUM_ROUNDOFFS * ROUNDOFF * sums
    uncertainty += given.rounding + known.stray_effect + known.loose_effect
    change = own_change(
        problem, size, np.abs(own), image.shifts + SHARE_ROUNDOFFS * ROUNDOFF * size
    )
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
    bound: Array = 1.5 * (energy.deflections(farther) - own)
    return bound


def _distance(given: _Given, image: _Image, residual: _Residual) -> Array:
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


def _words(given: _Given, image: _Image, residual: _Residual, distance: Array) -> Bounds:
    """Steps 5 and 6: the rise, known at every asperity sure to stick; the slips; and who slides.

    |Delta - Delta*| <= |Delta - A u - own| + the changes of both, the least of those that stick;
    i slides if |Delta - A u| - ceiling exceeds its error, and does not if it falls short by that.
    """
    problem, known, u = given.problem, given.known, given.states.increments
    P, ceilings, size, own = problem.loads, problem.ceilings, np.abs(u), residual.own
    distances = distance[:, None] / np.sqrt(known.stiffness) + image.shifts  # u* from t P*
    uncertainty = residual.uncertainty + (
        np.abs(own) * known.relative + image.coupled + given.remainder[:, None]
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
    return _bounds(given, near, proved, distances + known.image_distances(P, u))


def _bounds(given: _Given, near: Nearness, proved: NDArray[np.bool_], increments: Array) -> Bounds:
    losses = loss_errors(given.problem, given.known, given.states, near)
    return Bounds(proved, increments, near.errors, near.rises, near.sliding, near.partial, losses)


def _by_exhaustion(given: _Given) -> Bounds:
    """docs/theory/shear-errors.md, "Close to gross sliding": each u_i is within sum P - T of P_i.

    With c = Delta - A u - ceiling: no c* of a loaded asperity is less than -`shortfall`, which
    bounds the rise from below and tells who slides; the least c* is not positive, which bounds it
    from above. Nothing is claimed of T beyond its rounding: not even that it is below sum P*.
    """
    problem, known, states = given.problem, given.known, given.states
    P, u, ceilings, sure = problem.loads, states.increments, problem.ceilings, known.sure
    complete = known.stray == 0 and bool(sure.all())
    doubt = known.errors.sum() + known.stray + LIMIT_ROUNDOFFS * len(P) * ROUNDOFF * P.sum()
    unused = (P.sum() - states.totals)[:, None]
    most = unused + doubt
    errors = known.errors + np.minimum(most + (P - u), P + np.abs(u))
    uncertainty = couple_above(problem, errors) + given.rounding + given.remainder[:, None]
    sums = given.magnitude + ceilings + states.rises[:, None]
    uncertainty += SUM_ROUNDOFFS * ROUNDOFF * sums
    uncertainty += ceilings * known.relative + known.stray_effect
    lacking = 1.5 * most / P
    shortfall = ceilings * np.maximum(lacking, lacking ** (2 / 3))
    beyond = given.available - ceilings  # c
    above = np.where(sure, beyond + shortfall + uncertainty, np.inf).min(axis=1)  # Delta - Delta*
    below = (uncertainty.max(axis=1) - beyond.min(axis=1)) if complete else np.inf
    sliding = sure & (beyond - uncertainty > above[:, None])
    rise_errors = np.maximum(above, below)
    # Where all but one are sure to slide, and not all can, that one does not.
    alone = complete & (unused[:, 0] > doubt) & (sliding.sum(axis=1) == len(P) - 1)
    partial = ~sliding & alone[:, None]
    slip_errors = uncertainty + rise_errors[:, None]
    each = errors + np.abs(u) * (known.relative + SHARE_ROUNDOFFS * ROUNDOFF)  # u* from t P*
    unknown = np.full(len(u), np.inf)
    near = Nearness(
        unknown, each, each, given.available, slip_errors, rise_errors, sliding, partial
    )
    return _bounds(given, near, complete | sliding.any(axis=1), errors)
