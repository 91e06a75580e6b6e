"""Judge vector friction states: bounds on forces and slips, and which asperities slide.

The proof is that of docs/theory/friction-words.md, "Words that are proofs", step by step. Arrays
are (n,) or (n, 2). In the letters of that page, forces over f and displacements over c_t f:

    loads P, errors b, ceilings kappa     forces q = Q, rise X, kernel B = C
    stiffness h of H, margin mu           available X - C Q
    shifts tau                            own |u(Q)|, slips s
    residual e, distance || d ||_H        reach_ij |C_ij v| <= reach_ij |v|

Where no asperity is sure to stick, close to gross sliding and at |Q| = f P itself, forces are known
because |Q_i| <= f P_i leaves them little room: "Close to gross sliding" of that page.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.convex.definite import proved_margin
from convexrough.normal.residual import SUM_ROUNDOFFS
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.bounds import SHARE_ROUNDOFFS, Bounds
from convexrough.shearing.exhaustion import LIMIT_ROUNDOFFS
from convexrough.shearing.judgement import own_change
from convexrough.shearing.load_errors import MARGINS, LoadErrors
from convexrough.vector_shear.problem import VectorProblem, VectorState, along


def judge_vectors(problem: VectorProblem, state: VectorState, *, gross: bool) -> Bounds:
    """Bounds on one state of a contact, whose loads are known to its certificate; m = 1.

    gross : |Q| = f P
    """
    if problem.scalar.certificate.scope == "none":
        return Bounds.unproved(1, len(problem))
    known = LoadErrors.of(problem.scalar)
    margin = 0.0 if gross else margin_of(problem, known)
    bounds = None if gross else _by_convexity(problem, known, state, margin)
    return bounds or _by_exhaustion(problem, known, state, margin)


def _by_convexity(
    problem: VectorProblem, known: LoadErrors, state: VectorState, margin: float
) -> Bounds | None:
    """The steps of docs/theory/friction-words.md, "Words that are proofs"; None where they end.

    An asperity may touch that the problem leaves out, or the energy may not be convex, or no
    asperity is sure to stick.
    """
    if known.stray > 0 or margin == 0.0:
        return None
    given = _mapped(problem, known, state)
    image = _image(given)
    if image is None:
        return None
    residual = _residual(given, image)
    distance = _distance(given, residual, margin)
    bounds = _words(given, image, residual, distance)
    return bounds if bounds.proved[0] else None


class _Given(NamedTuple):
    """What the proof starts from: a state, and what the normal map makes of it (step 1).

    state : as given, of a total T and a rise X;  forces : (n, 2) q, mapped from X - B q of that
    sizes : (n,) lengths of `forces`;  own : (n,) their own deflections
    available : (n, 2) the displacement X - B q that `forces` leave to each asperity
    reach : (n, n) |B_ij v| <= reach_ij |v|
    """

    problem: VectorProblem
    known: LoadErrors
    state: VectorState
    forces: Array
    sizes: Array
    own: Array
    available: Array
    reach: Array


def _mapped(problem: VectorProblem, known: LoadErrors, state: VectorState) -> _Given:
    """Step 1: the same state through the normal map, which tells sliding from sticking."""
    q = problem.local_forces(state.rise - problem.couple(state.increments))
    sizes = problem.sizes(q)
    own = problem.scalar.deflections(sizes)
    reach = problem.scalar.influence.matrix * (1.0 + problem.bias)
    return _Given(problem, known, state, q, sizes, own, state.rise - problem.couple(q), reach)


class _Image(NamedTuple):
    """The state carried over to the true loads, q P* / P + tau: step 2.

    carried : (n,) bounds on how far q is from that without tau;  shifts : (n,) bounds on |tau|
    """

    carried: Array
    shifts: Array


def _image(given: _Given) -> _Image | None:
    """Step 2: q P* / P misses the total by `missing`, and tau restores it where asperities stick.

    The shifts are in proportion to the slopes of the scalar law. None where |tau_i| is not below
    (P_i - |q_i|) / 2, or where none is sure to stick.
    """
    problem, known, state, q, sizes, own, *_ = given
    P, total = problem.scalar.loads, state.total
    carried = known.image_distances(P, sizes) + 16 * ROUNDOFF * sizes
    missing = carried.sum() + float(np.hypot(*(q.sum(axis=0) - total)))
    missing += len(P) * ROUNDOFF * float(sizes.sum()) + 4 * ROUNDOFF * float(np.hypot(*total))
    sticking = known.sure & (sizes < P)
    slopes = np.where(sticking, problem.scalar.slopes(own), 0.0)
    if slopes.sum() == 0:
        return None
    shifts = missing * slopes / slopes.sum()
    room = (~sticking | (shifts < 0.5 * (P - sizes))).all()
    return _Image(carried, shifts) if room else None


class _Residual(NamedTuple):
    """How far the law is from holding: step 3.

    mapped : (n,) for the mapped state on the computed loads
    uncertainty : (n,) rounding of that, and what the true loads and tau change besides
    values : (n,) bounds on |e| for the image on the true loads, 0 where not sure
    """

    mapped: Array
    uncertainty: Array
    values: Array


def _residual(given: _Given, image: _Image) -> _Residual:
    """Step 3: e is how far X - B q is off the own deflection, or off the ray from it if it slides.

    With rounding, and with what true loads and shifts change: a ceiling by at most b / P of itself.
    """
    problem, known, state, q, sizes, own, available, reach = given
    length = np.hypot(*q.T)
    along_q = (available * along(np.ones(len(q)), q, length)).sum(axis=1)
    beyond = np.maximum(along_q, problem.scalar.ceilings)
    nearest = np.where(sizes < problem.scalar.loads, own, beyond)
    mapped = np.hypot(*(available - along(nearest, q, length)).T)
    sums = own + reach @ sizes + float(np.hypot(*state.rise))
    uncertainty = (SUM_ROUNDOFFS * ROUNDOFF + problem.product_error) * sums
    uncertainty += reach @ (image.carried + image.shifts) + own * known.relative
    change = own_change(problem.scalar, sizes, own, image.shifts + _blur(sizes))
    values = np.where(known.sure, mapped + uncertainty + change, 0.0)
    return _Residual(mapped, uncertainty, values)


def _blur(sizes: Array) -> Array:
    """What rounding of a share |q| / P can be read as: near full slip the law is steep."""
    return SHARE_ROUNDOFFS * ROUNDOFF * sizes


def _distance(given: _Given, residual: _Residual, margin: float) -> float:
    """Step 4: || d ||_H <= || e ||_{H^-1} / mu, d from the image to the solution."""
    norm = float(np.sqrt((residual.values**2 / given.known.stiffness).sum()))
    return norm / margin * (1 + SAFETY)


def _words(given: _Given, image: _Image, residual: _Residual, distance: float) -> Bounds:
    """Steps 5 and 6: the rise, known at every asperity sure to stick; the slips; and who slides.

    |X - X*| <= |e| + the change of the own deflection + |B (q - q*)|, the least of those that
    stick; i slides if |X - B q| - ceiling exceeds its error.
    """
    problem, known, state, q, sizes, own, available, reach = given
    h, ceilings = known.stiffness, problem.scalar.ceilings
    distances = distance / np.sqrt(h) + image.shifts  # q* from q P* / P
    coupled = distance * np.sqrt(reach**2 @ (1.0 / h)) * (1 + SAFETY)
    uncertainty = residual.uncertainty + coupled
    sticks = known.sure & (distances < 0.5 * (problem.scalar.loads - sizes))
    change = own_change(problem.scalar, sizes, own, distances + _blur(sizes))
    at_each = residual.mapped + uncertainty + change
    rise_error = float(at_each.min(where=sticks, initial=np.inf))
    slip_errors = uncertainty + rise_error + ceilings * known.relative
    length = np.hypot(*available.T)
    beyond = length - ceilings
    sliding = known.sure & (beyond > slip_errors)
    partial = known.sure & (sticks | (-beyond > slip_errors))
    # From the mapped state back to the one that is given.
    increments = distances + image.carried + np.hypot(*(q - state.increments).T)
    # What a vector has beyond a ball changes by no more than the vector does.
    slips = along(np.maximum(beyond, 0.0), available, length)
    errors = np.hypot(*(slips - state.slips).T) + slip_errors
    errors = np.where(partial, np.hypot(*state.slips.T), errors)
    return Bounds(
        proved=np.array([np.isfinite(rise_error)]),
        increments=increments[None],
        slips=np.where(known.sure, errors, np.inf)[None],
        rises=np.array([rise_error]),
        sliding=sliding[None],
        partial=partial[None],
        losses=np.array([np.inf]),  # vectors turn: no cycle is made of them
    )


def _by_exhaustion(
    problem: VectorProblem, known: LoadErrors, state: VectorState, margin: float
) -> Bounds:
    """docs/theory/friction-limit.md, "Close to gross sliding".

    The sum of P_i - q_i.t is at most `unused`. So each q is within (2 P unused)^(1/2) of P t, all
    together in the same sense; then X.t is no less than what it is at any asperity, and a sliding
    force that is turned costs friction.
    """
    P, ceilings, sure, n = problem.scalar.loads, problem.scalar.ceilings, known.sure, len(problem)
    total = float(np.hypot(*state.total))
    unproved = Bounds.unproved(1, n)
    if total == 0.0:
        return unproved
    t = state.total / total
    most = P + known.errors  # P* at most
    unused = most.sum() + known.stray + LIMIT_ROUNDOFFS * n * ROUNDOFF * P.sum() - total
    turned = np.minimum(np.sqrt(2.0 * most * unused), 2.0 * most)
    errors = known.errors + turned + 16 * ROUNDOFF * P
    errors = errors + np.hypot(*(state.increments - P[:, None] * t).T)

    # B q by what is known of q: `coupled` at P t, within `blur`.
    reach = problem.scalar.influence.matrix * (1.0 + problem.bias)
    coupled, across = problem.couple(P[:, None] * t), np.array([-t[1], t[0]])
    blur = reach @ known.errors + np.sqrt(2.0 * unused * (reach**2 @ most))
    blur += (1.0 + problem.bias) * known.stray_effect
    blur += (problem.product_error + 16 * ROUNDOFF) * (reach @ P)
    lacking = 1.5 * unused / P
    least = ceilings * (1.0 - lacking - lacking ** (2 / 3) - known.relative) + coupled @ t - blur
    least_rise = least.max(where=sure & (lacking < 1), initial=-np.inf)  # of X.t
    highest = ceilings * (1.0 + known.relative) + blur  # of | X - coupled | where it sticks
    pushed = least_rise - coupled @ t > highest
    # Were it to stick, displacements would be small, and forces turned by what differs across t.
    weights, side = np.where(sure, P - known.errors, 0.0), coupled @ across
    mean = float(weights @ side) / (float(weights.sum()) or 1.0)
    spread = np.sqrt(weights @ (side - mean) ** 2) - np.sqrt(weights @ blur**2)
    longest = highest + float(np.hypot(*np.ptp(coupled, axis=0))) + float(blur.max())
    sliding = sure & (pushed | (spread * (1 - SAFETY) > np.sqrt(2.0 * unused) * longest))
    complete = known.stray == 0 and bool(sure.all())
    proved = np.array([bool(sliding.any()) or complete])
    partial = ~sliding & complete & (sliding.sum() == n - 1)
    if partial.any():  # all but one slide, and that one does not if not all do
        partial &= _one_sticks(problem, known, side - mean, unused, margin)
    return unproved._replace(
        proved=proved, increments=errors[None], sliding=sliding[None], partial=partial[None]
    )


def _one_sticks(
    problem: VectorProblem, known: LoadErrors, side: Array, unused: float, margin: float
) -> bool:
    """Whether not all asperities slide: docs/theory/friction-limit.md, "The last one".

    side   : (n,) how much B P t differs across t;  unused : sum P* - T at most
    margin : I + H^-1/2 B H^-1/2 is at least that
    """
    P, least = problem.scalar.loads, problem.scalar.loads - known.errors
    A = problem.scalar.influence.matrix
    if margin == 0.0 or not unused < least.min():
        return False
    blur = problem.bias * (A @ known.errors + A.max(axis=1) * unused)
    blur += (problem.product_error + 16 * ROUNDOFF) * (1.0 + problem.bias) * (A @ P)
    ceilings = problem.scalar.ceilings * (1.0 - known.relative)
    differ = (P + known.errors) @ ((np.abs(side) + blur) ** 2 / ceilings)
    turned = differ / ((1.0 + 2.0 * margin) / 3.0) ** 2 / ceilings.min() * (1 + SAFETY)
    doubt = 2.0 * (known.errors.sum() + known.stray)
    doubt += 2.0 * LIMIT_ROUNDOFFS * len(P) * ROUNDOFF * P.sum()
    return bool(unused - doubt > turned)  # sum P* - T at least


def margin_of(problem: VectorProblem, known: LoadErrors) -> float:
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
