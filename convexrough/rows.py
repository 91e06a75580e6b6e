"""Scenes with equal numbers of asperities, pressed and cycled together as rows of arrays.

Scenes that differ only in heights and friction are a *family*, which shares one compliance matrix.
Scenes whose solutions are not proved in this way are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arithmetic.balls import Ball, joined, of_rows, where
from convexrough.arrays import Array, Indices
from convexrough.friction.order import proved_in_rows
from convexrough.friction.state import asperity_losses
from convexrough.normal.boxes import Box
from convexrough.normal.exact import Data, twofold_offsets
from convexrough.normal.level import Rows
from convexrough.normal.levels import MOST, NUMBERS, solved
from convexrough.normal.problem import NormalProblem
from convexrough.normal.stack import Stack
from convexrough.roundoff import AT_THE_END, ROUNDOFF, SAFETY
from convexrough.scene.scene import Scene

#: Rows are processed together up to this total number of entries of their matrices.
MATRICES = 2**21

#: Fields of `Contacts` (TOTALS) and of `Cycles` (CYCLE) with one number for each scene.
TOTALS = ("loads", "load_errors", "approaches", "approach_errors")
CYCLE = ("losses", "loss_errors", "displacement_amplitudes", "displacement_errors")


class PressedRows(NamedTuple):
    """m scenes whose solutions were proved together, in a stack of m rows."""

    places: Indices  # (m,) of the scenes
    problem: NormalProblem  # one that has the units of the stack
    stack: Stack
    box: Box  # the boxes of loads in which the solutions were proved
    high: Rows  # the solutions

    def contacts(self) -> dict[str, NDArray[Any]]:
        """The fields of `Contacts` for these rows, by name."""
        found, force, length = self.high, self.problem.units.force, self.problem.units.length
        loads = found.loads.value * force
        off = np.abs(loads.sum(axis=1) - found.load.value * force)
        status = np.where(found.touching, "contact", np.where(found.open, "open", "undecided"))
        return {
            "loads": loads.sum(axis=1),
            "load_errors": (off + found.load.error * force) * (1 + SAFETY),
            "approaches": found.approach.value * length,
            "approach_errors": found.approach.error * length,
            "asperity_loads": loads,
            "asperity_load_errors": found.loads.error * force,
            "status": status,
        }

    def cycles(
        self, upper: Array, lower: Array, friction: Array
    ) -> tuple[NDArray[np.bool_], dict[str, NDArray[Any]]]:
        """A mask (m,) of the proved cycles between the shear forces upper and lower (m,) [force],
        with friction coefficients (m,); and the fields of `Cycles` for these rows, by name."""
        problem, high, units = self.problem, self.high, self.problem.units
        f, nu = Ball.exact(friction), Ball.exact(problem.scene.material.poisson_ratio)
        half = (Ball.exact(upper) - Ball.exact(lower)) * 0.5
        drop = (half / f).scaled(1.0 / units.force)
        total = high.load - drop
        limit = friction * high.load.value * units.force
        ends = np.maximum(np.abs(upper), np.abs(lower)) >= (1 - AT_THE_END * ROUNDOFF) * limit
        inside = (half.value > 0) & (total.value > AT_THE_END * ROUNDOFF * high.load.value) & ~ends
        total = where(inside, total, high.load)[:, None]  # rows not `inside` are not proved
        rows = self.stack.at_load(total)
        level, good = solved(rows, self.box.closed(rows))
        low = level.rows
        ordered = proved_in_rows(rows, self.box, high, low)
        slip, slide = asperity_losses(high, low)
        travel = f * ((2.0 - nu) / ((1.0 - nu) * 2.0)) * units.length
        loss = (slip + slide).sum() * 4.0 * (f * units.force) * travel
        moved = (high.approach - low.approach) * travel
        status = np.where(high.open, "open", np.full(high.open.shape, "undecided", dtype="<U12"))
        status[high.touching & low.touching] = "partial"
        status[high.touching & low.open] = "sliding"
        return good & ordered & inside, {
            "losses": loss.value,
            "loss_errors": loss.error,
            "displacement_amplitudes": moved.value,
            "displacement_errors": moved.error,
            "status": status,
        }


def in_rows(scenes: Sequence[Scene], controls: Array, by_load: bool) -> list[PressedRows]:
    """Stacks of the scenes that can be pressed and proved together. The controls (m,) are loads
    [force] if `by_load` is True, else approaches [length]."""
    if not scenes or len(scenes[0]) > MOST:
        return []
    families: dict[tuple[Any, ...], list[int]] = {}
    for k, scene in enumerate(scenes):
        families.setdefault(_family(scene), []).append(k)
    alike: dict[tuple[Any, ...], list[tuple[NormalProblem, int]]] = {}
    some = max(1, min(MATRICES // len(scenes[0]) ** 2, NUMBERS // len(scenes[0])))
    with threads.one_where(MATRICES):
        for places in families.values():
            highest = [controls[k] + (0.0 if by_load else scenes[k].offsets.max()) for k in places]
            first = places[int(np.argmax(highest))]
            control = {"load" if by_load else "approach": float(controls[first])}
            problem = NormalProblem.assemble(scenes[first], **control, influence="dense")
            if len(problem):  # an asperity can touch; all become candidates
                key = problem.units, *_family(problem.scene)[2:5]
                problem = problem.widened(np.arange(len(problem.scene)))
                alike.setdefault(key, []).extend((problem, k) for k in places)
        starts = ((each, k) for each in alike.values() for k in range(0, len(each), some))
        found = [_proved(each[k : k + some], scenes, controls, by_load) for each, k in starts]
    return [rows for rows in found if rows is not None]


def _family(scene: Scene) -> tuple[Any, ...]:
    """A key that is equal for scenes that differ only in heights and friction."""
    asperities = scene.asperities
    shape = asperities.positions.tobytes(), asperities.tip_radii.tobytes()
    elastic = scene.material.contact_modulus, scene.material.poisson_ratio
    return *shape, scene.sphere_radius, *elastic, scene.geometry


def _proved(
    every: Sequence[tuple[NormalProblem, int]],
    scenes: Sequence[Scene],
    controls: Array,
    by_load: bool,
) -> PressedRows | None:
    """Press the scenes of one stack, in the units of the first problem; those that are proved."""
    first, places = every[0][0], np.array([k for _, k in every])
    n, units = len(first), first.units
    start, coupled = 0, list[tuple[slice, NormalProblem]]()
    offsets, known = list[Ball](), list[Ball]()
    for _, group in groupby(every, key=lambda each: id(each[0])):
        family = list(group)
        problem, m = family[0][0], len(family)
        coupled.append((slice(start, start + m), problem))
        offsets.append(_offsets(problem, [scenes[k] for _, k in family]))
        repeated = partial(np.broadcast_to, shape=(m, n))
        known.append(of_rows(repeated, problem.exact.coefficients))
        start += m
    unit = units.force if by_load else units.length
    given = Ball.exact(controls[places][:, None]).scaled(1.0 / unit)
    exact = Data(joined(known), joined(offsets), first.exact.scale)
    rows = Stack.of(coupled, exact, given, by_load)
    level, proved = solved(rows)
    good = np.flatnonzero(proved)
    if not len(good) or level.box is None:
        return None
    some = rows.only(good), level.box.at(good), level.rows.at(good)
    return PressedRows(places[good], first, *some)


def _offsets(problem: NormalProblem, rows: Sequence[Scene]) -> Ball:
    """(m, n) the offsets of scenes of one family, with error bounds."""
    if len(rows) == 1 and rows[0] is problem.scene:
        return problem.exact.offsets[None, :]
    heights = np.array([each.asperities.heights for each in rows])
    offsets = twofold_offsets(problem.scene, problem.candidates, problem.units, heights)
    heights /= problem.units.length
    sizes = np.abs(offsets.high) + 6.0 * (np.abs(heights) + np.abs(offsets.high - heights))
    return Ball.around(offsets, 2.0**-98 * sizes)
