"""Gradients of the energy that cycles and histories cost, and of a history's displacements."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.errors import InputError
from convexrough.gradients.adjoint import (
    Friction,
    Holding,
    Pulled,
    excess,
    through_loss,
    through_pressing,
    through_rise,
)
from convexrough.gradients.doubts import Doubt, LossDoubt, StateDoubt
from convexrough.gradients.gradient import Gradient, to_scene
from convexrough.gradients.gross import GrossDoubt, excess_in_gross_sliding, last_to_slide
from convexrough.gradients.origin import Origin, felt, held, pressed
from convexrough.gradients.system import TOLERANCE, System
from convexrough.shearing.cycle import Cycle
from convexrough.shearing.first_loading import FirstLoading
from convexrough.shearing.history import History
from convexrough.shearing.masing import remember
from convexrough.shearing.problem import TangentialProblem


def cycle_gradient(
    cycle: Cycle, *, holding: Holding | None = None, tolerance: float = TOLERANCE
) -> Gradient:
    """As `Cycle.gradient`."""
    contact = cycle.contact
    holding, problem = held(contact, holding), pressed(contact)
    loading = FirstLoading(contact)
    states, _ = loading.states(np.array([cycle.force_amplitude / problem.force_unit]))
    felt(problem, "maximum", states.totals)
    state = Friction.among(problem, states, 0)
    doubts: list[Doubt] | None = None
    if limit := bool(problem.at_limit(states.totals)[0]):
        last = last_to_slide(problem, holding, "maximum", cycle.maximum)
        pulled = _in_gross_sliding(problem, state, last)
        doubts = [GrossDoubt(loading.energy_unit, last)]
    else:
        beyond = excess(problem, state, System(problem, state.slopes, tolerance))
        pulled = through_loss(problem, state, beyond)
        force = (Fraction(cycle.maximum) - Fraction(cycle.minimum)) / 2
        doubts = [LossDoubt(loading.energy_unit, state, beyond, force)]
    pulled = pulled.scaled(loading.energy_unit)
    adjoint = through_pressing(problem, pulled, holding, tolerance)
    by_force = pulled.total / (2.0 * problem.force_unit)
    W, nu = cycle.energy, contact.scene.material.poisson_ratio
    slid = by_force * (cycle.maximum - cycle.minimum)
    return to_scene(
        Origin.of(contact, adjoint, holding, doubts=doubts),
        holding,
        value=W,
        scaled=(W,) if limit else (W, -slid),
        cancels=False,
        poisson_ratio=W / ((1.0 - nu) * (2.0 - nu)),
        friction=(2.0 * W - slid) / problem.friction,
        load=-np.inf if limit else None,
        maximum=by_force,
        minimum=-by_force,
    )


def _in_gross_sliding(problem: TangentialProblem, state: Friction, last: int) -> Pulled:
    """The loss where T is sum P: the last asperity has T / (2 c0) more in omega."""
    state = state._replace(widths=np.ones(len(problem)))
    pulled = through_loss(problem, state, excess_in_gross_sliding(problem, state, last))
    pulled.loads[last] += state.total / (2.0 * problem.stiffest[last])
    return pulled


def history_gradient(
    history: History,
    *,
    energy: ArrayLike | None = None,
    displacements: ArrayLike | None = None,
    holding: Holding | None = None,
    tolerance: float = TOLERANCE,
) -> Gradient:
    """As `History.gradient`."""
    contact = history.contact
    holding, problem = held(contact, holding), pressed(contact)
    m = len(history.applied)
    if energy is None and displacements is None:
        expected = "at least one: weights on what is to be differentiated"
        raise InputError("energy, displacements", found="none", expected=expected)
    on_energy = checks.array("energy", 0.0 if energy is None else energy, length=m, one="force")
    far = 0.0 if displacements is None else displacements
    on_moved = checks.array("displacements", far, length=m, one="force")

    asked = _look_ups(history.applied / problem.force_unit, on_energy, on_moved)
    loading = FirstLoading(contact)
    states, back = loading.states(np.array([each.total for each in asked]))
    if problem.at_limit(states.totals).any():
        expected = "forces below f P: where all slide, a history has no derivative"
        raise InputError("forces", found="gross sliding", expected=expected)
    felt(problem, "forces", states.totals)
    lost, rises = (np.zeros(len(states.totals)) for _ in range(2))
    for each, i in zip(asked, back, strict=True):
        lost[i] += each.lost * loading.energy_unit
        rises[i] += each.moved * problem.travel_unit

    apart: list[dict[Fraction, tuple[float, float]]] = [{} for _ in states.totals]
    for each, i in zip(asked, back, strict=True):  # one T in float64 may be several forces
        force = each.force(history.applied)
        lost_so, moved_so = apart[i].get(force, (0.0, 0.0))
        apart[i][force] = lost_so + each.lost, moved_so + each.moved

    zero = np.zeros(len(problem))
    spent = float(on_energy @ history.energy)
    far = float(on_moved @ history.displacements)
    pulled, by_friction = Pulled(zero, zero, []), 2.0 * spent
    doubts: list[Doubt] = []
    by_lost, by_rise = np.zeros_like(lost), np.zeros_like(rises)  # dw/dT, dDelta/dT
    for i, total in enumerate(states.totals):
        state = Friction.among(problem, states, i)
        system, rising = System(problem, state.slopes, tolerance), None
        beyond = excess(problem, state, system)
        loss = through_loss(problem, state, beyond)
        pulled, by_lost[i] = pulled.plus(loss.scaled(lost[i])), loss.total
        by_friction += rises[i] * beyond.rise - lost[i] * loss.total * total
        if rises[i]:
            rise = through_rise(problem, state, system)
            pulled, by_rise[i] = pulled.plus(rise.scaled(rises[i])), rise.total
            rising = rise.solution
        for force, (lost_so, moved_so) in apart[i].items():
            doubts.append(LossDoubt(lost_so * loading.energy_unit, state, beyond, force))
            if rising is not None:
                factor = moved_so * problem.travel_unit
                doubts.append(StateDoubt(factor, state, rising, zero, zero, -1.0, force))
    by_force = np.zeros(m)
    lost_by, rise_by = by_lost * loading.energy_unit, by_rise * problem.travel_unit
    for each, i in zip(asked, back, strict=True):
        slope = each.lost * lost_by[i] + each.moved * rise_by[i]
        for step, part in each.ends:
            by_force[step] += slope * part / problem.force_unit
    adjoint = through_pressing(problem, pulled, holding, tolerance)
    nu = contact.scene.material.poisson_ratio
    return to_scene(
        Origin.of(contact, adjoint, holding, doubts=doubts),
        holding,
        value=spent + far,
        scaled=(by_friction, -spent - far),
        cancels=bool(on_moved.any()),
        poisson_ratio=(spent + far) / ((1.0 - nu) * (2.0 - nu)),
        friction=by_friction / problem.friction,
        forces=frozen(by_force),
    )


class _LookUp(NamedTuple):
    """Weights on w(T) and on the rise at one T; and dT by the forces of steps."""

    total: float
    lost: float
    moved: float
    ends: list[tuple[int, float]]

    def force(self, applied: Array) -> Fraction:
        """[force] f T, exactly; of T = 0, whose ends do not matter, it is 0."""
        if self.total == 0.0:
            return Fraction(0)
        ends = ((Fraction(float(applied[i])), Fraction(part)) for i, part in self.ends)
        return sum((force * part for force, part in ends), Fraction(0))


def _look_ups(applied: Array, on_energy: Array, on_moved: Array) -> list[_LookUp]:
    """All first-loading states that weighted energies and displacements of a history are made of.

    applied : (m,) Q / f
    """
    steps, asked = remember(applied), []
    later = np.cumsum(on_energy[::-1])[::-1]  # what is lost at a step counts in all that follow
    moved = on_moved.copy()
    for m in range(len(steps) - 1, -1, -1):
        step = steps[m]
        if step.base >= 0:
            moved[step.base] += moved[m]
        if step.scale and moved[m]:
            ends = _ends(applied, m, step.base)
            asked.append(_LookUp(step.total, 0.0, moved[m] * step.scale, ends))
        if later[m]:
            for (factor, total), (i, j) in zip(step.lost, step.between, strict=True):
                asked.append(_LookUp(total, later[m] * factor, 0.0, _ends(applied, i, j)))
    return asked


def _ends(applied: Array, i: int, j: int) -> list[tuple[int, float]]:
    """dT of T = |Q_i - Q_j| / 2, or of |Q_i| where j is -1."""
    if j < 0:
        return [(i, float(np.sign(applied[i])))]
    half = 0.5 * float(np.sign(applied[i] - applied[j]))
    return [(i, half), (j, -half)]
