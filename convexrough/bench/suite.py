"""Run a plan: everything that is measured, with what was left out and why."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from convexrough import checks
from convexrough.bench.frontier import better_than_default, exponent, mark_frontier
from convexrough.bench.gradients import GradientRow, measure_gradient
from convexrough.bench.machine import describe_machine
from convexrough.bench.measure import (
    Attempt,
    CostRow,
    Outcome,
    Row,
    measure,
    measure_cost,
    outcome_of,
    timed,
)
from convexrough.bench.paths import PathRow, measure_path
from convexrough.bench.plan import Plan, attempts
from convexrough.bench.reference import Reference, measurable, refine
from convexrough.bench.scenes import APPROACH, REFINEMENTS, Family, scene
from convexrough.bench.sweeping import SweepRow, measure_sweeps
from convexrough.contact import Contact, press
from convexrough.errors import InputError, SolverError
from convexrough.memory import MemoryRise
from convexrough.normal.problem import NormalProblem
from convexrough.progress import Announce
from convexrough.scene.scene import Scene
from convexrough.shearing.cycle import cycles
from convexrough.shearing.state import shear
from convexrough.solvers import BristleQP, Conic, ConicCVXPY, Newton

#: The exponent of cost is fitted from so many asperities on: below, fixed costs count.
FITTED_FROM = 10_000

#: How often the default solver and what seems to beat it are timed in turns.
ROUNDS = 4

PARTS = ("assembling", "solving", "certifying")

#: What a solver, set so, took last: the number of asperities, and seconds.
Spent = dict[tuple[str, str], tuple[int, float]]


@dataclass(frozen=True, eq=False)
class Panel:
    """Every solver on one scene.

    reference : what the errors are relative to; None, and then `without` says why
    """

    family: Family
    asperities: int
    reference: Reference | None
    without: str
    rows: tuple[Row, ...]

    @property
    def default(self) -> Row | None:
        """The row of the default solver."""
        return next((row for row in self.rows if row.default), None)

    @property
    def offenders(self) -> tuple[Row, ...]:
        """Points that are clearly faster than the default solver, and at least as accurate."""
        return better_than_default(self.rows)


@dataclass(frozen=True)
class ShearRow:
    """what    : "state" or "loss curve";  states : how many amplitudes
    outcome : "answered", "refused", "failed" or "left out", and why
    seconds : [s];  memory : [bytes] risen
    """

    what: str
    family: str
    asperities: int
    touching: int
    states: int
    outcome: Outcome
    message: str = ""
    seconds: float = np.nan
    memory: int | None = None


@dataclass(frozen=True, eq=False)
class Bench:
    """All that was measured."""

    machine: dict[str, Any]
    quick: bool
    panels: tuple[Panel, ...]
    cost: tuple[CostRow, ...]
    shear: tuple[ShearRow, ...]
    paths: tuple[PathRow, ...]
    gradients: tuple[GradientRow, ...]
    seconds: float
    sweeps: tuple[SweepRow, ...] = ()

    def fitted(self, family: Family) -> list[CostRow]:
        """The presses of `FITTED_FROM` asperities and more."""
        rows = [row for row in self.cost if row.family == family and row.outcome == "answered"]
        return [row for row in rows if row.asperities >= FITTED_FROM]

    def exponent(self, family: Family) -> float:
        """Of the time of these presses against the number of asperities."""
        rows = self.fitted(family)
        return exponent([row.asperities for row in rows], [row.seconds for row in rows])


def run(plan: Plan, announce: Announce | None = None) -> Bench:
    """Measure all of it.

    announce : told in a line what is going on
    """
    began = time.perf_counter()
    machine = describe_machine()
    say = announce or (lambda line: None)
    _load_code(say)
    panels: list[Panel] = []
    spent: Spent = {}
    for family, size in plan.work:
        panels.append(_panel(plan, family, size, spent, say))
    cost = []
    for family, size in plan.cost:
        say(f"cost: {family}, about {size:,}")
        make = partial(scene, family, REFINEMENTS[size])
        cost.append(measure_cost(family, make, patience=plan.patience))
    sheared: list[ShearRow] = []
    for what, sizes in (("state", plan.shear), ("loss curve", plan.cycles)):
        for family, size in sizes:
            say(f"shear, {what}: {family}, about {size:,}")
            sheared.append(_shear_row(plan, what, family, size, sheared))
    followed = []
    for family, size in plan.paths:
        say(f"load path: {family}, about {size:,}")
        followed.append(measure_path(family, scene(family, REFINEMENTS[size])))
    swept: list[SweepRow] = []
    for size, scenes, workers in plan.sweeps:
        say(f"sweep: {scenes:,} scenes of about {size:,}")
        swept += measure_sweeps(size, scenes, workers)
    slopes = []
    for family, size in plan.gradients:
        say(f"gradient: {family}, about {size:,}")
        slopes.append(measure_gradient(family, scene(family, REFINEMENTS[size])))
    return Bench(
        machine=machine,
        quick=plan.quick,
        panels=tuple(panels),
        cost=tuple(cost),
        shear=tuple(sheared),
        paths=tuple(followed),
        sweeps=tuple(swept),
        gradients=tuple(slopes),
        seconds=time.perf_counter() - began,
    )


def _load_code(say: Announce) -> None:
    """Have every solver import what it needs, so that times are those of solving."""
    say("loading the solvers")
    small = scene("lattice", 1.0)
    for solver in (Newton(), Conic(), ConicCVXPY(), BristleQP()):
        with suppress(InputError, SolverError):  # it will come again, and be told
            press(small, approach=APPROACH, solver=solver)


def _panel(plan: Plan, family: Family, size: int, spent: Spent, say: Announce) -> Panel:
    """Every attempt at one scene; `spent` knows what the smaller ones took, and is added to."""
    each = scene(family, REFINEMENTS[size])
    n = len(each)
    title = f"{family}, {n:,} asperities"
    say(f"{title}: reference")
    reference, without = _reference(each)
    used = NormalProblem.assemble(each, approach=APPROACH).influence.name
    tried: list[Attempt] = []
    rows: list[Row] = []
    for attempt in attempts(plan):
        if attempt.influence == used:
            continue  # the default takes it anyway
        say(f"{title}: {attempt.solver}, {attempt.setting}")
        expected = _expected(attempt, n, spent)
        if expected > plan.longest:
            message = f"more than {plan.longest:g} s expected (in brackets: about how many)"
            setting = attempt.setting
            row = Row(attempt.solver, setting, attempt.default, "left out", message, expected)
        else:
            row = measure(each, attempt, reference, patience=plan.patience)
        tried.append(attempt)
        rows.append(row)
    say(f"{title}: the closest again")
    rows = _timed_in_turns(each, tried, rows, plan.patience)
    answered = [row for row in rows if row.outcome == "answered"]
    spent |= {(row.solver, row.setting): (n, row.seconds) for row in answered}
    return Panel(family, n, reference, without, mark_frontier(rows))


def _timed_in_turns(
    each: Scene, tried: Sequence[Attempt], rows: Sequence[Row], patience: float
) -> list[Row]:
    """What seems to beat the default solver is timed again, and so is that: in turns.

    Both keep their least times, so that a moment in which the machine was busy decides nothing.
    """
    rows = list(rows)
    for _ in range(ROUNDS):
        rivals = better_than_default(rows)
        if not rivals:
            break
        for i, row in enumerate(rows):
            if row.default or row in rivals:
                again = measure(each, tried[i], None, patience=patience)
                if again.outcome == "answered":
                    least = {name: min(getattr(row, name), getattr(again, name)) for name in PARTS}
                    rows[i] = replace(row, **least)
    return rows


def _expected(attempt: Attempt, n: int, spent: Spent) -> float:
    """[s] what an attempt is going to take, from a smaller scene; 0 where nothing is known."""
    if attempt.growth is None or (attempt.solver, attempt.setting) not in spent:
        return 0.0
    size, seconds = spent[attempt.solver, attempt.setting]
    return float(seconds * max(1.0, n / size) ** attempt.growth)


def _reference(each: Scene) -> tuple[Reference | None, str]:
    """And why there is none."""
    if not measurable(each):
        return None, f"no reference for {len(each):,} asperities off a lattice"
    problem = NormalProblem.assemble(each, approach=APPROACH)
    try:
        return refine(problem, Newton().solve(problem).loads), ""
    except (InputError, SolverError) as error:
        return None, str(error)


def _shear_row(
    plan: Plan, what: str, family: Family, size: int, before: list[ShearRow]
) -> ShearRow:
    each = scene(family, REFINEMENTS[size])
    states = 1 if what == "state" else plan.amplitudes
    contact = press(each, approach=APPROACH)
    touching = int(np.count_nonzero(contact.loads))
    blank = ShearRow(what, family, len(each), touching, states, "answered")
    smaller = [row for row in before if row.what == what and row.outcome == "answered"]
    if smaller:
        growth = len(each) / smaller[-1].asperities
        if (expected := smaller[-1].seconds * growth) > 5 * plan.longest:
            message = f"at least {expected:.1g} s expected, more than {5 * plan.longest:g} s"
            return replace(blank, outcome="left out", message=message)
    memory = MemoryRise()
    try:
        _, seconds = timed(lambda: _sheared(contact, states))
    except (InputError, SolverError) as error:
        return replace(blank, outcome=outcome_of(error), message=str(error))
    return replace(blank, seconds=seconds, memory=memory.risen())


def _sheared(contact: Contact, states: int) -> object:
    most = checks.friction(contact.scene.friction) * contact.load
    if states == 1:
        return shear(contact, force=0.5 * most)
    return cycles(contact, most * np.arange(1, states + 1) / (states + 1))
