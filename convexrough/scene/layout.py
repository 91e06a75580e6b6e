"""Positions of asperities, on regular patterns or anywhere, and data that depend only on them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices, frozen
from convexrough.cached import Cached
from convexrough.scene.lattice import Lattice, Sites
from convexrough.scene.neighbours import nearest_distances, refuse_coincident

#: For more asperities than this, a lattice is looked for before nearest neighbours are computed.
MANY = 5000

#: The rim of a layout consists of the farthest point in each of this number of sectors.
SECTORS = 16

#: Bound on the distance of points that were made on a lattice from their exact sites, divided by
#: the largest coordinate.
MADE_SITE_ERROR = 16 * 2.0**-53


#: The second vector b2 of the lattice in which each site has six nearest neighbours, and of that in
#: which each has four. The first vector b1 is (1, 0), and the spacing is 1.
HEXAGONAL, SQUARE = (0.5, float(np.sqrt(0.75))), (0.0, 1.0)


def sites_within(
    second: tuple[float, float], limit: float
) -> tuple[NDArray[np.int32], Indices, float]:
    """(n, 2) the sites (i, j) with |i b1 + j b2|^2 up to `limit`; (n,) indices that sort them; and
    a bound below which no other site has this square.

    The sites are ordered by distance and then by angle; the indices sort them by i and then by j.
    """
    skew = round(2.0 * second[0])  # |i b1 + j b2|^2 = i^2 + skew i j + j^2
    # All sites but the origin are rotations of those with i > 0 and j >= 0.
    steps, rotations = np.arange(int(np.sqrt(limit)) + 2), 4 + skew * 2
    i, j = steps[1:, None], steps
    norms = i * i + skew * i * j + j * j
    taken = norms <= limit
    others = float(norms[~taken].min())
    i, j = np.nonzero(taken)
    i, norms = i + 1, norms[taken]
    turns = np.arctan2(second[1] * j, i + second[0] * j) / 2.0
    order = np.argsort(norms + turns)  # turns are below 1, the least difference of two norms
    i, j, norms = i[order], j[order], norms[order]
    _, first, count = np.unique(norms, return_index=True, return_counts=True)
    place = 1 + np.arange(len(i)) + np.repeat((rotations - 1) * first, count)
    sites = np.zeros((1 + rotations * len(i), 2), dtype=np.int32)
    for _ in range(rotations):
        sites[place] = np.stack((i, j), axis=1)
        place += np.repeat(count, count)
        i, j = -j, i + skew * j
    most = int(np.abs(sites).max())
    places = np.full((2 * most + 1, 2 * most + 1), -1)
    places[tuple((sites + most).T)] = np.arange(len(sites))
    return sites, places[places >= 0], others


@dataclass(frozen=True, eq=False)
class Layout(Cached):
    """Distinct points (n, 2) [length] in the plane, with data that depend only on them."""

    points: Array
    #: The lattice on which the points were made, and (n, 2) their sites; None for other points.
    made: tuple[Lattice, Sites] | None = None
    #: [length] all sites of `made` that are nearer to the axis than this are points, up to rounding
    filled: float = 0.0
    exact: bool = False  # True if all points of `made` are at their sites, without rounding

    def __post_init__(self) -> None:
        if self.made is None and (len(self.points) <= MANY or self.lattice is None):
            refuse_coincident(self.points, self.nearest)

    @classmethod
    def of(cls, second: tuple[float, float], spacing: float, limit: float) -> Layout:
        """The layout of `sites_within` this limit, for a spacing [length].

        Of more than `MANY` points, all are exactly on their sites: the vectors of the lattice are
        rounded to so few bits that the coordinates of sites are float64 numbers.
        """
        sites, order, others = sites_within(second, limit)
        i, j = sites.T
        basis = spacing * np.array([[1.0, 0.0], second])
        if exact := len(sites) > MANY:
            # Coordinates become whole numbers of units below 2^53.
            unit = 2.0 ** (np.ceil(np.log2(2.0 * np.abs(sites).max() * spacing)) - 53)
            basis = np.rint(basis / unit) * unit
            points = frozen(sites @ basis)
        else:
            points = frozen(spacing * np.stack((i + second[0] * j, second[1] * j), axis=1))
        if len(points) < 3:
            return cls(points)
        site_error = MADE_SITE_ERROR * float(np.abs(points).max())
        lattice = Lattice(np.zeros(2), basis, site_error)
        layout = cls(points, (lattice, frozen(sites)), spacing * np.sqrt(others), exact)
        layout.__dict__["order"] = frozen(order)
        return layout

    def __getstate__(self) -> dict[str, Any]:
        """The fields only: what follows from them is computed again."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def nearest(self) -> Array:
        """(n,) [length] distance of each point to its nearest neighbour; infinite for one point."""
        return frozen(nearest_distances(self.points))

    @cached_property
    def lattice(self) -> Lattice | None:
        """The lattice on which all points lie, each on a different site; None if there is none."""
        return Lattice.through(self.points) if self.made is None else self.made[0]

    @cached_property
    def sites(self) -> Sites | None:
        """(n, 2) the site (i, j) of each point on the lattice; None if there is no lattice."""
        if self.made is not None:
            return self.made[1]
        return None if self.lattice is None else self.lattice.sites(self.points)

    @cached_property
    def order(self) -> Indices | None:
        """(n,) indices that sort points by their sites (i, j), i first; None without a lattice."""
        if self.sites is None:
            return None
        i, j = (self.sites - self.sites.min(axis=0)).T
        return np.argsort(i * (int(j.max()) + np.int64(1)) + j)

    def sorted(self, wanted: NDArray[np.bool_]) -> Indices:
        """The indices where `wanted` (n,) is True; for many points on a lattice, in `order`."""
        if len(self.points) <= MANY or self.order is None:
            return wanted.nonzero()[0]
        return self.order[wanted[self.order]]

    @cached_property
    def corners(self) -> tuple[Array, Array]:
        """(2,) [length] the least and the largest coordinates."""
        return self.points.min(axis=0), self.points.max(axis=0)

    @cached_property
    def rim(self) -> Indices:
        """Indices of the points at the rim: the farthest in each sector about the middle."""
        low, high = self.corners
        x, y = (self.points - (low + high) / 2).T
        sectors = np.rint(np.arctan2(y, x) * (SECTORS / (2.0 * np.pi))).astype(np.intp) % SECTORS
        outwards, farthest = np.argsort(x * x + y * y), np.full(SECTORS, -1)
        farthest[sectors[outwards]] = outwards  # in each sector the last one, the farthest, remains
        return farthest[farthest >= 0]

    @property
    def distances(self) -> Array:
        """(n,) [length] distance of each point from the axis."""
        x, y = self.points.T
        return frozen(np.hypot(x, y))
