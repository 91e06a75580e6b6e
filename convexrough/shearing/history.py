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
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact
from convexrough.progress import Announce
from convexrough.roundoff import SAFETY
from convexrough.shearing.first_loading import Family
from convexrough.shearing.problem import States


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


def history(contact: Contact, *, forces: ArrayLike, announce: Announce | None = None) -> History:
    """Any sequence of shear forces (m,) [force], |Q| <= f P, from the freshly pressed contact.

    announce : told in a line how far long work has come
    """
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
    states, back = family.states(np.array(totals + costs), announce)
    bounds, w = _judged(family, states, announce)

    m, n = len(steps), len(contact.scene)
    rises, errors, energy = np.empty(m), np.empty(m), np.empty(m)
    looked_up = (states.increments, states.deflections, states.slips)
    units = (family.force_unit, family.length_unit, family.length_unit)
    results = [np.zeros((m, n)) for _ in looked_up]
    touching, spent, lost = family.problem.touching, iter(back[m:]), 0.0
    for i, step in enumerate(steps):
        at, base, started = back[i], step.base, step.base >= 0
        for result, field, unit in zip(results, looked_up, units, strict=True):
            if started:
                result[i] = result[base]
            result[i, touching] += step.scale * unit * field[at]
        rises[i] = (rises[base] if started else 0.0) + step.scale * states.rises[at]
        moved = abs(step.scale) * bounds[at] if step.scale else 0.0
        errors[i] = (errors[base] if started else 0.0) + moved
        lost += sum(factor * w[next(spent)] for factor, _ in step.lost)
        energy[i] = lost
    increments, deflections, slips = results
    return History(
        contact=contact,
        applied=applied,
        displacements=frozen(rises * family.length_unit),
        displacement_errors=frozen(errors * family.length_unit * (1 + SAFETY)),
        forces=frozen(increments),
        asperity_displacements=frozen(deflections),
        slips=frozen(slips),
        energy=frozen(energy * family.energy_unit),
    )


def _judged(family: Family, states: States, announce: Announce | None) -> tuple[Array, Array]:
    """(m,) bounds on the rises of states, and w(T): what they cost."""
    bounds, w = [], []
    for part, proved in family.judged(states, announce):
        bounds.append(proved.rises)
        w.append((family.partial_slip(part) + family.sliding(part)).sum(axis=1))
    return np.concatenate(bounds), np.concatenate(w)


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
