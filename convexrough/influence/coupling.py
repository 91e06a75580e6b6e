"""The interface of all compliance operators of asperities, with bounds on their rounding errors.

A unit point force displaces the surface at the distance r by 1 / (pi E* r), with the contact
modulus E* (Boussinesq; equation (3) of Dini and Hills, 2009). The diagonal of an operator is 0: the
contact law adds the displacement of an asperity by its own load, by Hertz's law. A is the operator,
P the loads, r_ij the distance of the points i and j.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks, threads
from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, Indices, evenly
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene import neighbours

#: Bound on the relative error of a computed 1 / (pi E* r) for exact points, in units of the
#: roundoff. In these units, the error of a difference of coordinates is at most 1; that of its
#: square 3, of the sum of squares 4, of the root 3, and of the result 8.
ENTRY_ROUNDOFFS = 8

#: A matrix of 1 / r between asperities and other points is cached if it has at most this many
#: entries; for larger matrices a cache saves no time.
KEPT = 2**16

#: Number of entries of a matrix that are computed at once. They fit in a processor's cache, and in
#: memory that need not be mapped for each block.
ENTRIES = 2**14

#: The same number where several threads share the work, which wait for each other less often then.
IN_THREADS = 2**16

#: Ways to compute the operator: a matrix, transforms on a lattice, transforms on a mesh.
Kind = Literal["dense", "lattice", "scattered"]

#: A function of a vector r that returns an estimate of (I + W A W)^-1 r, with the diagonal matrix W
#: of `Influence.smoother`.
Smoother = Callable[[NDArray[Any]], NDArray[Any]]


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
        """A 2-norm of the residual, far below these bounds for A P, at which solvers can stop."""
        size = math.sqrt(np.vdot(displacement, displacement))
        return 0.1 * self.relative * size + 0.02 * self.each * math.sqrt(len(displacement))


class Coupling(ABC):
    """A linear map from loads at the asperities to displacements at some points."""

    @abstractmethod
    def apply(self, loads: Array) -> Array:
        """(m,) A P for loads (n,); in float32 if the loads are float32 and float32 is faster."""

    @abstractmethod
    def rounding(self, loads: Array) -> Rounding:
        """Bound on the error of `apply` for float64 loads."""

    @abstractmethod
    def falloff(self, strengths: Array, power: int) -> Array:
        """(m,) upper bounds on sum_j strengths_j / r_ij^power, often a few per cent too large.

        The `strengths` (n,) are not negative; `power` is 1, 2 or 3.
        """


class Influence(Coupling):
    """The compliance operator A among asperities, A_ij = scale / r_ij."""

    name: ClassVar[Kind]
    #: True if the matrix is stored; if False, products with float32 loads are cheaper.
    stored: ClassVar[bool] = False
    #: True if `sums` takes only a few times as long as `apply`. Then Newton's method may end early,
    #: and `normal.refine` makes the last steps with `sums`.
    cheap_sums: ClassVar[bool] = False

    points: Array  # (n, 2) [length] the contact points
    scale: float  # 1 / (pi E*) with the contact modulus E*, in the units of loads, displacements
    point_error: float  # [length] bound on the error of each coordinate of `points`

    #: (n,) sums over j of P_j / r_ij [force / length], with many more digits than `apply`.
    sums: Callable[[Pair], Ball]

    def __len__(self) -> int:
        return len(self.points)

    @property
    def matrix(self) -> Array:
        """(n, n) A as a matrix, which must fit in memory."""
        return dense_matrix(self.points, self.scale)

    def submatrix(self, which: Indices) -> Array:
        """(m, m) A among some of the asperities, as a new array."""
        return dense_matrix(self.points[which], self.scale)

    @cached_property
    def entry_error(self) -> float:
        """Bound on the relative error of each entry of `matrix`."""
        if self.point_error == 0:
            return entry_error(0.0, np.inf)
        return entry_error(self.point_error, float(self.separations().min(initial=np.inf)))

    @property
    def row_norm(self) -> float:
        """Upper bound on the 2-norm of any row of A."""
        squares = self.falloff(np.ones(len(self)), 2)
        return self.scale * math.sqrt(squares.max(initial=0.0)) * (1 + SAFETY)

    @abstractmethod
    def restricted(self, which: Indices) -> Influence:
        """The operator among some of the asperities."""

    def onto(self, points: Array) -> Coupling:
        """The map from loads to displacements at other points; a load at such a point adds 0."""
        return DirectCoupling(self.points, points, self.scale, self.point_error)

    def slopes(self, loads: Array) -> Ball:
        """(n, 2) derivatives of (A P)_i with respect to the contact point c_i of asperity i.

        They are -scale sum_j (c_i - c_j) P_j / r_ij^3. Errors that are not known are infinite.
        """
        points, total = self.points, np.empty((len(self), 2))
        for some in _rows(len(self), len(self)):
            weights = cubed(squared_distances(points[some], points)) * loads
            for k in (0, 1):
                apart = np.subtract.outer(points[some, k], points[:, k])
                total[some, k] = (weights * apart).sum(axis=1)
        off = (len(self) + 16) * ROUNDOFF + 4.0 * self.entry_error
        errors = self.falloff(np.abs(loads) * off, 2) * self.scale
        return Ball.around(-self.scale * total, errors[:, None])

    def separations(self) -> Array:
        """(n,) [length] lower bounds on the distances of asperities to their nearest neighbours."""
        if len(self) < 2:
            return np.full(len(self), np.inf)
        return np.maximum(self._nearest - 3.0 * self.point_error, 0.0)

    @property
    def _nearest(self) -> Array:
        """(n,) [length] distances of points to their nearest neighbours, perhaps rounded down."""
        return neighbours.nearest_distances(self.points)

    def crowding(self, radii: Array) -> float:
        """The largest (a_i + a_j) / r_ij; the `radii` a (n,) are contact radii, 0 where open."""
        return neighbours.crowding(self.points, radii)

    @property
    def shells(self) -> Array:
        """(n,) 1 / (pi E* s_i), where s_i is half the distance to the nearest neighbour.

        It is 0 for a single asperity, and infinite for points that may coincide. Spheres of radii
        s_i about the asperities (shells) do not overlap, so A + diag(1 / (pi E* s_i)) is positive
        semidefinite: docs/theory/convexity.md, "Why (2) is not convex as it stands".
        """
        with np.errstate(divide="ignore"):
            return evenly(lambda apart: 2.0 * self.scale / apart, self.separations())

    def fitted_shells(self, radii: Array, share: float) -> Array:
        """(n,) 1 / (pi E* s_i) for shells adapted to contact radii a_i = `radii`.

        s_i = share a_i / c + (1 - share) d_i / 2, where c is the largest (a_i + a_j) / r_ij, and
        d_i the distance to the nearest neighbour: docs/theory/certificate.md, "Choice of the box".
        """
        crowding = self.crowding(radii) * (1.0 + SAFETY + 2.0 * self.entry_error)
        s = (1.0 - share) * self.separations() / 2.0
        if 0 < crowding < np.inf:
            s = s + share * (radii / crowding)
        with np.errstate(divide="ignore"):
            return np.asarray(self.scale / s)

    def semidefinite_with(self, radius: float) -> bool:
        """True if A + (scale / radius) I is proved positive semidefinite: only on a lattice."""
        return False

    def smoother(self, root: Array) -> Smoother | None:
        """A symmetric, positive definite estimate of (I + W A W)^-1, W = diag(root), or None."""
        return None


@dataclass(frozen=True, eq=False)
class DirectCoupling(Coupling):
    """The map from loads at `points` (n, 2) to displacements at `targets` (m, 2), pair by pair."""

    points: Array
    targets: Array
    scale: float
    point_error: float

    def apply(self, loads: Array) -> Array:
        return self.scale * self._sums(loads, 1)

    def rounding(self, loads: Array) -> Rounding:
        terms = len(self.points) + 1
        return Rounding(1.01 * (terms * ROUNDOFF + self._entry_error), 0.0)

    def falloff(self, strengths: Array, power: int) -> Array:
        loss = (len(self.points) + 3) * ROUNDOFF + power * self._entry_error
        return self._sums(strengths, power) * (1.0 + 1.01 * loss)

    def _sums(self, values: Array, power: int) -> Array:
        sums = np.zeros(len(self.targets))

        def add_up(rows: slice, columns: slice, inverse: Array) -> None:
            sums[rows] += (inverse if power == 1 else inverse**power) @ values[columns]

        self._in_blocks(add_up)
        return sums

    @cached_property
    def _whole(self) -> Array:
        return inverse_distances(self.targets, self.points)

    def _in_blocks(self, work: Callable[[slice, slice, Array], object]) -> None:
        """Call work(rows, columns, inverse) for blocks of the matrix 1 / r, those of different rows
        perhaps in several threads; a small matrix is one block."""
        if (pairs := len(self.points) * len(self.targets)) <= KEPT:
            work(slice(None), slice(None), self._whole)
            return

        workers = threads.worthwhile(pairs)
        size = IN_THREADS if workers > 1 else ENTRIES

        def compute(rows: slice) -> None:
            for columns in threads.chunks(len(self.points), size):
                work(rows, columns, inverse_distances(self.targets[rows], self.points[columns]))

        blocks = threads.chunks(len(self.targets), max(1, size // len(self.points)))
        threads.each(compute, blocks, workers)

    @cached_property
    def _entry_error(self) -> float:
        if self.point_error == 0:
            return entry_error(0.0, np.inf)
        found = [0.0]
        self._in_blocks(lambda *block: found.append(float(block[-1].max(initial=0.0))))
        closest = max(found)
        return entry_error(self.point_error, 1.0 / closest if closest > 0 else np.inf)


@dataclass(frozen=True, eq=False)
class JointCoupling(Coupling):
    """The map from loads on the last points of an operator to displacements of the first points."""

    joint: Influence  # among all points
    targets: int  # number of first points; displacements are computed at these points

    def apply(self, loads: Array) -> Array:
        return self.joint.apply(self._all(loads))[: self.targets]

    def rounding(self, loads: Array) -> Rounding:
        return self.joint.rounding(self._all(loads))

    def falloff(self, strengths: Array, power: int) -> Array:
        return self.joint.falloff(self._all(strengths), power)[: self.targets]

    def _all(self, values: Array) -> Array:
        return np.concatenate((np.zeros(self.targets, dtype=values.dtype), values))


def known(points: Array, tails: Array | None, point_error: float) -> tuple[Pair, float]:
    """The points (n, 2) as double-double numbers, and a bound on the errors of their coordinates.

    The low parts are `tails`; if these are None, they are 0 and the bound is `point_error`.
    """
    if tails is None:
        return Pair.exact(points), point_error
    return Pair(points, tails), 2.0**-96 * float(np.abs(points).max(initial=0.0))


def dense_matrix(points: Array, scale: float) -> Array:
    """The matrix (n, n) of A_ij = scale / r_ij; raises InputError if it does not fit in memory."""
    checks.fits_in_memory("asperities that could touch", len(points), 5 * 8, power=2)
    matrix = np.empty((len(points), len(points)))
    for some in _rows(*matrix.shape):
        np.multiply(inverse_distances(points[some], points), scale, out=matrix[some])
    return matrix


def entry_error(point_error: float, nearest: float) -> float:
    """Bound on the relative error of a computed scale / r, for distances r >= `nearest`."""
    x = 2.0 * np.sqrt(2.0) * point_error / nearest if point_error > 0 else 0.0
    moved = x / (1.0 - x) if x < 1 else np.inf
    return 1.01 * (ENTRY_ROUNDOFFS * ROUNDOFF + moved)


def _rows(count: int, columns: int) -> Iterator[slice]:
    """Slices of the rows of a matrix, of about `ENTRIES` entries each."""
    return threads.chunks(count, max(1, ENTRIES // max(1, columns)))


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
