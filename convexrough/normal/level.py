"""Normal solutions of a scene at total loads L, from which friction and gradients are computed.

A proved solution is the only one in a box of loads. At the total load L it has the loads P_i(L),
the approach D0(L), the indentations n_i(L) (minus the gap where open), and the energy

    V(L) = min over sum P = L of  sum (3/5) k P^(5/3) + P'AP/2 - d'P,    so that dV/dL = D0.

The coefficients k, the operator A and the offsets d are those of `NormalProblem`. The derivatives
q = dP/dL and S = dD0/dL solve  q_i / c_i + (A q)_i = S,  sum q = 1  for the touching asperities,
with c = dP/dn = (3/2) P^(1/3) / k; elsewhere q_i = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball, where
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array
from convexrough.convex.newton_step import correct
from convexrough.convex.theorem import distance, excess
from convexrough.errors import ProofError, SolverError
from convexrough.normal.boxes import Box
from convexrough.normal.problem import REDUCTION, NormalProblem
from convexrough.normal.proved import Obstacle, Proved, proved
from convexrough.normal.refine import CORRECTIONS, ENOUGH, Trial, refined_loads
from convexrough.normal.stack import Stack
from convexrough.normal.together import NUMBERS, Rows, solved
from convexrough.roundoff import SAFETY
from convexrough.sphere import hertz

#: Largest accepted residual of `Level.response` after refinement, divided by that before it.
SOLVED = 1e-6

#: Largest number of candidates for which levels are solved together: for more this saves no time.
MOST = 512

#: A function of a problem and initial loads (or None) that returns loads, all in scaled units.
Press = Callable[[NormalProblem, Array | None], Array]


class Response(NamedTuple):
    """The solution x, beta of the linear system of `Level.response`, as balls in scaled units.

    loads : (n,) x, 0 where open;  approach : beta
    """

    loads: Ball
    approach: Ball


class Springs(NamedTuple):
    """The contacts of a level as linear springs, for the system that `Level.response` solves.

    touching  : (n,) True where the asperity touches and bounds on its compliance are known
    doubtful  : (n,) True for other asperities that may touch
    slopes    : (n,) c = dP/dn, 0 where not touching;  compliance : (n,) 1/c, 0 where not touching
    bound     : (n,) h, a lower bound on 1/c where the asperity may touch; infinite where open
    margin    : mu of docs/theory/one-theorem.md, with H = diag(h); 0 if nothing is proved
    """

    touching: NDArray[np.bool_]
    doubtful: NDArray[np.bool_]
    slopes: Array
    compliance: Ball
    bound: Array
    margin: float


@dataclass(frozen=True, eq=False)
class Level:
    """The normal solution at one total load, as balls in scaled units.

    load, approach : () the total load L and the approach D0(L)
    loads, indentation : (n,) P_i(L) and n_i(L) of the asperities that could touch (candidates)
    touching : (n,) True where the asperity is proved to touch
    open     : (n,) True where it is proved to be open
    solution : what is proved; None without a proof, and at L = 0
    trial    : the computed loads and their residuals; None at L = 0
    """

    problem: NormalProblem
    load: Ball
    approach: Ball
    loads: Ball
    indentation: Ball
    touching: NDArray[np.bool_]
    open: NDArray[np.bool_]
    solution: Proved | None = None
    trial: Trial | None = None

    @classmethod
    def of(cls, found: Proved, load: Ball) -> Level:
        """The level of a proved solution whose total load is `load`."""
        return cls(
            found.problem,
            load,
            found.approach,
            found.loads,
            found.indentation,
            found.touching,
            found.open,
            found,
            found.trial,
        )

    @classmethod
    def unproved(cls, problem: NormalProblem, state: Trial, load: Ball) -> Level:
        """A level of loads near which nothing is proved.

        The balls of loads and indentations have infinite radii. So has that of the approach, unless
        the approach is prescribed; then its radius is 0.
        """
        unknown = Ball.around(state.loads, np.inf)
        none = np.zeros(len(problem), dtype=bool)
        approach = Ball.around(state.approach.mid, np.inf if problem.load else 0.0)
        indentation = Ball.around(state.indentation.mid, np.inf)
        return cls(problem, load, approach, unknown, indentation, none, none, None, state)

    @classmethod
    def unloaded(cls, problem: NormalProblem) -> Level:
        """The level at L = 0, where the first asperity just touches."""
        offsets = problem.exact.offsets
        ends = np.array([offsets.lower.max(), offsets.upper.max()])
        highest = offsets[int(np.argmax(offsets.value))]
        ties = np.flatnonzero(offsets.upper >= ends[0])
        if len(ties) > 1:
            highest = Ball.around(highest.mid, highest.radius + (ends[1] - ends[0]))
        below = offsets - highest
        n = len(problem)
        touching = np.zeros(n, dtype=bool)
        zero = Ball.exact(np.zeros(n))
        return cls(problem, Ball.exact(0.0), -highest, zero, below, touching, below.negative)

    @cached_property
    def energy(self) -> Ball:
        """The energy V(L) of this module's docstring."""
        return energies([self])[0]

    @cached_property
    def tangent(self) -> Response:
        """The derivatives dP/dL and dD0/dL."""
        return self.response(Ball.exact(np.zeros(len(self.problem))), Ball.exact(1.0))

    @cached_property
    def springs(self) -> Springs:
        """The asperities as linear springs, for `response`. Raises ProofError at L = 0."""
        found, state = self.solution, self.trial
        if state is None:
            raise ProofError("at no load the approach has no derivative")
        zero = Ball.exact(np.zeros(len(self.problem)))
        if found is None:
            inside = np.asarray(state.inside)
            own = state.gap + state.indentation  # k P^(2/3)
            ratio = where(inside, own / where(inside, Ball.exact(state.loads), 1 + zero), zero)
            compliance = ratio / 1.5
            nowhere = np.full(len(self.problem), np.inf)
            slopes = np.where(inside, 1.0 / np.where(inside, compliance.value, 1.0), 0.0)
            return Springs(inside, ~inside & False, slopes, compliance, nowhere, 0.0)
        stiffness = 1.5 / self.problem.exact.coefficients * self.loads.cbrt()
        touching = self.touching & self.loads.positive  # else nothing bounds its compliance
        with np.errstate(divide="ignore"):
            known = np.maximum(found.compliance, (1.0 - SAFETY) / stiffness.upper)
        bound = np.where(self.open, np.inf, known)
        return Springs(
            touching,
            ~touching & ~self.open,
            np.where(touching, stiffness.value, 0.0),
            where(touching, 1.0 / where(touching, stiffness, 1 + zero), zero),
            bound,
            1.0 - min(found.box.convexity_number, found.box.problem.convexity_at(bound)),
        )

    def response(self, right: Ball, total: Ball) -> Response:
        """The solution x (n,) and beta, a number, of  x / c + A x = right + beta,  sum x = total.

        The equations hold for touching asperities; x is 0 for others. The solution is refined in
        pairs of float64 numbers until the residual no longer halves. The bounds on its error
        (docs/theory/one-theorem.md) allow for asperities that are not proved to touch or be open.

        right : (n,) the given right side;  total : the given sum of x

        Raises SolverError where the system is singular or nearly so, and no derivative exists.
        """
        problem, springs = self.problem, self.springs
        touching, c, compliance = springs.touching, springs.slopes, springs.compliance
        weights, largest = c / c.sum(), int(np.argmax(c))

        def completed(x: Pair) -> Pair:
            at = x.at(largest) + (total.mid - x.total())
            high, low = x.high.copy(), x.low.copy()
            high[largest], low[largest] = at
            return Pair(high, low)

        def residual(x: Pair, product: Ball) -> tuple[Ball, Ball]:
            """x / c + A x - right - beta, and beta; with it the mean, weighted by c, is 0."""
            above = compliance * x + product - right
            mean = float(weights @ above.value)
            beta = Ball.exact(mean) + float(weights @ (above - mean).value)
            return above - beta, beta

        def size_of(left: Ball) -> float:
            return float(np.sqrt(c @ left.value**2))

        x = completed(Pair.exact(float(total.value) * weights))
        left, beta = residual(x, problem.product(x))
        size = size_of(left)
        first = max(size, size_of(right))
        for _ in range(CORRECTIONS):
            rounding = float(np.sqrt(c @ left.radius**2))
            if size == 0.0 or size <= rounding < np.inf:
                break
            defect = np.where(touching, left.value, 0.0)
            unit = float(np.abs(defect).max())
            step = correct(
                problem.influence,
                problem.shells,
                np.sqrt(c),
                defect / unit,
                balanced=True,
                tolerance=max(REDUCTION, ENOUGH * min(rounding / size, 1.0)),
            )
            following = completed(x + Pair.exact(c * step * unit))
            better, risen = residual(following, problem.product(following))
            before, now = size, size_of(better)
            if now < size:
                x, left, beta, size = following, better, risen, now
            if not now < 0.5 * before:
                break
        if size > SOLVED * first:
            raise SolverError(
                "the state has no derivative: its linear system is singular, or nearly",
                solver="response",
                advice="the energy need not be convex there: press less hard",
            )
        return self._proved_response(x, left, beta, total)

    def _proved_response(self, x: Pair, left: Ball, beta: Ball, total: Ball) -> Response:
        problem, springs = self.problem, self.springs
        touching, doubtful, h = springs.touching, springs.doubtful, springs.bound
        if not springs.margin > 0.0:
            return Response(Ball.around(x, np.inf), Ball.around(beta.mid, np.inf))
        j = int(np.argmax(springs.slopes))
        short = float((total - Ball.exact(x).sum()).size)

        def excess(others: float) -> tuple[Array, float, float]:
            """Three bounds: on the residual once j carries the missing part of x, on that part, and
            on the displacements by it and by `others`.

            others : bound on the sum of |x| over asperities not proved to touch or be open
            """
            missing = short + others
            missing_effect = (missing + others) * problem.largest_entry
            e = left.size + missing_effect
            e[j] += missing * float(springs.compliance.upper[j])
            return e, missing, missing_effect

        carried = np.zeros(len(h))
        if doubtful.any():
            e, _, _ = excess(0.0)
            within = distance(np.where(np.isinf(h), 0.0, e), h, springs.margin)
            carried[doubtful] = (within / np.sqrt(h[doubtful])) * (1 + SAFETY)
        e, missing, missing_effect = excess(float(carried.sum()) * (1 + SAFETY))
        known = np.where(touching, h, np.inf)
        within = distance(np.where(touching, e, 0.0), known, springs.margin)
        errors = np.where(touching, within / np.sqrt(known) * (1 + SAFETY), carried)
        errors[j] += missing
        moved = within / np.sqrt(float(known.min())) * problem.row_norm + missing_effect
        each = (left.size + springs.compliance.upper * errors)[touching]
        off = (float(each.min()) + moved) * (1 + SAFETY)
        return Response(Ball.around(x, errors), Ball.around(beta.mid, beta.radius + off))

    @cached_property
    def rates(self) -> Array:
        """(n,) the derivatives dn/dL = S - A q, in float64."""
        q, rate = self.tangent
        rates: Array = float(rate.value) - self.problem.influence.apply(q.value)
        return rates


