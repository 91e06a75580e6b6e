"""First-loading states of one contact, in the scene's units: what cycles and histories look up.

By Masing's rule every state at constant normal load is a sum of these. The energy they cost is
counted in w(T) = T rise(T) / 2 - Psi(T), with Psi the energy of the increments: the error of the
trapezoid rule on the curve of rise against T. A cycle of amplitude T costs 8 c_t f^2 w(T).
"""

from __future__ import annotations

import numpy as np

from convexrough import checks, hertz
from convexrough.checks import Array
from convexrough.contact import Contact
from convexrough.tangential import States, TangentialProblem


class Family:
    """Units, states and losses of one contact with friction."""

    def __init__(self, contact: Contact) -> None:
        self.contact = contact
        self.friction = checks.friction(contact.scene.friction)
        self.problem = TangentialProblem.of(contact)
        ratio = hertz.mindlin_ratio(contact.scene.material.poisson_ratio)
        self.force_unit = self.friction * self.problem.units.force
        self.length_unit = ratio * self.friction * self.problem.units.length
        self.energy_unit = 8.0 * self.force_unit * self.length_unit

    def states(self, totals: Array) -> States:
        """One state for each T, each distinct T solved once."""
        distinct, back = np.unique(totals, return_inverse=True)
        return States(*(field[back] for field in self.problem.solve(distinct)))

    def spread(self, values: Array, unit: float) -> Array:
        """(m, n) values of the loaded asperities, among zeros for all others of the scene."""
        full = np.zeros((len(values), len(self.contact.scene)))
        full[:, self.problem.touching] = values * unit
        return full

    def partial_slip(self, states: States) -> Array:
        """(m, n) share of w(T) lost in partial slip: (3/5) P ceiling e(u / P)."""
        problem = self.problem
        shares = hertz.loss(np.abs(states.increments) / problem.loads)
        return np.asarray(0.6 * problem.loads * problem.ceilings * shares)

    def sliding(self, states: States) -> Array:
        """(m, n) share of w(T) lost in sliding: P slip / 2."""
        return 0.5 * self.problem.loads * np.abs(states.slips)

    def trapezoid_error(self, states: States) -> Array:
        """(m,) w(T) = T rise / 2 - Psi, from the totals and not asperity by asperity.

        Both terms are of second order and their difference of third. So subtract from each the
        elastic part, which cancels exactly: with q the elastic shares and u = q T + v,

            rise = rise'(0) T + sum q_i (excess deflection_i + slip_i),
            Psi  = rise'(0) T^2 / 2 + sum excess potential_i + v'(H + A) v / 2.
        """
        problem, q = self.problem, self.problem.elastic
        P, ceilings, u = problem.loads, problem.ceilings, states.increments
        t = np.abs(u) / P
        total = u.sum(axis=1)
        excess = np.copysign(ceilings * hertz.excess_deflection(t), u) + states.slips
        v = u - total[:, None] * q
        v -= v.sum(axis=1, keepdims=True) * q
        bent = problem.couple(v) + 2.0 / 3.0 * ceilings / P * v
        potential = hertz.excess_potential(t) @ (P * ceilings)
        return np.asarray(0.5 * total * (excess @ q) - potential - 0.5 * (v * bent).sum(axis=1))
