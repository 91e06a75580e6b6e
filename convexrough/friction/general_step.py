"""The general step: a friction step for indentations that may fall as the load rises.

Shear forces are divided by the coefficient of friction f, tangential displacements by c_t f with
Mindlin's ratio c_t. Each asperity i keeps its own memory curve, in the plane of its indentation and
its deflection. A straight step to the load P and the shear force T computes the normal solution at
P. Then Newton's method solves (1) of docs/theory/without-order.md, "The general step", for eta_i
and x: the displacements of the asperities and of the bodies in the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.errors import SolverError
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.levels import FrictionLevels, Snapshot
from convexrough.friction.own_curves import OwnCurves, OwnStep
from convexrough.friction.state import Point, States, by_status
from convexrough.influence import couple
from convexrough.progress import LOGGER
from convexrough.roundoff import ROUNDOFF
from convexrough.sphere import hertz

#: Newton's method stops at this residual, relative to the largest indentation. If rounding prevents
#: this, a residual up to a thousand times as large is accepted.
ACCURATE = 1e-14

#: Largest numbers of Newton steps, of halvings of a Newton step, and of halvings of a general step.
ITERATIONS, HALVINGS, CUTS = 60, 30, 6

#: The residual after a Newton step may not exceed the largest of this many latest residuals. Within
#: this limit it may grow, because slopes jump where an asperity begins or ceases to slide.
RECENT = 10

#: The smallest and the largest number of steps per segment.
FEWEST, MOST = 4, 64

#: The number of steps is doubled until each loss changes by less than SETTLED of itself, and the
#: displacements by less than SETTLED_MOTION of the largest. The change of a loss is compared with
#: the loss plus NEGLIGIBLE times the largest loss.
SETTLED, SETTLED_MOTION, NEGLIGIBLE = 1e-3, 1e-3, 1e-6


@dataclass(frozen=True)
class Bundle:
    """The state of n asperities after a step.

    load, height : [force] P and T = Q / f
    level     : the normal solution at P
    curves    : the memory curves of the asperities
    fronts    : (n,) indentation at the slip front of each; its whole indentation where it sticks
    carried   : (n,) [force] T_i, the shear forces of the asperities divided by f
    positions : (n,) deflection plus drift, divided by c_t f
    displacement : X / (c_t f), with the relative displacement X of the bodies
    work      : work of the shear force along X, divided by c_t f^2
    """

    load: Fraction
    level: Snapshot
    curves: OwnCurves
    fronts: Array
    carried: Array
    positions: Array
    displacement: float = 0.0
    height: Fraction = Fraction(0)
    work: float = 0.0

    @property
    def deflections(self) -> Array:
        """(n,) the own deflection of each asperity, divided by c_t f."""
        return self.curves.heights[:, -1]


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
        own, zero = np.maximum(level.indentations, 0.0), np.zeros(len(level.indentations))
        return Bundle(curve.load, level, OwnCurves.pressed(own, self.coefficients), own, zero, zero)

    def along(self, start: MemoryCurve, points: Sequence[Point], steps: int) -> list[Bundle]:
        """The state at each point, with `steps` general steps per segment."""
        now, found, segments = self.start(start), list[Bundle](), list[list[Point]]()
        for (load, height), (target, shear) in pairwise([(start.load, start.height), *points]):
            grading = 1 if load else 3  # indentations grow as L^(2/3)
            parts = [Fraction(k + 1, steps) ** grading for k in range(steps)]
            segments.append(
                [(load + x * (target - load), height + x * (shear - height)) for x in parts]
            )
        self.levels.prepare(load for each in segments for load, _ in each)
        for segment in segments:
            for load, height in segment:
                now = self.step(now, load, height)
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
        """The state at the smallest displacement at which all asperities slide."""
        trial, on = _Trial.of(self, now, level), level.indentations > 0
        coupled = self.A @ (sign * level.loads - now.carried)
        taken = (sign * level.indentations - now.deflections)[on] / trial.parts[on]
        x = sign * float((sign * (taken + coupled[on])).max())
        return self._reached(now, level, trial.at(x - coupled, x, sign * level.load))

    def _solve(self, now: Bundle, level: Snapshot, total: float) -> Bundle:
        trial = _Trial.of(self, now, level)
        size = float(np.abs(level.indentations).max())
        eta, x = trial.even(total)
        tried = [trial.at(eta, x, total)]
        residuals = [tried[0].residual]
        for _ in range(ITERATIONS):
            if residuals[-1] <= ACCURATE * size:
                break
            iterate, worst = tried[-1], max(residuals[-RECENT:])
            change, shift = iterate.newton(self.A)
            for k in range(HALVINGS):
                part = 2.0**-k
                following = trial.at(iterate.eta + part * change, iterate.x + part * shift, total)
                if (residual := following.residual) < worst:
                    break
            else:
                break
            tried.append(following)
            residuals.append(residual)
        least = min(residuals)
        if least > 1e3 * ACCURATE * size:
            found = f"a residual of {least / size:.1e} of the indentation"
            raise SolverError(f"{found} is left", solver="general step", advice="use more steps")
        return self._reached(now, level, tried[residuals.index(least)])

    def _reached(self, now: Bundle, level: Snapshot, iterate: _Iterate) -> Bundle:
        moved = now.positions + iterate.eta
        displacement = now.displacement + iterate.x
        own = iterate.own
        return Bundle(now.load, level, own.curves, own.fronts, own.forces, moved, displacement)

    def stored(self, state: Bundle) -> float:
        """The elastic energy divided by c_t f^2: that of own deflections, plus that of coupling."""
        own = float(state.curves.energies().sum())
        return own + 0.5 * float(state.carried @ self.A @ state.carried)


class SteppedPath(NamedTuple):
    """Results of general steps at m points, without proofs.

    losses : (m,) [force length] energy lost since the start; nan where doubling the number of steps
        still changes it
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
    points: Sequence[Point],
    steps: int | None = None,
    stepper: type[Stepper] | None = None,
) -> SteppedPath:
    """The results of general steps along a path.

    The loss W_n by n steps has an error of about e / n^2, with some constant e. The loss returned
    is (4 W_2n - W_n) / 3; its change from one doubling to the next estimates its error.

    steps : number n of steps per segment; the loss returned is then W_n. None doubles the number
        until losses and displacements settle, up to 64
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
        fronts=np.array([each.fronts for each in bundles]),
    )


class _Iterate(NamedTuple):
    eta: Array  # (n,) displacements of the asperities in the step
    x: float  # displacement of the bodies in the step
    own: OwnStep
    slopes: Array  # dT_i / deta_i
    defect: Array  # (n,) defects of the first equation of (1)
    excess: float  # sum of T_i minus T

    @property
    def residual(self) -> float:
        """The largest defect or the displacement that corrects `excess`, whichever is larger."""
        stiffness, rounding = float(self.slopes.sum()), len(self.eta) * ROUNDOFF
        missing = abs(self.excess) / stiffness if stiffness > 0 else np.inf
        beyond = abs(self.excess) > rounding * float(np.abs(self.own.forces).sum())
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
    """The equations of a step from the state `now` to the normal solution `level`."""

    stepper: Stepper
    now: Bundle
    level: Snapshot
    indentations: Array  # (n,) after the step, 0 where open
    curves: OwnCurves  # before the step, up to these indentations
    parts: Array  # (n,) fraction of the step during which each asperity touches

    @classmethod
    def of(cls, stepper: Stepper, now: Bundle, level: Snapshot) -> _Trial:
        own = np.maximum(level.indentations, 0.0)
        gaps = np.maximum(-now.level.indentations, 0.0)
        parts = np.divide(own, own + gaps, out=np.zeros_like(own), where=own > 0)
        return cls(stepper, now, level, own, now.curves.cut(own), parts)

    def even(self, total: float) -> tuple[Array, float]:
        """Start values of eta and x: each asperity is deflected by the same fraction of its limit.

        This limit is the indentation, and the fraction is `total` divided by the load.
        """
        wanted = total / self.level.load * self.indentations - self.now.deflections
        eta = np.divide(wanted, self.parts, out=np.zeros(len(wanted)), where=self.parts > 0)
        return eta, float(eta @ self.level.loads / self.level.load)

    def at(self, eta: Array, x: float, total: float) -> _Iterate:
        limits = self.indentations
        targets = np.clip(self.now.deflections + eta * self.parts, -limits, limits)
        own = self.curves.step(limits, targets)
        defect = eta + self.stepper.A @ (own.forces - self.now.carried) - x
        excess = float(own.forces.sum()) - total
        return _Iterate(eta, x, own, self.parts * own.stiffness, defect, excess)
