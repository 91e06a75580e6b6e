"""How a shear force is shared where every asperity sticks, and how far that is proved.

Shares Y solve  (H + C) Y = the same displacement everywhere,  sum Y = 1,  with H = diag(1/(2 E* a))
of the true loads. For computed shares y of residual r, and mu > 0 with H + C >= mu H,

    || Y - y ||_H  <=  || r ||_{H^-1} / mu:

docs/theory/shakedown.md, "Elastic shares". Y is (n,), or (n, 2, 2) with the full kernel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.normal.residual import SUM_ROUNDOFFS
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.load_errors import LoadErrors, couple_above
from convexrough.shearing.problem import TangentialProblem
from convexrough.vector_shear.judgement import margin_of
from convexrough.vector_shear.problem import VectorProblem

#: Where P* is within a tenth of P the local stiffness is within this part of the part of P.
STIFFENS = 0.4


class Shares(NamedTuple):
    """Shares of the n loaded asperities, own units; errors are infinite where nothing is proved.

    values : (n,) or (n, 2, 2);  errors : (n,) or (n, 2), under a force along x and along y
    loads, load_errors : (n,)
    """

    values: Array
    errors: Array
    loads: Array
    load_errors: Array


def scalar_shares(contact: Contact) -> Shares:
    """With the scalar kernel."""
    problem = TangentialProblem.of(contact)
    y, h = problem.elastic, 1.0 / problem.stiffest
    if problem.certificate.scope == "none":
        return _unproved(y, problem)
    known = LoadErrors.of(problem)
    moved = h * y + problem.couple(y)
    size = h * np.abs(y)
    above = couple_above(problem, np.abs(y))
    residual = np.abs(moved - moved.mean()) + STIFFENS * known.relative * size
    residual += problem.influence.rounding(y).of(above) + SUM_ROUNDOFFS * ROUNDOFF * (size + above)
    total, lost = float(y.sum()), len(y) * ROUNDOFF * float(np.abs(y).sum())
    missing = abs(1.0 - total) + lost
    errors = _errors(known, residual[:, None], 1.0 - known.convexity_number)[:, 0]
    errors = (errors + missing * np.abs(y)) / (1.0 - missing) * (1 + SAFETY)
    return Shares(y, errors, problem.loads, known.errors)


def vector_shares(contact: Contact) -> Shares:
    """With the full tangential kernel."""
    problem = VectorProblem.of(contact)
    n, h = len(problem), problem.stiffness
    checks.fits_in_memory("loaded asperities", n, 3 * 4 * 8, power=2)
    stiffness = problem.kernel + np.diag(np.repeat(h, 2))
    together = np.tile(np.eye(2), (n, 1))
    moved = np.linalg.solve(stiffness, together)
    y = moved @ np.linalg.inv(together.T @ moved)  # (2n, 2)
    if problem.scalar.certificate.scope == "none":
        return _unproved(y.reshape(n, 2, 2), problem.scalar)
    known = LoadErrors.of(problem.scalar)

    level = (stiffness @ y).reshape(n, 2, 2)
    off = level - level.mean(axis=0)
    shares = y.reshape(n, 2, 2)
    sizes = np.hypot(shares[:, 0], shares[:, 1])  # (n, 2): under a force along x, and along y
    around = problem.scalar.influence.matrix @ sizes
    local = h[:, None] * sizes
    residual = np.hypot(off[:, 0], off[:, 1]) + STIFFENS * known.relative[:, None] * local
    residual += problem.product_error * around + SUM_ROUNDOFFS * ROUNDOFF * (local + around)
    errors = _errors(known, residual, margin_of(problem, known))
    missing = float(np.abs(shares.sum(axis=0) - np.eye(2)).sum())
    missing += n * ROUNDOFF * float(sizes.sum())
    errors = (errors + missing * sizes.sum(axis=1, keepdims=True)) / (1.0 - missing)
    return Shares(shares, errors * (1 + SAFETY), problem.scalar.loads, known.errors)


def _unproved(values: Array, problem: TangentialProblem) -> Shares:
    """Shares of loads of which nothing is known."""
    nowhere = np.full(len(values), np.inf)
    errors = nowhere if values.ndim == 1 else np.full(values[:, 0].shape, np.inf)
    return Shares(values, errors, problem.loads, nowhere)


def _errors(known: LoadErrors, residual: Array, margin: float) -> Array:
    """(n, k) bounds from residuals (n, k) of k forces; infinite unless all loads are known."""
    if not margin > 0 or known.stray > 0 or not known.sure.all():
        return np.full(residual.shape, np.inf)
    h = known.stiffness[:, None]
    norms = np.sqrt((residual**2 / h).sum(axis=0)) / margin
    return np.asarray(norms / np.sqrt(h))
