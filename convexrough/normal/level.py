"""A solution of the normal contact problem at a total load L, which friction and gradients use.

A proved solution is the only one in a box of loads. At the total load L it has the loads P_i(L),
the approach D0(L), the indentations n_i(L) (minus the gap where open), and the energy

    V(L) = min over sum P = L of  sum (3/5) k P^(5/3) + P'AP/2 - d'P,    so that dV/dL = D0.

The coefficients k, the operator A and the offsets d are those of `NormalProblem`. The derivatives
q = dP/dL and S = dD0/dL solve  q_i / c_i + (A q)_i = S,  sum q = 1  for the touching asperities,
where c_i = dP_i/dn_i = (3/2) P_i^(1/3) / k_i. For all other asperities q_i = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball, added, of_rows, stacked, where
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, Indices, among_zeros, summed
from convexrough.convex.newton_step import correct
from convexrough.convex.theorem import distance, excess
from convexrough.errors import ProofError, SolverError
from convexrough.normal.boxes import Box
from convexrough.normal.problem import REDUCTION, NormalProblem
from convexrough.normal.refine import CORRECTIONS, ENOUGH, Trial, mean
from convexrough.roundoff import SAFETY

#: Largest accepted residual of `Level.response` after refinement, divided by the larger of the
#: residual before refinement and the right side with beta.
SOLVED = 1e-6

#: `Level.response` computes A x to thirty digits once the rounding error of the residual exceeds
#: this part of the residual; before that, float64 is enough. Affects speed only.
ROUGH = 1e-3


class Response(NamedTuple):
    """The solution x, beta of the linear system of `Level.response`, as balls in scaled units."""

    loads: Ball  # (n,) x, 0 where open
    approach: Ball  # beta


class Springs(NamedTuple):
    """The contacts of a level as linear springs, for `Level.response`. All arrays are (n,)."""

    #: True where the asperity is proved to touch and bounds on its compliance are known; if nothing
    #: is proved, where it has a load in `trial`
    touching: NDArray[np.bool_]
    doubtful: NDArray[np.bool_]  # True for other asperities that may touch
    slopes: Array  # c = dP/dn, 0 where not touching
    compliance: Ball  # 1/c, 0 where not touching
    bound: Array  # h, a lower bound on 1/c where the asperity may touch; infinite where open
    margin: float  # mu of docs/theory/one-theorem.md, with H = diag(h); 0 if nothing is proved

    def at(self, which: Indices) -> Springs:
        """The springs of some asperities."""
        return Springs._make((*(each[which] for each in self[:-1]), self.margin))


class Obstacle(NamedTuple):
    """The reason why nothing is proved, and the asperities, among the candidates, that cause it."""

    reason: str
    which: Indices


@dataclass(frozen=True, eq=False)
class Level:
    """A normal solution near computed loads, as balls, for the asperities of `problem`.

    The level of a stack of m problems has one row for each: arrays are (m, n) or, if they hold one
    number per problem, (m, 1). Where nothing is proved, the radii of the balls are infinite, except
    that of a prescribed approach.
    """

    problem: NormalProblem
    loads: Ball  # (n,) P_i
    indentation: Ball  # (n,) n_i
    approach: Ball  # () D0
    open: NDArray[np.bool_]  # (n,) True where an asperity is proved to have a gap
    trial: Trial | None  # the loads near which the solution was proved; None at L = 0
    #: a box that contains exactly one solution; None if nothing is proved, and at L = 0
    box: Box | None = None
    #: bound on (sum_i h_i (P_i - P*_i)^2)^(1/2), with the loads P of `trial` scaled to the total L,
    #: the solution P*, and the local compliance h at the upper ends of a second, smaller box, which
    #: also contains the solution
    distance: Any = np.inf
    compliance: Array = field(default_factory=lambda: np.zeros(0))  # (n,) these h_i
    obstacle: Obstacle | None = None  # the reason why nothing is proved

    @classmethod
    def unproved(cls, problem: NormalProblem, state: Trial, obstacle: Obstacle) -> Level:
        """The level for loads near which no solution is proved."""
        approach, opened = state.approach, np.zeros(len(problem), dtype=bool)
        if problem.by_load:  # asperities that carry no load in any solution
            highest = problem.approach_bound
            opened = problem.exact.offsets.upper + (highest + SAFETY * abs(highest)) < 0
            approach = Ball.around(approach.mid, np.inf)
        loads, below = (Ball.around(x, np.inf) for x in (state.loads, state.indentation.mid))
        return cls(problem, loads, below, approach, opened, state, obstacle=obstacle)

    @classmethod
    def unloaded(cls, problem: NormalProblem) -> Level:
        """The level at L = 0, where the first asperity just touches."""
        offsets = problem.exact.offsets
        ends = np.array([offsets.lower.max(), offsets.upper.max()])
        highest = offsets[int(np.argmax(offsets.value))]
        ties = np.flatnonzero(offsets.upper >= ends[0])
        if len(ties) > 1:
            highest = Ball.around(highest.mid, highest.radius + (ends[1] - ends[0]))
        loads, below = Ball.exact(np.zeros(len(problem))), offsets - highest
        unloaded = problem.at_load(Ball.exact(0.0))
        return cls(unloaded, loads, below, -highest, below.negative, None)

    @cached_property
    def touching(self) -> NDArray[np.bool_]:
        """(n,) True where an asperity is proved to carry a load."""
        return self.indentation.positive | self.loads.positive

    @cached_property
    def load(self) -> Ball:
        """() the total load L. If it is not prescribed, Cauchy's inequality bounds its error; where
        nothing is proved, the radius bounds only rounding errors of the sum of the computed loads.
        """
        if self.problem.by_load:
            return self.problem.control
        assert self.trial is not None
        total = Ball.exact(self.trial.loads).sum()
        if self.box is None:
            return total
        with np.errstate(invalid="ignore"):  # nan only in rows of a stack that are not proved
            spread = self.distance * np.sqrt(summed(1.0 / self.compliance)) * (1 + SAFETY)
        return Ball.around(total.mid, total.radius + np.reshape(spread, total.shape))

    def row(self, k: int, problem: NormalProblem) -> Level:
        """The level in row k of a stack whose rows share one `box`, and the problem of this row."""
        it = self.trial
        assert it is not None
        own = it.loads.at(k), it.product[k], it.gap[k]
        trial = Trial(problem, *own, it.approach[k, 0], it.missing[k, 0])
        found = self.loads[k], self.indentation[k], self.approach[k, 0], self.open[k]
        norm = float(self.distance[k, 0]), self.compliance[k]
        return Level(problem, *found, trial, self.box, *norm)

    @property
    def rows(self) -> Rows:
        """The levels of a stack, as arrays with one row for each level."""
        load = self.load if self.load.radius.ndim == 1 else self.load[:, 0]
        known = self.loads, self.indentation, self.touching, self.open
        return Rows(load, self.approach[:, 0], *known)

    @cached_property
    def energy(self) -> Ball:
        """The energy V(L), defined in this module's docstring."""
        return energies([self])[0]

    @cached_property
    def tangent(self) -> Response:
        """The derivatives dP/dL and dD0/dL."""
        return self.response(Ball.exact(np.zeros(len(self.problem))), Ball.exact(1.0))

    @cached_property
    def springs(self) -> Springs:
        """The asperities as linear springs, for `response`. Raises ProofError at L = 0."""
        state = self.trial
        if state is None:
            raise ProofError("at the load 0 the approach has no derivative")
        stiffness = 1.5 / self.problem.exact.coefficients * self.loads.cbrt()
        touching, bound, margin = state.inside, np.full(len(self.problem), np.inf), 0.0
        doubtful = np.zeros(len(touching), dtype=bool)
        if self.box is not None:
            # If the ball of a load contains 0, nothing bounds the compliance.
            touching = self.touching & self.loads.positive
            doubtful = ~touching & ~self.open
            with np.errstate(divide="ignore"):
                known = np.maximum(self.compliance, (1.0 - SAFETY) / stiffness.upper)
            bound = np.where(self.open, np.inf, known)
            convexity = self.box.convexity_at(bound)
            margin = 1.0 - min(self.box.convexity_number, convexity)
        one, zero = (Ball.exact(np.full(len(touching), x)) for x in (1.0, 0.0))
        compliance = where(touching, 1.0 / where(touching, stiffness, one), zero)
        slopes = np.where(touching, stiffness.value, 0.0)
        return Springs(touching, doubtful, slopes, compliance, bound, margin)

    def response(self, right: Ball, total: Ball) -> Response:
        """The solution x (n,) and beta, a number, of  x / c + A x = right + beta,  sum x = total.

        The equations hold for touching asperities; x is 0 for others. The solution is refined in
        pairs of float64 numbers until the residual no longer halves. The bounds on its error
        (docs/theory/one-theorem.md) also hold if asperities without a proved status touch.

        right : (n,) the given right side;  total : the given sum of x

        Raises SolverError if no asperity is proved to touch, or if the system is singular or nearly
        singular.
        """
        problem, springs, n = self.problem, self.springs, len(self.problem)
        if not springs.slopes.any():
            raise SolverError(
                "the state has no derivative: no asperity is proved to touch",
                solver="response",
                advice="nothing follows from these loads: press again, or with a larger load",
            )
        some = np.arange(n)
        if problem.influence.cheap_sums and springs.margin > 0:  # leave out those that are open
            some = np.flatnonzero(springs.touching | springs.doubtful)
            problem, right = problem.restricted(some), right[some]
            springs = springs.at(some)
        c, weights = springs.slopes, springs.slopes / springs.slopes.sum()
        j = int(np.argmax(c))

        def completed(x: Pair) -> Pair:
            high, low = x.high.copy(), x.low.copy()
            high[j], low[j] = x.at(j) + (total.mid - x.total())
            return Pair(high, low)

        def residual(x: Pair, product: Ball) -> tuple[Ball, Ball]:
            """x / c + A x - right - beta, and beta, which makes the mean weighted by c about 0."""
            above = added(springs.compliance * x, product, -right)
            beta = mean(c, above)
            return above - beta, beta

        sprung = c > 0

        def weighted(values: Array) -> float:  # errors may be infinite where c is 0
            return float(np.sqrt((c[sprung] * values[sprung] ** 2).sum()))

        nothing, sharp, halved = Pair.exact(np.zeros(len(c))), problem.few, True
        x = completed(Pair.exact(float(total.value) * weights))
        product = problem.moved(nothing, Ball.exact(nothing), x)
        left, beta = residual(x, product)
        size, rounding = weighted(left.value), weighted(left.radius)
        accepted = SOLVED * max(size, weighted(np.abs(right.value) + abs(float(beta.value))))
        for _ in range(CORRECTIONS):
            if not sharp and (rounding > ROUGH * size or not halved):
                product, sharp, halved = problem.product(x), True, True
                left, beta = residual(x, product)
                size, rounding = weighted(left.value), weighted(left.radius)
            if size == 0.0 or not halved or size <= rounding < np.inf:
                break
            defect = np.where(springs.touching, left.value, 0.0)
            unit = float(np.abs(defect).max())
            least = max(REDUCTION, ENOUGH * min(rounding / size, 1.0))
            system = problem.influence, problem.shells, np.sqrt(c)
            step = correct(*system, defect / unit, balanced=True, tolerance=least)
            following = completed(x + Pair.exact(c * step * unit))
            moved = problem.moved(x, product, following)
            better, risen = residual(following, moved)
            now = weighted(better.value)
            halved = now < 0.5 * size
            if now < size:
                x, product, left, beta, size = following, moved, better, risen, now
                rounding = weighted(left.radius)
        if size > accepted and not size <= rounding < np.inf:
            raise SolverError(
                "the state has no derivative: its linear system is singular or nearly singular",
                solver="response",
                advice="the energy may not be convex at this load: press with a smaller load",
            )
        found = Ball.around(x, np.inf), Ball.around(beta.mid, np.inf)
        if springs.margin > 0.0:
            found = _bounded(problem, springs, x, left, beta, total, j)
        spread = partial(among_zeros, places=some, count=n)
        return Response(of_rows(spread, found[0]), found[1])

    @cached_property
    def rates(self) -> Array:
        """(n,) the derivatives dn/dL = S - A q, in float64."""
        q, rate = self.tangent
        rates: Array = float(rate.value) - self.problem.influence.apply(q.value)
        return rates


