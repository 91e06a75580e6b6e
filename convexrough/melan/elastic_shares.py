"""Elastic shares: the shear forces of asperities that all stick, per unit of the total force.

The shares Y make all displacements (H + A) Y equal, and sum Y = 1. Here H = diag(1/(2 E* a)) with
the contact modulus E* and the contact radii a, and A is the compliance matrix. Y is (n,), or
(n, 2, 2) with the full tangential kernel. docs/theory/shakedown.md, "Elastic shares", bounds the
errors of computed shares.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.convex.theorem import distance
from convexrough.roundoff import SAFETY
from convexrough.vector_shear.problem import FrictionProblem


class Shares(NamedTuple):
    """Shares of the n loaded asperities. Errors are proved bounds, infinite without a proof.

    values : Y, (n,) or (n, 2, 2)
    errors : (n,) bounds on |error of Y|, or (n, 2) for total forces along x and along y
    loads, load_errors : (n,) normal loads and bounds on their errors, in scaled units
    """

    values: Array
    errors: Array
    loads: Array
    load_errors: Array


def scalar_shares(contact: Contact) -> Shares:
    """The shares with the scalar kernel: derivatives of the normal loads by the total load."""
    known = contact.cached(FrictionProblem)
    shares = known.elastic
    if known.scope == "none":
        return _unproved(shares.value, known)
    return Shares(shares.value, shares.error, known.loads, known.errors)


def vector_shares(contact: Contact) -> Shares:
    """The shares with the full tangential kernel."""
    problem = contact.cached(FrictionProblem)
    n, h = len(problem), problem.compliance
    checks.fits_in_memory("loaded asperities", n, 3 * 4 * 8, power=2)
    compliance = problem.kernel + np.diag(np.repeat(h, 2))
    together = np.tile(np.eye(2), (n, 1))
    moved = np.linalg.solve(compliance, together)
    y = moved @ np.linalg.inv(together.T @ moved)  # (2n, 2)
    if problem.scope == "none":
        return _unproved(y.reshape(n, 2, 2), problem)

    shares = y.reshape(n, 2, 2)
    if problem.margin == 0.0 or problem.stray > 0 or not problem.sure.all():
        return _unproved(shares, problem)
    errors = np.stack([_errors(problem, shares[..., k], np.eye(2)[k]) for k in (0, 1)], axis=1)
    return Shares(shares, errors, problem.loads, problem.errors)


def _errors(problem: FrictionProblem, shares: Array, total: Array) -> Array:
    """(n,) bounds on the errors of shares (n, 2) of one total force (2,), from their residual."""
    exact = Ball.exact(np.ascontiguousarray(shares.T))
    compliance = 1.0 / (problem.load_balls / problem.threshold_balls * 1.5)
    moved = exact * compliance + problem.couple(shares).T
    off = np.hypot(*(moved - moved.value.mean(axis=1)[:, None]).size)
    off += problem.product_error * (problem.influence.matrix @ np.hypot(*shares.T))
    missing = float(np.hypot(*(exact.sum() - total).size)) * (1 + SAFETY)
    off += missing * problem.reach[0]
    off[0] += missing * compliance.upper[0]
    within = distance(off * (1 + SAFETY), 1.0 / problem.stiffness, problem.margin)
    errors: Array = within * np.sqrt(problem.stiffness) * (1 + SAFETY)
    errors[0] += missing
    return errors


def _unproved(values: Array, problem: FrictionProblem) -> Shares:
    """The shares with infinite errors."""
    nowhere = np.full(len(values), np.inf)
    errors = nowhere if values.ndim == 1 else np.full(values[:, 0].shape, np.inf)
    return Shares(values, errors, problem.loads, nowhere)
