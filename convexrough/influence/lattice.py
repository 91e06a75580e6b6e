"""The coupling among points of a lattice: a convolution, by fast Fourier transforms.

Free space: the smallest box of sites that holds the asperities is padded with zeros to twice its
size, so that no asperity feels a periodic image of another. Heights and radii of the asperities
play no part in it. The rounding of the transforms is bounded in
docs/theory/operators-lattice.md, "On a lattice: Fourier transforms".
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices, even
from convexrough.influence.convolution import Box, Kernel, neighbours
from convexrough.influence.coupling import Coupling, Kind, Rounding, Smoother, Sums, cubed
from convexrough.influence.dense import DenseCoupling, dense_matrix, entry_error
from convexrough.influence.lattice_smoother import block_smoother
from convexrough.influence.lattice_symbol import least_symbol
from convexrough.influence.off_sites import first_order, off_sites
from convexrough.influence.packing import largest, lattice_packing, point_packing
from convexrough.influence.sliced import Distances, sliced_sums
from convexrough.influence.slopes import Spectra, odd_spectra
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.lattice import Lattice, Sites
from convexrough.scene.neighbours import crowding, separations

#: Roundoffs of one computed 1 / |i b1 + j b2| on a reduced basis, times a scale.
ENTRY_ROUNDOFFS = 24

#: Numbers looked at together: what a cache holds.
CHUNK = 2**14

#: A box that holds fewer asperities than this part of its sites is looked through by a k-d tree:
#: a heuristic, which decides speed and how sharp shells are.
FILLED = 0.2

#: The symbol of any lattice goes as low as that of a row, -2 log 2. Decides speed only.
LEAST_NEGATIVE = 1.386


@dataclass(frozen=True, eq=False)
class LatticeCoupling:
    """From loads on some sites of a box to displacements on others.

    sources : (n,) places in the box, row by row;  targets : (m,)
    spacing : [length] the shortest distance of two sites
    blur    : [spacing] bound on how far the difference of two points is from that of their sites
    """

    box: Box
    sources: Indices
    targets: Indices
    scale: float
    spacing: float
    blur: float

    def apply(self, loads: Array) -> Array:
        dtype = np.float32 if loads.dtype == np.float32 else np.float64
        product = self._convolve(loads.astype(dtype, copy=False), self._spectrum(dtype))
        product *= dtype(self._unit)
        return product

    def rounding(self, loads: Array) -> Rounding:
        # Points off their sites change 1/r by blur / r^2 at most; the sum of that over a row
        # bounds the effect on the 2-norm and on the largest.
        kernel, off = self._kernel, self._displaced
        size, largest = float(np.linalg.norm(loads)), float(np.abs(loads).max(initial=0.0))
        norm = self.box.bound(kernel, ROUNDOFF) * size + off * size
        each = self.box.bound_each(kernel, ROUNDOFF) * size + off * largest
        relative = 1.01 * ENTRY_ROUNDOFFS * ROUNDOFF
        most = 1.01 * kernel.norm / self._least * size  # by Cauchy's inequality
        return Rounding(relative, self._unit * norm, self._unit * each, self._unit * most)

    def falloff(self, strengths: Array, power: int) -> Array:
        """In single precision, with a bound on its rounding added."""
        kernel = self.box.kernel(power, np.float32)
        largest = float(strengths.max(initial=0.0)) or 1.0
        shares = (strengths / largest).astype(np.float32)
        total = self._convolve(shares, kernel.spectrum).astype(np.float64)
        total += self.box.bound_each(kernel, 2.0**-24) * float(np.linalg.norm(shares))
        stretched = (1.0 + 1e-6) / (self._least * self.spacing) ** power
        return np.maximum(total, 0.0) * (largest * stretched)

    def clearances(self) -> Array:
        """Of points that are none of the asperities: any two sites are the spacing apart."""
        return np.full(len(self.targets), self.spacing * self._least * (1.0 - 8 * ROUNDOFF))

    @property
    def _unit(self) -> float:
        """A_ij of nearest neighbours."""
        return self.scale / self.spacing

    @property
    def _least(self) -> float:
        """[spacing] the least that the shortest distance of two points can be."""
        return 1.0 - min(self.blur, 0.5)

    @property
    def _displaced(self) -> float:
        """[1 / spacing] norm of what points off their sites change 1/r by, by its row sums."""
        return self.blur / self._least * self._kernel.norm**2

    @cached_property
    def _kernel(self) -> Kernel:
        return self.box.kernel(1, np.float64)

    @cached_property
    def _single(self) -> NDArray[Any]:
        return self._kernel.spectrum.astype(np.float32)

    def _spectrum(self, dtype: Any) -> NDArray[Any]:
        return self._single if dtype == np.float32 else self._kernel.spectrum

    def _convolve(self, values: NDArray[Any], spectrum: NDArray[Any]) -> NDArray[Any]:
        field = np.zeros((self.box.shape[0], self.box.padded[1]), dtype=values.dtype)
        sources, targets = self._padded
        field.ravel()[sources] = values
        return self.box.convolve(field, spectrum).ravel()[targets]

    @cached_property
    def _padded(self) -> tuple[Indices, Indices]:
        """`sources` and `targets` where each row of the box is as long as the transforms."""
        (_, columns), (_, width) = self.box.shape, self.box.padded
        sources = self.sources + self.sources // columns * (width - columns)
        if self.targets is self.sources:
            return sources, sources
        return sources, self.targets + self.targets // columns * (width - columns)


@dataclass(frozen=True, eq=False)
class LatticeInfluence(LatticeCoupling):
    """The coupling among asperities on a lattice.

    array  : (N, 2) [length] points;  members : (n,) of which these asperities are some
    places : (n, 2) i and j of each
    """

    array: Array
    members: Indices
    lattice: Lattice
    places: Sites
    point_error: float

    name: ClassVar[Kind] = "lattice"
    at_hand: ClassVar[bool] = False
    prefers_single: ClassVar[bool] = True
    sharp: ClassVar[bool] = True

    @classmethod
    def assemble(
        cls, points: Array, lattice: Lattice, scale: float, point_error: float = 0.0
    ) -> LatticeInfluence:
        """Raises ValueError where the points are not on the lattice."""
        places = lattice.sites(points)
        if places is None:
            raise ValueError("points off the lattice")
        return cls.of(points, np.arange(len(points)), lattice, places, scale, point_error)

    @classmethod
    def of(
        cls,
        array: Array,
        members: Indices,
        lattice: Lattice,
        places: Sites,
        scale: float,
        point_error: float,
    ) -> LatticeInfluence:
        """Where the places are known."""
        box, index = _boxed(lattice, places)
        off = 2.0 * float(np.sqrt(2.0)) * (lattice.blur + point_error)
        spacing = lattice.spacing
        both = scale, spacing, off / spacing
        return cls(box, index, index, *both, array, members, lattice, places, point_error)

    def __len__(self) -> int:
        return len(self.members)

    @property
    def points(self) -> Array:
        """(n, 2) [length]"""
        return self.array[self.members]

    @property
    def matrix(self) -> Array:
        return dense_matrix(self.points, self.scale)

    def submatrix(self, which: Indices) -> Array:
        return dense_matrix(self.array[self.members[which]], self.scale)

    @property
    def entry_error(self) -> float:
        return entry_error(self.point_error, self.spacing * self._least)

    def among(self, which: Indices) -> LatticeInfluence:
        members, places = self.members[which], self.places[which]
        return self.of(self.array, members, self.lattice, places, self.scale, self.point_error)

    def onto(self, points: Array) -> Coupling:
        places = self.lattice.sites(points)
        if places is None:
            return DenseCoupling(self.points, points, self.scale, self.point_error)
        box, index = _boxed(self.lattice, np.concatenate((self.places, places)))
        n = len(self)
        return LatticeCoupling(box, index[:n], index[n:], self.scale, self.spacing, self.blur)

    @property
    def _filled(self) -> bool:
        """Whether a neighbouring site is mostly taken."""
        return len(self) > FILLED * self.box.shape[0] * self.box.shape[1]

    def slopes(self, loads: Array) -> Array:
        each = [self._convolve(loads, spectrum) for spectrum in self._odd]
        return -self.scale / self.spacing**2 * np.stack(each, axis=1)

    @cached_property
    def _odd(self) -> Spectra:
        return odd_spectra(self.box, cubed)

    def separations(self) -> Array:
        if not self._filled:
            return separations(self.points, self.point_error)
        nearest = self.spacing * self._least * (1.0 - 8 * ROUNDOFF) if len(self) > 1 else np.inf
        return even(nearest, len(self))

    def crowding(self, radii: Array) -> float:
        """Pairs in the order of their distance, until none further apart can be more crowded."""
        if not self._filled:
            return crowding(self.points, radii)
        field = np.full(self.box.shape, -np.inf)
        field.ravel()[self.sources] = radii
        most, worst = 2.0 * float(radii.max()), 0.0
        for distance, i, j in self._pairs():
            if most <= worst * distance:
                break
            worst = max(worst, largest(_sum, field, i, j) / distance)
        return worst

    def packing(self, radii: Array) -> float:
        if not self._filled:
            return point_packing(self.points, radii, 3.0 * self.point_error)
        field = np.zeros(self.box.shape)
        field.ravel()[self.sources] = radii
        return lattice_packing(field, self._pairs())

    def clearances(self) -> Array:
        return self.separations()

    def _pairs(self) -> Iterator[tuple[float, int, int]]:
        """`neighbours`, and no more than the distance of points that far apart."""
        for on_sites, i, j in neighbours(self.box):
            yield self.spacing * (on_sites - self.blur) * (1.0 - 8 * ROUNDOFF), i, j

    def semidefinite_with(self, radius: float) -> bool:
        """By the least of the lattice's symbol, and by how far points are off their sites."""
        if radius * LEAST_NEGATIVE > self.spacing:
            return False
        least = self.lattice.keep(_least_symbol) - self._displaced
        return -least * radius * (1.0 + SAFETY) <= self.spacing

    def sums(self, loads: Array) -> Sums | None:
        """sum_j P_j / r_ij to many more digits than `apply`, with the points where they are."""
        unit = 2.0 ** np.floor(np.log2(self.spacing))
        field = np.zeros(self.box.shape)
        field.ravel()[self.sources] = loads
        distances = Distances.of(self.lattice.basis, unit, max(self.box.shape))
        found = sliced_sums(self.box, distances, unit, field)
        if found is None:
            return None
        off, error = self._off_sites(loads, found.error * found.unit)
        at = self.sources
        rest = found.rest.ravel()[at] + off / found.unit
        more = error / found.unit + 2 * ROUNDOFF * float(np.abs(rest).max(initial=0.0))
        bounds = found.error + more, found.norm + more * math.sqrt(len(self))
        return Sums(found.whole.ravel()[at], rest, found.unit, *bounds)

    def _off_sites(self, loads: Array, little: float) -> tuple[Array, float]:
        """What points off their sites change in sum_j P_j / r_ij, and a bound on each one's error.

        little : [force / length] an error that does not matter
        """
        x, y, rounded = self._away
        furthest = float(np.hypot(x, y).max(initial=0.0)) * (1 + 1e-9)
        top, spacing = float(np.abs(loads).max(initial=0.0)), self.spacing * self._least
        # By |P| at most, |r| times 1 / r^2 and for the second order 1 / r^3, as in `rounding`.
        each = top / spacing**2 * self._kernel.norm**2
        unknown = 2.0 * (rounded + math.sqrt(2.0) * self.point_error) * each
        if 2.0 * furthest * each <= little:
            return np.zeros(len(self)), 1.01 * (unknown + 2.0 * furthest * each)
        units = top / self.spacing**2 * furthest
        change, error = first_order(
            self.box, self.sources, loads / top, (x / furthest, y / furthest)
        )
        second = (2.0 * furthest) ** 2 / spacing * each
        return change * units, 1.01 * (unknown + error * units + 1.01 * second)

    @cached_property
    def _away(self) -> tuple[Array, Array, float]:
        return off_sites(self.lattice, self.array, self.members, self.places)

    def smoother(self, root: Array) -> Smoother:
        box = self.box
        return block_smoother(box.shape, box.basis, self.sources, self._unit, root, box.workers)


