"""Melan's theorem at constant normal load, for asperities that stick until they slide.

docs/theory/shakedown.md, "Melan's program", states the program (2), in which the points of a path
of shear forces are t0 + lambda t_v. It derives a lower bound on lambda from residual forces, and
the upper bound (3) from slips. A solver, which need not be accurate, finds residual forces and
slips. The section "Elastic shares" derives the elastic forces and bounds on their errors. All
shear forces are divided by the coefficient of friction.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, among_zeros
from convexrough.contact import Contact
from convexrough.convex.theorem import distance
from convexrough.errors import SolverError
from convexrough.friction.order import Order
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.solvers.programs import ConeProgram, run_clarabel
from convexrough.vector_shear.problem import FrictionProblem

#: The solver's tolerance, and the fraction by which residual forces are moved away from the
#: friction limits.
TOLERANCE, MARGIN = 1e-10, 1e-9

#: Slips are rounded to multiples of the largest slip / STEPS, so that sums of slips are exact.
STEPS = 2.0**30


class Limit(NamedTuple):
    """Fields of `Shakedown`; shear forces are divided by the coefficient of friction."""

    factor: float
    lower: float
    upper: float
    factors: Array
    gross: float
    witness: Array
    mechanism: Array
    order: Order | None = None


def solve(contact: Contact, mean: Array, vertices: Array) -> Limit:
    """The shakedown limit by Melan's program with the full tangential kernel.

    mean, vertices : (2,) t0 and (m, 2) t_v [force], shear forces divided by f
    """
    known = contact.cached(FrictionProblem)
    unit, n, m = known.units.force, len(known), len(vertices)
    checks.fits_in_memory("cones", m * n, 4000.0)
    shares, share_errors = elastic_shares(known)
    elastic = np.einsum("ijk,vk->vij", shares, vertices / unit)  # (m, n, 2)
    errors = np.einsum("ik,vk->vi", share_errors, np.abs(vertices) / unit)
    steady = shares @ (mean / unit)
    raw = run_clarabel(_program(known.loads, steady, elastic), "shakedown", TOLERANCE)
    rest = _inwards(known.loads, steady + raw.x[1:].reshape(n, 2), mean / unit)
    cones = raw.multipliers[2:].reshape(m, n, 3)
    slips = _closed(-cones[..., 1:] / known.loads[:, None])
    factor = _largest(rest, elastic, known.loads)[1]
    return Limit(
        factor=factor,
        lower=_lower(known, rest, mean / unit, elastic, errors),
        upper=_upper(known, slips, mean / unit, elastic, errors),
        factors=np.where(contact.loads > 0, factor, np.nan),
        gross=_largest(mean[None], vertices[:, None], np.array([contact.load]))[1],
        witness=known.to_scene((rest - steady) * unit),
        mechanism=among_zeros(
            slips / np.hypot(*np.moveaxis(slips, -1, 0)).max(),
            known.touching,
            len(contact.scene),
            axis=1,
        ),
    )


def elastic_shares(problem: FrictionProblem) -> tuple[Array, Array]:
    """(n, 2, 2) the shares Y, and (n, 2) bounds on |error of Y| for total forces along x and y.

    The bounds are infinite where nothing is proved. docs/theory/shakedown.md, "Elastic shares",
    derives them.
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

    m, n, _ = elastic.shape
    unknowns = 1 + 2 * n
    scaled, constant = np.zeros((m, n, 3)), np.zeros((m, n, 3))
    scaled[..., 1:] = -elastic / limits[:, None]
    constant[..., 0], constant[..., 1:] = 1.0, steady / limits[:, None]
    of_asperities = sparse.kron(sparse.diags_array(-1.0 / limits), np.eye(3, 2, -1))
    balance = sparse.kron(np.ones((1, n)), np.eye(2))
    rests = sparse.kron(np.ones((m, 1)), of_asperities)
    rows: list[list[Any]] = [[None, balance], [scaled.reshape(-1, 1), rests]]
    return ConeProgram(
        quadratic=sparse.csc_matrix((unknowns, unknowns)),
        linear=np.append(-1.0, np.zeros(2 * n)),
        constraints=sparse.csc_matrix(sparse.block_array(rows)),
        constant=np.append(np.zeros(2), constant.reshape(-1)),
        equalities=2,
    )


def _inwards(limits: Array, state: Array, mean: Array) -> Array:
    """(n, 2) residual forces: `state`, corrected to the sum `mean` and moved away from the limits.

    limits : (n,) the friction limits P
    """
    parts = limits[:, None] / limits.sum()
    state = state + parts * (mean - state.sum(axis=0))
    return np.asarray(state + MARGIN * (parts * mean - state))


def _lower(
    known: FrictionProblem, rest: Array, mean: Array, elastic: Array, errors: Array
) -> float:
    """A lower bound on the largest lambda, from residual forces `rest`; 0 without a proof.

    elastic, errors : (m, n, 2) elastic forces at t_v, and (m, n) bounds on their errors
    """
    missing = float(np.hypot(*(rest.sum(axis=0) - mean)))
    missing += 4 * len(rest) * ROUNDOFF * float(np.abs(rest).sum())
    limits = (known.loads - known.errors - missing) * (1 - SAFETY)
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
    """The least and the largest lambda with |fixed + lambda scaled| <= limits; (inf, 0) if none.

    fixed, scaled, limits : (n, 2), (m, n, 2) and (n,)
    """
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
    """(m, n, 2) the slips as whole numbers, with the same sum over m for all asperities."""
    largest = float(np.abs(slips).max())
    if not largest > 0:
        raise SolverError("the solver found no slips", solver="shakedown")
    slips = np.round(slips * (STEPS / largest))
    net = slips.sum(axis=0)
    together = np.round(net.mean(axis=0))
    most = np.hypot(slips[..., 0], slips[..., 1]).argmax(axis=0)
    slips[most, np.arange(slips.shape[1])] += together - net
    return np.asarray(slips)


def _upper(
    known: FrictionProblem, slips: Array, mean: Array, elastic: Array, errors: Array
) -> float:
    """The upper bound (3) on lambda, from slips; infinite if the work of the slips may be <= 0.

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
    cost = float((sizes * (known.loads + known.errors)).sum()) * (1 + SAFETY)
    cost += -float(given.sum()) + 4 * ROUNDOFF * float(np.abs(given).sum())
    return cost / work * (1 + SAFETY) if work > 0 else np.inf
