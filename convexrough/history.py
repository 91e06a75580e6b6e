"""Shear histories at constant normal load: Masing's rule, with memory.

On a branch from a turning point Q1 to Q, with T = |Q - Q1| / (2 f),

    Q_i = Q_i(Q1) -+ 2 f u_i(T),  X = X(Q1) -+ 2 c_t f rise(T),  s_i = s_i(Q1) -+ 2 c_t f slip_i(T).

A branch that reaches the previous turning point closes its loop; both points are forgotten and the
older branch goes on; first loading ends the stack. A branch costs half of a cycle of its amplitude,
first loading a quarter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.checks import Array, frozen
from convexrough.contact import Contact
from convexrough.family import Family
from convexrough.normal import SAFETY
from convexrough.shear_certificate import judge_states


@dataclass(frozen=True, eq=False)
class History:
    """A sequence of shear forces from 0, monotonic from each to the next.

    applied       : (m,) Q [force]
    displacements : (m,) X [length], both bodies
    displacement_errors : (m,) [length] proved bounds on |X - solution|, infinite without proof
    forces        : (m, n) Q_i [force]
    asperity_displacements : (m, n) X_i + slip_i [length]
    slips         : (m, n) gross slip [length]
    energy        : (m,) lost since the beginning [force length]
    """

    contact: Contact
    applied: Array
    displacements: Array
    displacement_errors: Array
    forces: Array
    asperity_displacements: Array
    slips: Array
    energy: Array


class _Step(NamedTuple):
    """How one step is looked up: state = base + scale * family(total)."""

    base: int  # the step at the turning point, -1 for the virgin state
    scale: float  # +-2 on a branch, +-1 on first loading, 0 if nothing moves
    total: float  # T
    lost: list[tuple[float, float]]  # (factor, T): the step costs sum factor * w(T)


def history(contact: Contact, *, forces: ArrayLike) -> History:
    """Any sequence of shear forces (m,) [force], |Q| <= f P, from the freshly pressed contact."""
    limit = checks.friction(contact.scene.friction) * contact.load
    applied = checks.bearable("forces", checks.array("forces", forces), limit)
    if contact.load == 0.0 or len(applied) == 0:
        none = frozen(np.zeros((len(applied), len(contact.scene))))
        zero = frozen(np.zeros(len(applied)))
        return History(contact, applied, zero, zero, none, none, none, zero)
    family = Family(contact)
    steps = _remember(applied / family.force_unit)
    totals = [step.total for step in steps]
    costs = [total for step in steps for _, total in step.lost]
    distinct, back = np.unique(
        family.problem.limited(np.array(totals + costs)), return_inverse=True
    )
    states = family.problem.solve(distinct)
    bounds = judge_states(family.problem, contact, states)
    w = (family.partial_slip(states) + family.sliding(states)).sum(axis=1)
    deflections = family.problem.deflections(states.increments) + states.slips

    looked_up = (states.rises[:, None], states.increments, deflections, states.slips)
    results = [np.empty((len(steps), field.shape[1])) for field in looked_up]
    energy, spent = np.empty(len(steps)), iter(back[len(steps) :])
    errors = np.empty(len(steps))
    lost = 0.0
    for m, step in enumerate(steps):
        for result, field in zip(results, looked_up, strict=True):
            base = result[step.base] if step.base >= 0 else 0.0
            result[m] = base + step.scale * field[back[m]]
        moved = abs(step.scale) * bounds.rises[back[m]] if step.scale else 0.0
        errors[m] = (errors[step.base] if step.base >= 0 else 0.0) + moved
        lost += sum(factor * w[next(spent)] for factor, _ in step.lost)
        energy[m] = lost
    rises, increments, deflections, slips = results
    return History(
        contact=contact,
        applied=applied,
        displacements=frozen(rises[:, 0] * family.length_unit),
        displacement_errors=frozen(errors * family.length_unit * (1 + SAFETY)),
        forces=frozen(family.spread(increments, family.force_unit)),
        asperity_displacements=frozen(family.spread(deflections, family.length_unit)),
        slips=frozen(family.spread(slips, family.length_unit)),
        energy=frozen(energy * family.energy_unit),
    )


def _remember(applied: Array) -> list[_Step]:
    """Masing's rule with memory: which turning point each step hangs on. T-units: Q / f.

    The stack holds turning points (Q, step) that are not yet wiped out. The costs of a step are
    differences of w along the branches it runs through: 1/4 of a cycle on first loading, 1/2 on
    a branch.
    """
    stack: list[tuple[float, int]] = []
    steps: list[_Step] = []
    now = 0.0
    for m, target in enumerate(applied):
        if target == now:
            steps.append(_Step(m - 1, 0.0, 0.0, []))  # the same state once more
            continue
        origin, direction = now, np.sign(target - now)
        heading = np.sign(now - stack[-1][0]) if stack else np.sign(now)
        if heading == -direction:
            stack.append((now, m - 1))  # a new turning point
        lost: list[tuple[float, float]] = []
        while stack:
            turn = stack[-1][0]
            # The branch closes where it meets the point before; the first one, on first loading.
            close = stack[-2][0] if len(stack) > 1 else -turn
            end = min(target * direction, close * direction) * direction
            lost += [(0.5, abs(end - turn) / 2), (-0.5, abs(origin - turn) / 2)]
            if target * direction < close * direction:
                break
            origin = close
            del stack[-2:]
        if not stack:
            lost += [(0.25, abs(target)), (-0.25, abs(origin))]
            steps.append(_Step(-1, float(np.sign(target)), abs(target), lost))
        else:
            turn, step = stack[-1]
            total = abs(target - turn) / 2
            steps.append(_Step(step, 2.0 * float(np.sign(target - turn)), total, lost))
        now = target
    return steps
