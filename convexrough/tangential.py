"""The friction problem at constant normal load (Ciavarella-Jaeger), in increments. Own units.

A shear force Q on the pressed contact is carried as Q_i = f u_i with |u_i| <= P_i. The increments u
minimise a convex energy,

    sum_i P_i ceiling_i potential(u_i / P_i) + (1/2) u'Au   over |u_i| <= P_i, sum u_i = T = Q / f,

whose conditions are a normal map again: with eta_i the displacement that asperity i must take up,

    eta + A u(eta) = rise,      u_i = P_i force(eta_i / ceiling_i),

where `force` saturates: beyond ceiling_i = k_i P_i^(2/3) the asperity slides, and eta_i - ceiling_i
is its slip. Displacements are these times c_t f. Where u >= 0 this is the reduced normal contact
p = P - u of Ciavarella and Jaeger, and the slip is its gap; but u = 0 is exact at Q = 0 and
everything keeps its relative accuracy as Q -> 0.

The local part of the Hessian is least at u = 0, where it is diag(1 / (2 E* a_i)) with the contact
radii of the pressed state: the problem is convex wherever that state is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import hertz
from convexrough.checks import Array, Indices
from convexrough.contact import Contact
from convexrough.errors import SolverError
from convexrough.influence import DenseInfluence, shell_radii
from convexrough.normal import SAFETY, Units

#: Evenly spaced states from which many others are interpolated to start with.
FAMILY = 128


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


@dataclass(frozen=True, eq=False)
class TangentialProblem:
    """The loaded asperities of a contact.

    touching   : (n,) their indices in the scene
    loads      : (n,) P
    ceilings   : (n,) k P^(2/3): the deflection at which an asperity slides
    influence  : A among them
    elastic    : (n,) shares of a vanishing T, all sticking;  compliance : rise / T there
    """

    units: Units
    touching: Indices
    loads: Array
    ceilings: Array
    influence: DenseInfluence
    shells: Array
    elastic: Array
    compliance: float

    @classmethod
    @lru_cache(maxsize=4)
    def of(cls, contact: Contact) -> TangentialProblem:
        scene = contact.scene
        touching = np.flatnonzero(contact.loads)
        modulus = scene.material.contact_modulus
        k = hertz.local_coefficient(modulus, scene.relative_radii[touching])
        largest = contact.contact_radii.max() ** 2 / scene.relative_radii.min()
        units = Units.of(float(largest), float(np.median(k)))
        points = scene.contact_points[touching]
        scale = units.force / units.length / (np.pi * modulus)
        influence = DenseInfluence.assemble(points, scale, scene.point_error)
        loads = contact.loads[touching] / units.force
        ceilings = hertz.indentation(loads, k * units.local)
        stiffness = np.diag(2.0 / 3.0 * ceilings / loads) + influence.matrix
        shares = np.linalg.solve(stiffness, np.ones(len(loads)))
        return cls(
            units=units,
            touching=touching,
            loads=loads,
            ceilings=ceilings,
            influence=influence,
            shells=scale / shell_radii(points, scene.point_error),
            elastic=shares / shares.sum(),
            compliance=1.0 / float(shares.sum()),
        )

    def increments(self, deflections: Array) -> Array:
        """u(eta), saturated at +-P."""
        u: Array = self.loads * hertz.force(deflections / self.ceilings)
        return u

    def deflections(self, increments: Array) -> Array:
        """The local deflection of an asperity that does not slide."""
        eta: Array = self.ceilings * hertz.deflection(increments / self.loads)
        return eta

    def couple(self, increments: Array) -> Array:
        """(m, n) A u for each of m states."""
        product: Array = increments @ self.influence.matrix
        return product

    def energies(self, increments: Array, coupling: Array) -> Array:
        """(m,) the energy of m states."""
        local = hertz.potential(increments / self.loads) @ (self.loads * self.ceilings)
        return np.asarray(local + 0.5 * (increments * coupling).sum(axis=1))

    def solve(self, totals: Array) -> States:
        """States at the given total increments 0 <= T <= sum P; in blocks that fit in memory."""
        size = max(1, 2**20 // len(self.loads) ** 2)  # matrices that stay in a cache, or just one
        starts = self._starts(totals)
        blocks = [slice(i, i + size) for i in range(0, len(totals), size)]
        parts = [self._solve(totals[block], starts[block]) for block in blocks]
        return States(*(np.concatenate(field) for field in zip(*parts, strict=True)))

    def limited(self, totals: Array) -> Array:
        """T, and exactly sum P where it is that to rounding, or beyond."""
        limited: Array = np.where(self.at_limit(totals), self.loads.sum(), totals)
        return limited

    def _starts(self, totals: Array) -> Array:
        """(m, n) deflections to start from: elastic, or interpolated where m is large."""
        share = np.minimum(totals[:, None] * self.elastic, self.loads)
        starts = self.deflections(share)
        if len(totals) < 4 * FAMILY:
            return starts
        coarse = np.linspace(0.0, float(self.loads.sum()), FAMILY)
        known = self.solve(coarse).deflections
        cell = np.minimum(np.searchsorted(coarse, totals, side="right"), FAMILY - 1) - 1
        part: Array = ((totals - coarse[cell]) / coarse[1])[:, None]
        between = known[cell] * (1 - part) + known[cell + 1] * part
        return np.where(self.elastically(totals)[:, None], starts, between)

    def elastically(self, totals: Array) -> NDArray[np.bool_]:
        """Where T is so small that the elastic state, off by about T / sum P, is exact."""
        return np.asarray(totals <= 1e-20 * self.loads.sum())

    def at_limit(self, totals: Array) -> NDArray[np.bool_]:
        """Where T is sum P to rounding: every asperity slides, the last one just."""
        limit = float(self.loads.sum())
        return np.asarray(limit - totals <= 4 * np.finfo(float).eps * limit)

    def _solve(self, totals: Array, starts: Array) -> States:
        iterate = self._evaluate(starts, totals)
        limit = self.at_limit(totals)
        active = np.flatnonzero(~self.elastically(totals) & ~limit)
        for _ in range(100):
            if len(active) == 0:
                break
            before = _Iterate(*(field[active] for field in iterate))
            after = self._step(before, totals[active])
            accurate = before.residuals <= 1e-12 * before.rises
            take = ~accurate | (after.residuals < before.residuals)
            for field, new in zip(iterate, after, strict=True):
                field[active[take]] = new[take]
            active = active[~accurate]  # so an accurate state has had one step more
        else:
            worst = float((iterate.residuals / iterate.rises)[active].max())
            raise SolverError(
                f"shear: residual {worst:.3g} of the displacement after 100 Newton steps, at "
                f"{float(totals[active[0]] / self.loads.sum()):.6g} of gross sliding"
            )
        eta, u, coupling, _, rises, _ = iterate
        if limit.any():
            u[limit], coupling[limit] = self.loads, self.couple(self.loads)
            rises[limit] = (self.ceilings + coupling[limit]).max(axis=1)
            eta[limit] = rises[limit, None] - coupling[limit]
        slips = eta - np.clip(eta, -self.ceilings, self.ceilings)
        return States(totals, eta, u, rises, slips)

    def _evaluate(self, eta: Array, totals: Array) -> _Iterate:
        eta = eta + self._shifts(eta, totals)[:, None]
        u = self.increments(eta)
        coupling = self.couple(u)
        slopes = self.slopes(eta)
        level = eta + coupling  # the rise, at every asperity
        weight = slopes.sum(axis=1)
        rises = (slopes * level).sum(axis=1) / np.where(weight > 0, weight, 1.0)
        defects = level - rises[:, None]
        return _Iterate(eta, u, coupling, defects, rises, np.abs(defects).max(axis=1))

    def _step(self, state: _Iterate, totals: Array) -> _Iterate:
        """One Newton step for each state, halved until its energy falls."""
        direction = self._directions(state)
        energies = self.energies(state.increments, state.coupling)
        gradients = np.clip(state.deflections, -self.ceilings, self.ceilings) + state.coupling
        gradients -= state.rises[:, None]
        lengths = np.ones(len(totals))
        after = self._evaluate(state.deflections + direction, totals)
        for _ in range(50):
            changes = self.energies(after.increments, after.coupling) - energies
            slopes = (gradients * (after.increments - state.increments)).sum(axis=1)
            rejected = np.flatnonzero(changes > 1e-4 * np.minimum(slopes, 0) + SAFETY * energies)
            if len(rejected) == 0:
                return after
            lengths[rejected] /= 2
            trial = state.deflections[rejected] + lengths[rejected, None] * direction[rejected]
            again = self._evaluate(trial, totals[rejected])
            for field, new in zip(after, again, strict=True):
                field[rejected] = new
        raise SolverError("shear: no step along Newton's direction lowers the energy")

    def _directions(self, state: _Iterate) -> Array:
        """d(eta) = -F - A W y + beta, with (I + W A W) y = -W F + beta W and sum du = 0."""
        root = np.sqrt(self.slopes(state.deflections))  # W, 0 where sliding
        matrices = root[:, :, None] * self.influence.matrix * root[:, None, :]
        matrices[:, range(len(self.loads)), range(len(self.loads))] = 1.0
        right = np.stack((-root * state.defects, root), axis=2)
        y, border = np.moveaxis(_solve(matrices, right), 2, 0)
        beta = -(root * y).sum(axis=1) / (root * border).sum(axis=1)
        y = y + beta[:, None] * border
        return np.asarray(beta[:, None] - state.defects - self.couple(root * y))

    def slopes(self, eta: Array) -> Array:
        """c = du/deta, 0 where sliding."""
        left = np.maximum(1.0 - np.abs(eta) / self.ceilings, 0.0)
        slopes: Array = 1.5 * self.loads / self.ceilings * np.sqrt(left)
        return slopes

    def _shifts(self, eta: Array, totals: Array) -> Array:
        """(m,) the shift of each state's eta that makes its increments add up to T.

        Newton's method inside a bracket: the sum grows with the shift, from -sum P to sum P.
        """
        low = (-self.ceilings - eta).min(axis=1)
        high = (self.ceilings - eta).max(axis=1)
        shifts = np.zeros(len(totals))
        for _ in range(100):
            moved = eta + shifts[:, None]
            excess = self.increments(moved).sum(axis=1) - totals
            low, high = np.where(excess < 0, shifts, low), np.where(excess > 0, shifts, high)
            slopes = self.slopes(moved).sum(axis=1)
            steps = -excess / np.where(slopes > 0, slopes, np.inf)
            following = shifts + steps
            outside = ~((following > low) & (following < high)) & (excess != 0)
            following = np.where(outside, (low + high) / 2, following)
            change = np.abs(following - shifts)
            shifts = following
            if (change <= 1e-15 * np.abs(moved).max(axis=1)).all():
                break
        return shifts


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


class _Iterate(NamedTuple):
    """Newton's method at m states; `rises` is the best estimate, `defects` F = eta + A u - rise."""

    deflections: Array
    increments: Array
    coupling: Array
    defects: Array
    rises: Array
    residuals: Array
