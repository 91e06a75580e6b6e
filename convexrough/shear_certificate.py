"""Judge friction states: bounds on their forces and slips, and which asperities slide.

The normal loads are known only to their certified bounds b. A state u of the computed loads P is
carried over to the true ones P* at equal u_i / P_i, and its total mended where it sticks; that
changes its residual by terms of the order (b_i / P_i) u_i, which are added to it. From there the
argument is that of `convexrough.certificate`: on |u| <= P* the energy is strictly convex with
H = diag(1 / (2 E* a_i)), so

    || u - u* ||_H  <=  || e ||_{H^-1} / (1 - theta),

and an asperity slides if the slip that A u* leaves it is proved positive. All bounds shrink with
the shear force. Arrays are (m, n): m states of n loaded asperities.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.certificate import SUM_ROUNDOFFS
from convexrough.checks import Array
from convexrough.contact import Contact
from convexrough.influence import ROUNDOFF
from convexrough.normal import SAFETY
from convexrough.tangential import States, TangentialProblem


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
    if contact.certificate.scope == "none":
        return _nothing(states)
    known = Known.of(problem, contact)
    near_elastic = _by_convexity(problem, known, states)
    near_gross = _by_exhaustion(problem, known, states)
    # At Q = f P itself there is nothing to prove: |Q_i| <= f P_i leaves one state.
    gross = problem.at_limit(states.totals)[:, None] & known.sure
    use = near_elastic.proved[:, None]
    rows = near_elastic.proved
    return Bounds(
        proved=rows | near_gross.proved,
        increments=np.where(use, near_elastic.increments, near_gross.increments),
        slips=np.where(known.sure, np.where(use, near_elastic.slips, near_gross.slips), np.inf),
        rises=np.where(rows, near_elastic.rises, near_gross.rises),
        sliding=np.where(use, near_elastic.sliding, near_gross.sliding) | gross,
        partial=np.where(use, near_elastic.partial, near_gross.partial),
    )


class Known(NamedTuple):
    """What the normal certificate says of the loads P, in own units."""

    errors: Array  # (n,) b
    sure: NDArray[np.bool_]  # (n,) proved to touch, and known to some digits
    relative: Array  # (n,) b / P of those, 0 of the others
    stray: float  # most that asperities with no load here, but not proved open, carry in all
    stray_effect: Array  # (n,) most that this moves each of the others

    @classmethod
    def of(cls, problem: TangentialProblem, contact: Contact) -> Known:
        certificate, scene, force = contact.certificate, contact.scene, problem.units.force
        errors = certificate.load_errors[problem.touching] / force
        sure = certificate.status[problem.touching] == "contact"
        sure &= errors < 0.1 * problem.loads
        strays = np.flatnonzero((contact.loads == 0) & (certificate.status != "open"))
        most = certificate.load_errors[strays] / force
        effect = np.zeros(len(sure))
        for block, rows, error in problem.influence.elsewhere(scene.contact_points[strays]):
            effect += most[block] @ rows * (1.0 + error)
        relative = np.where(sure, errors / problem.loads, 0.0)
        return cls(errors, sure, relative, float(most.sum()), effect)

    def moved(self, loads: Array, increments: Array) -> Array:
        """How far each u can be from its image on the true loads; |u| <= P is all known of some."""
        size = np.abs(increments)
        return size * self.relative + np.where(self.sure, 0.0, loads + self.errors + size)


def _by_convexity(problem: TangentialProblem, known: Known, states: States) -> Bounds:
    P, ceilings, A = problem.loads, problem.ceilings, problem.influence
    u, rises = states.increments, states.rises
    size = np.abs(u)
    h = np.where(known.sure, 2.0 / 3.0 * ceilings / (P + known.errors), np.inf)
    theta = float((problem.shells / h).max()) * (1 + SAFETY)
    if not theta < 1 or not known.sure.any():
        return _nothing(states)

    # The image on the true loads misses the total; a shift of eta where it sticks mends that.
    moved = known.moved(P, u)
    missing = moved.sum(axis=1) + np.abs(u.sum(axis=1) - states.totals)
    missing += len(P) * ROUNDOFF * size.sum(axis=1) + known.stray
    sticking = known.sure & (size < P)
    slopes = np.where(sticking, problem.slopes(states.deflections), 0.0)
    weights = slopes.sum(axis=1)
    shares = slopes / np.where(weights > 0, weights, 1.0)[:, None]
    mended = missing[:, None] * shares
    proved = (weights > 0) & (~sticking | (mended < 0.5 * (P - size))).all(axis=1)
    mended[~proved] = 0.0
    local = problem.deflections(u)
    bent = 1.5 * (problem.deflections(size + mended) - np.abs(local))  # 1.5: for P* in place of P

    # The residual of the mended image on the true loads, with rounding.
    asked = rises[:, None] - problem.couple(u)  # the deflection left to each asperity
    unsure = (SUM_ROUNDOFFS * ROUNDOFF + A.product_error) * (
        np.abs(local) + problem.couple(size) + rises[:, None]
    )
    unsure += problem.couple(moved + mended) + np.abs(local) * known.relative
    unsure += known.stray_effect
    surplus = asked * np.sign(u) - ceilings
    residual = np.where(
        size < P, np.abs(asked - local) + unsure + bent, np.maximum(unsure - surplus, 0.0)
    )
    residual = np.where(known.sure, residual, 0.0)
    norm = np.sqrt((residual**2 / h).sum(axis=1)) / (1.0 - theta) * (1 + SAFETY)
    off = norm[:, None] / np.sqrt(h) + mended  # from the image

    # The rise, known at every asperity sure to stick; and from it the slips.
    unsure += norm[:, None] * A.spread(1.0 / h) * (1 + SAFETY)
    held = known.sure & (off < 0.5 * (P - size))
    bent = 1.5 * (problem.deflections(np.minimum(size + off, P)) - np.abs(local))
    each = np.where(held, np.abs(asked - local) + unsure + bent, np.inf)
    rise_errors = each.min(axis=1)
    slip_errors = unsure + rise_errors[:, None] + ceilings * known.relative
    sliding = known.sure & (np.abs(asked) - ceilings > slip_errors)
    partial = known.sure & (held | (ceilings - np.abs(asked) > slip_errors))
    proved &= np.isfinite(rise_errors)
    return Bounds(proved, off + moved, slip_errors, rise_errors, sliding, partial)


def _by_exhaustion(problem: TangentialProblem, known: Known, states: States) -> Bounds:
    """Near gross sliding: |u| <= P and sum u = T leave each asperity within sum P - T of P.

    The last asperity to slide, i, then fixes the rise: it is at most k_i P_i^(2/3) + (A P)_i, and
    at least what u_i = P_i - (sum P - T) asks.
    """
    if known.stray > 0 or not known.sure.all():
        return _nothing(states)
    P, ceilings, A = problem.loads, problem.ceilings, problem.influence
    u, rises = states.increments, states.rises
    left = (P.sum() - states.totals + known.errors.sum())[:, None]
    left += 2 * len(P) * ROUNDOFF * P.sum()
    errors = left + known.errors + (P - u)
    spread = problem.couple(errors) + (SUM_ROUNDOFFS * ROUNDOFF + A.product_error) * (
        problem.couple(np.abs(u)) + ceilings + rises[:, None]
    )
    asked = rises[:, None] - problem.couple(u)
    spread += ceilings * known.relative
    lowest = ceilings * np.minimum(1.5 * left / P, 1.0) ** (2 / 3)
    last = np.argmin(asked - ceilings, axis=1)
    every = np.arange(len(rises))
    rise_errors = (np.abs(asked - ceilings) + lowest + spread)[every, last] + spread.max(axis=1)
    slip_errors = spread + rise_errors[:, None]
    sliding = asked - ceilings > slip_errors
    # Where all but one are sure to slide, and not all can, that one does not.
    short = P.sum() * (1 - 2 * len(P) * ROUNDOFF) - known.errors.sum() - states.totals > 0
    alone = short & (sliding.sum(axis=1) == len(P) - 1)
    proved = np.ones(len(rises), dtype=bool)
    return Bounds(proved, errors, slip_errors, rise_errors, sliding, ~sliding & alone[:, None])


def _nothing(states: States) -> Bounds:
    unknown = np.full(states.increments.shape, np.inf)
    no = np.zeros(states.increments.shape, dtype=bool)
    return Bounds(np.zeros(len(no), dtype=bool), unknown, unknown, np.full(len(no), np.inf), no, no)
