"""Shear histories at constant normal load, by Masing's rule with memory (`shearing.masing`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array, frozen, row_sums
from convexrough.contact import Contact
from convexrough.drawn import Drawn
from convexrough.progress import Announce
from convexrough.record import Along, Table
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.first_loading import FirstLoading
from convexrough.shearing.masing import remember
from convexrough.shearing.normal_map import States
from convexrough.twofold import Twofold, exact_sum

if TYPE_CHECKING:
    from convexrough.gradients.adjoint import Holding
    from convexrough.gradients.gradient import Gradient


@dataclass(frozen=True, eq=False, repr=False)
class History(Table, Drawn):
    """A sequence of shear forces from 0, monotonic from each to the next.

    applied       : (m,) Q [force]
    displacements : (m,) X [length], both bodies
    displacement_errors : (m,) [length] proved bounds on |X - solution|, infinite without proof
    forces        : (m, n) Q_i [force]
    asperity_displacements : (m, n) X_i + slip_i [length]
    slips         : (m, n) gross slip [length]
    energy        : (m,) lost since the beginning [force length]
    energy_errors : (m,) [force length] proved bounds on |energy - solution|, likewise

    >>> past = cr.history(contact, forces=contact.load * np.array([0.4, -0.4, 0.4]))
    >>> past.forces.shape, bool((np.diff(past.energy) > 0).all())
    ((3, 61), True)
    """

    _along: ClassVar[Along] = {
        ("step",): ("applied", "displacements", "displacement_errors", "energy", "energy_errors"),
        ("step", "asperity"): ("forces", "asperity_displacements", "slips"),
    }

    contact: Contact
    applied: Array
    displacements: Array
    displacement_errors: Array
    forces: Array
    asperity_displacements: Array
    slips: Array
    energy: Array
    energy_errors: Array

    def gradient(
        self,
        *,
        energy: ArrayLike | None = None,
        displacements: ArrayLike | None = None,
        holding: Holding | None = None,
        tolerance: float = 1e-9,
    ) -> Gradient:
        """Derivatives of a weighted sum over the steps: one pressed state for all reversals.

        energy, displacements : (m,) weights on them, at least one of the two
        holding, tolerance    : as in `Contact.gradient`; the forces of all steps are held

        Raises InputError where the history has reached gross sliding.

        >>> past = cr.history(contact, forces=contact.load * np.array([0.3, -0.3]))
        >>> print([f"{each:.3g}" for each in past.gradient(energy=[0, 1]).forces])
        ['5.88e-06', '-2.94e-06']
        """
        from convexrough.gradients.losses import history_gradient  # a floor above: when asked

        return history_gradient(
            self, energy=energy, displacements=displacements, holding=holding, tolerance=tolerance
        )


def history(contact: Contact, *, forces: ArrayLike, announce: Announce | None = None) -> History:
    """Any sequence of shear forces (m,) [force], |Q| <= f P, from the freshly pressed contact.

    announce : told in a line how far long work has come

    >>> past = cr.history(contact, forces=contact.load * np.array([0.4, 0.0]))
    >>> print([f"{moved:.3g}" for moved in past.displacements])  # the way back is not the way there
    ['1.81e-05', '2.66e-06']
    """
    checks.instance("contact", contact, Contact)
    limit = checks.friction(contact.scene.friction) * contact.load
    applied = checks.bearable("forces", checks.array("forces", forces), limit)
    if contact.load == 0.0 or len(applied) == 0:
        none = frozen(np.zeros((len(applied), len(contact.scene))))
        zero = frozen(np.zeros(len(applied)))
        return History(contact, applied, zero, zero, none, none, none, zero, zero)
    loading = FirstLoading(contact)
    problem = loading.problem
    steps = remember(applied / problem.force_unit)
    totals = [step.total for step in steps]
    costs = [total for step in steps for _, total in step.lost]
    states, back = loading.states(np.array(totals + costs), announce)
    bounds, w, w_errors = _judged(loading, states, announce)
    spent = _Spent(w, w_errors)

    m, n = len(steps), len(contact.scene)
    rises, errors, energy, energy_errors = (np.empty(m) for _ in range(4))
    looked_up = (states.increments, states.deflections, states.slips)
    units = (problem.force_unit, problem.travel_unit, problem.travel_unit)
    results = [np.zeros((m, n)) for _ in looked_up]
    touching, costing = problem.touching, iter(back[m:])
    for i, step in enumerate(steps):
        at, base, started = back[i], step.base, step.base >= 0
        for result, field, unit in zip(results, looked_up, units, strict=True):
            if started:
                result[i] = result[base]
            result[i, touching] += step.scale * unit * field[at]
        rises[i] = (rises[base] if started else 0.0) + step.scale * states.rises[at]
        moved = abs(step.scale) * bounds[at] if step.scale else 0.0
        errors[i] = (errors[base] if started else 0.0) + moved
        for factor, _ in step.lost:
            spent.add(factor, next(costing))
        energy[i], energy_errors[i] = spent.energy, spent.error
    increments, deflections, slips = results
    return History(
        contact=contact,
        applied=applied,
        displacements=frozen(rises * problem.travel_unit),
        displacement_errors=frozen(errors * problem.travel_unit * (1 + SAFETY)),
        forces=frozen(increments),
        asperity_displacements=frozen(deflections),
        slips=frozen(slips),
        energy=frozen(energy * loading.energy_unit),
        energy_errors=frozen(loading.energy_errors(energy_errors)),
    )


class _Spent:
    """sum factor * w, and what it can be off by: states that are spent and had back cost nothing.

    w, errors : (m,) of the states of first loading, and bounds on |w - w*|
    """

    def __init__(self, w: Array, errors: Array) -> None:
        self.w, self.proved = w, np.isfinite(errors)
        self.errors = np.where(self.proved, errors, 0.0)
        self.counts = np.zeros(len(w))  # sums of quarters, exact
        self.sum = Twofold(0.0, 0.0)
        self.doubt = self.rounding = 0.0
        self.unproved = 0.0  # the sum of |counts| of those not proved

    def add(self, factor: float, state: int) -> None:
        """Loss of `factor` cycles."""
        before, after = self.counts[state], self.counts[state] + factor
        self.counts[state] = after
        high, off = exact_sum(self.sum.high, factor * float(self.w[state]))
        self.sum = Twofold(high, self.sum.low + off)
        self.doubt += (abs(after) - abs(before)) * self.errors[state]
        self.unproved += (abs(after) - abs(before)) * (not self.proved[state])
        self.rounding += 4 * ROUNDOFF * (self.w[state] + abs(self.sum.low) + self.doubt)

    @property
    def energy(self) -> float:
        """The sum so far."""
        return float(self.sum.high + self.sum.low)

    @property
    def error(self) -> float:
        """Bound on |energy - solution|."""
        if self.unproved:
            return np.inf
        return (self.doubt + self.rounding + 4 * ROUNDOFF * abs(self.energy)) * (1 + SAFETY)


def _judged(
    loading: FirstLoading, states: States, announce: Announce | None
) -> tuple[Array, Array, Array]:
    """(m,) bounds on the rises of states; w(T), what they cost; and bounds on |w - w*|."""
    bounds, w, w_errors = [], [], []
    for part, proved in loading.judged(states, announce):
        bounds.append(proved.rises)
        w.append(row_sums(loading.partial_slip(part) + loading.sliding(part)))
        w_errors.append(proved.losses)
    return np.concatenate(bounds), np.concatenate(w), np.concatenate(w_errors)
