"""The general step: a friction step for indentations that may fall as the load rises.

Each asperity i keeps its own memory curve, in the plane of its indentation and its deflection over
c_t f. A straight step to the load P and the shear force f T computes the normal solution at P. Then
Newton's method solves (1) of docs/theory/without-order.md, "The general step", for eta_i and x: the
displacements of the asperities and of the bodies in the step. Shear forces are divided by f, and
displacements by c_t f.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.errors import SolverError
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.levels import FrictionLevels, Snapshot
from convexrough.friction.state import States, by_status
from convexrough.influence import couple
from convexrough.progress import LOGGER
from convexrough.roundoff import ROUNDOFF
from convexrough.sphere import hertz

#: Newton's method stops at this residual, relative to the largest indentation. If rounding keeps
#: the residual larger, up to a thousand times as much is accepted.
ACCURATE = 1e-14

#: Largest numbers of Newton steps, of halvings of a Newton step, and of halvings of a general step.
ITERATIONS, HALVINGS, CUTS = 60, 30, 6

#: The residual after a Newton step may not exceed the largest of this many latest residuals. It may
#: grow, because slopes jump where an asperity begins or ceases to slide.
RECENT = 10

#: The smallest and the largest number of steps per segment.
FEWEST, MOST = 4, 64

#: The steps are doubled until each loss, and the displacements, change by less than these
#: fractions. A loss below NEGLIGIBLE times the largest may change by more.
SETTLED, SETTLED_MOTION, NEGLIGIBLE = 1e-3, 1e-3, 1e-6


@dataclass(frozen=True)
class Bundle:
    """The state of n asperities after a step.

    load, height : [force] P and T = Q / f
    curves    : the memory curve of each asperity
    carried   : (n,) T_i
    positions : (n,) deflection plus drift, divided by c_t f
    displacement : X / (c_t f), with the relative displacement X of the bodies
    work      : work of the shear force along X, divided by c_t f^2
    """

    load: Fraction
    level: Snapshot
    curves: tuple[MemoryCurve, ...]
    carried: Array
    positions: Array
    displacement: float = 0.0
    height: Fraction = Fraction(0)
    work: float = 0.0

    @property
    def deflections(self) -> Array:
        """(n,) own deflection over c_t f."""
        return np.array([float(curve.height) for curve in self.curves])


class Stepper:
    """Solver of general steps, for scenes whose compliance matrix fits in memory."""

    def __init__(self, levels: FrictionLevels) -> None:
        scene = levels.scene
        checks.fits_in_memory("asperities", len(scene), 24.0, 2)
        modulus = scene.material.contact_modulus
        self.levels = levels
        self.coefficients = hertz.local_coefficient(modulus, scene.relative_radii)
        everyone = np.arange(len(scene))
        self.A = couple(scene, everyone, 1.0 / (np.pi * modulus), "dense").matrix

    def start(self, curve: MemoryCurve) -> Bundle:
        """The state without shear at the load of this curve."""
        level = self.levels.snapshot(curve.load)
        own = tuple(MemoryCurve.pressed(max(each, 0.0)) for each in level.indentations)
        zero = np.zeros(len(own))
        return Bundle(curve.load, level, own, zero, zero)

    def along(
        self, start: MemoryCurve, points: Sequence[tuple[Fraction, Fraction]], steps: int
    ) -> list[Bundle]:
        """The state at each point, with `steps` general steps per segment."""
        now, found = self.start(start), list[Bundle]()
        load, height = start.load, start.height
        for target, shear in points:
            grading = 1 if load else 3  # indentations grow as L^(2/3)
            for k in range(steps):
                part = Fraction(k + 1, steps) ** grading
                now = self.step(
                    now, load + part * (target - load), height + part * (shear - height)
                )
            load, height = target, shear
            found.append(now)
        return found

    def step(self, now: Bundle, load: Fraction, height: Fraction, cuts: int = CUTS) -> Bundle:
        """The state after one step, which is halved if Newton's method does not converge."""
        level = self.levels.snapshot(load)
        try:
            if not load:
                found = self.start(MemoryCurve())
            elif abs(height) == load:
                found = self._gross(now, level, 1 if height > 0 else -1)
            else:
                found = self._solve(now, level, float(height))
        except SolverError:
            if cuts == 0:
                raise
            middle = (now.load + load) / 2, (now.height + height) / 2
            return self.step(self.step(now, *middle, cuts - 1), load, height, cuts - 1)
        mean, run = float(now.height + height) / 2, found.displacement - now.displacement
        return replace(found, load=load, height=height, work=now.work + mean * run)

    def _gross(self, now: Bundle, level: Snapshot, sign: int) -> Bundle:
        """The state in which all asperities slide, at the least displacement at which they do."""
        trial, on = _Trial.of(self, now, level), level.indentations > 0
        coupled = self.A @ (sign * level.loads - now.carried)
        taken = (sign * level.indentations - trial.deflections)[on] / trial.parts[on]
        x = sign * float((sign * (taken + coupled[on])).max())
        return self._reached(now, level, trial.at(x - coupled, x, sign * level.load))

    def _solve(self, now: Bundle, level: Snapshot, total: float) -> Bundle:
        trial = _Trial.of(self, now, level)
        size = float(np.abs(level.indentations).max())
        eta, x = trial.even(total)
        tried = [trial.at(eta, x, total)]
        for _ in range(ITERATIONS):
            iterate, worst = tried[-1], max(each.residual for each in tried[-RECENT:])
            if iterate.residual <= ACCURATE * size:
                break
            change, shift = iterate.newton(self.A)
            part = 1.0
            for _ in range(HALVINGS):
                following = trial.at(iterate.eta + part * change, iterate.x + part * shift, total)
                if following.residual < worst:
                    break
                part /= 2
            else:
                break
            tried.append(following)
        iterate = min(tried, key=lambda each: each.residual)
        if iterate.residual > 1e3 * ACCURATE * size:
            found = f"a residual of {iterate.residual / size:.1e} of the indentation"
            raise SolverError(f"{found} is left", solver="general step", advice="use more steps")
        return self._reached(now, level, iterate)

    def _reached(self, now: Bundle, level: Snapshot, iterate: _Iterate) -> Bundle:
        moved = now.positions + iterate.eta
        displacement = now.displacement + iterate.x
        return Bundle(now.load, level, iterate.curves, iterate.carried, moved, displacement)

    def stored(self, state: Bundle) -> float:
        """The elastic energy divided by c_t f^2: that of own deflections, plus that of coupling."""
        own = 0.0
        for curve, k in zip(state.curves, self.coefficients, strict=True):
            carried = 0.0
            levels = np.array([float(level) for level in curve.levels])
            loads = hertz.load(levels, k)
            for j, slope in enumerate(map(float, curve.slopes)):
                run, added = levels[j + 1] - levels[j], loads[j + 1] - loads[j]
                own += slope * (carried - slope * loads[j]) * run
                own += 0.4 * slope**2 * (loads[j + 1] * levels[j + 1] - loads[j] * levels[j])
                carried += slope * added
        return own + 0.5 * float(state.carried @ self.A @ state.carried)


