"""The approach under a prescribed load, to the digits of the loads: docs/theory/prescribed-load.md.

For loads whose residual is e_i + beta, beta the unknown error of D0, and any weights mu >= 0 on
asperities that touch in both states,

    |beta| sum mu  <=  |sum mu e| + |sum v| + sum_j |v_j| |(M mu)_j - 1|,     M = diag(h) + A.

The better mu solves M mu = 1, the less is left of beta.
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Array
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.normal.residual import Fit
from convexrough.normal.sup_norm import SupNorm
from convexrough.roundoff import ROUNDOFF, SAFETY

#: What conjugate gradients may leave of M mu = 1. Heuristic: what is left is part of the bound.
LEFT = 1e-4


def riding_weights(problem: NormalProblem, loads: Array) -> Array:
    """(n,) mu, about what the loads gain as D0 does: M mu = 1 where they touch, else 0."""
    slopes = 1.0 / problem.stiffness(loads)
    try:
        change = correct(
            problem.influence,
            problem.shells,
            np.sqrt(slopes),
            np.full(len(loads), -1.0),
            balanced=False,
            tolerance=LEFT,
        )
    except SolverError:  # hopelessly crowded: any weights will do, and prove little
        return slopes
    weights = slopes * np.maximum(change, 0.0)
    return weights if weights.any() else slopes


def approach_error(
    problem: NormalProblem, loads: Array, errors: Array, fit: Fit, weights: Array, sup: SupNorm
) -> float:
    """Bound on |beta|; infinite where the weights are not good enough.

    errors : (n,) bounds on the loads, with which sup.stiffness holds
    """
    assert problem.load is not None
    sure = loads > errors
    mu = np.where(sure, weights, 0.0)
    total = float(mu.sum())
    if not total > 0:
        return np.inf
    stiffest = np.where(sure, problem.stiffness(np.where(sure, loads - errors, 1.0)), 0.0)
    own = np.where(sure, sup.stiffness, 0.0) * mu
    coupled = problem.influence.apply(mu)
    off = np.abs(own + coupled - 1.0) + (stiffest * mu - own)
    off += problem.influence.rounding(mu).of(coupled) + 8 * ROUNDOFF * (own + np.abs(coupled) + 1.0)
    left = sup.growth * float((off / sup.stiffness).sum()) / total * (1 + SAFETY)
    if not left < 1:
        return np.inf
    rounding = fit.rounding + min(fit.component, fit.remainder * float(np.linalg.norm(mu)) / total)
    mean = abs(float(mu @ fit.gap)) + float(mu @ rounding) + problem.missing(loads)
    mean += len(loads) * ROUNDOFF * float(mu @ np.abs(fit.gap))
    largest = float(fit.residual.max()) + fit.component
    return (mean / total + left * largest) / (1.0 - left) * (1 + SAFETY)
