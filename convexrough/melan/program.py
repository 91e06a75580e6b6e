"""Melan's theorem at constant normal load, for asperities that stick until they slide.

docs/theory/shakedown.md, "Melan's program", states the program (2) for the points t0 + lambda t_v
of a path. Residual forces give a lower bound on lambda, slips the upper bound (3); a solver, which
need not be accurate, finds both. All shear forces are divided by the coefficient of friction.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, among_zeros
from convexrough.contact import Contact
from convexrough.convex.theorem import distance
from convexrough.errors import SolverError
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.solvers.programs import ConeProgram, run_clarabel
from convexrough.vector_shear.problem import FrictionProblem

TOLERANCE = 1e-10  # of the solver
MARGIN = 1e-9  # fraction by which residual forces are moved away from the friction limits
STEPS = 2.0**30  # slips are multiples of the largest / STEPS, so that their sums are exact


def solve(contact: Contact, mean: Array, vertices: Array) -> dict[str, Any]:
    """Fields of `Shakedown` by Melan's program with the full tangential kernel, from t0 and t_v."""
    known = contact.cached(FrictionProblem)
    unit, n, m = known.units.force, len(known), len(vertices)
    checks.fits_in_memory("cones", m * n, 4000.0)
    shares, share_errors = elastic_shares(known)
    elastic = np.einsum("ijk,vk->vij", shares, vertices / unit)  # (m, n, 2) forces at t_v
    errors = np.einsum("ik,vk->vi", share_errors, np.abs(vertices) / unit)  # (m, n) of `elastic`
    mean, steady, P = mean / unit, shares @ (mean / unit), known.loads
    raw = run_clarabel(_program(P, steady, elastic), "shakedown", TOLERANCE)
    # The residual forces, corrected to the sum t0, and moved away from the friction limits.
    rest, parts = steady + raw.x[1:].reshape(n, 2), P[:, None] / P.sum()
    rest = rest + parts * (mean - rest.sum(axis=0))
    rest = rest + MARGIN * (parts * mean - rest)
    slips = _closed(-raw.multipliers[2:].reshape(m, n, 3)[..., 1:] / P[:, None])
    sizes = np.hypot(slips[..., 0], slips[..., 1])
    factor = _largest(rest, elastic, P)[1]
    whole = mean[None], vertices[:, None] / unit, np.array([contact.load / unit])
    return {
        "factor": factor,
        "limited_by": "sliding",
        "lower": _lower(known, rest, mean, elastic, errors),
        "upper": _upper(known, slips, mean, elastic, errors),
        "factors": np.where(contact.loads > 0, factor, np.nan),
        "gross": _largest(*whole)[1],
        "witness": known.to_scene(rest * unit),
        "mechanism": among_zeros(slips / sizes.max(), known.touching, len(contact.scene), axis=1),
    }


def elastic_shares(problem: FrictionProblem) -> tuple[Array, Array]:
    """(n, 2, 2) the shares Y, and (n, 2) bounds on |error of Y| for total forces along x and y,
    which docs/theory/shakedown.md, "Elastic shares", derives; infinite where nothing is proved.
    """
    n = len(problem)
    checks.fits_in_memory("loaded asperities", n, 3 * 4 * 8, power=2)
    compliance = problem.kernel + np.diag(np.repeat(problem.compliance, 2))
    together = np.tile(np.eye(2), (n, 1))
    moved = np.linalg.solve(compliance, together)
    shares = (moved @ np.linalg.inv(together.T @ moved)).reshape(n, 2, 2)
    known = problem.scope != "none" and problem.stray == 0 and problem.sure.all()
    if not known or problem.margin == 0.0:
        return shares, np.full((n, 2), np.inf)
    errors = [_errors(problem, shares[..., k], np.eye(2)[k]) for k in (0, 1)]
    return shares, np.stack(errors, axis=1)


def _errors(problem: FrictionProblem, shares: Array, total: Array) -> Array:
    """(n,) bounds on the errors of the shares (n, 2) of a total force (2,), from their residual."""
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


