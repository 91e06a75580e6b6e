"""The lattice on which given points lie, found from their coordinates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, frozen
from convexrough.cached import Cached
from convexrough.checks import SMALLEST

Sites = NDArray[Any]  # whole numbers

#: Largest accepted distance of points from the sites of a lattice, divided by the largest
#: coordinate. This is a little more than the rounding errors of coordinates.
SITE_ERROR = 32 * 2.0**-53

#: Largest accepted distance of points from the sites, divided by the spacing of the lattice.
CLOSEST = 1e-10

#: Lattices with a spacing below this part of the largest coordinate are not used.
FINEST = 1e-12

#: Lattices with more sites per point than this are not used. A heuristic, for speed.
SPARSEST = 50


@dataclass(frozen=True, eq=False)
class Lattice(Cached):
    """The sites origin + i b1 + j b2 with whole numbers i and j."""

    origin: Array  # (2,) [length]
    basis: Array  # (2, 2) [length] rows b1 and b2, a reduced basis (of shortest vectors)
    site_error: float  # [length] bound on the distance of points from sites along x and along y
    #: If `shrunk` made this lattice, its factors along x and y, and the basis before shrinking.
    shrink: tuple[Fraction, Fraction] = (Fraction(1), Fraction(1))
    unshrunk: Array | None = None

    def __post_init__(self) -> None:
        frozen(self.origin)
        frozen(self.basis)

    def shrunk(self, along_x: Fraction, along_y: Fraction) -> Lattice | None:
        """The lattice of points whose coordinates are multiplied by these factors, at most 1; None
        if the new basis is not reduced, or if points are too far from the new sites."""
        assert self.unshrunk is None
        times = np.array([float(along_x), float(along_y)])
        basis = times * self.basis
        a, b = basis
        if 2.0 * abs(a @ b) > min(a @ a, b @ b) * (1.0 + 1e-9):
            return None
        site_error = 2.0 * float(times.max()) * self.site_error  # twice, for rounding errors
        made = Lattice(times * self.origin, basis, site_error, (along_x, along_y), self.basis)
        return made if site_error <= 4.0 * CLOSEST * made.spacing else None

    @property
    def exactly(self) -> list[list[Fraction]]:
        """The rows b1 and b2 of the basis without rounding, as fractions."""
        given = self.basis if self.unshrunk is None else self.unshrunk
        return [[t * Fraction(x) for t, x in zip(self.shrink, row, strict=True)] for row in given]

    @cached_property
    def spacing(self) -> float:
        """[length] the shortest distance between two sites."""
        a, b = self.basis
        return min(math.hypot(*vector) for vector in (a, b, a + b, a - b))

    @classmethod
    def through(cls, points: Array) -> Lattice | None:
        """The lattice on which these points (n, 2) lie, up to rounding, each on its own site; None
        if there is none, or only one with far more sites, or with too small a spacing for float64.
        """
        anchor = points[np.argmin(((points - points.mean(axis=0)) ** 2).sum(axis=1))]
        basis, reach = _shortest(points - anchor), float(np.abs(points).max())
        if basis is None or np.hypot(*basis[0]) < max(SMALLEST, FINEST * reach):
            return None
        sites = _nearest_sites(points - anchor, basis)
        # Fit origin and basis to all points. With sites relative to the middle, the two fits
        # decouple.
        middle = np.rint(sites.mean(axis=0))
        away = np.column_stack((np.ones(len(points)), sites - middle))
        fitted = np.zeros((3, 2))
        try:
            for _ in range(2):  # the second time reduces rounding errors
                missing = points - anchor - away @ fitted
                fitted += np.linalg.solve(away.T @ away, away.T @ missing)
        except np.linalg.LinAlgError:
            return None
        off = float(np.abs(points - anchor - away @ fitted).max()) + 12 * 2.0**-53 * reach
        origin = anchor + fitted[0] - middle @ fitted[1:]
        found = cls(origin, fitted[1:], off + 4 * 2.0**-53 * reach)
        if not off <= min(SITE_ERROR * reach, CLOSEST * found.spacing) or _crowded(sites):
            return None
        return found

    def sites(self, points: Array) -> Sites | None:
        """(n, 2) the sites (i, j) of the points; None if one of them is not on the lattice."""
        sites = _nearest_sites(points - self.origin, self.basis)
        off = np.abs(points - self.origin - sites @ self.basis).max(initial=0.0)
        reach = np.abs(points).max(initial=0.0)
        return sites if off + 4 * 2.0**-53 * reach <= self.site_error else None


def _nearest_sites(points: Array, basis: Array) -> Sites:
    return np.rint(points @ np.linalg.inv(basis)).astype(np.int64)


def _shortest(points: Array) -> Array | None:
    """The reduced basis (2, 2), from points near the origin; None if they lie on one line."""
    squares = (points**2).sum(axis=1)
    few = min(len(points), 64)
    nearby = points[np.argpartition(squares, few - 1)[:few]]
    unit = 2.0 ** np.floor(np.log2(max(float(np.abs(nearby).max()), 1e-300)))  # no overflow
    points = (nearby[:, None] - nearby).reshape(-1, 2) / unit
    squares = (points**2).sum(axis=1)
    near = np.argsort(squares)
    near = near[squares[near] > 0]
    if len(near) < 2:
        return None
    a = points[near[0]]
    across = np.abs(points[near] @ np.array([-a[1], a[0]]))
    oblique = np.flatnonzero(across > 1e-3 * np.sqrt(squares[near] * squares[near[0]]))
    if len(oblique) == 0:
        return None
    b = points[near[oblique[0]]]
    while True:
        b = b - np.rint((a @ b) / (a @ a)) * a
        if b @ b >= (a @ a) * (1 - 1e-9):
            return np.asarray(np.array([a, b]) * unit)
        a, b = b, a


def _crowded(sites: Sites) -> bool:
    """True if two points are on one site, or if there are far more sites than points."""
    low = sites.min(axis=0)
    rows, columns = (sites.max(axis=0) - low + 1).tolist()
    if rows * columns > SPARSEST * len(sites) + 1000:
        return True
    taken = np.zeros(rows * columns, dtype=bool)
    taken[(sites[:, 0] - low[0]) * columns + sites[:, 1] - low[1]] = True
    return int(taken.sum()) < len(sites)
