"""Melan's theorem at constant normal load, for asperities that stick until they slide.

With elastic shares q_i(v) of the vertices v of a path, q0_i of its mean, in units of f,

    maximise lambda  with  |q0_i + lambda q_i(v) + rho_i| <= P_i  for all i and v,  sum rho_i = 0,

and by slips s_iv with sum_v s_iv the same for all i, any lambda is at most

    [sum P_i |s_iv| - sum s_iv . q0_i] / sum s_iv . q_i(v).

Both are evaluated here for what a solver found, so it need not be trusted:
docs/theory/load-paths.md, "Melan's program".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.errors import SolverError
from convexrough.roundoff import SAFETY
from convexrough.shearing.problem import TangentialProblem
from convexrough.solvers.programs import ConeProgram, run_clarabel
from convexrough.vector_shear.problem import VectorProblem

#: What the solver is asked for, and how far its state is moved towards one that is surely safe.
TOLERANCE, MARGIN = 1e-10, 1e-9


class Melan(NamedTuple):
    """Bounds on lambda, the residual state [force over f] and the slips of each vertex."""

    lower: float
    upper: float
    gross: float
    residual: Array  # (n, 2)
    slips: Array  # (m, n, 2)


def elastic_shares(contact: Contact) -> Array:
    """(n,) of a vanishing shear force, all sticking, with the scalar kernel."""
    problem = TangentialProblem.of(contact)
    shares: Array = problem.to_scene(problem.elastic)
    return shares


def solve(contact: Contact, mean: Array, vertices: Array) -> Melan:
    """The program with the full tangential kernel; mean (2,) and vertices (m, 2) are Q / f."""
    problem = VectorProblem.of(contact)
    scalar, n = problem.scalar, len(problem)
    unit = scalar.units.force
    limits = scalar.loads
    shares = _shares(problem)  # (n, 2, 2)
    elastic = np.einsum("ijk,vk->vij", shares, vertices / unit)  # (m, n, 2)
    steady = shares @ (mean / unit)  # (n, 2)
    checks.fits_in_memory("cones", len(vertices) * n, 4000.0)
    raw = run_clarabel(_program(limits, steady, elastic), "shakedown", TOLERANCE)
    rest = raw.x[1:].reshape(n, 2)
    cones = raw.multipliers[2:].reshape(len(vertices), n, 3)
    slips = -cones[..., 1:] / limits[:, None]
    lower, rest = _lower(limits, steady, elastic, shares, rest, mean / unit)
    upper, slips = _upper(limits, steady, elastic, slips)
    errors = contact.certificate.load_errors[scalar.touching] / contact.loads[scalar.touching]
    doubt = float(errors.max()) + SAFETY
    residual = np.zeros((len(contact.scene), 2))
    residual[scalar.touching] = rest * unit
    everywhere = np.zeros((len(vertices), len(contact.scene), 2))
    everywhere[:, scalar.touching] = slips
    total = contact.load
    whole = np.broadcast_to(mean, vertices.shape)
    gross = float(_largest(whole, vertices, np.full(len(vertices), total))[1])
    return Melan(lower * (1 - doubt), upper * (1 + doubt), gross, residual, everywhere)


def _shares(problem: VectorProblem) -> Array:
    """(n, 2, 2) Y_i: forces q_i = Y_i Q under which all asperities move together, unslipped."""
    n = len(problem)
    stiffness = problem.kernel + np.diag(np.repeat(problem.stiffness, 2))
    together = np.tile(np.eye(2), (n, 1))
    moved = np.linalg.solve(stiffness, together)
    return np.asarray((moved @ np.linalg.inv(together.T @ moved)).reshape(n, 2, 2))


def _program(limits: Array, steady: Array, elastic: Array) -> ConeProgram:
    """Unknowns lambda and rho; cones scaled by P_i."""
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


def _lower(
    limits: Array, steady: Array, elastic: Array, shares: Array, rest: Array, mean: Array
) -> tuple[float, Array]:
    """The largest lambda that the state admits, once it balances and is moved a little inwards."""
    rest = rest - shares @ rest.sum(axis=0)
    safe = limits[:, None] / limits.sum() * mean - steady
    rest = rest + MARGIN * (safe - rest)
    whole = np.broadcast_to(steady + rest, elastic.shape)
    least, most = _largest(whole, elastic, np.broadcast_to(limits, elastic.shape[:-1]))
    if not max(least, 0.0) <= most:
        raise SolverError("the residual state is outside friction", solver="shakedown")
    return most, rest


def _largest(fixed: Array, scaled: Array, limits: Array) -> tuple[float, float]:
    """The least and largest lambda with |fixed + lambda scaled| <= limit everywhere."""
    a = (scaled**2).sum(axis=-1)
    b = (fixed * scaled).sum(axis=-1)
    c = (fixed**2).sum(axis=-1) - limits**2
    moving = a > 0
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0)[moving])
    if (b**2 < a * c)[moving].any() or (c[~moving] > 0).any():
        return np.inf, 0.0
    a, b = a[moving], b[moving]
    return float(((-b - root) / a).max()), float(((-b + root) / a).min())


def _upper(limits: Array, steady: Array, elastic: Array, slips: Array) -> tuple[float, Array]:
    """The bound of the slips, made to close and scaled to unit work."""
    net = slips.sum(axis=0)
    together = net.mean(axis=0)
    slips = slips.copy()
    largest = np.hypot(slips[..., 0], slips[..., 1]).argmax(axis=0)
    everyone = np.arange(len(limits))
    slips[largest, everyone] += together - net
    work = float((slips * elastic).sum())
    if not work > 0:
        raise SolverError("the slips do no work", solver="shakedown")
    slips /= work
    sizes = np.hypot(slips[..., 0], slips[..., 1])
    return float((sizes * limits).sum() - (slips * steady).sum()), slips
