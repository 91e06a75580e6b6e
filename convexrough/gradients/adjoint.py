"""Weights on the results of a state, pulled back to what determines it. Own units.

First through the friction state, then through the pressed state that it starts from: one linear
system each (docs/theory/gradients.md). A derivative is then

    dJ = loads'dP + local'd log k + sum over pairs left'dA right + total dT

at a friction state, and with dP of the pressed state

    dJ = offsets'dd + local'd log k + sum over pairs left'dA right + prescribed d(P or D0).
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.gradients.system import Solution, System
from convexrough.shearing.normal_map import States
from convexrough.shearing.problem import TangentialProblem
from convexrough.shearing.state import ShearState
from convexrough.sphere import annulus

Holding = Literal["load", "approach"]

#: |eta| within so many roundoffs of the ceiling is at it: at the onset of its sliding.
ONSET_ROUNDOFFS = 1e-13


class Pair(NamedTuple):
    """left'dA right: what a change of the coupling does."""

    left: Array
    right: Array


class Friction(NamedTuple):
    """One friction state, with the slopes of its law.

    total : T;  deflections : eta;  increments : u;  rise : Delta
    widths : x of the slip annulus, 1 where sliding;  slopes : c = c0 (1 - x)
    """

    total: float
    deflections: Array
    increments: Array
    rise: float
    widths: Array
    slopes: Array

    @classmethod
    def of(
        cls, problem: TangentialProblem, total: float, eta: Array, u: Array, rise: float
    ) -> Friction:
        x = annulus.width_at(eta / problem.ceilings)
        x = np.where(np.abs(eta) >= problem.ceilings * (1.0 - ONSET_ROUNDOFFS), 1.0, x)
        return cls(total, eta, u, rise, x, problem.stiffest * (1.0 - x))

    @classmethod
    def of_state(cls, problem: TangentialProblem, state: ShearState) -> Friction:
        """Of a state's own numbers, as if its force were positive."""
        touching, travel = problem.touching, problem.travel_unit
        sign = -1.0 if state.force < 0 else 1.0
        return cls.of(
            problem,
            float(problem.limited(np.array([abs(state.force) / problem.force_unit]))[0]),
            sign * state.displacements[touching] / travel,
            sign * state.forces[touching] / problem.force_unit,
            abs(state.displacement) / travel,
        )

    @classmethod
    def among(cls, problem: TangentialProblem, states: States, i: int) -> Friction:
        """One of many states."""
        return cls.of(
            problem,
            float(states.totals[i]),
            states.deflections[i],
            states.increments[i],
            float(states.rises[i]),
        )

    @property
    def signs(self) -> Array:
        return np.sign(self.deflections)

    @property
    def slides(self) -> NDArray[np.bool_]:
        """(n,) whether it slides, or is about to."""
        return np.asarray(self.widths == 1.0)


class Pulled(NamedTuple):
    """dJ at a friction state, or at a pressed one: as the module says."""

    loads: Array
    local: Array
    pairs: list[Pair]
    total: float = 0.0
    solution: Solution | None = None

    def plus(self, other: Pulled) -> Pulled:
        """Of the sum of two numbers."""
        loads, local = self.loads + other.loads, self.local + other.local
        return Pulled(loads, local, self.pairs + other.pairs, self.total + other.total)

    def scaled(self, factor: float) -> Pulled:
        """Of J times a factor."""
        pairs = [Pair(factor * pair.left, pair.right) for pair in self.pairs]
        return Pulled(factor * self.loads, factor * self.local, pairs, factor * self.total)


class Adjoint(NamedTuple):
    """dJ in what determines a state: as the module says.

    offsets    : (n,) dJ/dd
    local      : (n,) dJ/d log k
    pairs      : what a change of the coupling does
    prescribed : dJ/dP, or dJ/dD0 where the approach is held
    """

    offsets: Array
    local: Array
    pairs: list[Pair]
    prescribed: float
    solution: Solution


