"""Friction states of few asperities, many at once, by factorising their matrices.

The steps are those of `convex.newton_step` and the rules those of `convex.newton`, for m states in
arrays: one call of numpy for all of them, which for few asperities is what takes time.
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Array
from convexrough.convex.newton import falls
from convexrough.convex.newton_step import FACTORISED
from convexrough.errors import SolverError
from convexrough.roundoff import SAFETY
from convexrough.shearing.energy import TangentialEnergy
from convexrough.shearing.newton import ACCURATE, MOST_STEPS, advice
from convexrough.shearing.normal_map import (
    Iterates,
    States,
    elastic_deflections,
    evaluate,
    gradients,
    gross_sliding,
    slips,
)

#: Evenly spaced states from which many others are interpolated to start with.
COARSE = 128


def by_matrices(energy: TangentialEnergy) -> bool:
    """Whether states are solved by factorisations, many at once."""
    return energy.influence.at_hand and len(energy) <= FACTORISED


def solve_together(energy: TangentialEnergy, totals: Array) -> States:
    """States at 0 <= T <= sum P of few asperities, in blocks of matrices that fit in memory."""
    size = max(1, 2**20 // len(energy) ** 2)  # matrices that stay in a cache, or just one
    starts = _starts(energy, totals)
    blocks = [slice(i, i + size) for i in range(0, len(totals), size)]
    parts = [_solve_block(energy, totals[block], starts[block]) for block in blocks]
    return States(*(np.concatenate(field) for field in zip(*parts, strict=True)))


def _starts(energy: TangentialEnergy, totals: Array) -> Array:
    """(m, n) deflections to start from: elastic, or interpolated where m is large."""
    starts = elastic_deflections(energy, totals)
    if len(totals) < 4 * COARSE:
        return starts
    coarse = np.linspace(0.0, energy.limit, COARSE)
    known = solve_together(energy, coarse).deflections
    cell = np.minimum(np.searchsorted(coarse, totals, side="right"), COARSE - 1) - 1
    part: Array = ((totals - coarse[cell]) / coarse[1])[:, None]
    between = known[cell] * (1 - part) + known[cell + 1] * part
    return np.where(energy.elastically(totals)[:, None], starts, between)


def _solve_block(energy: TangentialEnergy, totals: Array, starts: Array) -> States:
    states = evaluate(energy, starts, totals)
    limit = energy.at_limit(totals)
    active = np.flatnonzero(~energy.elastically(totals) & ~limit)
    for _ in range(MOST_STEPS):
        if len(active) == 0:
            break
        before = Iterates(*(field[active] for field in states))
        after = _descend(energy, before, _directions(energy, before), totals[active])
        accurate = before.residuals <= ACCURATE * before.rises
        take = ~accurate | (after.residuals < before.residuals)
        for field, new in zip(states, after, strict=True):
            field[active[take]] = new[take]
        active = active[~accurate]  # so an accurate state has had one step more
    else:
        worst = active[np.argmax((states.residuals / states.rises)[active])]
        raise SolverError(
            f"residual {float(states.residuals[worst] / states.rises[worst]):.3g} of the "
            f"displacement after {MOST_STEPS} steps, {ACCURATE:.3g} needed",
            solver="shear",
            advice=advice(energy, float(totals[worst])),
            iterate=states.increments[worst],
        )
    eta, u, rises = states.deflections, states.increments, states.rises
    if limit.any():
        eta[limit], u[limit], rises[limit] = gross_sliding(energy)
    return States(totals, eta, u, rises, slips(energy, eta))


def _descend(
    energy: TangentialEnergy, states: Iterates, directions: Array, totals: Array
) -> Iterates:
    """One step for each state, halved until its energy falls."""
    after = evaluate(energy, states.deflections + directions, totals)
    gradient = gradients(energy, states.deflections, states.coupling, states.rises[:, None])
    lengths = np.ones(len(totals))
    for _ in range(50):
        changes = after.energies - states.energies
        slopes = (gradient * (after.increments - states.increments)).sum(axis=1)
        rejected = np.flatnonzero(~falls(changes, slopes, SAFETY * states.energies))
        if len(rejected) == 0:
            return after
        lengths[rejected] /= 2
        trial = states.deflections[rejected] + lengths[rejected, None] * directions[rejected]
        again = evaluate(energy, trial, totals[rejected])
        for field, new in zip(after, again, strict=True):
            field[rejected] = new
    raise SolverError(
        "no step along its direction lowers the energy",
        solver="shear",
        advice=advice(energy, float(totals[rejected[0]])),
        iterate=states.increments[rejected[0]],
    )


def _directions(energy: TangentialEnergy, states: Iterates) -> Array:
    """d(eta) = -F - A W y + beta, with (I + W A W) y = -W F + beta W and sum du = 0."""
    root = np.sqrt(states.slopes)  # W, 0 where sliding
    matrices = root[:, :, None] * energy.influence.matrix * root[:, None, :]
    matrices[:, range(len(energy)), range(len(energy))] = 1.0
    right = np.stack((-root * states.defects, root), axis=2)
    y, border = np.moveaxis(_solve(matrices, right), 2, 0)
    beta = -(root * y).sum(axis=1) / (root * border).sum(axis=1)
    y = y + beta[:, None] * border
    return np.asarray(beta[:, None] - states.defects - energy.couple(root * y))


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