def _program(limits: Array, steady: Array, elastic: Array) -> ConeProgram:
    """The cone program in lambda and r - `steady`; the cones of asperity i are divided by P_i.

    limits : (n,) P;  steady : (n, 2) elastic forces at t0;  elastic : (m, n, 2) those at t_v
    """
    from scipy import sparse  # 0.1 s to import: only when solving

    (m, n, _), unknowns = elastic.shape, 1 + 2 * elastic.shape[1]
    scaled, constant = np.zeros((m, n, 3)), np.zeros((m, n, 3))
    scaled[..., 1:] = -elastic / limits[:, None]
    constant[..., 0], constant[..., 1:] = 1.0, steady / limits[:, None]
    of_asperities = sparse.kron(sparse.diags_array(-1.0 / limits), np.eye(3, 2, -1))
    balance = sparse.kron(np.ones((1, n)), sparse.eye_array(2))
    rests = sparse.kron(np.ones((m, 1)), of_asperities)
    rows: list[list[Any]] = [[None, balance], [scaled.reshape(-1, 1), rests]]
    return ConeProgram(
        quadratic=sparse.csc_array((unknowns, unknowns)),
        linear=np.append(-1.0, np.zeros(2 * n)),
        constraints=sparse.csc_array(sparse.block_array(rows)),
        constant=np.append(np.zeros(2), constant.reshape(-1)),
        equalities=2,
    )


def _lower(
    known: FrictionProblem, rest: Array, mean: Array, elastic: Array, errors: Array
) -> float:
    """A lower bound on the largest lambda, from residual forces `rest`; 0 without a proof."""
    missing = float(np.hypot(*(rest.sum(axis=0) - mean)))
    missing += 4 * len(rest) * ROUNDOFF * float(np.abs(rest).sum())
    limits, most = (known.loads - known.errors - missing) * (1 - SAFETY), 0.0
    if not np.isfinite(errors).all():
        return 0.0
    for _ in range(2):  # the second time with errors, which grow with lambda
        limits = limits - most * errors
        least, most = _largest(rest, elastic, limits)
        if (limits <= 0).any() or not least <= 0.0 <= most:
            return 0.0
    return most * (1 - SAFETY)


def _largest(fixed: Array, scaled: Array, limits: Array) -> tuple[float, float]:
    """The least and the largest lambda with |fixed + lambda scaled| <= limits; (inf, 0) if none."""
    a, b = (scaled**2).sum(axis=-1), (fixed * scaled).sum(axis=-1)
    c = np.broadcast_to((fixed**2).sum(axis=-1) - limits**2, a.shape)
    moving = a > 0
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0)[moving])
    if (b**2 < a * c)[moving].any() or (c[~moving] > 0).any():
        return np.inf, 0.0
    a, b = a[moving], b[moving]
    return float(((-b - root) / a).max()), float(((-b + root) / a).min())


def _closed(slips: Array) -> Array:
    """(m, n, 2) the slips as whole numbers, with the same sum over m for all asperities."""
    largest = float(np.abs(slips).max())
    if not largest > 0:
        raise SolverError("the solver found no slips", solver="shakedown")
    slips = np.round(slips * (STEPS / largest))
    net, most = slips.sum(axis=0), np.hypot(slips[..., 0], slips[..., 1]).argmax(axis=0)
    slips[most, np.arange(slips.shape[1])] += np.round(net.mean(axis=0)) - net
    return np.asarray(slips)


def _upper(
    known: FrictionProblem, slips: Array, mean: Array, elastic: Array, errors: Array
) -> float:
    """The upper bound (3) on lambda, from slips; infinite if the work of the slips may be <= 0."""
    sizes, done = np.hypot(slips[..., 0], slips[..., 1]), slips * elastic
    rounding = 4 * done.size * ROUNDOFF * float(np.abs(done).sum())
    work = float(done.sum()) - (float((sizes * errors).sum()) + rounding)
    given = slips.sum(axis=0)[0] * mean
    cost = float((sizes * (known.loads + known.errors)).sum()) * (1 + SAFETY)
    cost += -float(given.sum()) + 4 * ROUNDOFF * float(np.abs(given).sum())
    return cost / work * (1 + SAFETY) if work > 0 else np.inf