def through_pressing(
    problem: TangentialProblem,
    pulled: Pulled,
    holding: Holding,
    tolerance: float,
    approach: float = 0.0,
) -> Adjoint:
    """From dJ in loads, and a weight on the approach, to what determines both.

    zeta + A (c0 zeta) = p - mu,  lambda = c0 zeta;  sum lambda = -D under load control, or mu = 0:

        dJ = lambda'(dd - P^(2/3) dk - dA P) + {mu dP  |  (sum lambda + D) dD0}
    """
    system = System(problem, problem.stiffest, tolerance)
    solution = system.solve(pulled.loads, -approach if holding == "load" else None)
    multipliers = problem.stiffest * solution.values  # lambda
    by_approach = float(multipliers.sum()) + approach
    return Adjoint(
        offsets=multipliers,
        local=pulled.local - multipliers * problem.ceilings,
        pairs=[*pulled.pairs, Pair(-multipliers, problem.loads)],
        prescribed=-solution.shift if holding == "load" else by_approach,
        solution=solution,
    )


def through_friction(
    problem: TangentialProblem,
    state: Friction,
    system: System,
    *,
    increments: Array,
    slips: Array,
    rise: float,
) -> Pulled:
    """From weights on u, on signed slips and on Delta of a state.

    zeta + A (c zeta) = u_b - b - A e,  sum c zeta = -r - sum e,  a = e + c zeta, with e the weights
    on eta, which are those on slips where there are any:

        dJ = (sigma x zeta)'dP - (c eta zeta)'d log k - a'dA u + b dT.
    """
    C, sigma = problem.ceilings, state.signs
    e = np.where(state.slides, slips, 0.0)
    ceilings = -sigma * e  # dJ/dC, as a slip is eta less the ceiling
    right = increments - problem.couple(e) if e.any() else increments
    solution = system.solve(right, -rise - float(e.sum()))
    zeta = solution.values
    moved = e + state.slopes * zeta  # a
    return Pulled(
        loads=sigma * state.widths * zeta + ceilings * 2.0 * C / (3.0 * problem.loads),
        local=ceilings * C - state.slopes * state.deflections * zeta,
        pairs=[Pair(-moved, state.increments)],
        total=-solution.shift,
        solution=solution,
    )


def through_rise(problem: TangentialProblem, state: Friction, system: System) -> Pulled:
    """Of Delta alone."""
    zero = np.zeros(len(problem))
    return through_friction(problem, state, system, increments=zero, slips=zero, rise=1.0)


class Excess(NamedTuple):
    """Of u, eta and Delta what is beyond proportion to T: y = u - T u', Y and beta likewise."""

    increments: Array
    deflections: Array
    rise: float
    solution: Solution | None


def excess(problem: TangentialProblem, state: Friction, system: System) -> Excess:
    """b = sigma P x^2 (3 - x) / 2,   Y + A (b + c Y) = beta,   y = b + c Y,   sum y = 0."""
    x = state.widths
    b = state.signs * problem.loads * (x * x * (3.0 - x) / 2.0)
    solution = system.solve(-problem.couple(b), -float(b.sum()))
    y = b + state.slopes * solution.values
    return Excess(y, solution.values, solution.shift, solution)


def through_loss(problem: TangentialProblem, state: Friction, beyond: Excess) -> Pulled:
    """Of w(T) = T Delta / 2 - Psi, all terms of which are of third order in T.

    omega = -C x^3 / 6 + |slip| / 2 + sigma x Y / 2,
    kappa = C [0.6 P e(x) - sigma y phi(x) / 2],   left, right = -y / 2, u,   total = -beta / 2.
    """
    x, sigma, C = state.widths, state.signs, problem.ceilings
    slip = np.where(state.slides, np.maximum(np.abs(state.deflections) - C, 0.0), 0.0)
    omega = -C * x**3 / 6.0 + slip / 2.0 + sigma * x * beyond.deflections / 2.0
    own = 0.6 * problem.loads * annulus.loss(x)
    kappa = C * (own - sigma * beyond.increments * annulus.deflection(x) / 2.0)
    pairs = [Pair(-beyond.increments / 2.0, state.increments)]
    return Pulled(omega, kappa, pairs, -beyond.rise / 2.0)
