"""How far weights on loads can be off that friction states leave, and so derivatives by heights.

The terms are those of docs/theory/gradient-bounds.md, "Weights of a loss" and "Weights of a state".
Arrays are (N,), of the asperities of `bounds.Known`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, TypeAlias

import numpy as np

from convexrough.arrays import Array
from convexrough.gradients.adjoint import Excess, Friction
from convexrough.gradients.bounds import (
    CUBE_ROOT,
    FEW,
    Known,
    Moved,
    Off,
    above,
    respond,
)
from convexrough.gradients.gross import GrossDoubt
from convexrough.gradients.system import Solution
from convexrough.gradients.widths import Widths
from convexrough.roundoff import SAFETY
from convexrough.shearing.judgement import LOCAL, StateErrors, state_errors
from convexrough.shearing.normal_map import States, slips
from convexrough.shearing.problem import TangentialProblem


class Weights(NamedTuple):
    """How far weights on loads can be off: || dp ||_(1/h) of the sure, |dp| of the unsure."""

    dual: float
    unsure: Array


@dataclass(frozen=True)
class LossDoubt:
    """Of the weights of w(T), times a factor;  force : [force] f T, exactly."""

    factor: float
    state: Friction
    beyond: Excess
    force: Fraction

    def weights(self, known: Known, problem: TangentialProblem) -> Weights | None:
        """None where nothing is proved."""
        near = near_of(problem, self.state)
        if near is None or self.beyond.solution is None:
            return None
        y = known.spread(self.beyond.increments)
        off = known.rounding(self.beyond.solution, y, self.sizes(known, problem), 0.0)
        return self.judged(known, problem, near, off)

    def sizes(self, known: Known, problem: TangentialProblem) -> Array:
        """(N,) of what was coupled to find Y."""
        x = self.state.widths
        b = known.spread(problem.loads * x**2 * (3.0 - x) / 2.0)
        sticks = known.spread(self.state.slopes) > 0
        y = np.abs(known.spread(self.beyond.increments))
        return np.asarray(np.where(sticks, y + b, b))

    def judged(
        self, known: Known, problem: TangentialProblem, near: StateErrors, off: Off
    ) -> Weights:
        """The weights' doubt, given how near the state is and what rounding made of the system."""
        assert self.beyond.solution is not None
        there = Widths.of(known, self.state, near)
        x, w = there.farthest, np.sqrt(known.slopes)
        C, Y = there.ceilings, known.spread(self.beyond.deflections)
        y = known.spread(self.beyond.increments)
        felt = self.beyond.rise - known.influence.apply(y)
        Y = np.where(known.loaded, Y, felt)
        b = known.spread(problem.loads * self.state.widths**2 * (3.0 - self.state.widths) / 2.0)
        per_width = 1.5 * there.most * x * (2.0 - x) + known.slopes * np.abs(Y)
        per_load = x * x * (3.0 - x) / 2.0
        per_load += CUBE_ROOT * known.slopes * there.sticks * np.abs(Y) / there.fewest
        rest = there.respond(
            known,
            self.beyond.solution,
            per_width,
            per_load,
            off=off,
            sizes=self.sizes(known, problem),
            loose=there.most + b + known.slopes * np.abs(Y),
            total=0.0,
        )
        dual = known.of_loads(LOCAL / 6.0 * x**3 / w)
        dual += there.norm((C * x * x + np.abs(Y)) / 2.0 * w)
        dual += 0.5 * there.shifted(known, rest)
        dual += 0.5 * _slips(known, problem, near, there)
        slip = known.spread(np.abs(slips(problem, self.state.deflections)))
        sizes = C * x**3 + slip + x * np.abs(Y)
        dual += FEW * known.roundoff * known.dual(sizes)
        unsure = np.where(known.unsure, sizes + C + np.abs(Y) + rest.unsure, 0.0)
        if known.unsure.any():
            u = known.spread(self.state.increments)
            left = np.abs(self.state.rise - known.influence.apply(u))
            moved = above(known.influence, there.apart(known, u)) + near.rise
            unsure += np.where(known.unsure, left + moved, 0.0)
        factor = abs(self.factor) * (1 + SAFETY)
        return Weights(factor * dual, factor * unsure)