def _bounded(
    problem: NormalProblem, springs: Springs, x: Pair, left: Ball, beta: Ball, total: Ball, j: int
) -> tuple[Ball, Ball]:
    """Balls of the solution near x and `beta`, whose residual is `left`.

    A change of x_j makes the total right. Let s bound this change: what the total misses, and
    the sum of |x| of asperities neither proved to touch nor to be open.
    """
    short = float((total - Ball.exact(x).sum()).size)
    touching, doubtful, _, compliance, h, margin = springs

    def residual(others: float) -> tuple[Array, float, float]:
        """Bounds on the residual after the change, on s, and on the displacements by it and by
        asperities without a proved status, whose |x| have the sum `others`."""
        s = short + others
        moved = (s + others) * problem.largest_entry
        e = left.size + moved
        e[j] += s * float(compliance.upper[j])
        return e, s, moved

    carried = np.zeros(len(h))
    if doubtful.any():
        e, _, _ = residual(0.0)
        within = distance(np.where(np.isinf(h), 0.0, e), h, margin)
        carried[doubtful] = (within / np.sqrt(h[doubtful])) * (1 + SAFETY)
    e, s, moved = residual(float(carried.sum()) * (1 + SAFETY))
    known = np.where(touching, h, np.inf)
    within = distance(np.where(touching, e, 0.0), known, margin)
    errors = np.where(touching, within / np.sqrt(known) * (1 + SAFETY), carried)
    errors[j] += s
    moved += within / np.sqrt(float(known.min())) * problem.row_norm
    each = (left.size + compliance.upper * errors)[touching]
    off = (float(each.min()) + moved) * (1 + SAFETY)
    return Ball.around(x, errors), Ball.around(beta.mid, beta.radius + off)


