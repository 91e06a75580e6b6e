"""Melan's theorem at constant normal load, for asperities that stick until they slide.

The points of a path of shear forces are t0 + lambda t_v. Melan's program asks for the largest
lambda for which constant residual forces r_i exist, with the sum t0, such that the sum of r_i and
lambda times the elastic forces at t_v is at most the load P_i in size, at every point. This module
computes a lower bound on it from given r_i, and an upper bound, (3) of docs/theory/shakedown.md,
from given slips. A solver finds both, and need not be accurate. The bounds include the errors of
shares and loads. All shear forces are divided by the coefficient of friction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, among_zeros
from convexrough.contact import Contact
from convexrough.errors import SolverError
from convexrough.melan.elastic_shares import Shares, vector_shares
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.solvers.programs import ConeProgram, run_clarabel
from convexrough.vector_shear.problem import FrictionProblem

#: The solver's tolerance, and the fraction by which residual forces are moved into the cones.
TOLERANCE, MARGIN = 1e-10, 1e-9

#: Slips are rounded to multiples of the largest slip / STEPS, so that sums of slips are exact.
STEPS = 2.0**30


class Melan(NamedTuple):
    """The largest lambda of Melan's program, with proved bounds.

    factor : lambda for the computed residual forces, shares and loads
    lower, upper : proved bounds on the largest lambda; 0 and infinite without a proof
    gross  : lambda at which the path reaches the friction limit of the whole contact
    rest   : (N, 2) [force] r_i minus the elastic shares of the mean force t0
    slips  : (m, N, 2) slips at each of the m points of the path, in whole multiples of a unit
    """

    factor: float
    lower: float
    upper: float
    gross: float
    rest: Array
    slips: Array


def solve(contact: Contact, mean: Array, vertices: Array) -> Melan:
    """The solution of Melan's program with the full tangential kernel.

    mean, vertices : (2,) t0 and (m, 2) t_v [force], shear forces divided by f
    """
    problem = contact.cached(FrictionProblem)
    unit, n = problem.units.force, len(problem)
    shares, m = vector_shares(contact), len(vertices)
    checks.fits_in_memory("cones", m * n, 4000.0)
    elastic = np.einsum("ijk,vk->vij", shares.values, vertices / unit)  # (m, n, 2)
    errors = np.einsum("ik,vk->vi", shares.errors, np.abs(vertices) / unit)
    steady = shares.values @ (mean / unit)
    raw = run_clarabel(_program(shares.loads, steady, elastic), "shakedown", TOLERANCE)
    rest = _inwards(shares.loads, steady + raw.x[1:].reshape(n, 2), mean / unit)
    cones = raw.multipliers[2:].reshape(m, n, 3)
    slips = _closed(-cones[..., 1:] / shares.loads[:, None])
    return Melan(
        factor=_largest(rest, elastic, shares.loads)[1],
        lower=_lower(shares, rest, mean / unit, elastic, errors),
        upper=_upper(shares, slips, mean / unit, elastic, errors),
        gross=_largest(mean[None], vertices[:, None], np.array([contact.load]))[1],
        rest=problem.to_scene((rest - steady) * unit),
        slips=among_zeros(slips, problem.touching, len(contact.scene), axis=1),
    )


def _program(limits: Array, steady: Array, elastic: Array) -> ConeProgram:
    """The cone program in lambda and r - `steady`; the cones of asperity i are divided by P_i.

    limits : (n,) P;  steady : (n, 2) elastic forces at t0;  elastic : (m, n, 2) those at t_v
    """
    from scipy.sparse import csc_matrix, hstack, identity, kron, vstack

    m, n, _ = elastic.shape
    inverse = np.diag(1.0 / limits)
    into = csc_matrix(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    scaled = np.zeros((m, n, 3))
    scaled[..., 1:] = -elastic / limits[:, None]
    rests = kron(csc_matrix(np.ones((m, 1))), kron(csc_matrix(-inverse), into))
    balance = kron(csc_matrix(np.ones((1, n))), identity(2))
    equal = hstack([csc_matrix((2, 1)), balance])
    within = hstack([csc_matrix(scaled.reshape(-1, 1)), rests])
    constant = np.zeros((m, n, 3))
    constant[..., 0] = 1.0
    constant[..., 1:] = steady / limits[:, None]
    unknowns = 1 + 2 * n
    linear = np.zeros(unknowns)
    linear[0] = -1.0
    return ConeProgram(
        quadratic=csc_matrix((unknowns, unknowns)),
        linear=linear,
        constraints=csc_matrix(vstack([equal, within])),
        constant=np.append(np.zeros(2), constant.reshape(-1)),
        equalities=2,
    )


def _inwards(limits: Array, state: Array, mean: Array) -> Array:
    """(n, 2) residual forces: `state`, corrected to the sum `mean` and moved a little inwards.

    limits : (n,) the friction limits P
    """
    parts = limits[:, None] / limits.sum()
    state = state + parts * (mean - state.sum(axis=0))
    return np.asarray(state + MARGIN * (parts * mean - state))


def _lower(shares: Shares, rest: Array, mean: Array, elastic: Array, errors: Array) -> float:
    """A lower bound on the largest lambda that the residual forces `rest` allow, or 0.

    elastic, errors : (m, n, 2) elastic forces at t_v, and (m, n) bounds on their errors
    """
    missing = float(np.hypot(*(rest.sum(axis=0) - mean)))
    missing += 4 * len(rest) * ROUNDOFF * float(np.abs(rest).sum())
    limits = (shares.loads - shares.load_errors - missing) * (1 - SAFETY)
    if not np.isfinite(errors).all() or (limits <= 0).any():
        return 0.0
    least, most = _largest(rest, elastic, limits)
    if not least <= 0.0 <= most:
        return 0.0
    limits = limits - most * errors  # errors grow with lambda
    if (limits <= 0).any():
        return 0.0
    least, most = _largest(rest, elastic, limits)
    return most * (1 - SAFETY) if least <= 0.0 <= most else 0.0


def _largest(fixed: Array, scaled: Array, limits: Array) -> tuple[float, float]:
    """The least and largest lambda with |fixed (n, 2) + lambda scaled (m, n, 2)| <= limits (n,)."""
    a = (scaled**2).sum(axis=-1)
    b = (fixed * scaled).sum(axis=-1)
    c = np.broadcast_to((fixed**2).sum(axis=-1) - limits**2, a.shape)
    moving = a > 0
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0)[moving])
    if (b**2 < a * c)[moving].any() or (c[~moving] > 0).any():
        return np.inf, 0.0
    a, b = a[moving], b[moving]
    return float(((-b - root) / a).max()), float(((-b + root) / a).min())


def _closed(slips: Array) -> Array:
    """(m, n, 2) the slips, changed to whole numbers; the sum over m is equal for all asperities."""
    largest = float(np.abs(slips).max())
    if not largest > 0:
        raise SolverError("the solver found no slips", solver="shakedown")
    slips = np.round(slips * (STEPS / largest))
    net = slips.sum(axis=0)
    together = np.round(net.mean(axis=0))
    most = np.hypot(slips[..., 0], slips[..., 1]).argmax(axis=0)
    slips[most, np.arange(slips.shape[1])] += together - net
    return np.asarray(slips)


def _upper(shares: Shares, slips: Array, mean: Array, elastic: Array, errors: Array) -> float:
    """The upper bound (3) on lambda from these slips; infinite if their work may be 0 or less.

    elastic, errors : as for `_lower`
    """
    sizes = np.hypot(slips[..., 0], slips[..., 1])
    done = slips * elastic
    uncertainty = float((sizes * errors).sum()) + 4 * done.size * ROUNDOFF * float(
        np.abs(done).sum()
    )
    work = float(done.sum()) - uncertainty
    together = slips.sum(axis=0)[0]
    given = together * mean
    cost = float((sizes * (shares.loads + shares.load_errors)).sum()) * (1 + SAFETY)
    cost += -float(given.sum()) + 4 * ROUNDOFF * float(np.abs(given).sum())
    return cost / work * (1 + SAFETY) if work > 0 else np.inf
