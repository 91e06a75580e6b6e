"""The interface of all compliance operators of asperities, with bounds on their rounding errors.

A unit point force displaces the surface at the distance r by 1 / (pi E* r), with the contact
modulus E* (Boussinesq; equation (3) of Dini and Hills, 2009). The diagonal of an operator is 0: the
contact law adds the displacement of an asperity by its own load, by Hertz's law. A is the operator,
P the loads, r_ij the distance of the points i and j.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, Indices

#: Bound on the relative error of a computed 1 / (pi E* r) for exact points, in units of the
#: roundoff. In these units, the error of a difference of coordinates is at most 1; that of its
#: square 3, of the sum of squares 4, of the root 3, and of the result 8.
ENTRY_ROUNDOFFS = 8

#: Ways to compute the operator: a matrix, transforms on a lattice, transforms on a mesh.
Kind = Literal["dense", "lattice", "scattered"]

#: A function of a vector r that returns estimates of (I + W A W)^-1 r and of the 2-norm of A W r,
#: with the diagonal matrix W of `Influence.smoother`.
Smoother = Callable[[NDArray[Any]], tuple[NDArray[Any], float]]


class Rounding(NamedTuple):
    """Bounds on the error of a computed product A P, for loads of either sign.

    The error of component i is at most  relative * (A |P|)_i + each.  In docs/theory/operators.md,
    `relative` is eta and `each` is rho.
    """

    relative: float
    each: float

    def of(self, displacement: Array) -> Array:
        """Bounds on the errors of all components; `displacement` is A |P| as computed."""
        return self.relative * np.maximum(displacement, 0.0) + 1.01 * self.each

    def negligible(self, displacement: Array) -> float:
        """A 2-norm of the residual at which solvers can stop, as it is far below these bounds.

        displacement : A P as computed
        """
        size = math.sqrt(np.vdot(displacement, displacement))
        return 0.1 * self.relative * size + 0.02 * self.each * math.sqrt(len(displacement))


class Coupling(Protocol):
    """A linear map from loads at the asperities to displacements at some points."""

    def apply(self, loads: Array) -> Array:
        """(m,) A P for loads (n,); in float32 if the loads are float32 and float32 is faster."""
        ...

    def rounding(self, loads: Array) -> Rounding:
        """Bound on the error of `apply` for float64 loads."""
        ...

    def falloff(self, strengths: Array, power: int) -> Array:
        """(m,) upper bounds on sum_j strengths_j / r_ij^power, often a few per cent too large.

        strengths : (n,) not negative
        power     : 2 or 3
        """
        ...


class Influence(Coupling, Protocol):
    """The compliance operator A among asperities, A_ij = scale / r_ij.

    name   : "dense", "lattice" or "scattered"
    points : (n, 2) [length] the contact points
    scale  : 1 / (pi E*) with the contact modulus E*, in the units of loads and displacements
    stored : True if the matrix is stored; if False, products with float32 loads are cheaper
    cheap_sums : True if `sums` takes only a few times as long as `apply`. Then Newton's method ends
        early, and `normal.refine` makes the last steps with `sums`
    """

    @property
    def name(self) -> Kind: ...
    @property
    def points(self) -> Array: ...
    @property
    def scale(self) -> float: ...
    @property
    def stored(self) -> bool: ...
    @property
    def cheap_sums(self) -> bool: ...

    @property
    def matrix(self) -> Array:
        """(n, n) A as a matrix, which must fit in memory."""
        ...

    def submatrix(self, which: Indices) -> Array:
        """(m, m) A among some of the asperities, as a new array."""
        ...

    @property
    def entry_error(self) -> float:
        """Bound on the relative error of each entry of `matrix`."""
        ...

    def __len__(self) -> int: ...

    def restricted(self, which: Indices) -> Influence:
        """The operator among some of the asperities."""
        ...

    def onto(self, points: Array) -> Coupling:
        """The map from loads to displacements at other points; a load at such a point adds 0."""
        ...

    def slopes(self, loads: Array) -> Array:
        """(n, 2) derivatives of (A P)_i with respect to the contact point c_i of asperity i.

        They are -scale sum_j (c_i - c_j) P_j / r_ij^3, without a bound on the rounding error.
        """
        ...

    def separations(self) -> Array:
        """(n,) [length] lower bounds on the distances of asperities to their nearest neighbours."""
        ...

    def crowding(self, radii: Array) -> float:
        """The largest (a_i + a_j) / r_ij; the `radii` a (n,) are contact radii, 0 where open."""
        ...

    def semidefinite_with(self, radius: float) -> bool:
        """True if A + (scale / radius) I is proved positive semidefinite; else False.

        Only the operator on a lattice proves it.
        """
        ...

    def sums(self, loads: Pair) -> Ball:
        """(n,) sums over j of P_j / r_ij [force / length], with many more digits than `apply`."""
        ...

    def smoother(self, root: Array) -> Smoother | None:
        """A symmetric, positive definite approximation of (I + W A W)^-1, with W = diag(root).

        None if no approximation is available.
        """
        ...


@dataclass(frozen=True, eq=False)
class JointCoupling:
    """The map from loads on the last points of an operator to displacements of the first points.

    joint : the operator among all points
    targets : number of first points; displacements are computed at these points
    """

    joint: Influence
    targets: int

    def apply(self, loads: Array) -> Array:
        return self.joint.apply(self._all(loads))[: self.targets]

    def rounding(self, loads: Array) -> Rounding:
        return self.joint.rounding(self._all(loads))

    def falloff(self, strengths: Array, power: int) -> Array:
        return self.joint.falloff(self._all(strengths), power)[: self.targets]

    def _all(self, values: Array) -> Array:
        return np.concatenate((np.zeros(self.targets, dtype=values.dtype), values))


def error_reach(coupling: Coupling, scale: float, variances: Array) -> Array:
    """(m,) bounds on the square root of sum_j A_ij^2 v_j for v = `variances`.

    They bound |A e|_i for every error e of the loads with sum_j e_j^2 / v_j <= 1.
    """
    return scale * np.sqrt(coupling.falloff(variances, 2))


def known(points: Array, tails: Array | None, point_error: float) -> tuple[Pair, float]:
    """The points (n, 2) as double-double numbers, and a bound on the errors of their coordinates.

    tails : the low parts of the numbers; if None, they are 0 and the bound is `point_error`
    """
    if tails is None:
        return Pair.exact(points), point_error
    return Pair(points, tails), 2.0**-96 * float(np.abs(points).max(initial=0.0))


def squared_distances(points: Array, others: Array) -> Array:
    """(n, m) [length^2] r_ij^2."""
    squares, y = (np.subtract.outer(points[:, k], others[:, k]) for k in (0, 1))
    squares *= squares
    y *= y
    squares += y
    return np.asarray(squares)


def inverse_distances(points: Array, others: Array) -> Array:
    """(n, m) [1 / length] 1 / r_ij, and 0 where two points coincide."""
    squares = squared_distances(points, others)
    with np.errstate(divide="ignore"):
        inverse: Array = 1.0 / np.sqrt(squares)
    inverse[squares == 0] = 0.0
    return inverse


def cubed(squares: Array) -> Array:
    """1 / r^3 for squared distances r^2, and 0 where two points coincide."""
    with np.errstate(divide="ignore"):
        inverse: Array = 1.0 / (squares * np.sqrt(squares))
    inverse[squares == 0] = 0.0
    return inverse
