"""The energy of the increments of friction, and its normal map. Own units.

Increments u of the loads P that asperities hold in friction minimise a convex energy,

    sum_i P_i ceiling_i potential(u_i / P_i) + (1/2) u'Au   over |u_i| <= P_i, sum u_i = T,

whose conditions are a normal map: with eta_i the displacement that asperity i must take up,

    eta + A u(eta) = rise,      u_i = P_i force(eta_i / ceiling_i),

where `force` saturates: beyond ceiling_i = k_i P_i^(2/3) the asperity slides, and eta_i - ceiling_i
is its slip.

The local part of the Hessian is least at u = 0, where it is diag(1 / (2 E* a_i)) with the contact
radii of the pressed state: the problem is convex wherever that state is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.convex.newton_step import FACTORISED, correct
from convexrough.errors import SolverError
from convexrough.influence import Influence
from convexrough.sphere import annulus


@dataclass(frozen=True, eq=False)
class TangentialEnergy:
    """n loaded asperities. Arrays are (n,), or (m, n) for m states at once.

    loads     : (n,) P
    ceilings  : (n,) k P^(2/3): the deflection at which an asperity slides
    influence : A among them
    shells    : (n,) added to the diagonal of A they make it semidefinite
    """

    loads: Array
    ceilings: Array
    influence: Influence
    shells: Array

    def __len__(self) -> int:
        return len(self.loads)

    def increments(self, deflections: Array) -> Array:
        """u(eta), saturated at +-P."""
        u: Array = self.loads * np.copysign(
            annulus.force(annulus.width_at(deflections / self.ceilings)), deflections
        )
        return u

    def deflections(self, increments: Array) -> Array:
        """The local deflection of an asperity that does not slide."""
        local: Array = annulus.deflection(self.widths(increments))
        eta: Array = self.ceilings * np.copysign(local, increments)
        return eta

    def widths(self, increments: Array) -> Array:
        """x of the slip annuli, to the last digits near full slip as well."""
        size = np.abs(increments)
        x: Array = annulus.width_between(size / self.loads, (self.loads - size) / self.loads)
        return x

    def slopes(self, deflections: Array) -> Array:
        """c = du/deta, 0 where sliding."""
        c: Array = self.stiffest * (1.0 - annulus.width_at(deflections / self.ceilings))
        return c

    def respond(self, deflections: Array) -> tuple[Array, Array]:
        """`increments` and `slopes` at once."""
        x = annulus.width_at(deflections / self.ceilings)
        u: Array = self.loads * np.copysign(annulus.force(x), deflections)
        return u, self.stiffest * (1.0 - x)

    def couple(self, increments: Array) -> Array:
        """A u, of one state or of each of m."""
        if increments.ndim == 1:
            return self.influence.apply(increments)
        if self.influence.at_hand:
            return self.influence.apply(increments.T).T
        product = np.empty_like(increments)
        for row, u in zip(product, increments, strict=True):
            row[:] = self.influence.apply(u)
        return product

    def energies(self, deflections: Array, increments: Array, coupling: Array) -> Array:
        """(m,) the energy of m states."""
        local = annulus.potential(annulus.width_at(deflections / self.ceilings))
        coupled = 0.5 * (increments * coupling).sum(axis=1)
        return np.asarray(local @ (self.loads * self.ceilings) + coupled)

    @cached_property
    def stiffest(self) -> Array:
        """(n,) c at eta = 0: 2 E* a, the inverse of the local part H of the Hessian there."""
        c: Array = 1.5 * self.loads / self.ceilings
        return c

    @cached_property
    def limit(self) -> float:
        """The largest T: gross sliding."""
        return float(self.loads.sum())

    def at_limit(self, totals: Array) -> NDArray[np.bool_]:
        """Where T is sum P to rounding, and the last asperity just slides, or just does not."""
        roundoffs = 4 + np.log2(len(self))  # of adding n loads up
        return np.asarray(self.limit - totals <= roundoffs * np.finfo(float).eps * self.limit)

    def elastically(self, totals: Array) -> NDArray[np.bool_]:
        """Where T is so small that the elastic state, off by about T / sum P, is exact."""
        return np.asarray(totals <= 1e-20 * self.limit)

    @cached_property
    def elastic(self) -> Array:
        """(n,) shares q of a vanishing T, all sticking: (H + A) q is the same everywhere.

        Newton's method on the same normal map with all slopes held at those of eta = 0. The map is
        linear, so each step leaves what its linear solver does.
        """
        c, root = self.stiffest, np.sqrt(self.stiffest)
        if self.influence.at_hand and len(self) <= FACTORISED:
            stiffness = np.diag(1.0 / c) + self.influence.matrix
            shares = np.linalg.solve(stiffness, np.ones(len(self)))
            return np.asarray(shares / shares.sum())
        eta, best, before = np.full(len(self), 1.0 / float(c.sum())), c, np.inf
        for _ in range(20):
            shares = c * eta
            level = eta + self.couple(shares)
            defect = level - float(shares @ level)
            size = float(np.linalg.norm(defect))
            if size >= 0.5 * before:  # nothing but rounding is left
                return best
            best, before = shares, size
            step = correct(self.influence, self.shells, root, defect, balanced=True, tolerance=1e-5)
            eta = eta + step
            eta /= float(c @ eta)
        raise SolverError("the elastic state does not converge", solver="shear")
