"""The compliance operator of points on a lattice: a convolution, computed by Fourier transforms.

The smallest box of sites that holds the asperities is padded with enough zeros that periodic images
do not contribute, to about twice its size in each direction, or less. "Sharp" products have more
digits. docs/theory/operators-lattice.md explains the method and its rounding errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any, ClassVar, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import CHUNK, PAIR_ROUNDOFF, Pair, in_parts, two_product, two_sum
from convexrough.arrays import Array, Indices, even
from convexrough.influence import coupling
from convexrough.influence.convolution import Kernel, SiteBox, through_waves
from convexrough.influence.lattice_symbol import least_symbol
from convexrough.influence.sliced import LARGE, MANY, PULLED, SLICES, Distances, Pulls, Sliced
from convexrough.influence.smoother import Blocks
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.lattice import Lattice
from convexrough.scene.layout import Layout

Made = TypeVar("Made")

#: Bound on the relative error, in roundoffs, of a computed scale / |i b1 + j b2|, where b1, b2 is a
#: reduced basis of the lattice.
ENTRY_ROUNDOFFS = 24

#: Fraction of occupied sites of a box up to which a k-d tree finds neighbours. A heuristic: it
#: affects speed, and the lower bounds on nearest distances, from which shells are computed
#: (docs/theory/convexity.md).
FILLED = 0.2

#: For more asperities than this, rarely needed transforms of kernels, and operators among parts of
#: the asperities, are not cached.
MOST_KEPT = 2**21

#: Displacements at up to this number of other points are computed pair by pair. Affects speed only.
FEW = 32

#: 2 log 2, rounded down. The least value of the symbol (`lattice_symbol`), times scale / spacing,
#: bounds the eigenvalues of A from below. It is -2 log 2 for a row of points, and at most this
#: number for every lattice. The constant affects speed only.
LEAST_NEGATIVE = 1.386


@dataclass(frozen=True, eq=False)
class LatticeInfluence(coupling.Influence):
    """The compliance operator of asperities on a lattice; see `coupling.Influence`.

    The points in `array` are the exact positions of the summits, multiplied by the factors
    `lattice.shrink` along x and y, and rounded. The factors are 1 in the geometry "summit", and
    R / (R + tip radius) in "closest", with the radius R of the sphere.
    """

    array: Array  # (N, 2) [length] contact points
    members: Indices  # (n,) indices of the operator's asperities in `array`
    layout: Layout  # the exact positions of the summits
    lattice: Lattice  # that of the points in `array`
    scale: float
    point_error: float = 0.0

    name: ClassVar[coupling.Kind] = "lattice"
    cheap_sums: ClassVar[bool] = True

    @cached_property
    def _boxed(self) -> tuple[SiteBox, Indices]:
        """The smallest box of sites that holds the asperities, and (n,) their flat indices."""
        basis, (i, j) = self.lattice.basis / self.lattice.spacing, self.places
        if len(i) == 0:
            return SiteBox((1, 1), basis), np.zeros(0, dtype=np.intp)
        i, j = i - i.min(), j - j.min()
        shape = int(i.max()) + 1, int(j.max()) + 1
        box = SiteBox(shape, basis, 2.0 * _farthest(i, j, shape, basis))
        return box, i * np.intp(box.stride) + j

    def _boxed_for(self, loads: Array) -> tuple[SiteBox, Indices]:
        """The box and the indices of `_boxed`, but with transforms that suffice for these loads.

        The extent of this box need only bound the distances of all asperities from the loaded ones.
        """
        box, loaded, (i, j) = self.box, loads.nonzero()[0], self.cells
        reach = _farthest(i[loaded], j[loaded], box.shape, box.basis)
        last: tuple[float, SiteBox, Indices] = self._kept.get("boxed", (-1.0, box, i))
        if last[0] < reach:
            self._kept.clear()  # transforms of kernels on the last box
            box = replace(box, extent=box.extent / 2.0 + reach)
            last = self._keep("boxed", (reach, box, i * np.intp(box.stride) + j))
        return last[1:]

    @property
    def box(self) -> SiteBox:
        return self._boxed[0]

    @property
    def cells(self) -> tuple[Indices, Indices]:
        """(n,) row and (n,) column of each asperity in the box."""
        rows, columns = np.divmod(self._boxed[1], self.box.stride)
        return rows, columns

    @property
    def site_error(self) -> float:
        """[spacing] bound on |(x_i - x_j) - (s_i - s_j)|, where s_i is the site of point x_i."""
        return 2.0 * math.sqrt(2.0) * self.lattice.site_error / self.lattice.spacing

    def apply(self, loads: Array) -> Array:
        single = loads.dtype == np.float32
        loads = loads if single else loads.astype(np.float64, copy=False)
        box, places = self._boxed
        spectrum = self._single if single else self._kernel.spectrum
        product = box.convolve_at(places, loads, spectrum)
        product *= loads.dtype.type(self._unit)
        return product

    def rounding(self, loads: Array) -> coupling.Rounding:
        # Deviations of points from their sites change 1/r by at most site_error / r^2. The largest
        # sum of site_error / r^2 in a row bounds the change of a component.
        each = self.box.bound(self._kernel.norm) * float(np.linalg.norm(loads))
        each += self._displaced * float(np.abs(loads).max(initial=0.0))
        return coupling.Rounding(1.01 * ENTRY_ROUNDOFFS * ROUNDOFF, self._unit * each)

    def falloff(self, strengths: Array, power: int) -> Array:
        (box, places), largest = self._boxed, float(strengths.max(initial=0.0)) or 1.0
        if largest == np.inf:
            return np.full(len(strengths), np.inf)
        kernel = box.kernel(power, np.float32)
        shares = (strengths / largest).astype(np.float32)
        total = box.convolve_at(places, shares, kernel.spectrum).astype(np.float64)
        total += box.bound(kernel.norm, 2.0**-24) * float(np.linalg.norm(shares))
        stretched = (1.0 + 1e-6) / (self._least * self.lattice.spacing) ** power
        return np.maximum(total, 0.0) * (largest * stretched)

    @property
    def row_norm(self) -> float:  # the kernel has all entries of a row, and more
        return self._unit / self._least * self._kernel.norm * (1 + SAFETY)

    @property
    def _unit(self) -> float:
        """The entry A_ij for two sites at the distance `spacing`."""
        return self.scale / self.lattice.spacing

    @property
    def _least(self) -> float:
        """[spacing] lower bound on the shortest distance between two points; nearly 1."""
        return 1.0 - self.site_error

    @property
    def _displaced(self) -> float:
        """[1 / spacing] bound on row sums of the changes of 1/r_ij by deviations from the sites."""
        return self.site_error / self._least * self._kernel.norm**2

    @cached_property
    def _kernel(self) -> Kernel:
        return self.box.kernel(1, np.float64)

    @cached_property
    def _single(self) -> NDArray[Any]:
        return self._kernel.spectrum.astype(np.float32)

    def __len__(self) -> int:
        return len(self.members)

    @property
    def points(self) -> Array:  # type: ignore[override]
        return self.array.take(self.members, axis=0)  # several times faster than by an index

    def submatrix(self, which: Indices) -> Array:
        return coupling.dense_matrix(self.array[self.members[which]], self.scale)

    @cached_property
    def entry_error(self) -> float:
        return coupling.entry_error(self.point_error, self.lattice.spacing * self._least)

    @property
    def places(self) -> tuple[Indices, Indices]:
        """The sites (i, j) of the asperities: (n,) i and (n,) j."""
        assert self.layout.sites is not None
        i, j = self.layout.sites.T
        return i[self.members], j[self.members]

    def restricted(self, which: Indices) -> LatticeInfluence:
        members = self.members[which]
        part: LatticeInfluence | None = self._kept.get("part")
        if part is None or not np.array_equal(part.members, members):
            part = self._keep("part", replace(self, members=members))
        return part

    def onto(self, points: Array) -> coupling.Coupling:
        places = self.lattice.sites(points) if len(points) > FEW else None
        if places is None:
            return super().onto(points)
        together = np.concatenate((points, self.points))
        sites = np.concatenate((places, np.stack(self.places, axis=1)))
        layout = Layout(together, (self.lattice, sites))
        joint = replace(self, array=together, members=np.arange(len(together)), layout=layout)
        return coupling.JointCoupling(joint, len(points))

    def slopes(self, loads: Array) -> Ball:
        box, places = self._boxed_for(loads)
        slices = self._on(box, "sliced pulls", lambda: self._slice_pulls(box))
        pulls = [pull.sums(Pair.exact(loads), places) for pull in slices]
        moved: Array | float = 0.0
        if not self.layout.exact:
            # The vector d / |d|^3 changes by at most 2 / |d|^3 times a small change of d.
            _, _, most, unknown = self._deviations
            moved = 4.04 * (most + unknown) * self.lattice.spacing * self.falloff(np.abs(loads), 3)
        values = np.stack([pull.value for pull in pulls], axis=1)
        errors = np.stack([pull.error + moved for pull in pulls], axis=1)
        return Ball.around(-self.scale * values, self.scale * (errors + 8 * ROUNDOFF * abs(values)))

    def separations(self) -> Array:
        if len(self) <= FILLED * math.prod(self.box.shape):
            return super().separations()
        return even(self._at_least(1.0) if len(self) > 1 else np.inf, len(self))

    def crowding(self, radii: Array) -> float:
        """The largest (a_i + a_j) / r_ij, for contact radii a.

        Pairs are searched by the difference (p, q) of their sites: first all with max(|p|, |q|) =
        1, then all with 2, and so on, until no farther pair can exceed the largest ratio found. On
        a reduced basis these differences have lengths of at least 0.8, 1.6, ... times the spacing.
        """
        if len(self) <= FILLED * math.prod(self.box.shape):
            return super().crowding(radii)
        (rows, columns), stride, places = self.box.shape, self.box.stride, self._boxed[1]
        most, worst = 2.0 * float(radii.max()), 0.0
        for reach in range(1, max(rows, columns)):
            if most <= worst * self._at_least(0.8 * reach):
                break
            width = columns + reach  # the ends of rows are never mistaken for neighbours
            field = np.full(rows * width, -np.inf)
            field[places + places // stride * (width - stride)] = radii
            square = np.ndindex(reach + 1, 2 * reach + 1)
            for a, b in ((a, b - reach) for a, b in square if reach in (a, abs(b - reach))):
                distance = self._at_least(float(np.hypot(*((a, b) @ self.box.basis))))
                if a * width + b > 0 and worst * distance < most:
                    worst = max(worst, _largest_sum(field, a * width + b) / distance)
        return worst

    def _at_least(self, length: float) -> float:
        """[length] lower bound on the distance of points on sites this far apart [spacing]."""
        return self.lattice.spacing * (length - self.site_error) * (1.0 - 8 * ROUNDOFF)

    def semidefinite_with(self, radius: float) -> bool:
        # A lower bound on the symbol (the Fourier transform of the kernel) is also one on the
        # eigenvalues of A (docs/theory/operators-lattice.md, "The symbol").
        if radius * LEAST_NEGATIVE > self.lattice.spacing:
            return False
        least = self.lattice.cached(_least_symbol) - self._displaced
        return -least * radius * (1.0 + SAFETY) <= self.lattice.spacing

    @property
    def least_slices(self) -> int:
        """The number of slices that a press needs."""
        return SLICES + int(math.prod(self.box.shape) > LARGE)

    @property
    def slices(self) -> int:
        """The number of slices that friction needs."""
        return SLICES + sum(math.prod(self.box.shape) > many for many in MANY)

    def sums(self, loads: Pair, slices: int | None = None) -> Ball:
        """(n,) sums over j of P_j / r_ij, from slices (docs/theory/operators-lattice.md, "Slices").
        Their default number is that for friction.
        """
        slices = slices or self.slices
        box, places = self._boxed_for(np.asarray(loads.high))
        total = self._on(box, slices, lambda: self._slice(box, slices)).sums(loads, places)
        if self.layout.exact:
            return total
        return total + self._off_sites(np.asarray(loads.high), box, places)

    def _on(self, box: SiteBox, name: object, make: Callable[[], Made]) -> Made:
        """The object on this box that `make` returns; threads can use other boxes meanwhile."""
        of, made = self._kept.get(name, (None, None))
        return cast(Made, made) if of is box else self._keep(name, (box, make()))[1]

    def _keep(self, name: object, made: Made) -> Made:
        """The same object, kept in `_kept` unless there are many asperities."""
        if len(self) <= MOST_KEPT:
            self._kept[name] = made
        return made

    @cached_property
    def _kept(self) -> dict[object, Any]:
        """By name: the last box of `_boxed_for`, kernels with their box, the last `restricted`."""
        return {}

    def _slice(self, box: SiteBox, count: int) -> Sliced:
        unit, basis = self._in_unit
        norm = self._kernel.norm * unit / self.lattice.spacing
        return Sliced.of(box, Distances.of(basis, max(box.shape)), norm, unit, count)

    def _slice_pulls(self, box: SiteBox) -> list[Sliced]:
        """The kernels x / r^3 and y / r^3, in slices."""
        unit, basis = self._in_unit
        norm = self._kernel.norm * unit / self.lattice.spacing  # r >= 1, so 1 / r^2 <= 1 / r
        found, known = [], Distances.of(basis, max(box.shape))
        for one, two in zip(*basis, strict=True):
            along = Pair.nearest(one), Pair.nearest(two)
            pulls = Pulls(known.gram, 3.0 * known.error + 32 * PAIR_ROUNDOFF, along)
            found.append(Sliced.of(box, pulls, norm, unit**2, PULLED))
        return found

    @property
    def _in_unit(self) -> tuple[float, list[list[Fraction]]]:
        """A power of two up to the spacing, and the basis in this unit."""
        unit = float(2.0 ** np.floor(np.log2(self.lattice.spacing)))
        return unit, [[x / Fraction(unit) for x in vector] for vector in self.lattice.exactly]

    @property
    def _deviations(self) -> tuple[Array, Array, float, float]:
        """[spacing] the deviations (n,), (n,) of points from their sites along x and along y, a
        bound on their size, and one on the errors of these two.
        """
        layout = self.layout
        x, y, unknown = layout.cached(off_sites) if len(self) <= MOST_KEPT else off_sites(layout)
        shrunk = [float(factor) / self.lattice.spacing for factor in self.lattice.shrink]
        x, y = (t * each[self.members] for t, each in zip(shrunk, (x, y), strict=True))
        most = math.hypot(*(float(np.abs(each).max(initial=0.0)) for each in (x, y))) * (1 + 1e-9)
        return x, y, most, max(shrunk) * unknown + 8 * ROUNDOFF * most

    def _off_sites(self, loads: Array, box: SiteBox, places: Indices) -> Ball:
        """(n,) changes of sum_j P_j / r_ij by deviations of points from their sites.

        docs/theory/operators-lattice.md, "Points off their sites", derives the expansion.
        """
        x, y, most, unknown = self._deviations
        top = float(np.abs(loads).max(initial=0.0))
        if most + unknown == 0.0 or top == 0.0:
            return Ball.exact(np.zeros(len(self)))
        shares = loads / top
        pulls = self._on(box, "pulls", lambda: box.pulls(coupling.cubed))

        def pull(waves: list[NDArray[Any]], each: slice) -> list[NDArray[Any]]:
            along, across = (1j * kernel.spectrum[:, each] for kernel in pulls)
            whole, *moments = waves
            return [along * whole, across * whole, along * moments[0] + across * moments[1]]

        given = (box.laid_out(weight * shares, places) for weight in (1.0, x, y))
        fields = through_waves(given, box.padded, box.workers, pull)
        change = fields.pop().ravel()[places]
        size = float(np.abs(change).max())
        for each in (y, x):
            part = each * fields.pop().ravel()[places]
            size += float(np.abs(part).max())
            change -= part
        # The square of the kernel's norm bounds the row sums of 1 / r^2, and those of 1 / r^3.
        whole = self._kernel.norm**2 / self._least**2
        norm = math.hypot(*(kernel.norm for kernel in pulls))
        error = 2.0 * box.bound(norm, operations=10) * most * float(np.linalg.norm(shares))
        error += 2.0 * unknown * whole + (2.0 * most) ** 2 / self._least * whole
        error += 4 * ROUNDOFF * size
        unit = top / self.lattice.spacing
        return Ball.around(change * unit, 1.01 * error * unit)

    def smoother(self, root: Array) -> coupling.Smoother:
        return self._blocks.smoother(root)

    @cached_property
    def _blocks(self) -> Blocks:
        return Blocks.of(self.cells, self.box.basis, self._unit)


def _largest_sum(values: Array, apart: int) -> float:
    """The largest sum of two values that are so far apart in the array; 0 if none is positive."""
    here, there, found = values[:-apart], values[apart:], [0.0]

    def look(some: slice) -> None:
        found.append(float((here[some] + there[some]).max()))

    threads.each(look, threads.chunks(len(here), CHUNK), threads.worthwhile(len(here)))
    return max(found)


def off_sites(layout: Layout) -> tuple[Array, Array, float]:
    """(N,), (N,) [length] x and y deviations of points from their sites, and their error bound.

    That of a point p is p - o - i b1 - j b2 with the lattice's origin o, rounded at the end.
    """
    assert layout.lattice is not None
    assert layout.sites is not None
    lattice, sites, points = layout.lattice, layout.sites, layout.points

    def away(k: int, some: slice) -> Pair:
        left = Pair(*two_sum(points[some, k], -lattice.origin[k]))
        for n in (0, 1):
            left -= Pair(*two_product(sites[some, n].astype(np.float64), lattice.basis[n, k]))
        return left

    x, y = (in_parts(len(points), partial(away, k)).high for k in (0, 1))
    most = float(np.abs(sites).max(initial=0))
    largest = float(np.abs(lattice.origin).max() + most * np.abs(lattice.basis).sum())
    return x, y, 96 * ROUNDOFF**2 * largest


def _least_symbol(lattice: Lattice) -> float:
    return least_symbol(lattice.basis / lattice.spacing)


def _farthest(i: Indices, j: Indices, shape: tuple[int, int], basis: Array) -> float:
    """Upper bound on the distances [spacing] of sites (i, j) from the middle of the box."""
    (g11, g12), (_, g22) = basis @ basis.T
    largest = 0.0
    for some in threads.chunks(len(i), CHUNK):
        x, y = i[some] - (shape[0] - 1) / 2.0, j[some] - (shape[1] - 1) / 2.0
        largest = max(largest, float((x * (g11 * x + 2.0 * g12 * y) + g22 * (y * y)).max()))
    return float(np.sqrt(largest)) * (1.0 + 1e-9)
