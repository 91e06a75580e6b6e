"""The friction problem with the full tangential kernel, as one convex program. Own units.

A shear force Q on the pressed contact is carried as Q_i = f q_i with vectors |q_i| <= P_i in the
plane. A tangential point force moves the surface by Cerruti's tensor, here for both bodies,

    C_ij = 1 / (pi G r) [(1 - nu) I + nu d d'],    d the unit vector from j to i, r the distance.

With c_t Mindlin's ratio, A the normal coupling and bias = nu / (2 - nu), that is c_t B_ij with

    B_ij = A_ij [(1 - bias) I + 2 bias d d'].

The forces minimise a convex energy (times c_t f^2; displacements are times c_t f),

    sum_i P_i ceiling_i potential(|q_i| / P_i) + (1/2) q'Bq   over |q_i| <= P_i, sum q = T = Q / f,

and at the least energy there are a rigid displacement X, the multiplier of the total, and slips,
the multipliers of |q_i| <= P_i times the direction of q_i, with

    X = own(q_i) + (B q)_i + slip_i,    own(q) = ceiling_i deflection(|q| / P_i) q / |q|.

Averaging d d' over all directions leaves B = A: that is Ciavarella and Jaeger's problem. Derived in
docs/theory/friction.md, "The kernel" and "The program".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.convex.definite import is_definite
from convexrough.errors import SolverError
from convexrough.normal.residual import SUM_ROUNDOFFS
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.problem import TangentialProblem
from convexrough.sphere import mindlin


class VectorState(NamedTuple):
    """A friction state of the n loaded asperities; own units.

    total : (2,) T;  increments : (n, 2) q;  rise : (2,) X;  slips : (n, 2)
    """

    total: Array
    increments: Array
    rise: Array
    slips: Array
    iterations: int


class Shift(NamedTuple):
    """What makes the kernel semidefinite: B + diag(shift_i I) >= 0.

    shares : (n,) S_i, the shift over the least local stiffness; convex where all S_i <= 1

    docs/theory/friction.md, "Convexity".
    """

    values: Array
    shares: Array


@dataclass(frozen=True, eq=False)
class VectorProblem:
    """The loaded asperities of a contact, and how tangential forces couple them.

    scalar : the same with the angular mean of the kernel (Ciavarella-Jaeger)
    bias   : nu / (2 - nu)
    kernel : (2n, 2n) B, in the order x_1, y_1, x_2, y_2, ...
    """

    scalar: TangentialProblem
    bias: float
    kernel: Array

    @classmethod
    def of(cls, contact: Contact) -> VectorProblem:
        """That of a contact, which keeps it. Raises InputError where it does not fit in memory."""
        return contact.keep(cls._assemble)

    @classmethod
    def _assemble(cls, contact: Contact) -> VectorProblem:
        n = int(np.count_nonzero(contact.loads))
        checks.fits_in_memory("loaded asperities", n, 5 * 4 * 8, power=2)
        scalar = TangentialProblem.of(contact)
        nu = contact.scene.material.poisson_ratio
        bias = nu / (2.0 - nu)
        x, y = contact.scene.contact_points[scalar.touching].T
        dx, dy = np.subtract.outer(x, x), np.subtract.outer(y, y)
        squares = dx**2 + dy**2
        squares[np.diag_indices(n)] = 1.0
        kernel = np.empty((n, 2, n, 2))
        A = scalar.influence.matrix
        turned = bias * A * (dx - dy) * (dx + dy) / squares  # 2 d d' - I = [[cos, sin], [., -cos]]
        kernel[:, 0, :, 0], kernel[:, 1, :, 1] = A + turned, A - turned
        kernel[:, 0, :, 1] = kernel[:, 1, :, 0] = bias * A * 2.0 * dx * dy / squares
        return cls(scalar, bias, kernel.reshape(2 * n, 2 * n))

    def __len__(self) -> int:
        return len(self.scalar.loads)

    @property
    def stiffness(self) -> Array:
        """(n,) h_i = (2/3) ceiling_i / P_i = 1 / (2 E* a_i): the local Hessian is at least h_i I.

        Its eigenvalues, along q and across, are ceiling/P times deflection'(t) and deflection(t)/t:
        docs/theory/friction.md, "Convexity".
        """
        h: Array = (2.0 / 3.0) * self.scalar.ceilings / self.scalar.loads
        return h

    @property
    def convexity_numbers(self) -> Array:
        """(n,) a_i / ((pi/2) s_i) of the pressed state, s_i half the distance to the nearest."""
        numbers: Array = self.scalar.shells / self.stiffness
        return numbers

    @property
    def product_error(self) -> float:
        """(B q)_i as computed is off by at most this times sum_j A_ij |q_j|."""
        entries = self.scalar.influence.entry_error
        return 4.0 * (entries + (2 * len(self) + SUM_ROUNDOFFS) * ROUNDOFF)

    def couple(self, increments: Array) -> Array:
        """(n, 2) B q."""
        product: Array = self.kernel @ increments.reshape(-1)
        return product.reshape(-1, 2)

    def own(self, increments: Array) -> Array:
        """(n, 2) how far each asperity's own force moves it, |q_i| <= P_i."""
        size = self.sizes(increments)
        return along(self.scalar.deflections(size), increments, size)

    def sizes(self, increments: Array) -> Array:
        """(n,) |q_i|, and exactly P_i where it is that to rounding, or beyond.

        The local law is steep there: one roundoff less than P_i would seem 2e-11 off the ceiling.
        """
        size, P = np.hypot(*increments.T), self.scalar.loads
        full: Array = np.where(size >= P * (1.0 - 8 * ROUNDOFF), P, size)
        return full

    def local_forces(self, deflections: Array) -> Array:
        """(n, 2) q(eta), the inverse of `own`, along eta; |q_i| = P_i where it slides."""
        size = np.hypot(*deflections.T)
        return along(self.scalar.increments(size), deflections, size)

    def energy(self, increments: Array, coupling: Array) -> float:
        """`coupling` is B q."""
        P, ceilings = self.scalar.loads, self.scalar.ceilings
        local = mindlin.potential(np.hypot(*increments.T) / P) @ (P * ceilings)
        return float(local + 0.5 * (increments * coupling).sum())

    def residual(self, state: VectorState) -> float:
        """How far the conditions of the least energy are from holding; dimensionless.

        The largest of: what displacements fail to balance by at an asperity, the part of a slip
        that is not along the force, the slip where friction is not used up times the share of it
        that is left (all over |X|); the force beyond P_i over P_i; the missing total over |T|. The
        conditions are those of docs/theory/friction.md, "The program".
        """
        if not np.isfinite(state.rise).all():
            return np.inf
        q, slips, P = state.increments, state.slips, self.scalar.loads
        size = self.sizes(q)
        slip_size = np.hypot(*slips.T)
        imbalance = np.hypot(*(state.rise - self.own(q) - self.couple(q) - slips).T)
        across = np.hypot(*(slips - along(slip_size, q, size)).T)
        unused = slip_size * np.maximum(1.0 - size / P, 0.0)
        missing = float(np.hypot(*(q.sum(axis=0) - state.total)))
        travel, total = float(np.hypot(*state.rise)), float(np.hypot(*state.total))
        parts = (
            float(np.max([imbalance, across, unused])) / (travel or 1.0),
            float((np.hypot(*q.T) / P - 1.0).max()),
            missing / (total or 1.0),
        )
        return max(parts)

    @cached_property
    def shift(self) -> Shift:
        """A shift for the cones and the dual bound, confirmed by Cholesky.

        By the neighbours' distances, (3) of docs/theory/friction.md, "Convexity": 2 / (2 - nu) of

            1 / (pi E* s_i) at nu = 0,    (9/4) (1 - 2 nu / 3) / (pi E* s_i) for 0 < nu <= 1/2.

        Where a share exceeds 21/25, the least with equal shares, from the smallest eigenvalue.
        """
        nu = 2.0 * self.bias / (1.0 + self.bias)
        factor = 1.0 if nu == 0 else 4.5 * (1.0 - 2.0 * nu / 3.0) / (2.0 - nu)
        by_distance = factor * self.scalar.shells
        shares = by_distance / self.stiffness
        if shares.max() <= 21 / 25 and self._semidefinite(shares):
            return Shift(by_distance, shares)
        equal = np.full(len(self), self.least_share + self._rounding)
        if not self._semidefinite(equal):
            raise SolverError(
                "no shift makes the tangential kernel semidefinite", solver="friction"
            )
        return Shift(equal * self.stiffness, equal)

    @cached_property
    def least_share(self) -> float:
        """The least S with B + S diag(h_i I) >= 0: the energy is convex where it is below 1."""
        return max(float(-np.linalg.eigvalsh(self._scaled)[0]), 0.0)

    @property
    def _scaled(self) -> Array:
        """(2n, 2n) B with rows and columns over the roots of the stiffness."""
        root = np.repeat(1.0 / np.sqrt(self.stiffness), 2)
        scaled: Array = self.kernel * root * root[:, None]
        return scaled

    @property
    def _rounding(self) -> float:
        """What rounding can hide of an eigenvalue of `_scaled`, which are of the order of 1."""
        return 1e-14 * (1 + len(self))

    def _semidefinite(self, shares: Array) -> bool:
        """Whether a shift of these shares makes B semidefinite, up to rounding."""
        matrix = self._scaled
        matrix[np.diag_indices(len(matrix))] = np.repeat(shares, 2) + self._rounding
        return is_definite(matrix)

    def duality_gap(self, state: VectorState) -> float:
        """Upper bound on the energy of the forces above the least, from q and X alone.

        With M = B + shift, semidefinite, and h_i(q) = the local energy - shift |q|^2 / 2, convex,

            least energy >= X'T - q'Mq / 2 + sum_i min over |x| <= P_i of [h_i(x) + (M q - X)_i x],

        and the energy less that is a sum of terms that are not negative. Infinite where a share
        of the shift exceeds 1, or X is. docs/theory/friction.md, "The least energy from below",
        and "Rounding" there.
        """
        shares = self.shift.shares + self._slack
        if shares.max() > 1 or not np.isfinite(state.rise).all():
            return np.inf
        q, X, shift = state.increments, state.rise, shares * self.stiffness
        size, coupling = np.hypot(*q.T), self.couple(q)
        pull = X - coupling - shift[:, None] * q  # X - M q
        slope = np.hypot(*pull.T)
        best = self._best_sizes(slope, shares)
        terms = self._convex_part(size, shift) - (pull * q).sum(axis=1)
        terms = terms - self._convex_part(best, shift) + slope * best

        # What pulls are off by moves the best forces, and both move the terms.
        P = self.scalar.loads
        sums = self.scalar.influence.matrix @ size + shift * size + float(np.hypot(*X))
        off = self.product_error * sums + self._slope_defect(best, slope, shift)
        curvature = self.stiffness - shift
        moved = np.divide(off, curvature, out=np.full(len(P), np.inf), where=curvature > 0)
        apart = np.hypot(*(along(best, pull, slope) - q).T)
        rounding = off * np.minimum(apart + moved, 2.0 * np.maximum(P, size))
        largest = np.maximum(size, best)
        own = self.scalar.deflections(np.minimum(largest, P))
        rounding += 64 * ROUNDOFF * largest * (own + shift * largest + slope)
        short = [math.fsum((*column, -part)) for column, part in zip(q.T, state.total, strict=True)]
        missing = abs(float(X @ short)) + 8 * ROUNDOFF * float(np.abs(X) @ np.abs(state.total))
        missing += 4 * ROUNDOFF * float(np.abs(X) @ np.abs(short))
        return (float((np.maximum(terms, 0.0) + rounding).sum()) + missing) * (1 + SAFETY)

    def _slope_defect(self, sizes: Array, slope: Array, shift: Array) -> Array:
        """(n,) how far the slopes of h_i at these sizes are from those asked for, with rounding."""
        x = mindlin.deflection(sizes / self.scalar.loads)
        own, P = self.scalar.ceilings * x, self.scalar.loads
        found = own - shift * sizes
        asked = np.where(sizes < P, slope, np.minimum(slope, found))
        # One roundoff of a size near P changes the deflection by far more than one.
        steep = self.scalar.deflections(np.minimum(sizes * (1 + 8 * ROUNDOFF), P)) - own
        loss = np.abs(found - asked) + steep
        return np.asarray(loss + 16 * ROUNDOFF * (own + shift * sizes + slope))

    @property
    def _slack(self) -> float:
        """What shares lack of a proof that B + shift >= 0: rounding of the factorisation, and of B.

        As in `convex.definite`, with a trace of at most 2n (the largest share and a little).
        """
        n = 2 * len(self)
        rows = float(np.abs(self._scaled).sum(axis=1).max())
        trace = n * (float(self.shift.shares.max()) + self._rounding)
        blur = (self.product_error + 8 * ROUNDOFF) * rows
        return self._rounding + 1.1 * (blur + (n + 2) * ROUNDOFF * trace)

    def _convex_part(self, sizes: Array, shift: Array) -> Array:
        """(n,) h_i of forces of these sizes: the local energy less shift |q|^2 / 2."""
        P, ceilings = self.scalar.loads, self.scalar.ceilings
        return np.asarray(P * ceilings * mindlin.potential(sizes / P) - shift * sizes**2 / 2.0)

    def _best_sizes(self, slope: Array, shares: Array) -> Array:
        """(n,) the size |q| <= P_i at which h_i(q) - slope_i |q| is least.

        With x = deflection(|q| / P) that is where  ceiling [x - (2/3) S force(x)] = slope, or 1: a
        convex, growing function of x, so Newton's method runs down to it from its tangent at 0.
        docs/theory/friction.md, "The least energy from below".
        """
        ceilings = self.scalar.ceilings
        slope = np.minimum(slope, ceilings * (1.0 - 2.0 / 3.0 * shares))
        x = np.minimum(slope / (ceilings * np.maximum(1.0 - shares, 1e-300)), 1.0)
        for _ in range(60):
            value = ceilings * (x - 2.0 / 3.0 * shares * mindlin.force(x)) - slope
            rate = ceilings * (1.0 - shares * np.sqrt(1.0 - x))
            step = np.where(rate > 0, value / np.where(rate > 0, rate, 1.0), 0.0)
            x = np.clip(x - step, 0.0, 1.0)
            if (np.abs(step) <= 1e-15 * x).all():
                break
        best: Array = self.scalar.loads * mindlin.force(x)
        return best


def along(lengths: Array, vectors: Array, sizes: Array) -> Array:
    """(n, 2) of the given lengths, in the directions of the vectors; 0 where those are 0."""
    scale: Array = lengths / np.where(sizes > 0, sizes, 1.0)
    return vectors * scale[:, None]
