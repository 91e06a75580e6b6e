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

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.convex.definite import proved_margin
from convexrough.influence.coupling import Coupling, Influence, error_reach
from convexrough.normal.prescribed_load import approach_error, riding_weights
from convexrough.normal.problem import NormalProblem
from convexrough.normal.residual import SUM_ROUNDOFFS, Fit, fit, scaled_to
from convexrough.normal.sup_norm import SupNorm
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.sphere import hertz

Scope = Literal["global", "local", "none"]

#: Convexity number of the loads themselves from which shells fitted to them are tried. A heuristic:
#: if it is off, work is wasted, or a bound is less sharp than it could be.
FIT_FROM = 0.8

#: Margins mu that Cholesky's factorisation is tried with, the best first. Any will do, as the
#: bounds are sharpened afterwards on a smaller box.
MARGINS = (0.1, 1e-3)


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

    @classmethod
    def of(cls, problem: NormalProblem, given: Array) -> Judgement:
        """Of loads (n,) of the candidates, not negative."""
        loads, weights = given, None
        if problem.load is not None:
            loads = scaled_to(problem.load, given)
            weights = riding_weights(problem, loads)
        found = fit(problem, loads, weights)
        screened = _screened(problem, loads, found.approach)
        indentation = problem.to_scene(found.indentation)
        indentation[screened.which] = screened.indentation
        box = _find_box(problem, loads, found.displacement)
        ball = None if box is None else _ball(box, found, loads)
        if box is None or ball is None:
            return _unproved(problem, loads, found, indentation)
        bounds = _bounds(box.problem, loads, found, ball, weights, screened.coupling)
        error = bounds.moved + found.rounding + found.component + bounds.approach

        # delta* gives a second bound on each load, sharper where the load is small.
        low = hertz.load(found.indentation - error, problem.coefficients) * (1 - SAFETY)
        high = hertz.load(found.indentation + error, problem.coefficients) * (1 + SAFETY)
        load_errors = np.minimum(bounds.loads, np.maximum(loads - low, high - loads))
        load_errors += np.abs(loads - given) * (1 + SAFETY) + 4 * ROUNDOFF * loads

        everywhere = problem.to_scene(error)
        everywhere[screened.which] = bounds.elsewhere + screened.rounding + bounds.approach
        return cls(
            scope=box.scope,
            convexity_number=box.convexity_number,
            load_errors=load_errors,
            touches=(loads > bounds.loads) | (found.indentation > error),
            indentation=indentation,
            errors=everywhere,
            approach=found.approach,
            approach_error=bounds.approach,
            duality_gap=box.problem.duality_gap(
                loads,
                found.displacement,
                found.approach,
                ball.near,
                found.rounding + found.component,
            ),
        )


class _Bounds(NamedTuple):
    """What is proved of the distance to the solution."""

    loads: Array  # (n,) of P
    moved: Array  # (n,) of A P
    approach: float  # of D0
    elsewhere: Array  # of A P at the screened asperities


def _bounds(
    problem: NormalProblem,
    loads: Array,
    found: Fit,
    ball: _Ball,
    weights: Array | None,
    screened: Coupling | None,
) -> _Bounds:
    """The smaller of (1) and of docs/theory/sup-norm.md, for each asperity."""
    A, errors, shift = problem.influence, ball.load_errors, 0.0
    sup = SupNorm.of(A, problem.stiffness(ball.near))
    if weights is not None:
        shift = np.inf
        if sup is not None:
            shift = approach_error(problem, loads, errors, found, weights, sup)
        if shift == np.inf:
            shift = _approach_error(problem, loads, found, errors, ball.moves(A, A.scale))
    if sup is None or shift == np.inf:
        elsewhere = np.zeros(0) if screened is None else ball.moves(screened, A.scale)
        return _Bounds(errors, ball.moves(A, A.scale), shift, elsewhere)
    residuals = found.residual + (found.component + shift)
    largest = float(residuals.max(initial=0.0))
    errors = np.minimum(errors, sup.load_errors(residuals, largest))
    moved, elsewhere = ball.lesser(sup.moves(A, largest), A, A), np.zeros(0)
    if screened is not None:
        elsewhere = ball.lesser(sup.moves_at(screened, largest), screened, A)
    return _Bounds(errors, moved, shift, elsewhere)


class _Box(NamedTuple):
    """A box of loads that holds the solution, and how convex the energy is on it."""

    scope: Scope
    problem: NormalProblem  # with the shells that prove it
    loads: Array  # the upper corner
    stiffness: Array  # h there
    convexity_number: float  # 1 - mu
    faces: Array  # upper faces that the solution must be shown to stay below; else infinite


class _Ball(NamedTuple):
    """Where (1) says that the solution is: || P - P* ||_H <= radius."""

    radius: float  # eps
    stiffness: Array  # h
    near: Array  # upper corner of a box that holds the ball and the solution

    @property
    def load_errors(self) -> Array:
        errors: Array = self.radius / np.sqrt(self.stiffness)
        return errors

    def moves(self, coupling: Coupling, scale: float) -> Array:
        """How far A (P - P*) can be from 0."""
        return self.radius * error_reach(coupling, scale, 1.0 / self.stiffness) * (1 + SAFETY)

    def lesser(self, moved: Array, coupling: Coupling, influence: Influence) -> Array:
        """The smaller of `moved` and `moves`, which is left out where it cannot be much smaller.

        As sum_j A_ij^2 / h_j is no less than what it would be if all were as far as the farthest.
        """
        if len(influence) == 0:
            return moved
        extent = max(float(np.hypot(*np.ptp(influence.points, axis=0))), checks.SMALLEST)
        total = float((1.0 / self.stiffness).sum()) - 1.0 / float(self.stiffness.min())
        least = self.radius * influence.scale / extent * np.sqrt(max(total, 0.0))
        if float(moved.max(initial=0.0)) <= least:
            return moved
        return np.minimum(moved, self.moves(coupling, influence.scale))


