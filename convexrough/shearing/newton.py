"""Newton's method for states of friction on the normal map, safeguarded by the energy.

The unknown is eta, what each asperity takes up in local deflection and in slip. A step is that of
`convexrough.convex.newton_step`, and keeps the sum of the increments. Of few asperities, many
states are solved at once by their matrices. Of many, one state after the other, each started from
those already known, as the curves eta(T) are smooth.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.convex.newton_step import FACTORISED, correct
from convexrough.errors import SolverError
from convexrough.influence import DenseInfluence
from convexrough.progress import Announce
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.energy import TangentialEnergy
from convexrough.solvers.newton import MOST_LEFT

#: Evenly spaced states from which many others are interpolated to start with.
FAMILY = 128

#: A state is accurate where its residual is below this part of the rise.
TOLERANCE = 1e-12

MOST_STEPS = 100

#: States nearer to each other than this part of T are one for the curve through them, which is
#: followed no farther than to so many times the largest T: it magnifies their errors.
NEAR, FAR = 1e-4, 3.0


class States(NamedTuple):
    """Friction states at m total increments of the n touching asperities; own units.

    totals : (m,) T;  deflections : (m, n) eta;  increments : (m, n) u;  rises : (m,)
    slips  : (m, n) what eta exceeds the ceiling by, 0 where not sliding
    """

    totals: Array
    deflections: Array
    increments: Array
    rises: Array
    slips: Array

    def take(self, rows: slice | Indices) -> States:
        """Some of the states."""
        return States(*(field[rows] for field in self))


class Iterate(NamedTuple):
    """Newton's method at m states; `rises` is the best estimate, `defects` F = eta + A u - rise."""

    deflections: Array
    increments: Array
    coupling: Array
    slopes: Array
    defects: Array
    rises: Array
    energies: Array
    residuals: Array


def by_matrices(energy: TangentialEnergy) -> bool:
    """Whether states are solved by factorisations, many at once."""
    return isinstance(energy.influence, DenseInfluence) and len(energy) <= FACTORISED