def _sum(radii: Array, others: Array) -> float:
    return float((radii + others).max(initial=0.0))


def _least_symbol(lattice: Lattice) -> float:
    return least_symbol(lattice.basis / lattice.spacing)


def _boxed(lattice: Lattice, places: Sites) -> tuple[Box, Indices]:
    """The smallest box, and where in it each place is."""
    basis = lattice.basis / lattice.spacing
    if len(places) == 0:
        return Box((1, 1), basis), np.zeros(0, dtype=np.intp)
    low, high = places.min(axis=0), places.max(axis=0)
    rows, columns = (high - low + 1).tolist()
    index = (places[:, 0] - low[0]) * np.intp(columns) + (places[:, 1] - low[1])
    return Box((rows, columns), basis, _extent(places, (low + high) / 2.0, basis)), index


def _extent(places: Sites, middle: Array, basis: Array) -> float:
    """No two places are further apart: twice the largest distance from the middle, and a little."""
    (g11, g12), (_, g22) = basis @ basis.T
    largest = 0.0
    for start in range(0, len(places), CHUNK):
        i, j = (places[start : start + CHUNK] - middle).T
        largest = max(largest, float((i * (g11 * i + 2.0 * g12 * j) + g22 * (j * j)).max()))
    return 2.0 * float(np.sqrt(largest)) * (1.0 + 1e-9)