@dataclass(frozen=True)
class StateDoubt:
    """Of what weights of increments, slips and the rise of a state leave, times a factor.

    increments, slips : (n,) the weights of those;  total : sum c zeta
    force : [force] f T, exactly
    """

    factor: float
    state: Friction
    solution: Solution
    increments: Array
    slips: Array
    total: float
    force: Fraction

    def weights(self, known: Known, problem: TangentialProblem) -> Weights | None:
        """None where nothing is proved, or a slip is weighted that may or may not be there."""
        near = near_of(problem, self.state)
        if near is None or (self.slips[~near.sliding & ~near.partial] != 0).any():
            return None
        y = known.spread(self.state.slopes * self.solution.values)
        off = known.rounding(self.solution, y, self.sizes(known), self.total)
        return self.judged(known, problem, near, off)

    def sizes(self, known: Known) -> Array:
        """(N,) of what was coupled to find Y."""
        e = np.where(self.state.slides, np.abs(self.slips), 0.0)
        y = known.spread(self.state.slopes * self.solution.values)
        return np.asarray(np.abs(y) + known.spread(e))

    def judged(
        self, known: Known, problem: TangentialProblem, near: StateErrors, off: Off
    ) -> Weights:
        """The weights' doubt, given how near the state is and what rounding made of the system."""
        there = Widths.of(known, self.state, near)
        w = np.sqrt(known.slopes)
        y = known.spread(self.state.slopes * self.solution.values)
        zeta = np.where(
            known.loaded,
            known.spread(self.solution.values),
            self.solution.shift - known.influence.apply(y),
        )
        e = np.where(self.state.slides, np.abs(self.slips), 0.0)
        rest = there.respond(
            known,
            self.solution,
            known.slopes * np.abs(zeta),
            CUBE_ROOT * known.slopes * there.sticks * np.abs(zeta) / there.fewest,
            off=off,
            sizes=self.sizes(known),
            loose=np.abs(y) + known.slopes * np.abs(zeta),
            total=self.total,
        )
        own = known.spread(e * problem.ceilings / problem.loads)
        dual = known.of_loads(2.0 / 3.0 * own * CUBE_ROOT / there.fewest * w)
        dual += there.norm(np.abs(zeta) * w) + there.shifted(known, rest)
        dual += FEW * known.roundoff * known.dual(there.farthest * np.abs(zeta) + own)
        unsure = np.where(known.unsure, 2.0 * np.abs(zeta) + rest.unsure + 2.0 * own, 0.0)
        factor = abs(self.factor) * (1 + SAFETY)
        return Weights(factor * dual, factor * unsure)


@dataclass(frozen=True)
class GivenDoubt:
    """Of weights as given, (n,) of the loaded asperities.

    off : (n,) of the scene, what rounding or a missing place makes of them
    """

    factor: float
    loads: Array
    off: Array

    def weights(self, known: Known, problem: TangentialProblem) -> Weights:
        """Always known."""
        off = abs(self.factor) * self.off[known.places]
        return Weights(known.dual(off), np.where(known.unsure, off, 0.0))


Doubt: TypeAlias = LossDoubt | StateDoubt | GivenDoubt | GrossDoubt


def height_errors(
    problem: TangentialProblem,
    doubts: Sequence[Doubt] | None,
    pressing: Solution,
    total: float | None,
) -> Array:
    """(n,) bounds on dJ/dd of the asperities of the scene; infinite where nothing is proved.

    doubts : about the weights on loads; None for weights that nothing is known of
    total  : sum lambda, where the load is held
    """
    n, known = len(problem.scene), Known.of(problem)
    weights = [] if known is None else [each.weights(known, problem) for each in doubts or ()]
    if known is None or doubts is None or None in weights:
        return np.full(n, np.inf)
    found = [each for each in weights if each is not None]
    multipliers = known.spread(problem.stiffest * pressing.values)
    off = known.rounding(pressing, multipliers, np.abs(multipliers), total)
    doubt = Weights(
        sum(each.dual for each in found),
        sum((each.unsure for each in found), np.zeros(len(known.places))),
    )
    errors = np.zeros(n)
    errors[known.places] = through_pressing(known, pressing, multipliers, off, doubt, total)
    return errors


def through_pressing(
    known: Known,
    pressing: Solution,
    multipliers: Array,
    off: Off,
    doubt: Weights,
    total: float | None,
) -> Array:
    """(N,) bounds on the error of lambda, from the doubt about the weights on loads."""
    zeta = np.where(
        known.loaded,
        known.spread(pressing.values),
        pressing.shift - known.influence.apply(multipliers),
    )
    fewest = np.where(known.unsure, 1.0, known.loads - known.errors)
    per_load = CUBE_ROOT * known.slopes * np.abs(zeta) / fewest
    rounding = FEW * known.roundoff * np.abs(multipliers)
    each = per_load * known.errors + rounding
    loose = known.slopes * np.abs(zeta) + np.abs(multipliers)
    least = known.slopes * np.cbrt(fewest / (known.loads + known.errors))  # of c0*
    firm = known.of_loads(per_load / np.sqrt(least))
    firm += float(np.linalg.norm((rounding / np.sqrt(least))[known.sure]))
    rest = respond(
        known,
        pressing,
        off,
        Moved(firm, 0.0, np.where(known.unsure, loose, each)),
        least=float(least[known.sure].sum()),
        total=total,
        residual=doubt.dual,
        residual_unsure=doubt.unsure,
    )
    return rest.forces


def near_of(problem: TangentialProblem, state: Friction) -> StateErrors | None:
    """How near a state is to the true one; None where nothing is proved."""
    numbers = np.array([state.total]), np.array([state.rise])
    states = States(
        numbers[0],
        state.deflections[None],
        state.increments[None],
        numbers[1],
        slips(problem, state.deflections)[None],
    )
    return state_errors(problem, states)


def _slips(known: Known, problem: TangentialProblem, near: StateErrors, there: Widths) -> float:
    """Bound on || d slip ||_(1/h): d(Delta) - A du - dC where an asperity slides, or may."""
    may = (known.spread(~near.partial) & known.sure).astype(np.float64)
    if not may.any():
        return 0.0
    moved = near.carried + there.distance
    found = near.rise * known.dual(may) + known.coupling * moved
    found += known.of_loads(LOCAL * may / np.sqrt(known.slopes))
    return found + known.dual(may * known.spread(near.uncertainty))