def solve_together(energy: TangentialEnergy, totals: Array) -> States:
    """States at 0 <= T <= sum P of few asperities, in blocks of matrices that fit in memory."""
    size = max(1, 2**20 // len(energy) ** 2)  # matrices that stay in a cache, or just one
    starts = _starts(energy, totals)
    blocks = [slice(i, i + size) for i in range(0, len(totals), size)]
    parts = [_solve_block(energy, totals[block], starts[block]) for block in blocks]
    return States(*(np.concatenate(field) for field in zip(*parts, strict=True)))


def solve_in_turn(
    energy: TangentialEnergy,
    totals: Array,
    first: Callable[[float], Array],
    known: States | None = None,
    announce: Announce | None = None,
) -> States:
    """States at 0 <= T <= sum P of many asperities, by increasing T.

    first : (n,) deflections to start from at some T where nothing is known
    known : states to start from, besides
    """
    m, n = len(totals), len(energy)
    states = States(totals, np.zeros((m, n)), np.zeros((m, n)), np.zeros(m), np.zeros((m, n)))
    curve = _Curve(known)
    limit, elastic = energy.at_limit(totals), energy.elastically(totals)
    for done, i in enumerate(np.argsort(totals, kind="stable")):
        total = float(totals[i])
        if total == 0.0:
            continue
        if limit[i]:
            eta, u, rise, residual = _gross(energy)
        elif elastic[i]:
            state = evaluate(energy, _elastic(energy, totals[i : i + 1]), totals[i : i + 1])
            eta, u, rise, residual = _single(state)
        else:
            start = curve.at(total)
            eta, u, rise, residual = _converge(
                energy, first(total) if start is None else start, total
            )
        states.deflections[i], states.increments[i], states.rises[i] = eta, u, rise
        states.slips[i] = eta - np.clip(eta, -energy.ceilings, energy.ceilings)
        curve.add(total, states.deflections[i])
        if announce is not None:
            sliding = int(np.count_nonzero(states.slips[i]))
            part = residual / rise if rise > 0 else 0.0
            announce(
                f"state {done + 1} of {m}: residual {part:.0e} of the displacement, "
                f"{sliding:,} sliding"
            )
    return states


class _Curve:
    """eta(T) through the states known so far; it starts from 0."""

    def __init__(self, known: States | None) -> None:
        self.totals: list[float] = []
        self.deflections: list[Array] = []
        if known is not None:
            for total, eta in zip(known.totals.tolist(), known.deflections, strict=True):
                self.add(total, eta)

    def add(self, total: float, deflections: Array) -> None:
        """One more state, unless there is one so near that no line should go through both."""
        place = bisect_left(self.totals, total)
        near = [0.0, *self.totals[max(place - 1, 0) : place + 1]]
        if min(abs(total - other) for other in near) > NEAR * total:
            self.totals.insert(place, total)
            self.deflections.insert(place, deflections)

    def at(self, total: float) -> Array | None:
        """On the parabola through the three nearest states, of which 0 may be one; None if far."""
        if not self.totals or total > FAR * self.totals[-1]:
            return None
        place = bisect_left(self.totals, total)
        low = max(0, min(place - 2, len(self.totals) - 3))
        points = list(zip(self.totals[low : low + 3], self.deflections[low : low + 3], strict=True))
        zeros = [] if len(points) == 3 else [0.0]
        eta = np.zeros_like(self.deflections[0])
        for here, values in points:
            others = np.array([there for there, _ in points if there != here] + zeros)
            eta += float(np.prod((total - others) / (here - others))) * values
        return eta


def _converge(
    energy: TangentialEnergy, start: Array, total: float
) -> tuple[Array, Array, float, float]:
    """Steps until the state is as good as it gets: eta, u, the rise and the residual.

    As in the normal problem, that is where the defect is small beside what rounding can make of
    A u, which the certificate has to allow for anyway, or a further step no longer halves it.
    """
    totals = np.array([total])
    state = evaluate(energy, start[None], totals)
    before = float(state.rises[0]) * np.sqrt(len(energy))
    for _ in range(MOST_STEPS):
        accurate = state.residuals[0] <= TOLERANCE * state.rises[0]
        noise = energy.influence.rounding(state.increments[0])
        size = float(np.linalg.norm(state.defects))
        target = noise.negligible(state.coupling)
        if accurate and size <= target:
            break
        forcing = min(MOST_LEFT, (size / before) ** 2)
        following = _advance(energy, state, totals, max(forcing, 0.3 * target / size))
        if accurate and following.residuals[0] >= 0.5 * state.residuals[0]:
            state = min(state, following, key=lambda each: float(each.residuals[0]))
            break
        state, before = following, size
    else:
        raise _stalled(energy, total, float(state.residuals[0] / state.rises[0]))
    return _single(state)


def _single(state: Iterate) -> tuple[Array, Array, float, float]:
    eta, u = state.deflections[0], state.increments[0]
    return eta, u, float(state.rises[0]), float(state.residuals[0])


def _advance(energy: TangentialEnergy, state: Iterate, totals: Array, tolerance: float) -> Iterate:
    """One Newton step of a single state."""
    correction = correct(
        energy.influence,
        energy.shells,
        np.sqrt(state.slopes[0]),
        state.defects[0],
        balanced=True,
        tolerance=tolerance,
    )
    return _descend(energy, state, correction[None], totals)


def _gross(energy: TangentialEnergy) -> tuple[Array, Array, float, float]:
    """At T = sum P: the last asperity to slide fixes the rise."""
    coupling = energy.couple(energy.loads)
    rise = float((energy.ceilings + coupling).max())
    return rise - coupling, energy.loads, rise, 0.0


def _stalled(energy: TangentialEnergy, total: float, residual: float) -> SolverError:
    return SolverError(
        f"residual {residual:.3g} of the displacement after {MOST_STEPS} Newton steps, at "
        f"{total / energy.limit:.6g} of gross sliding",
        solver="shear",
    )


def evaluate(energy: TangentialEnergy, eta: Array, totals: Array) -> Iterate:
    """Every number of m states, shifted to their totals."""
    eta, u, slopes = _balanced(energy, eta, totals)
    coupling = energy.couple(u)
    weight = slopes.sum(axis=1)
    rises = (slopes * (eta + coupling)).sum(axis=1) / np.where(weight > 0, weight, 1.0)
    # How far a sliding asperity slides does not matter: take what the rise asks, if that slides.
    asked = rises[:, None] - coupling
    sign = np.sign(eta)
    eta = np.where(slopes > 0, eta, sign * np.maximum(sign * asked, energy.ceilings))
    defects = eta - asked
    energies = energy.energies(eta, u, coupling)
    residuals = np.abs(defects).max(axis=1)
    return Iterate(eta, u, coupling, slopes, defects, rises, energies, residuals)


def _descend(energy: TangentialEnergy, state: Iterate, directions: Array, totals: Array) -> Iterate:
    """One step for each state, halved until its energy falls."""
    after = evaluate(energy, state.deflections + directions, totals)
    gradients = np.clip(state.deflections, -energy.ceilings, energy.ceilings) + state.coupling
    gradients -= state.rises[:, None]
    lengths = np.ones(len(totals))
    for _ in range(50):
        changes = after.energies - state.energies
        slopes = (gradients * (after.increments - state.increments)).sum(axis=1)
        rejected = np.flatnonzero(changes > 1e-4 * np.minimum(slopes, 0) + SAFETY * state.energies)
        if len(rejected) == 0:
            return after
        lengths[rejected] /= 2
        trial = state.deflections[rejected] + lengths[rejected, None] * directions[rejected]
        again = evaluate(energy, trial, totals[rejected])
        for field, new in zip(after, again, strict=True):
            field[rejected] = new
    raise SolverError("no step along Newton's direction lowers the energy", solver="shear")


def _balanced(energy: TangentialEnergy, eta: Array, totals: Array) -> tuple[Array, Array, Array]:
    """eta shifted so that the increments add up to T, with those and their slopes.

    Newton's method inside a bracket: the sum grows with the shift, from -sum P to sum P.
    """
    low = (-energy.ceilings - eta).min(axis=1)
    high = (energy.ceilings - eta).max(axis=1)
    shifts = np.zeros(len(totals))
    for _ in range(100):
        moved = eta + shifts[:, None]
        u, slopes = energy.respond(moved)
        excess = u.sum(axis=1) - totals
        low, high = np.where(excess < 0, shifts, low), np.where(excess > 0, shifts, high)
        slope = slopes.sum(axis=1)
        following = shifts - excess / np.where(slope > 0, slope, np.inf)
        outside = ~((following > low) & (following < high)) & (excess != 0)
        following = np.where(outside, (low + high) / 2, following)
        settled = np.abs(following - shifts) <= 1e-15 * np.abs(moved).max(axis=1)
        if (settled | (np.abs(excess) <= 2 * ROUNDOFF * totals)).all():
            break
        shifts = following
    return moved, u, slopes


def _starts(energy: TangentialEnergy, totals: Array) -> Array:
    """(m, n) deflections to start from: elastic, or interpolated where m is large."""
    starts = _elastic(energy, totals)
    if len(totals) < 4 * FAMILY:
        return starts
    coarse = np.linspace(0.0, energy.limit, FAMILY)
    known = solve_together(energy, coarse).deflections
    cell = np.minimum(np.searchsorted(coarse, totals, side="right"), FAMILY - 1) - 1
    part: Array = ((totals - coarse[cell]) / coarse[1])[:, None]
    between = known[cell] * (1 - part) + known[cell + 1] * part
    return np.where(energy.elastically(totals)[:, None], starts, between)


def _elastic(energy: TangentialEnergy, totals: Array) -> Array:
    """(m, n) deflections under the elastic shares of m totals."""
    return energy.deflections(np.minimum(totals[:, None] * energy.elastic, energy.loads))


def _solve_block(energy: TangentialEnergy, totals: Array, starts: Array) -> States:
    iterate = evaluate(energy, starts, totals)
    limit = energy.at_limit(totals)
    active = np.flatnonzero(~energy.elastically(totals) & ~limit)
    for _ in range(MOST_STEPS):
        if len(active) == 0:
            break
        before = Iterate(*(field[active] for field in iterate))
        after = _descend(energy, before, _directions(energy, before), totals[active])
        accurate = before.residuals <= TOLERANCE * before.rises
        take = ~accurate | (after.residuals < before.residuals)
        for field, new in zip(iterate, after, strict=True):
            field[active[take]] = new[take]
        active = active[~accurate]  # so an accurate state has had one step more
    else:
        worst = float((iterate.residuals / iterate.rises)[active].max())
        raise _stalled(energy, float(totals[active[0]]), worst)
    eta, u, rises = iterate.deflections, iterate.increments, iterate.rises
    if limit.any():
        eta[limit], u[limit], rises[limit], _ = _gross(energy)
    slips = eta - np.clip(eta, -energy.ceilings, energy.ceilings)
    return States(totals, eta, u, rises, slips)


def _directions(energy: TangentialEnergy, state: Iterate) -> Array:
    """d(eta) = -F - A W y + beta, with (I + W A W) y = -W F + beta W and sum du = 0."""
    root = np.sqrt(state.slopes)  # W, 0 where sliding
    matrices = root[:, :, None] * energy.influence.matrix * root[:, None, :]
    matrices[:, range(len(energy)), range(len(energy))] = 1.0
    right = np.stack((-root * state.defects, root), axis=2)
    y, border = np.moveaxis(_solve(matrices, right), 2, 0)
    beta = -(root * y).sum(axis=1) / (root * border).sum(axis=1)
    y = y + beta[:, None] * border
    return np.asarray(beta[:, None] - state.defects - energy.couple(root * y))


def _solve(matrices: Array, right: Array) -> Array:
    """(m, n, 2) solutions of m symmetric systems, each with two right sides."""
    if matrices.shape[1] < 128:
        return np.asarray(np.linalg.solve(matrices, right), dtype=np.float64)
    from scipy.linalg.lapack import dposv  # half the work, but one call for each matrix

    solutions = np.empty_like(right)
    for m, matrix in enumerate(matrices):
        _, solution, info = dposv(matrix.T, right[m], lower=1)  # symmetric, and in LAPACK's order
        solutions[m] = solution if info == 0 else np.linalg.solve(matrix, right[m])
    return solutions