class Levels:
    """The normal solutions of one scene up to the load of the level `top`; `at` caches them.

    top      : the level of a pressed contact
    press    : the function that computes the loads of other levels
    together : True if Newton's method may solve several levels at once, as rows of a stack
    """

    def __init__(self, top: Level, press: Press, *, together: bool = False) -> None:
        self.top, self.problem, self._press, self._together = top, top.problem, press, together
        self._known: dict[tuple[float, float, float], Level] = {}

    @property
    def presses(self) -> int:
        """The number of levels that `at` and `prepare` have computed."""
        return len(self._known)

    def below(self, drop: Ball) -> Level:
        """The level at the load of `top` minus `drop`, both in scaled units."""
        return self.at(self.top.load - drop)

    def at(self, load: Ball) -> Level:
        """The level at a total load, positive or exactly 0. Raises ProofError for other loads."""
        key = _key(load)
        if key not in self._known:
            self._known[key] = self._level(load)
        return self._known[key]

    def _level(self, load: Ball) -> Level:
        if not load.positive:
            if load.size == 0.0:
                return Level.unloaded(self.problem)
            raise ProofError(f"the load of a level may be 0 or less: {float(load.value):.3g}")
        return self._solved(self.problem.at_load(load), load)

    def prepare(self, loads: Ball) -> list[Level | None]:
        """The levels at k positive loads, solved together; None for a level that is not found.

        `at` may still find such a level.
        """
        found, problem = self.top.solution, self.problem
        able = self._together and problem.influence.stored and len(problem) <= MOST
        if not able or found is None:
            return [None] * len(loads)
        rows, levels = max(1, NUMBERS // len(problem)), list[Level | None]()
        for start in range(0, len(loads), rows):
            levels += _together(problem, found.box.closed, loads[start : start + rows])
        self._known |= {_key(level.load): level for level in levels if level is not None}
        return levels

    def at_approach(self, approach: Ball) -> Level:
        """The level at an approach above first touch, in scaled units. It is not cached."""
        return self._solved(self.problem.at_approach(approach), None)

    def _solved(self, problem: NormalProblem, load: Ball | None) -> Level:
        """The level of `problem`, computed first without initial loads, then from those of `top`.

        The second attempt is made if the first proves nothing. The level is proved in the box of
        `top` (`Box.closed`). If the proof of `top` does not exclude solutions outside its box, only
        the loads of `top` are tried as initial loads. Without a proof: `Level.unproved`.
        """
        top = self.top.solution
        local = top is not None and top.box.scope == "local"
        state, found = self._sought(problem, top.trial.loads.high if top and local else None)
        if isinstance(found, Obstacle) and top is not None and not local:
            with suppress(SolverError):
                state, found = self._sought(problem, top.trial.loads.high)
        if isinstance(found, Obstacle):
            total = Ball.exact(state.loads).sum() if load is None else load
            return Level.unproved(problem, state, total)
        return Level.of(found, found.total if load is None else load)

    def _sought(
        self, problem: NormalProblem, start: Array | None
    ) -> tuple[Trial, Proved | Obstacle]:
        """Refined loads, and the solution proved near them in the box of `top`.

        If nothing is proved, the second is the obstacle to a proof.
        """
        state = refined_loads(problem, self._press(problem, start))
        boxes = None if self.top.solution is None else iter((self.top.solution.box.closed,))
        return state, proved(problem, state, boxes)


def _key(load: Ball) -> tuple[float, float, float]:
    return float(load.mid.high), float(load.mid.low), float(load.radius)


def _together(problem: NormalProblem, box: Box, loads: Ball) -> list[Level | None]:
    scene, exact, m, total = problem.scene, problem.exact, len(loads), loads[:, None]
    rows = Stack([(slice(0, m), problem)], exact, problem.shells, total, None)
    force, modulus = total.value * problem.units.force, scene.material.contact_modulus
    reach = hertz.contact_radius(force, modulus, scene.mean_radius) ** 2
    squares = scene.asperities.distances[problem.candidates] ** 2
    found = solved(rows, problem.offsets, squares, reach, box)

    def level(k: int) -> Level:
        it = found.row(k, problem.at_load(loads[k]))
        known = it.approach, it.loads, it.indentation, found.rows.touching[k], found.rows.open[k]
        return Level(it.problem, loads[k], *known, it, it.trial)

    return [level(k) if found.good[k] else None for k in range(m)]


def rows_of(levels: Sequence[Level]) -> Rows:
    """Levels of one scene as arrays with one row for each level."""
    balls = [(it.load, it.approach, it.loads, it.indentation) for it in levels]
    load, approach, loads, indentation = map(Ball.stacked, map(list, zip(*balls, strict=True)))
    touching, open_ = (
        np.array([getattr(it, name) for it in levels]) for name in ("touching", "open")
    )
    return Rows(load, approach, loads, indentation, touching, open_)


@np.errstate(invalid="ignore")  # unproved levels
def energies(levels: Sequence[Level]) -> Ball:
    """(k,) the energies V(L) of k levels of one scene; errors are infinite without a proof."""
    high, low, radius = np.zeros((3, len(levels)))
    which = [k for k, level in enumerate(levels) if level.trial is not None]
    if which:
        loaded = [levels[k] for k in which]
        states = [level.trial for level in loaded if level.trial is not None]
        gap, product, missing = (
            Ball.stacked([getattr(state, name) for state in states])
            for name in ("gap", "product", "missing")
        )
        trial = Pair(*(np.stack(part) for part in zip(*(s.loads for s in states), strict=True)))
        data = loaded[0].problem.exact
        local = data.coefficients * Ball.exact(trial).two_thirds()
        per_load = local * Fraction(3, 5) + product * 0.5 - data.offsets
        found = Ball.exact(trial).dot(per_load)
        # The energy of the trial loads exceeds the least at their total by at most e'|P - P*|.
        loads = Ball.stacked([level.loads for level in loaded])
        off = loads.error + np.abs(loads.mid.low)
        above = (excess(gap, trial.high > 0) * off).sum(axis=-1) * (1 + SAFETY)
        uncertainty = np.array([float(level.load.radius) for level in loaded])
        rate = np.array([float(level.approach.size) for level in loaded])
        error = found.radius + above + (missing.size + uncertainty) * rate * (1 + SAFETY)
        proved_ones = np.array([level.solution is not None for level in loaded])
        known = Ball.around(found.mid, np.where(proved_ones, error, np.inf))
        high[which], low[which], radius[which] = *known.mid, known.radius
    return Ball(Pair(high, low), radius)
