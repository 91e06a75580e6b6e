"""The general step: a friction step for indentations that may fall as the load rises.

Newton's method solves (1) of docs/theory/without-order.md, "The general step", for eta_i and x, the
displacements of the asperities and of the bodies in the step. Shear forces are divided by the
coefficient of friction f, tangential displacements by c_t f with Mindlin's ratio c_t. Each asperity
has its own memory curve: the deflection by its own shear force, as a function of its indentation. A
step cuts it at the smaller of the old and the new indentation, then changes it as in
docs/theory/paths.md, "Changes of the curve".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import SolverError
from convexrough.friction.curve import MemoryCurve, Point
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.state import States, by_status
from convexrough.influence import couple
from convexrough.progress import LOGGER
from convexrough.roundoff import AT_THE_END, ROUNDOFF
from convexrough.sphere import hertz

#: Newton's method stops at this residual, relative to the largest indentation. If rounding prevents
#: this accuracy, a residual up to a thousand times as large is accepted. The residual must be below
#: the largest of the RECENT latest ones; slopes jump where an asperity begins or ceases to slide.
ACCURATE, RECENT = 1e-14, 10

#: Largest numbers of Newton steps, and of halvings of a Newton step.
ITERATIONS, HALVINGS = 60, 30

#: The numbers of steps per segment that are tried, until each loss changes by at most SETTLED times
#: the sum of this loss and NEGLIGIBLE times the largest loss, and each displacement by at most
#: SETTLED_MOTION times the largest displacement.
COUNTS = (4, 8, 16, 32, 64)
SETTLED, SETTLED_MOTION, NEGLIGIBLE = 1e-3, 1e-3, 1e-6


@dataclass(frozen=True, eq=False)
class OwnCurves:
    """The memory curves of n asperities, as lines of m vertices; the last may be repeated."""

    coefficients: Array  # (n,) k of Hertz's law
    vertices: Array  # (2, n, m) indentations and deflections

    @cached_property
    def layers(self) -> tuple[Array, Array, Array]:
        """(n, m) loads and shear forces at the vertices; (n, m - 1) slopes of the layers."""
        run, added = np.diff(self.vertices)
        slopes = np.divide(added, run, out=np.zeros(run.shape), where=run > 0)
        loads = hertz.load(self.vertices[0], self.coefficients[:, None])
        forces = np.cumsum(slopes * np.diff(loads), axis=1)
        return loads, np.column_stack((np.zeros(len(forces)), forces)), slopes

    def cut(self, indentations: Array) -> OwnCurves:
        """The curves up to these indentations (n,); curves that end below these are unchanged."""
        after, front = self._front(np.zeros(len(indentations)), indentations)
        return self.ended(after, front, front)

    def step(self, indentations: Array, deflections: Array) -> OwnStep:
        """The step to these indentations and deflections; the curves are cut at `indentations`."""
        base, moved = self.vertices[0, :, -1], deflections - self.vertices[1, :, -1]
        sticks = (indentations > base) & (np.abs(moved) <= indentations - base)
        sign = np.where(sticks, 0.0, np.sign(moved))
        wanted = np.where(sign == 0, base, indentations - sign * deflections)
        (after, front), k = self._front(sign, wanted), self.coefficients
        depth = front[0]
        loads, forces, slopes = (each[np.arange(len(k)), after - 1] for each in self.layers)
        low, high = hertz.load(depth, k), hertz.load(indentations, k)
        grown = np.where(sticks, indentations - base, 1.0)
        slope = np.where(sticks, moved / grown, sign)
        stiffness = np.where(sticks, (high - low) / grown, 1.5 * np.sqrt(depth / k**3))
        return OwnStep(
            partial(self.ended, after, front, np.stack((indentations, deflections))),
            fronts=np.where(sign != 0, depth, indentations),
            forces=forces + slopes * (low - loads) + slope * (high - low),
            stiffness=np.where(np.abs(deflections) < indentations, stiffness, 0.0),
        )

    def energies(self) -> Array:
        """(n,) elastic energies of the own deflections, divided by c_t f^2."""
        loads, forces, slope = self.layers
        plain = slope * (forces[:, :-1] - slope * loads[:, :-1]) * np.diff(self.vertices[0])
        power = np.diff(loads * self.vertices[0])
        return np.asarray((plain + 0.4 * slope**2 * power).sum(axis=1))

    def _front(self, sign: Array, wanted: Array) -> tuple[Indices, Array]:
        """The points (2, n) of the curves where  indentation - sign * deflection  reaches `wanted`
        (n,), and the indices of the next vertices.
        """
        keys = self.vertices[0] - sign[:, None] * self.vertices[1]
        below, rows = (keys < wanted[:, None]).sum(axis=1), np.arange(len(sign))
        after = np.clip(below, 1, keys.shape[1] - 1)
        width = keys[rows, after] - keys[rows, after - 1]
        part = np.where(below > after, 1.0, 0.0)
        np.divide(wanted - keys[rows, after - 1], width, out=part, where=width > 0)
        here, there = self.vertices[:, rows, after - 1], self.vertices[:, rows, after]
        return after, here + np.clip(part, 0.0, 1.0) * (there - here)

    def ended(self, after: Indices, front: Array, end: Array) -> OwnCurves:
        """The curves up to their fronts (2, n) before the vertices `after`, then lines to `end`."""
        columns, after = np.arange(int(after.max()) + 2), after[:, None]
        kept = self.vertices[:, :, np.minimum(columns, self.vertices.shape[2] - 1)]
        following = np.where(columns == after, front[:, :, None], end[:, :, None])
        return OwnCurves(self.coefficients, np.where(columns < after, kept, following))


class OwnStep(NamedTuple):
    """A straight step of n asperities; arrays are (n,)."""

    curves: Callable[[], OwnCurves]  # the curves after the step, which few steps need
    fronts: Array  # indentation at the slip front; the whole indentation where an asperity sticks
    forces: Array  # shear forces T_i
    stiffness: Array  # derivatives of the forces with respect to the deflections


class Bundle(NamedTuple):
    """The state of n asperities at the load P and the shear force f T [force]; arrays are (n,)."""

    load: Fraction
    height: Fraction  # T
    indentations: Array  # at P; minus the gap of an open asperity
    curves: OwnCurves
    fronts: Array  # as in `OwnStep`
    forces: Array  # T_i, divided by f
    positions: Array  # own deflection plus drift (docs/theory/paths.md), divided by c_t f
    displacement: float = 0.0  # X / (c_t f), with the relative displacement X of the bodies
    work: float = 0.0  # work of the shear force along X, divided by c_t f^2

    @property
    def deflections(self) -> Array:
        return self.curves.vertices[1, :, -1]


class Step(NamedTuple):
    """The equations of a step from the state `now` to shear forces T_i with the sum `total`."""

    now: Bundle
    total: float
    indentations: Array  # (n,) after the step; minus the gap of an open asperity
    own: Array  # (n,) the same, but 0 if open
    loads: Array  # (n,) after the step
    curves: OwnCurves  # before the step, up to the indentations `own`
    parts: Array  # (n,) fraction of the step during which each asperity touches

    @classmethod
    def to(cls, now: Bundle, indentations: Array, total: float) -> Step:
        own, gaps = np.maximum(indentations, 0.0), np.maximum(-now.indentations, 0.0)
        parts = np.divide(own, own + gaps, out=np.zeros_like(own), where=own > 0)
        curves = now.curves.cut(own)
        loads = hertz.load(own, curves.coefficients)
        return cls(now, total, indentations, own, loads, curves, parts)

    def taken(self, deflections: Array) -> Array:
        """(n,) the displacements eta_i that lead to these own deflections; 0 if open."""
        wanted, nothing = deflections - self.now.deflections, np.zeros(len(deflections))
        return np.divide(wanted, self.parts, out=nothing, where=self.parts > 0)

    def at(self, eta: Array) -> OwnStep:
        """The step of each asperity i that is displaced by eta_i."""
        targets = self.now.deflections + eta * self.parts
        return self.curves.step(self.own, np.clip(targets, -self.own, self.own))


class Stepper:
    """Solver of general steps, for scenes whose compliance matrix fits in memory."""

    def __init__(self, levels: FrictionLevels) -> None:
        scene, which = levels.scene, levels.candidates
        checks.fits_in_memory("asperities", len(which), 24.0, 2)
        modulus = scene.material.contact_modulus
        self.levels = levels
        self.coefficients = hertz.local_coefficient(modulus, scene.relative_radii[which])
        self.influence = couple(scene, which, 1.0 / (np.pi * modulus), "dense")
        self.A = self.influence.matrix

    def start(self, load: Fraction) -> Bundle:
        """The state without shear at a load."""
        found = self.levels.depths(load)
        own, zero = np.maximum(found, 0.0), np.zeros(len(found))
        curves = OwnCurves(self.coefficients, np.stack(((zero, own), (zero, zero))).mT)
        return Bundle(load, Fraction(0), found, curves, own, zero, zero)

    def along(self, start: MemoryCurve, points: Sequence[Point], steps: int) -> list[Bundle]:
        """The state at each point, with `steps` general steps per segment."""
        now, found, segments = self.start(start.load), list[Bundle](), list[list[Point]]()
        for (load, height), (target, shear) in pairwise([(start.load, start.height), *points]):
            grading = 1 if load else 3  # indentations grow as L^(2/3)
            parts = [Fraction(k + 1, steps) ** grading for k in range(steps)]
            added, moved = target - load, shear - height
            segments.append([(load + x * added, height + x * moved) for x in parts])
        self.levels.prepare(load for each in segments for load, _ in each)
        for segment in segments:
            for load, height in segment:
                now = self.step(now, load, height)
            found.append(now)
        return found

    def step(self, now: Bundle, load: Fraction, height: Fraction) -> Bundle:
        """The state after one step."""
        if not load:
            lost = float(now.height) / 2 * now.displacement
            return self.start(load)._replace(work=now.work - lost)
        step = Step.to(now, self.levels.depths(load), float(height))
        gross = load - abs(height) <= AT_THE_END * Fraction(ROUNDOFF) * load
        eta, x, own = self._gross(step) if gross else self._solve(step)
        moved, displacement = now.positions + eta, now.displacement + x
        work = now.work + float(now.height + height) / 2 * x
        known = step.indentations, own.curves(), own.fronts, own.forces
        return Bundle(load, height, *known, moved, displacement, work)

    def _gross(self, step: Step) -> tuple[Array, float, OwnStep]:
        """eta, x and the own steps at the smallest displacement at which all asperities slide."""
        sign, on = np.sign(step.total), step.own > 0
        coupled = self.A @ (sign * step.loads - step.now.forces)
        x = sign * float((sign * (step.taken(sign * step.own) + coupled)[on]).max())
        return x - coupled, x, step.at(x - coupled)

    def _solve(self, step: Step) -> tuple[Array, float, OwnStep]:
        """eta, x and the own steps, from deflections that are equal fractions of indentations."""
        size, load = float(np.abs(step.indentations).max()), float(step.loads.sum())
        eta = step.taken(step.total / load * step.own)
        tried = [self._iterate(step, np.append(eta, eta @ step.loads / load))]
        for _ in range(ITERATIONS):
            iterate, worst = tried[-1], max(each.residual for each in tried[-RECENT:])
            if iterate.residual <= ACCURATE * size:
                break
            change = self._newton(iterate)
            for k in range(HALVINGS):
                following = self._iterate(step, iterate.unknown + 2.0**-k * change)
                if following.residual < worst:
                    break
            else:
                break
            tried.append(following)
        best = min(tried, key=lambda each: each.residual)
        if best.residual > 1e3 * ACCURATE * size:
            found = f"a residual of {best.residual / size:.1e} of the indentation"
            raise SolverError(f"{found} is left", solver="general step", advice="use more steps")
        return best.unknown[:-1], float(best.unknown[-1]), best.own

    def _iterate(self, step: Step, unknown: Array) -> _Iterate:
        own, x = step.at(unknown[:-1]), float(unknown[-1])
        defect = unknown[:-1] + self.A @ (own.forces - step.now.forces) - x
        excess, slopes = float(own.forces.sum()) - step.total, step.parts * own.stiffness
        total, rounding = float(slopes.sum()), len(slopes) * ROUNDOFF
        missing = abs(excess) / total if total > 0 else np.inf
        beyond = abs(excess) > rounding * float(np.abs(own.forces).sum())
        residual = max(float(np.abs(defect).max()), missing if beyond else 0.0)
        return _Iterate(unknown, own, slopes, np.append(defect, excess), residual)

    def _newton(self, iterate: _Iterate) -> Array:
        """The change of eta and x, from a system in x and those eta_i on which T_i depends."""
        some, wanted = np.flatnonzero(iterate.slopes), -iterate.defect
        slopes, moved, n = iterate.slopes[some], wanted[:-1], len(some)
        coupled, matrix = self.A[:, some] * slopes, np.zeros((n + 1, n + 1))
        matrix[:n, :n], matrix[:n, n], matrix[n, :n] = coupled[some], -1.0, slopes
        matrix[range(n), range(n)] += 1.0
        try:
            found = np.linalg.solve(matrix, np.append(moved[some], wanted[-1]))
        except np.linalg.LinAlgError as error:
            raise SolverError("everything slides", solver="general step") from error
        return np.append(moved + found[-1] - coupled @ found[:-1], found[-1])

    def lost(self, state: Bundle) -> float:
        """The work less the elastic energy (of own deflections and coupling), over c_t f^2."""
        stored = float(state.curves.energies().sum())
        return state.work - (stored + 0.5 * float(state.forces @ self.A @ state.forces))


class _Iterate(NamedTuple):
    unknown: Array  # (n + 1,) eta, the displacements of the asperities in the step; then x
    own: OwnStep  # the steps of the asperities that are displaced by eta
    slopes: Array  # (n,) dT_i / deta_i
    defect: Array  # (n + 1,) the left sides of (1) minus the right sides
    residual: float  # the largest |defect| of eta or, if larger, the displacement to correct T


class SteppedPath(NamedTuple):
    """Results of general steps at m points, without proofs."""

    states: States
    losses: Array  # (m,) [force length] energy lost since the start; nan if it does not settle
    status: NDArray[np.str_]  # (m, N) "open" or "undecided"
    fronts: Array  # (m, n) as in `OwnStep`, for each candidate


def followed(
    by: Stepper, start: MemoryCurve, points: Sequence[Point], steps: int | None = None
) -> SteppedPath:
    """The results of general steps along a path, with `steps` steps per segment.

    With None, the number n of steps is doubled until losses and displacements settle. The error of
    the loss W_n is about e / n^2 with some constant e, so the loss is then (4 W_2n - W_n) / 3.
    """
    levels, f = by.levels, float(by.levels.coefficient.value)
    travel = float((levels.coefficient * levels.ratio).value)

    def found(count: int) -> SteppedPath:
        LOGGER.info(f"computing {count} general steps per segment")
        bundles = by.along(start, points, count)
        positions = travel * np.array([each.positions for each in bundles])
        own = travel * np.array([each.deflections for each in bundles])
        forces = f * np.array([each.forces for each in bundles])
        displacements = travel * np.array([each.displacement for each in bundles])
        parts = (displacements, forces, positions, positions - own)
        return SteppedPath(
            states=States(*(Ball.around(part, np.inf) for part in parts)),
            losses=frozen(f * travel * np.array([by.lost(each) for each in bundles])),
            status=frozen(np.array([by_status(levels, levels.at(each.load)) for each in bundles])),
            fronts=np.array([each.fronts for each in bundles]),
        )

    if steps is not None:
        return found(steps)
    here, best = found(COUNTS[0]), np.full(len(points), np.inf)
    for count in COUNTS[1:]:
        before, here, last = here, found(count), best
        best = (4.0 * here.losses - before.losses) / 3.0
        settled = np.abs(best - last) <= SETTLED * (best + NEGLIGIBLE * best.max(initial=0.0))
        far = here.states.displacements.value
        moved = far - before.states.displacements.value
        if settled.all() and np.abs(moved).max() <= SETTLED_MOTION * np.abs(far).max():
            break
    known = np.maximum.accumulate(np.maximum(best, 0.0))
    return here._replace(losses=frozen(np.where(settled, known, np.nan)))
