"""Judge loads from any source: how far from the solution they can be, and which asperities touch.

Knows no solver. Derived in docs/theory/certificate.md; in short, for loads P with residual e (the
gap where loaded, its negative part where not), a box 0 <= P <= B that holds every solution,
H = diag(2/3 k B^(-1/3)), and mu > 0 with Hessian >= mu H on that box,

    || P - P* ||_H  <=  || e ||_{H^-1} / mu  =:  eps,                                          (1)

so |P_i - P*_i| <= eps / sqrt(h_i), and A P is off by at most eps sqrt(sum_j A_ij^2 / h_j). At the
solution delta* = D - A P* is the indentation where positive and minus the gap where negative.

Headings in quotes below are of that page. Its letters, and the names here:

    P^, the loads judged           loads
    |e| + rho, rho                 residual, rounding; both less a remainder known by its norm
    B, h, mu                       box.loads, box.stiffness, 1 - box.convexity_number
    eps                            ball.radius
    theta, s_i                     convexity_number, shells (1 / (pi E* s_i))
    delta, D_0                     indentation, approach
    q, L                           weights, load
    eta, rho_inf, rho_2            Rounding.relative, .each and .norm (docs/theory/operators.md)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.influence.coupling import Coupling
from convexrough.normal.bounds import Ball, Bounds, ball_of, bounds_of, reach
from convexrough.normal.boxes import Box, Scope, box_of_touching, crowded, lowest_ceiling, tried
from convexrough.normal.prescribed_load import riding_weights
from convexrough.normal.problem import NormalProblem
from convexrough.normal.residual import SUM_ROUNDOFFS, Displaced, Fit, fit, scaled_to
from convexrough.normal.rivals import NO_RIVALS, UNKNOWN, Rivals
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.sphere import hertz

#: Boxes of those that touch that are tried: larger ones where the solution may be outside, and with
#: asperities let in that are not proved open. Heuristics, as is the room that a box leaves.
ATTEMPTS, ROOM = 6, 2.0

NONE = np.zeros(0, dtype=np.intp)

CROWDED = "their discs overlap so far that the energy is not known to be convex"
POORLY_KNOWN = "their loads are not known well enough to stay in a box where the energy is convex"
NOT_OPEN = "they are held open, but their gaps are not proved"


class Judgement(NamedTuple):
    """What is proved of loads, in the problem's own units.

    Of the candidates (n,), or of all asperities of the scene (N,).
    """

    scope: Scope
    convexity_number: float
    load_errors: Array  # (n,) infinite where nothing is proved, as all bounds then are
    touches: NDArray[np.bool_]  # (n,) proved to carry a load
    indentation: Array  # (N,) delta = D - A P
    errors: Array  # (N,) bounds on |delta - delta*|
    approach: float
    approach_error: float
    duality_gap: float
    held: int  # candidates taken to be open, as they then are proved to be in this solution
    rivals: Rivals
    obstacle: Obstacle

    @classmethod
    def of(cls, problem: NormalProblem, given: Array, nearby: Displaced | None = None) -> Judgement:
        """Of loads (n,) of the candidates, not negative; `nearby` as `fit` takes it."""
        loads, weights = given, None
        if problem.load is not None:
            loads = scaled_to(problem.load, given)
            weights = riding_weights(problem, loads)
        found = fit(problem, loads, weights, nearby)
        screened = _screened(problem, loads, found.approach)
        indentation = problem.to_scene(found.indentation)
        indentation[screened.which] = screened.indentation
        proved = _proved(problem, loads, found, weights, screened.coupling)
        if isinstance(proved, Obstacle):
            return _unproved(problem, loads, found, indentation, proved)
        box, ball, bounds = proved
        error = bounds.of_indentation(found)

        # delta* gives a second bound on each load, sharper where the load is small.
        low = hertz.load(found.indentation - error, problem.coefficients) * (1 - SAFETY)
        high = hertz.load(found.indentation + error, problem.coefficients) * (1 + SAFETY)
        load_errors = np.minimum(bounds.loads, np.maximum(loads - low, high - loads))
        load_errors += np.abs(loads - given) * (1 + SAFETY) + 4 * ROUNDOFF * loads

        everywhere = problem.to_scene(error)
        everywhere[screened.which] = bounds.elsewhere + screened.rounding + bounds.approach
        rivals = NO_RIVALS
        if box.scope != "global":
            ceiling = lowest_ceiling(problem, loads, found.displacement)
            rivals = Rivals.of(problem, ball.near, ceiling)
        return cls(
            scope="local" if rivals.possible else "global",
            convexity_number=box.convexity_number,
            load_errors=load_errors,
            touches=(loads > bounds.loads) | (found.indentation > error),
            indentation=indentation,
            errors=everywhere,
            approach=found.approach,
            approach_error=bounds.approach * (1 + SAFETY)
            + (0.0 if problem.load is None else 2 * ROUNDOFF * abs(found.approach)),
            duality_gap=_energy_error(box, ball, bounds, loads, found),
            held=int(box.held.sum()),
            rivals=rivals,
            obstacle=Obstacle("", NONE),
        )


class Obstacle(NamedTuple):
    """What stands in the way of a proof."""

    reason: str
    which: Indices  # candidates


def _proved(
    problem: NormalProblem,
    loads: Array,
    found: Fit,
    weights: Array | None,
    screened: Coupling | None,
) -> tuple[Box, Ball, Bounds] | Obstacle:
    """The first box that keeps the solution inside, and how far it can be: "Which box".

    Where no box of all candidates does, one of those that touch, if all others are then open.
    """
    for box in tried(problem, loads, found.displacement):
        if (ball := ball_of(box, found, loads)) is not None:
            return box, ball, bounds_of(box, loads, found, ball, weights, screened)
    return _proved_of_touching(problem, loads, found, weights, screened)


def _proved_of_touching(
    problem: NormalProblem,
    loads: Array,
    found: Fit,
    weights: Array | None,
    screened: Coupling | None,
) -> tuple[Box, Ball, Bounds] | Obstacle:
    """The same with all others held open, and then proved to be: docs/theory/crowded.md."""
    touching, room, obstacle = loads > 0, np.zeros(len(loads)), Obstacle("", NONE)
    for _ in range(ATTEMPTS):
        box = box_of_touching(problem, loads, touching, room)
        if box is None:
            break
        part = found.of_some(touching)
        if (ball := ball_of(box, part, loads)) is None:
            needed = reach(box, part, loads)
            obstacle = Obstacle(POORLY_KNOWN, np.flatnonzero(loads + needed >= box.faces))
            room = np.maximum(room, ROOM * needed)
            continue
        bounds = bounds_of(box, loads, part, ball, weights, screened)
        doubtful = box.held & ~(-found.indentation > bounds.of_indentation(found))
        if not doubtful.any():
            return box, ball, bounds
        obstacle = Obstacle(NOT_OPEN, np.flatnonzero(doubtful))
        touching, room = touching | doubtful, np.maximum(room, ROOM * ball.load_errors)
    return obstacle if obstacle.reason else Obstacle(CROWDED, crowded(problem, loads))


def _energy_error(box: Box, ball: Ball, bounds: Bounds, loads: Array, found: Fit) -> float:
    """Of Phi(P) above its least: by a dual point, or, where loads are known well, by convexity.

    Phi(P) - Phi(P*) <= g(P)'(P - P*), and each part is at most |e_i| times the error of the load.
    """
    problem = box.problem
    residuals = np.where(box.held, 0.0, found.residual + found.component)
    slope = float(residuals @ bounds.loads) * (1 + SAFETY)
    if problem.load is not None:
        slope += abs(found.approach) * problem.missing(loads)
    if slope < ROUNDOFF * float(loads @ found.local):  # less than a dual point can say
        return slope
    rounding = found.rounding + found.component
    dual = problem.duality_gap(loads, found.displacement, found.approach, ball.near, rounding)
    return min(dual, slope)


class _Screened(NamedTuple):
    """The asperities that cannot touch."""

    which: Indices  # in the scene
    coupling: Coupling | None  # from the candidates; None if there are no others
    indentation: Array  # D - A P
    rounding: Array  # bound on its error


def _screened(problem: NormalProblem, loads: Array, approach: float) -> _Screened:
    scene, length = problem.scene, problem.units.length
    left = np.ones(len(scene), dtype=bool)
    left[problem.candidates] = False
    others = left.nonzero()[0]
    if len(others) == 0:
        return _Screened(others, None, np.zeros(0), np.zeros(0))
    coupling = problem.influence.onto(scene.contact_points[others])
    product, offsets = coupling.apply(loads), scene.offsets[others] / length
    rounding = coupling.rounding(loads).of(product) + scene.offset_errors[others] / length
    rounding += SUM_ROUNDOFFS * ROUNDOFF * (np.abs(product) + np.abs(offsets) + abs(approach))
    return _Screened(others, coupling, approach + offsets - product, rounding)


def _unproved(
    problem: NormalProblem, loads: Array, found: Fit, indentation: Array, obstacle: Obstacle
) -> Judgement:
    """Said plainly: "Which box", 4."""
    return Judgement(
        scope="none",
        convexity_number=max(1.0, problem.convexity_number(loads)),
        load_errors=np.full(len(loads), np.inf),
        touches=np.zeros(len(loads), dtype=bool),
        indentation=indentation,
        errors=np.full(len(indentation), np.inf),
        approach=found.approach,
        approach_error=0.0 if problem.load is None else np.inf,
        duality_gap=np.inf,
        held=0,
        rivals=UNKNOWN,
        obstacle=obstacle,
    )