class SteppedPath(NamedTuple):
    """Results of general steps at m points, without proofs.

    losses : (m,) [force length] energy lost since the start; nan if the doubling does not settle
    status : (m, N) "open" or "undecided"
    fronts : (m, N) indentation at the slip front of each asperity; its indentation if it sticks
    """

    states: States
    losses: Array
    status: NDArray[np.str_]
    fronts: Array


def followed(
    levels: FrictionLevels,
    start: MemoryCurve,
    points: Sequence[tuple[Fraction, Fraction]],
    steps: int | None = None,
    stepper: type[Stepper] | None = None,
) -> SteppedPath:
    """The results of general steps along a path.

    The loss W_n by n steps has an error of about e / n^2, with some constant e. The loss returned
    is (4 W_2n - W_n) / 3; its change from one doubling to the next estimates its error.

    steps : number of steps per segment, with which the loss is W_n; None doubles the number until
        losses and displacements settle
    """
    by = (stepper or Stepper)(levels)

    def found(count: int) -> SteppedPath:
        LOGGER.info(f"solving {count} general steps per segment, as order is not proved")
        return _found(levels, by, by.along(start, points, count))

    if steps is not None:
        return found(steps)
    count, before, best = 2 * FEWEST, found(FEWEST), np.full(len(points), np.inf)
    while True:
        here = found(count)
        last, best = best, (4.0 * here.losses - before.losses) / 3.0
        settled = np.abs(best - last) <= SETTLED * (best + NEGLIGIBLE * best.max(initial=0.0))
        moved = here.states.displacements - before.states.displacements
        near = np.abs(moved).max() <= SETTLED_MOTION * np.abs(here.states.displacements).max()
        if (settled.all() and near) or count >= MOST:
            known = np.maximum.accumulate(np.maximum(best, 0.0))
            return here._replace(losses=frozen(np.where(settled, known, np.nan)))
        count, before = 2 * count, here


