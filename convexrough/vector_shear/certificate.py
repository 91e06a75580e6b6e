"""Judge vector friction states: bounds on forces and slips, and which asperities slide.

The argument is that of `convexrough.shearing.certificate`, for vectors. The local energy is radial
and its Hessian at least h_i I, so on the true loads P* the energy is strictly convex with
H = diag(h_i I), and for a state q with the residual e

    || q - q* ||_H  <=  || e ||_{H^-1} / margin,    margin I <= I + H^-1/2 B H^-1/2,

where a Cholesky factorisation proves the margin. The residual of an asperity that uses all its
friction is what the displacement left to it, X - (B q)_i, is off the ray from the ceiling along
q_i. The pressed loads P are known to their certified bounds b: a state is carried over to the true
loads at equal q_i / P_i, its total mended where asperities stick, and both enter the residual.

Nothing is proved where no asperity is sure to stick, close to gross sliding, and all words there
are "undecided"; except at |Q| = f P itself, where |Q_i| <= f P_i leaves one state.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.convex.definite import proved_margin
from convexrough.normal.judgement import SUM_ROUNDOFFS
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.certificate import Bounds, Known
from convexrough.vector_shear.problem import VectorProblem, VectorState, along

#: Margins of convexity tried, the best first.
MARGINS = (0.6, 0.3, 0.1, 1e-2, 1e-3)


def judge_vectors(
    problem: VectorProblem, contact: Contact, state: VectorState, *, gross: bool
) -> Bounds:
    """Bounds on one state of a contact, whose loads are known to its certificate; m = 1.

    gross : |Q| = f P
    """
    if contact.certificate.scope == "none":
        return _nothing(len(problem))
    known = Known.of(problem.scalar, contact)
    if gross:
        return _at_limit(problem, known, state)
    if known.stray > 0:  # an asperity may touch that the problem leaves out
        return _nothing(len(problem))
    margin = _margin(problem, known)
    if margin == 0.0:
        return _nothing(len(problem))
    P, ceilings = problem.scalar.loads, problem.scalar.ceilings
    A = problem.scalar.influence
    reach = A.matrix * (1.0 + problem.bias)  # |B_ij v| <= reach_ij |v|
    h = np.where(known.sure, 2.0 / 3.0 * ceilings / (P + known.errors), np.inf)

    # The same state through the normal map: it tells sliding from sticking.
    q = problem.local_forces(state.rise - problem.couple(state.increments))
    size = problem.sizes(q)
    local = problem.scalar.deflections(size)
    coupling = problem.couple(q)

    # The image on the true loads misses the total; a shift of eta where it sticks mends that.
    moved = known.moved(P, size) + 16 * ROUNDOFF * size
    missing = moved.sum() + float(np.hypot(*(q.sum(axis=0) - state.total)))
    missing += len(P) * ROUNDOFF * float(size.sum()) + 4 * ROUNDOFF * float(np.hypot(*state.total))
    sticking = known.sure & (size < P)
    slopes = np.where(sticking, problem.scalar.slopes(local), 0.0)
    if slopes.sum() == 0:
        return _nothing(len(problem))
    mended = missing * slopes / slopes.sum()
    if not (~sticking | (mended < 0.5 * (P - size))).all():
        return _nothing(len(problem))

    # The residual of the mended image on the true loads, with rounding. Along a segment the local
    # Hessian is at most the slope of the deflection at the larger end: `bent` bounds its change.
    asked = state.rise - coupling
    far = float(np.hypot(*state.rise))
    unsure = (SUM_ROUNDOFFS * ROUNDOFF + problem.product_error) * (local + reach @ size + far)
    unsure += reach @ (moved + mended) + local * known.relative
    bent = _bent(problem, size, local, mended)
    along_q = (asked * along(np.ones(len(P)), q, np.hypot(*q.T))).sum(axis=1)
    taken = np.where(size < P, local, np.maximum(along_q, ceilings))
    off_ray = np.hypot(*(asked - along(taken, q, np.hypot(*q.T))).T)
    residual = np.where(known.sure, off_ray + unsure + bent, 0.0)
    norm = float(np.sqrt((residual**2 / h).sum())) / margin * (1 + SAFETY)
    off = norm / np.sqrt(h) + mended  # from the image

    # The rise, known at every asperity sure to stick; and from it the slips.
    unsure += norm * np.sqrt(reach**2 @ (1.0 / h)) * (1 + SAFETY)
    held = known.sure & (off < 0.5 * (P - size))
    each = off_ray + unsure + _bent(problem, size, local, off)
    rise_error = float(each.min(where=held, initial=np.inf))
    slip_errors = unsure + rise_error + ceilings * known.relative
    left = np.hypot(*asked.T) - ceilings
    sliding = known.sure & (left > slip_errors)
    partial = known.sure & (held | (-left > slip_errors))
    # From the mapped state back to the one that is reported.
    increments = off + moved + np.hypot(*(q - state.increments).T)
    # What a vector has beyond a ball changes by no more than the vector does.
    mapped = along(np.maximum(left, 0.0), asked, np.hypot(*asked.T))
    slips = np.hypot(*(mapped - state.slips).T) + slip_errors
    slips = np.where(partial, np.hypot(*state.slips.T), slips)
    return Bounds(
        proved=np.array([np.isfinite(rise_error)]),
        increments=increments[None],
        slips=np.where(known.sure, slips, np.inf)[None],
        rises=np.array([rise_error]),
        sliding=sliding[None],
        partial=partial[None],
    )


def _bent(problem: VectorProblem, size: Array, local: Array, change: Array) -> Array:
    """How far the local deflection can turn or grow when the force changes by so much."""
    farther = np.minimum(size + change, problem.scalar.loads)
    bent: Array = 1.5 * (problem.scalar.deflections(farther) - local)  # 1.5: P* in place of P
    return bent


def _margin(problem: VectorProblem, known: Known) -> float:
    """A proved lower bound on the least eigenvalue of I + H^-1/2 B H^-1/2; 0 where none is found.

    With H on loads no smaller than the true ones, so that a little more is proved than is said.
    Asperities not sure to touch are not among the unknowns.
    """
    sure = known.sure
    h = np.where(sure, 2.0 / 3.0 * problem.scalar.ceilings, 1.0)
    h /= np.where(sure, problem.scalar.loads + known.errors, 1.0)
    root = np.repeat(np.where(sure, 1.0 / np.sqrt(h), 0.0), 2)
    scaled = problem.kernel * root * root[:, None]
    return proved_margin(scaled, MARGINS, problem.product_error + 8 * ROUNDOFF, spare=SAFETY)


def _at_limit(problem: VectorProblem, known: Known, state: VectorState) -> Bounds:
    """Gross sliding: every force is f P_i along the total, whatever the displacements."""
    n = len(problem)
    unknown = np.full(n, np.inf)
    errors = known.errors + 8 * ROUNDOFF * problem.scalar.loads
    return Bounds(
        proved=np.array([True]),
        increments=errors[None],
        slips=unknown[None],
        rises=np.array([np.inf]),
        sliding=known.sure[None],
        partial=np.zeros((1, n), dtype=bool),
    )


def _nothing(n: int) -> Bounds:
    unknown, no = np.full((1, n), np.inf), np.zeros((1, n), dtype=bool)
    proved: NDArray[np.bool_] = np.array([False])
    return Bounds(proved, unknown, unknown, np.array([np.inf]), no, no)