def _ball(box: _Box, found: Fit, loads: Array) -> _Ball | None:
    """(1) on the box, and once more on the box up to there: "A bound on the loads".

    None where the solution may lie outside the local box: "Which box", 3.
    """
    h = box.stiffness
    radius = _norm(found, h, box.convexity_number)
    errors = radius / np.sqrt(h)
    if (loads + errors >= box.faces).any():
        return None
    near = np.minimum(box.loads, loads + errors)
    if (theta := box.problem.convexity_number(near)) <= box.convexity_number:
        h = box.problem.stiffness(near)
        radius = _norm(found, h, theta)
    return _Ball(radius, h, near)


def _norm(found: Fit, stiffness: Array, convexity_number: float) -> float:
    """eps = || e ||_{H^-1} / (1 - theta), the right side of (1)."""
    squared = float(np.sum(found.residual**2 / stiffness))
    remainder = found.remainder / np.sqrt(float(stiffness.min(initial=np.inf)))
    return float(np.sqrt(squared) + remainder) / (1.0 - convexity_number) * (1 + SAFETY)


def _find_box(problem: NormalProblem, loads: Array, displacement: Array) -> _Box | None:
    """Global from the a priori bound by shells, then by Cholesky; else local; else None.

    "Which box", 1 to 4.
    """
    ceiling = problem.ceiling
    if problem.load is not None:
        ceiling = min(ceiling, problem.overhang(loads, displacement))
    corner = np.maximum(problem.bounds(ceiling), loads)  # the box must hold both states
    h = problem.stiffness(corner)
    nowhere = np.full(len(problem), np.inf)
    if (theta := problem.convexity_number(corner)) < 1:
        return _Box("global", problem, corner, h, theta, nowhere)
    if (margin := convex_margin(problem.influence, h, MARGINS)) > 0:
        return _Box("global", problem, corner, h, 1.0 - margin, nowhere)
    theta = problem.convexity_number(loads)
    if theta > FIT_FROM:
        fitted = problem.fitted_to(loads)
        if (number := fitted.convexity_number(loads)) < theta:
            problem, theta = fitted, number
    if theta < 1:
        theta = (1.0 + theta) / 2.0
        # The faces a_i = theta (pi/2) s_i, where h_i = shell_i / theta.
        faces = (2.0 / 3.0 * problem.coefficients * theta / problem.shells) ** 3
        local = np.minimum(corner, faces)
        beyond = np.where(faces < corner, faces, np.inf)
        return _Box("local", problem, local, problem.stiffness(local), theta, beyond)
    return None


def convex_margin(influence: Influence, stiffness: Array, margins: Sequence[float]) -> float:
    """The first mu with  I + H^(-1/2) A H^(-1/2) >= mu I  proved, else 0: "Which box", 2.

    Only where there is a matrix: a factorisation costs as the cube of its size.
    """
    if not influence.at_hand:
        return 0.0
    root = 1.0 / np.sqrt(stiffness)
    scaled = influence.matrix * root * root[:, None]
    return proved_margin(scaled, margins, influence.entry_error + 8 * ROUNDOFF)


def _approach_error(
    problem: NormalProblem, loads: Array, found: Fit, errors: Array, moved: Array
) -> float:
    """|D0 - D0*|, as D0* = k_i P*_i^(2/3) + (A P*)_i - d_i at every asperity sure to touch.

    "Prescribed load".
    """
    least = hertz.indentation(np.maximum(loads - errors, 0.0), problem.coefficients)
    each = np.abs(found.gap) + found.rounding + found.component + (found.local - least) + moved
    return float(each.min(where=loads > errors, initial=np.inf))


class _Screened(NamedTuple):
    """The asperities that cannot touch."""

    which: Indices  # in the scene
    coupling: Coupling | None  # from the candidates; None if there are no others
    indentation: Array  # D - A P
    rounding: Array  # bound on its error


def _screened(problem: NormalProblem, loads: Array, approach: float) -> _Screened:
    scene, length = problem.scene, problem.units.length
    others = np.delete(np.arange(len(scene)), problem.candidates)
    if len(others) == 0:
        return _Screened(others, None, np.zeros(0), np.zeros(0))
    coupling = problem.influence.onto(scene.contact_points[others])
    product, offsets = coupling.apply(loads), scene.offsets[others] / length
    rounding = coupling.rounding(loads).of(product) + scene.offset_errors[others] / length
    rounding += SUM_ROUNDOFFS * ROUNDOFF * (np.abs(product) + np.abs(offsets) + abs(approach))
    return _Screened(others, coupling, approach + offsets - product, rounding)


def _unproved(problem: NormalProblem, loads: Array, found: Fit, indentation: Array) -> Judgement:
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
    )
