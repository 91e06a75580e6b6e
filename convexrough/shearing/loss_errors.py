"""How far the computed loss of a cycle can be from the true one.

A cycle of amplitude T costs 8 c_t f^2 w(T), and w is a sum over asperities of

    (3/5) P ceiling e(t) + P slip / 2,      t = |u| / P,   ceiling = k P^(2/3).

The bounds on |w - w*| of m states of n asperities are those of
docs/theory/loss-errors.md, "The error of the loss", in own units. They rest on how
near a state is proved to be to the true one: `Nearness`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.load_errors import LoadErrors
from convexrough.shearing.normal_map import States
from convexrough.shearing.problem import TangentialProblem
from convexrough.sphere import annulus

#: Roundoffs of a computed loss, relative to itself: about 20 of e, 20 of P ceiling and 15 of what
#: energies are counted in, and as many again to spare.
LOSS_ROUNDOFFS = 110


class Nearness(NamedTuple):
    """What is proved of m states of n asperities: u* is near t P*, and eta* near Delta - A u."""

    distance: Array  # (m,) bounds on || u* - t P* - tau ||_H; infinite where not known
    shifts: Array  # (m, n) bounds on |tau|, with rounding of t
    each: Array  # (m, n) bounds on |u* - t P*| one by one, with rounding of t
    available: Array  # (m, n) Delta - A u
    errors: Array  # (m, n) bounds on what that is off by, and the slip where sure
    rises: Array  # (m,) bounds on |Delta - Delta*|
    sliding: NDArray[np.bool_]  # (m, n) proved to slide
    partial: NDArray[np.bool_]  # (m, n) proved not to


def loss_errors(
    problem: TangentialProblem, known: LoadErrors, states: States, near: Nearness
) -> Array:
    """(m,) bounds on |w - w*|."""
    P, most, slips = problem.loads, problem.loads + known.errors, np.abs(states.slips)
    e = annulus.loss(problem.widths(states.increments))
    found = P * (0.6 * problem.ceilings * e + 0.5 * slips)
    left = np.maximum(np.abs(near.available) - problem.ceilings, 0.0)
    slid = most * (near.errors + np.abs(slips - left)) + known.errors * slips
    slid[near.partial & (slips == 0)] = 0.0
    loose = np.maximum(found, 0.5 * most * (np.abs(near.available) + near.errors))
    bound = np.where(known.sure, 0.5 * slid, loose).sum(axis=1)
    bound += _by_increments(problem, known, states, near) + _by_loads(problem, known, e)
    if known.stray > 0:
        travel = np.abs(states.rises) + near.rises
        bound += 0.5 * (known.stray * travel + most @ known.stray_effect + known.stray_among)
    bound += LOSS_ROUNDOFFS * ROUNDOFF * found.sum(axis=1)
    return np.asarray(bound * (1 + SAFETY) + len(P) * np.finfo(float).tiny)


def _by_increments(
    problem: TangentialProblem, known: LoadErrors, states: States, near: Nearness
) -> Array:
    """(m,) what t* in place of t makes of the losses in partial slip.

    As e is convex and grows, no change of t by at most `off` changes it more than the last such
    step below `top`. Where that is not cut off at t = 1 its chord bounds smaller changes in
    proportion, and then the norm bounds those of all asperities together.
    """
    P, size = problem.loads, np.abs(states.increments)
    fixed = near.sliding & (size == P)  # at t* = t = 1
    off = np.where(known.sure & ~fixed, near.each / np.maximum(P - known.errors, 0.9 * P), 0.0)
    top = np.minimum(size / P + off, 1.0)
    change = _loss(top) - _loss(np.maximum(top - off, 0.0)) + LOSS_ROUNDOFFS * ROUNDOFF * _loss(top)
    change = 0.6 * _ceilings_at_most(problem, known) * np.where(off > 0, change, 0.0)
    singly = (P + known.errors) * change
    chord = np.where(top < 1, change / np.where(off > 0, off, 1.0), 0.0)
    distance = np.where(np.isfinite(near.distance), near.distance, 0.0)
    together = distance * np.sqrt((chord**2 / known.stiffness).sum(axis=1))
    together += np.where(top < 1, chord * near.shifts, singly).sum(axis=1)
    together[~np.isfinite(near.distance)] = np.inf
    return np.asarray(np.minimum(singly.sum(axis=1), together))


def _by_loads(problem: TangentialProblem, known: LoadErrors, e: Array) -> Array:
    """(m,) what P* in place of P makes of them at the same t: (3/5) k |P*^(5/3) - P^(5/3)| e."""
    slope = np.where(known.sure, _ceilings_at_most(problem, known) * e, 0.0)
    together = known.distance * np.sqrt((slope**2 / known.stiffness).sum(axis=1))
    return np.asarray(np.minimum((slope * known.errors).sum(axis=1), together))


def _ceilings_at_most(problem: TangentialProblem, known: LoadErrors) -> Array:
    """(n,) of loads as large as they can be."""
    return np.asarray(problem.ceilings * np.cbrt(1.0 + known.errors / problem.loads) ** 2)


def _loss(share: Array) -> Array:
    """e(t)."""
    return np.asarray(annulus.loss(annulus.width_under(share)))
