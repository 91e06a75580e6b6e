"""First-loading states of one contact: what cycles and histories look up, and what they cost.

By Masing's rule every state at constant normal load is a sum of these. The energy they cost is
counted in w(T) = T rise(T) / 2 - Psi(T), with Psi the energy of the increments: the error of the
trapezoid rule on the curve of rise against T. A cycle of amplitude T costs 8 c_t f^2 w(T)
(docs/theory/shear.md, "Energy").
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.progress import Announce
from convexrough.roundoff import SAFETY
from convexrough.shearing.bounds import Bounds
from convexrough.shearing.judgement import judge_in_turn
from convexrough.shearing.many_states import by_matrices
from convexrough.shearing.normal_map import States
from convexrough.shearing.problem import TangentialProblem
from convexrough.sphere import annulus

#: Numbers of an array of states that are kept for whoever asks again: a gradient of a cycle's loss.
KEPT = 2**21


class _Kept:
    """The states that were asked for last."""

    def __init__(self, problem: TangentialProblem) -> None:
        self.states: States | None = None


class FirstLoading:
    """The states of one contact with friction, and their losses.

    problem : its friction problem;  energy_unit : what 8 w(T) is counted in [force length]
    """

    def __init__(self, contact: Contact) -> None:
        self.problem = TangentialProblem.of(contact)
        self.energy_unit = 8.0 * self.problem.force_unit * self.problem.travel_unit

    def states(self, totals: Array, announce: Announce | None = None) -> tuple[States, Indices]:
        """One state for each distinct T, and which of them each of the totals is."""
        distinct, back = np.unique(self.problem.limited(totals), return_inverse=True)
        kept = self.problem.keep(_Kept)
        if kept.states is not None and np.isin(distinct, kept.states.totals).all():
            return kept.states.take(np.searchsorted(kept.states.totals, distinct)), back
        states = self.problem.solve(distinct, announce=announce)
        kept.states = states if states.increments.size <= KEPT else None
        return states, back

    def judged(
        self, states: States, announce: Announce | None = None
    ) -> Iterator[tuple[States, Bounds]]:
        """The states in blocks, with what is proved of each."""
        for block, bounds in judge_in_turn(self.problem, states):
            yield states.take(block), bounds
            if announce is not None and not by_matrices(self.problem):
                announce(f"certified {min(block.stop, len(states.totals))} states")

    def partial_slip(self, states: States) -> Array:
        """(m, n) share of w(T) lost in partial slip: (3/5) P ceiling e(u / P)."""
        problem = self.problem
        shares = annulus.loss(problem.widths(states.increments))
        return np.asarray(0.6 * problem.loads * problem.ceilings * shares)

    def sliding(self, states: States) -> Array:
        """(m, n) share of w(T) lost in sliding: P slip / 2."""
        return 0.5 * self.problem.loads * np.abs(states.slips)

    def energy_errors(self, errors: Array) -> Array:
        """[force length] from bounds on w, in whose units too small a number may vanish."""
        least = len(self.problem) * np.finfo(float).smallest_subnormal
        return np.asarray(self.energy_unit * errors * (1 + SAFETY) + least)

    def trapezoid_error(self, states: States) -> Array:
        """(m,) w(T) = T rise / 2 - Psi, from the totals and not asperity by asperity.

        Both terms are of second order and their difference of third. So subtract from each the
        elastic part, which cancels exactly: with q the elastic shares and u = q T + v,

            rise = rise'(0) T + sum q_i (excess deflection_i + slip_i),
            Psi  = rise'(0) T^2 / 2 + sum excess potential_i + v'(H + A) v / 2.
        """
        problem, q = self.problem, self.problem.elastic
        P, ceilings, u = problem.loads, problem.ceilings, states.increments
        x = problem.widths(u)
        total = u.sum(axis=1)
        excess = np.copysign(ceilings * annulus.excess_deflection(x), u) + states.slips
        v = u - total[:, None] * q
        v -= v.sum(axis=1, keepdims=True) * q
        bent = problem.couple(v) + v / problem.stiffest
        potential = annulus.excess_potential(x) @ (P * ceilings)
        return np.asarray(0.5 * total * (excess @ q) - potential - 0.5 * (v * bent).sum(axis=1))
