"""Proved bounds on the errors of a vector friction state.

docs/theory/vector-friction.md, "What is proved of a state" and "Close to gross sliding", derive the
steps 1 to 6 that comments name. Symbols, in scaled units: q are the shear forces (in code,
`increments`), eta the sums of deflection and slip, T the total force, X the rigid displacement, P
the loads, k the thresholds of |eta| at which asperities slide, and B the kernel. A star marks the
exact state for the true loads, which are known as balls.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball, quietly
from convexrough.arrays import Array
from convexrough.convex.theorem import distance
from convexrough.roundoff import AT_THE_END, ROUNDOFF, SAFETY, SUM_ROUNDOFFS
from convexrough.vector_shear.problem import FrictionProblem, VectorState, along, slopes

#: Number of radii r tried in step 2, and the ratio of each to the one before. Heuristics.
TRIALS, WIDER = 24, 1.5

#: A bound on the rounding of a unit vector, and of |eta| / k.
ROUNDED = 8 * ROUNDOFF


class VectorBounds(NamedTuple):
    """Proved bounds on the errors of a state, in scaled units; infinite without a proof."""

    proved: bool  # False if nothing is proved
    increments: Array  # (n,) bounds on |q - q*|
    slips: Array  # (n,) bounds on |slip - slip*|
    displacement_error: float  # bound on |X - X*|
    sliding: NDArray[np.bool_]  # (n,) True where the asperity is proved to slide
    partial: NDArray[np.bool_]  # (n,) True where it is proved not to slide
    excess: float = np.inf  # bound on the energy minus the least energy

    @classmethod
    def unproved(cls, n: int) -> VectorBounds:
        """The bounds for n asperities without any proof."""
        unknown, no = np.full(n, np.inf), np.zeros(n, dtype=bool)
        return cls(False, unknown, unknown, np.inf, no, no)


@quietly
def certify_vectors(problem: FrictionProblem, state: VectorState, total: Ball) -> VectorBounds:
    """Bounds on the errors of a state from any source; `total` is T (2,) as a ball."""
    found = VectorBounds.unproved(len(problem))
    if problem.scope == "none" or not problem.sure.any():
        return found
    if np.isfinite(state.displacement).all() and problem.margin > 0:
        found = _by_convexity(problem, state, total)
    if not (found.sliding | found.partial).all():
        other = _by_exhaustion(problem, state, total)
        found = VectorBounds(
            found.proved or other.proved,
            np.fmin(found.increments, other.increments),
            np.fmin(found.slips, other.slips),
            min(found.displacement_error, other.displacement_error),
            found.sliding | other.sliding,
            found.partial | other.partial,
        )
    return found._replace(excess=_excess(problem, state, total, found.increments))


def _by_convexity(problem: FrictionProblem, state: VectorState, total: Ball) -> VectorBounds:
    sure, stiffness, reach = problem.sure, problem.stiffness, problem.reach
    limits, thresholds = problem.load_balls, problem.threshold_balls

    # 1. The trial, its imbalance, and the error of its total.
    eta = state.displacement - problem.couple(state.increments)
    q = _forces(eta, limits, thresholds)
    forces, force_errors = q.value.T, np.hypot(*q.error)
    imbalance = (Ball.exact(eta) + problem.couple(forces) - state.displacement).size
    off = np.hypot(*imbalance.T)
    off += problem.product_error * (problem.influence.matrix @ np.hypot(*forces.T))
    off = (off + reach @ force_errors + problem.stray_effect * (1.0 + problem.bias)) * (1 + SAFETY)
    missing = float(np.hypot(*(q.sum() - total).size)) + problem.stray

    # 2. The shift that restores the total.
    size = np.hypot(*eta.T)
    shift = _shift(problem, eta, np.zeros(len(eta)), missing)
    if shift == np.inf:
        return VectorBounds.unproved(len(eta))
    moved = _steepest(problem, size - shift) * shift

    # 3. and 4. The residual, and the theorem.
    residual = np.where(sure, off + reach @ moved, 0.0)
    within = distance(residual, 1.0 / stiffness, problem.margin)
    distances = within * np.sqrt(stiffness) + moved

    # 5. The displacement.
    coupled = within * np.sqrt(reach**2 @ np.where(sure, stiffness, 0.0)) + reach @ moved
    turned = (off + coupled) * (1 + SAFETY)
    carried = float(np.where(sure, _steepest(problem, size - turned) * turned, 0.0).sum())
    displacement_error = _shift(problem, eta, turned, (missing + carried) * (1 + SAFETY))

    # 6. Statuses, and bounds for the given state.
    uncertainty = (turned + displacement_error) * (1 + SAFETY) + ROUNDED * size
    nearer = np.fmin(distances, _steepest(problem, size - uncertainty) * uncertainty)
    distances = nearer * (1 + SAFETY)
    sliding = sure & (size - uncertainty > thresholds.upper)
    bears_more = np.hypot(*forces.T) * (1 + ROUNDED) + force_errors + distances < limits.lower
    partial = sure & ((size + uncertainty < thresholds.lower) | bears_more)
    increments = distances + force_errors + np.hypot(*(forces - state.increments).T) * (1 + SAFETY)
    increments = np.where(sure, increments, problem.most + np.hypot(*state.increments.T))
    # A slip is eta minus its projection onto the disc |eta| <= k. It changes by at most the changes
    # of eta and k.
    slips = along(np.maximum(size - thresholds.value, 0.0), eta, size)
    slip_errors = np.hypot(*(slips - state.slips).T) + uncertainty + thresholds.error
    slip_errors = np.where(partial, np.hypot(*state.slips.T), np.where(sure, slip_errors, np.inf))
    proved = bool(np.isfinite(displacement_error))
    return VectorBounds(proved, increments, slip_errors, displacement_error, sliding, partial)


def _forces(eta: Array, limits: Ball, thresholds: Ball) -> Ball:
    """(2, n) q(eta): P/k [1 + z / (1 + z^(1/2))] eta if z = 1 - |eta|/k >= 0, else P eta/|eta|."""
    exact = Ball.exact(np.ascontiguousarray(eta.T))
    squares = exact * exact
    share = (squares[0] + squares[1]).sqrt() / thresholds
    left, beyond = (1.0 - share).positive_part(), (share - 1.0).positive_part()
    return exact * (limits / thresholds * (1.0 + left / (1.0 + left.sqrt())) / (1.0 + beyond))


def _steepest(problem: FrictionProblem, size: Array) -> Array:
    """(n,) upper bounds on the slopes of q where |eta| is at least `size`."""
    share = np.fmax(size, 0.0) / problem.threshold_balls.upper * (1.0 - ROUNDED)
    _, across = slopes(problem.load_balls.upper / problem.threshold_balls.lower, share)
    return np.asarray(np.where(problem.sure, across * (1 + SAFETY), 0.0))


def _shift(problem: FrictionProblem, eta: Array, turned: Array, missing: float) -> float:
    """The r of step 2, or infinity: some vector of at most this length, added to all eta, restores
    the total, which the forces miss by at most `missing`. Each eta_i may also change by up to
    `turned` (n,)."""
    size = np.hypot(*eta.T)
    if not np.isfinite(turned).all() or not missing < np.inf:
        return np.inf
    scale = problem.load_balls.lower / problem.threshold_balls.upper
    direction = along(np.ones(len(size)), eta, size)

    def least_slope(reached: Array) -> float:
        share = (size + reached) / problem.threshold_balls.lower * (1.0 + ROUNDED)
        radial, across = np.where(problem.sure, slopes(scale, share), 0.0)
        extra = across - radial
        angle = np.minimum(reached / np.maximum(size, 1e-300), 1.0) + ROUNDED
        _, axes = np.linalg.eigh((direction * extra[:, None]).T @ direction)
        sines, cosines = (direction @ axes).T
        least = float(extra @ sines**2 - abs(extra @ (sines * cosines)))
        root = np.sqrt(max(least, 0.0)) - np.sqrt(float(extra @ angle**2))
        return float(radial.sum() + max(root, 0.0) ** 2) * (1 - SAFETY)

    slope = least_slope(turned)
    if not slope > 0:
        return np.inf
    radius = missing / slope * (1 + 1e-9)
    enough = missing * (1 + SAFETY)
    for _ in range(TRIALS):
        if not np.isfinite(radius) or radius * least_slope(turned + radius) > enough:
            return radius
        radius = radius * WIDER + 1e-300
    return np.inf


def _excess(problem: FrictionProblem, state: VectorState, total: Ball, errors: Array) -> float:
    """Bound on E(q) - E(q*) for the energy E; infinite if X is, or if E is not proved convex.

    It is the sum of e_i |q_i - q*_i|, for `errors` (n,) that bound |q - q*|, plus a term for the
    error of the total and, for the rounding of |q_i| = P_i, the sum of slip times P_i - |q_i|; it
    also holds for forces q converted to the scene's units. It holds if |q_i| <= P_i up to rounding.
    e_i is the distance of X - (B q)_i from the deflection of q_i or, where |q_i| = P_i, from the
    ray of all eta with this force.
    """
    q, X = state.increments, state.displacement
    if not np.isfinite(X).all() or problem.margin == 0.0:
        return np.inf
    size = problem.sizes(q)
    eta, own = X - problem.couple(q), problem.deflections(size)
    length = np.hypot(*q.T)
    along_q = (eta * along(np.ones(len(q)), q, length)).sum(axis=1)
    nearest = np.where(size < problem.loads, own, np.maximum(along_q, own))
    off = np.hypot(*(eta - along(nearest, q, length)).T)
    # Near |q| = P one roundoff of |q| changes the deflection by many roundoffs.
    steep = problem.deflections(np.minimum(size * (1 + ROUNDED), problem.loads)) - own
    sums = own + problem.influence.matrix @ size + float(np.hypot(*X))
    off = off + steep + (SUM_ROUNDOFFS * ROUNDOFF + problem.product_error) * sums
    moved = np.fmin(errors, length + problem.most)
    lacking = np.abs(problem.loads - length) + 4 * ROUNDOFF * problem.loads
    short = (Ball.exact(np.ascontiguousarray(q.T)).sum() - total) * X
    converted = 4 * ROUNDOFF * (size @ np.hypot(*(along(own, q, length) + X - eta).T))
    wrong = off @ moved + (nearest - own) @ lacking + short.size.sum() + converted
    return float(wrong) * (1 + SAFETY)


def _by_exhaustion(problem: FrictionProblem, state: VectorState, total: Ball) -> VectorBounds:
    """The bounds near gross sliding: docs/theory/vector-friction.md, "Close to gross sliding".

    t is the unit vector along T, and the sum of P_i - q_i.t is at most `unused`.
    """
    sure, reach, unproved = problem.sure, problem.reach, VectorBounds.unproved(len(problem))
    P, thresholds = np.where(sure, problem.loads, 0.0), problem.threshold_balls
    size = float(np.hypot(*total.value))
    if size == 0.0:
        return unproved
    t = total.value / size
    left = problem.load_balls.sum() - total.dot(total).sqrt()
    unused = max(float(left.upper), 0.0) + problem.stray
    most = np.where(sure, problem.most, 0.0)
    turned = np.minimum(np.sqrt(2.0 * most * unused), 2.0 * most)
    errors = np.where(sure, problem.errors, problem.most) + turned + 2 * ROUNDED * P
    errors = errors + np.hypot(*(state.increments - P[:, None] * t).T)

    # B q is within `uncertainty` of `coupled`, its value at q = P t.
    coupled, across = problem.couple(P[:, None] * t), np.array([-t[1], t[0]])
    uncertainty = reach @ np.where(sure, problem.errors, 0.0)
    uncertainty = uncertainty + np.sqrt(2.0 * unused * (reach**2 @ most))
    uncertainty += (1.0 + problem.bias) * problem.stray_effect
    uncertainty += (problem.product_error + 2 * ROUNDED) * (reach @ P)
    least = np.where(sure, problem.load_balls.lower, np.inf)
    missing = unused / least
    deflected = thresholds.lower * (1.0 - missing - missing ** (2 / 3) - ROUNDED)
    lowest = deflected + coupled @ t - uncertainty
    least_displacement = lowest.max(where=sure & (missing < 1), initial=-np.inf)  # bounds X.t
    highest = thresholds.upper + uncertainty  # bounds |X - coupled| where an asperity sticks
    pushed = least_displacement - coupled @ t > highest * (1 + SAFETY)
    # If i stuck, |X| would be so small that differences of B q across t turned the forces too far.
    weights, side = np.where(sure, least, 0.0), coupled @ across
    mean = float(weights @ side) / float(weights.sum())
    spread = np.sqrt(weights @ (side - mean) ** 2) - np.sqrt(weights @ uncertainty**2)
    longest = highest + float(np.hypot(*np.ptp(coupled, axis=0))) + float(uncertainty.max())
    sliding = sure & (pushed | (spread * (1 - SAFETY) > np.sqrt(2.0 * unused) * longest))
    complete = problem.stray == 0 and bool(sure.all())
    proved = bool(sliding.any()) or complete
    # If the bias is 0, all forces are along t. So below the friction limit not all asperities
    # slide, and if all but one slide, that one sticks.
    straight = problem.bias == 0.0 and problem.margin > 0 and unused < float(least.min())
    below = float(left.lower) > AT_THE_END * ROUNDOFF * size
    last = complete and straight and below and int(sliding.sum()) == len(P) - 1
    partial = ~sliding & last
    return unproved._replace(proved=proved, increments=errors, sliding=sliding, partial=partial)
