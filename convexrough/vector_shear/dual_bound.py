"""A lower bound on the energy of vector friction that trusts no solver.

docs/theory/friction-cones.md, "The least energy from below", and "Rounding" there.
"""

from __future__ import annotations

import math

import numpy as np

from convexrough.arrays import Array
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.sphere import mindlin
from convexrough.vector_shear.problem import VectorProblem, VectorState, along


def duality_gap(problem: VectorProblem, state: VectorState) -> float:
    """Upper bound on the energy of the forces above the least, from q and X alone.

    With M = B + shift, semidefinite, and h_i(q) = the local energy - shift |q|^2 / 2, convex,

        least energy >= X'T - q'Mq / 2 + sum_i min over |x| <= P_i of [h_i(x) + (M q - X)_i x],

    and the energy less that is a sum of terms that are not negative. Infinite where a share
    of the shift exceeds 1, or X is. docs/theory/friction-cones.md,
    "The least energy from below", and "Rounding" there.
    """
    shares = problem.shift.shares + problem.slack
    if shares.max() > 1 or not np.isfinite(state.rise).all():
        return np.inf
    q, X, shift = state.increments, state.rise, shares * problem.stiffness
    size, coupling = np.hypot(*q.T), problem.couple(q)
    pull = X - coupling - shift[:, None] * q  # X - M q
    slope = np.hypot(*pull.T)
    best = _best_sizes(problem, slope, shares)
    terms = _convex_part(problem, size, shift) - (pull * q).sum(axis=1)
    terms = terms - _convex_part(problem, best, shift) + slope * best

    # What pulls are off by moves the best forces, and both move the terms.
    P = problem.scalar.loads
    sums = problem.scalar.influence.matrix @ size + shift * size + float(np.hypot(*X))
    off = problem.product_error * sums + _slope_defect(problem, best, slope, shift)
    curvature = problem.stiffness - shift
    moved = np.divide(off, curvature, out=np.full(len(P), np.inf), where=curvature > 0)
    apart = np.hypot(*(along(best, pull, slope) - q).T)
    rounding = off * np.minimum(apart + moved, 2.0 * np.maximum(P, size))
    largest = np.maximum(size, best)
    own = problem.scalar.deflections(np.minimum(largest, P))
    rounding += 64 * ROUNDOFF * largest * (own + shift * largest + slope)
    short = [math.fsum((*column, -part)) for column, part in zip(q.T, state.total, strict=True)]
    missing = abs(float(X @ short)) + 8 * ROUNDOFF * float(np.abs(X) @ np.abs(state.total))
    missing += 4 * ROUNDOFF * float(np.abs(X) @ np.abs(short))
    return (float((np.maximum(terms, 0.0) + rounding).sum()) + missing) * (1 + SAFETY)


def _slope_defect(problem: VectorProblem, sizes: Array, slope: Array, shift: Array) -> Array:
    """(n,) how far the slopes of h_i at these sizes are from those asked for, with rounding."""
    x = mindlin.deflection(sizes / problem.scalar.loads)
    own, P = problem.scalar.ceilings * x, problem.scalar.loads
    found = own - shift * sizes
    asked = np.where(sizes < P, slope, np.minimum(slope, found))
    # One roundoff of a size near P changes the deflection by far more than one.
    steep = problem.scalar.deflections(np.minimum(sizes * (1 + 8 * ROUNDOFF), P)) - own
    loss = np.abs(found - asked) + steep
    return np.asarray(loss + 16 * ROUNDOFF * (own + shift * sizes + slope))


def _convex_part(problem: VectorProblem, sizes: Array, shift: Array) -> Array:
    """(n,) h_i of forces of these sizes: the local energy less shift |q|^2 / 2."""
    P, ceilings = problem.scalar.loads, problem.scalar.ceilings
    return np.asarray(P * ceilings * mindlin.potential(sizes / P) - shift * sizes**2 / 2.0)


def _best_sizes(problem: VectorProblem, slope: Array, shares: Array) -> Array:
    """(n,) the size |q| <= P_i at which h_i(q) - slope_i |q| is least.

    With x = deflection(|q| / P) that is where  ceiling [x - (2/3) S force(x)] = slope, or 1: a
    convex, growing function of x, so Newton's method runs down to it from its tangent at 0.
    docs/theory/friction-cones.md, "The least energy from below".
    """
    ceilings = problem.scalar.ceilings
    slope = np.minimum(slope, ceilings * (1.0 - 2.0 / 3.0 * shares))
    x = np.minimum(slope / (ceilings * np.maximum(1.0 - shares, 1e-300)), 1.0)
    for _ in range(60):
        value = ceilings * (x - 2.0 / 3.0 * shares * mindlin.force(x)) - slope
        rate = ceilings * (1.0 - shares * np.sqrt(1.0 - x))
        step = np.where(rate > 0, value / np.where(rate > 0, rate, 1.0), 0.0)
        x = np.clip(x - step, 0.0, 1.0)
        if (np.abs(step) <= 1e-15 * x).all():
            break
    best: Array = problem.scalar.loads * mindlin.force(x)
    return best
