"""How far the solution in a box can be: by all residuals together, and by the largest alone.

docs/theory/certificate.md, "A bound on the loads", and docs/theory/sup-norm.md; for each asperity
the smaller of the two bounds counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.influence.coupling import Coupling, Influence, error_reach
from convexrough.normal.boxes import Box
from convexrough.normal.prescribed_load import approach_error
from convexrough.normal.problem import NormalProblem
from convexrough.normal.residual import Fit
from convexrough.normal.sup_norm import SupNorm
from convexrough.roundoff import SAFETY
from convexrough.sphere import hertz


class Bounds(NamedTuple):
    """What is proved of the distance to the solution."""

    loads: Array  # (n,) of P
    moved: Array  # (n,) of A P
    approach: float  # of D0
    elsewhere: Array  # of A P at the screened asperities

    def of_indentation(self, found: Fit) -> Array:
        """(n,) of delta = D - A P as computed."""
        error: Array = self.moved + found.rounding + found.component + self.approach
        return error


def bounds_of(
    box: Box,
    loads: Array,
    found: Fit,
    ball: Ball,
    weights: Array | None,
    screened: Coupling | None,
) -> Bounds:
    """The smaller of (1) and of docs/theory/sup-norm.md, for each asperity."""
    problem = box.problem
    A, errors, shift = problem.influence, ball.load_errors, 0.0
    sup = SupNorm.of(A, ball.stiffness)
    if weights is not None:
        shift = np.inf
        if sup is not None:
            shift = approach_error(problem, loads, errors, found, weights, sup)
        if shift == np.inf:
            shift = _approach_error(problem, loads, found, errors, ball.moves(A, A.scale))
    if sup is None or shift == np.inf:
        elsewhere = np.zeros(0) if screened is None else ball.moves(screened, A.scale)
        return Bounds(errors, ball.moves(A, A.scale), shift, elsewhere)
    residuals = np.where(box.held, 0.0, found.residual + (found.component + shift))
    largest = float(residuals.max(initial=0.0))
    errors = np.minimum(errors, sup.load_errors(residuals, largest))
    moved, elsewhere = ball.lesser(sup.moves(A, largest), A, A), np.zeros(0)
    if screened is not None:
        elsewhere = ball.lesser(sup.moves_at(screened, largest), screened, A)
    return Bounds(errors, moved, shift, elsewhere)


class Ball(NamedTuple):
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
        x, y = influence.points.T
        extent = max(math.hypot(x.max() - x.min(), y.max() - y.min()), checks.SMALLEST)
        total = float((1.0 / self.stiffness).sum()) - 1.0 / float(self.stiffness.min())
        least = self.radius * influence.scale / extent * np.sqrt(max(total, 0.0))
        if float(moved.max(initial=0.0)) <= least:
            return moved
        return np.minimum(moved, self.moves(coupling, influence.scale))


def ball_of(box: Box, found: Fit, loads: Array) -> Ball | None:
    """(1) on the box, and once more on the box up to there: "A bound on the loads".

    None where the solution may lie outside the local box: "Which box", 3.
    """
    errors = reach(box, found, loads)
    if (loads + errors >= box.faces).any():
        return None
    near = np.minimum(box.loads, loads + errors)
    # The margin of the whole box holds, in parts of H, on any smaller one, where H is no less.
    h = box.problem.stiffness(near)
    theta = min(box.convexity_number, box.problem.convexity_at(h))
    return Ball(_radius(box, found, loads, h, theta), h, near)


def reach(box: Box, found: Fit, loads: Array) -> Array:
    """(n,) how far (1) lets the loads of the solution be."""
    h = box.stiffness
    errors: Array = _radius(box, found, loads, h, box.convexity_number) / np.sqrt(h)
    return errors


def _radius(box: Box, found: Fit, loads: Array, stiffness: Array, convexity_number: float) -> float:
    """eps = || e ||_{H^-1} / (1 - theta), the right side of (1).

    Under a prescribed load of the loads made smaller by a part s until their total is right, and
    s || P ||_H more: docs/theory/certificate-rounding.md, "Prescribed load".
    """
    residual, scaling = found.residual, 0.0
    if box.problem.load is not None:
        part = box.problem.missing(loads) / box.problem.load
        more = part * (_spread(box.problem.offsets, loads) + found.local + residual)
        residual = residual + np.where(box.held, 0.0, more)
        scaling = part * math.sqrt(float(found.local @ loads))
    squared = float(np.sum(residual**2 / stiffness))
    remainder = found.remainder / math.sqrt(float(stiffness.min(initial=np.inf)))
    return ((math.sqrt(squared) + remainder) / (1.0 - convexity_number) + scaling) * (1 + SAFETY)


def _spread(offsets: Array, loads: Array) -> Array:
    """(n,) how far offsets are from the middle of those that touch."""
    touching = loads > 0
    low = float(offsets.min(where=touching, initial=np.inf))
    high = float(offsets.max(where=touching, initial=-np.inf))
    return np.abs(offsets - (low + high) / 2.0)


def _approach_error(
    problem: NormalProblem, loads: Array, found: Fit, errors: Array, moved: Array
) -> float:
    """|D0 - D0*|, as D0* = k_i P*_i^(2/3) + (A P*)_i - d_i at every asperity sure to touch.

    "Prescribed load".
    """
    least = hertz.indentation(np.maximum(loads - errors, 0.0), problem.coefficients)
    each = np.abs(found.gap) + found.rounding + found.component + (found.local - least) + moved
    return float(each.min(where=loads > errors, initial=np.inf))