class Rows(NamedTuple):
    """Levels at k total loads: the fields of `Level` as arrays (k,) or (k, n), in scaled units."""

    load: Ball
    approach: Ball
    loads: Ball
    indentation: Ball
    touching: NDArray[np.bool_]
    open: NDArray[np.bool_]

    def at(self, which: Indices) -> Rows:
        """The levels with these indices."""
        return Rows._make(each[which] for each in self)


def rows_of(levels: Sequence[Level]) -> Rows:
    """Levels of one scene as arrays with one row for each level."""
    names = "load", "approach", "loads", "indentation", "touching", "open"
    return Rows._make(stacked([getattr(level, name) for level in levels]) for name in names)


@np.errstate(invalid="ignore")  # nan occurs only for levels that are not proved
def energies(levels: Sequence[Level]) -> Ball:
    """(k,) the energies V(L) of k levels of one scene; errors are infinite without a proof."""
    high, low, radius = np.zeros((3, len(levels)))
    which = [k for k, level in enumerate(levels) if level.trial is not None]
    if which:
        loaded = [levels[k] for k in which]
        states = [level.trial for level in loaded if level.trial is not None]
        carrying = np.any(
            [level.loads.size > 0 for level in loaded] + [it.inside for it in states], 0
        )
        at = partial(np.take, indices=carrying.nonzero()[0], axis=-1)
        trial, gap, product = (
            stacked([of_rows(at, getattr(state, name)) for state in states])
            for name in ("loads", "gap", "product")
        )
        missing = stacked([state.missing for state in states])
        data = loaded[0].problem.exact.at(carrying)
        local = data.coefficients * Ball.exact(trial).two_thirds()
        per_load = added(local * Fraction(3, 5), product.scaled(0.5), -data.offsets)
        found = Ball.exact(trial).dot(per_load)
        # The energy of trial loads P exceeds the least energy at their total by at most the sum of
        # e_i |P_i - P*_i|, for the solution P* and e = `excess`.
        off = (Ball.exact(trial) - stacked([of_rows(at, level.loads) for level in loaded])).size
        above = (excess(gap, trial.high > 0) * off).sum(axis=-1) * (1 + SAFETY)
        uncertainty = np.array([float(level.load.radius) for level in loaded])
        rate = np.array([float(level.approach.size) for level in loaded])
        error = found.radius + above + (missing.size + uncertainty) * rate * (1 + SAFETY)
        proved_ones = np.array([level.box is not None for level in loaded])
        known = Ball.around(found.mid, np.where(proved_ones, error, np.inf))
        high[which], low[which], radius[which] = *known.mid, known.radius
    return Ball(Pair(high, low), radius)