def _found(levels: FrictionLevels, stepper: Stepper, bundles: Sequence[Bundle]) -> SteppedPath:
    unit = (float(levels.coefficient.value), float((levels.coefficient * levels.ratio).value))
    f, travel = unit
    positions = travel * np.array([each.positions for each in bundles])
    own = travel * np.array([each.deflections for each in bundles])
    forces = f * np.array([each.carried for each in bundles])
    spent = np.array([each.work - stepper.stored(each) for each in bundles])
    displacements = travel * np.array([each.displacement for each in bundles])
    parts = (displacements, forces, positions, positions - own)
    unknown = (np.full(part.shape, np.inf) for part in parts)
    fields = (frozen(each) for pair in zip(parts, unknown, strict=True) for each in pair)
    return SteppedPath(
        states=States(*fields),
        losses=frozen(f * travel * spent),
        status=frozen(np.array([by_status(levels, levels.at(each.load)) for each in bundles])),
        fronts=np.array([[_front(curve) for curve in each.curves] for each in bundles]),
    )


def _front(curve: MemoryCurve) -> float:
    return float(curve.load if curve.front is None else curve.front)


class _Iterate(NamedTuple):
    eta: Array
    x: float
    curves: tuple[MemoryCurve, ...]
    carried: Array
    slopes: Array  # dT_i / deta_i
    defect: Array  # (n,) defects of the first equation of (1)
    excess: float  # sum of T_i minus T

    @property
    def residual(self) -> float:
        """The largest defect, or the displacement that supplies what the total lacks."""
        stiffness, rounding = float(self.slopes.sum()), len(self.carried) * ROUNDOFF
        missing = abs(self.excess) / stiffness if stiffness > 0 else np.inf
        beyond = abs(self.excess) > rounding * float(np.abs(self.carried).sum())
        return max(float(np.abs(self.defect).max()), missing if beyond else 0.0)

    def newton(self, A: Array) -> tuple[Array, float]:
        """The changes of eta and x in a Newton step."""
        n = len(self.eta)
        matrix = np.empty((n + 1, n + 1))
        matrix[:n, :n] = A * self.slopes
        matrix[np.diag_indices(n)] += 1.0
        matrix[:n, n] = -1.0
        matrix[n, :n] = self.slopes
        matrix[n, n] = 0.0
        try:
            step = np.linalg.solve(matrix, -np.append(self.defect, self.excess))
        except np.linalg.LinAlgError as error:
            raise SolverError("everything slides", solver="general step") from error
        return step[:n], float(step[n])


class _Trial(NamedTuple):
    """The equations of a step from a state to a level of the normal load."""

    stepper: Stepper
    now: Bundle
    level: Snapshot
    deflections: Array  # (n,) before the step
    parts: Array  # (n,) fraction of the step during which each asperity touches

    @classmethod
    def of(cls, stepper: Stepper, now: Bundle, level: Snapshot) -> _Trial:
        own = np.maximum(level.indentations, 0.0)
        gaps = np.maximum(-now.level.indentations, 0.0)
        parts = np.divide(own, own + gaps, out=np.zeros_like(own), where=own > 0)
        return cls(stepper, now, level, now.deflections, parts)

    def even(self, total: float) -> tuple[Array, float]:
        """Start values of eta and x: each asperity carries the same part of its friction limit."""
        own = np.maximum(self.level.indentations, 0.0)
        wanted = total / self.level.load * own - self.deflections
        eta = np.divide(wanted, self.parts, out=np.zeros_like(own), where=self.parts > 0)
        return eta, float(eta @ self.level.loads / self.level.load)

    def at(self, eta: Array, x: float, total: float) -> _Iterate:
        curves, carried, slopes = [], np.zeros(len(eta)), np.zeros(len(eta))
        targets = self.deflections + eta * self.parts
        for i, (old, k) in enumerate(zip(self.now.curves, self.stepper.coefficients, strict=True)):
            own = max(float(self.level.indentations[i]), 0.0)
            curve, _ = old.go(own, min(max(targets[i], -own), own))
            curves.append(curve)
            if own == 0.0:
                continue
            levels = np.array([float(level) for level in curve.levels])
            loads = hertz.load(levels, k)
            carried[i] = np.diff(loads) @ np.array([float(slope) for slope in curve.slopes])
            if abs(targets[i]) < own:
                slopes[i] = self.parts[i] * _slope(old, curve, k)
        defect = eta + self.stepper.A @ (carried - self.now.carried) - x
        return _Iterate(
            eta, x, tuple(curves), carried, slopes, defect, float(carried.sum()) - total
        )


def _slope(old: MemoryCurve, curve: MemoryCurve, k: float) -> float:
    """The derivative of T_i with respect to the deflection: by sticking, or at the slip front."""
    high = float(curve.load)
    if curve.front is None and curve.load > old.load:
        low = float(old.load)
        return float((hertz.load(high, k) - hertz.load(low, k)) / (high - low))
    front = high if curve.front is None else float(curve.front)
    return float(1.5 * np.sqrt(front / k**3))
