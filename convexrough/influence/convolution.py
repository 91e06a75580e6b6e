"""Convolutions on a box of lattice sites by Fourier transforms, with bounds on their rounding."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arrays import Array, Indices
from convexrough.roundoff import ROUNDOFF

#: Error of one pass of a transform in roundoffs, relative to the 2-norm, by the radix of the pass:
#: docs/theory/operators-lattice.md, "Rounding". Radices 4 and 8 are counted as two and three
#: passes of radix 2, which have a larger error.
PASS_ROUNDOFFS = {2: 6, 3: 14, 5: 18, 7: 24, 11: 35}

#: Columns are transformed in groups that have ROW bytes in each row. Rows of a kernel are computed
#: in groups of about LAID_OUT numbers, and rows of a field are transformed in groups of about
#: IN_ROWS numbers. All groups fit in the cache.
ROW, LAID_OUT, IN_ROWS = 512, 2**16, 2**16

#: A function of differences i of row numbers and j of column numbers of two sites, and of squared
#: distances (len(i), len(j)) [spacing^2]. It returns values (len(i), len(j)) of each kernel.
Values = Callable[[Indices, Indices, Array], Sequence[Array]]

#: A function of the transforms of some fields in a slice of columns, and of this slice. It returns
#: the transforms of equally many fields, and may change its arguments.
Mix = Callable[[list[NDArray[Any]], slice], list[NDArray[Any]]]


@dataclass(frozen=True, eq=False)
class SiteBox:
    """A rectangle of lattice sites i b1 + j b2, with convolutions on it."""

    shape: tuple[int, int]  # numbers of rows and of columns of sites
    basis: Array  # (2, 2) [spacing] rows b1 and b2; the shorter one has the length 1
    extent: float = np.inf  # [spacing] at least the distance of any two sites with a point

    @cached_property
    def padded(self) -> tuple[int, int]:
        """The size of the transforms: no two differences of occupied sites share an entry.

        Twice the box always suffices. A smaller size suffices if every vector between two periodic
        images of a site is longer than twice the extent.
        """
        from scipy.fft import next_fast_len  # takes 0.1 s to import, so only if transforms are used

        (rows, columns), longest = self.shape, 2.0 * self.extent
        (across, along), twice = np.hypot(*self.basis.T), (2 * rows - 1, 2 * columns - 1)
        first = next_fast_len(_least(rows, twice[0], longest / across))
        second = next_fast_len(_least(columns, twice[1], longest / along), real=True)
        while first < twice[0] and second < twice[1]:
            both = np.array([[first, second], [first, -second]]) @ self.basis
            if (np.hypot(*both.T) > longest).all():
                break
            if first * across <= second * along:
                first = next_fast_len(first + 1)
            else:
                second = next_fast_len(second + 1, real=True)
        return first, second

    @property
    def stride(self) -> int:
        """The number of columns of a field that has room for its transform."""
        return 2 * (self.padded[1] // 2 + 1)

    @property
    def workers(self) -> int:
        return threads.worthwhile(self.padded[0] * self.padded[1])

    @cached_property
    def loss(self) -> float:
        """Bound on the error of a two-dimensional transform, in roundoffs of the 2-norm."""
        loss = 0.0
        for length in self.padded:
            for radix, cost in PASS_ROUNDOFFS.items():
                while length % radix == 0:
                    length //= radix
                    loss += cost
            assert length == 1  # next_fast_len returns only products of these radices
        return loss

    def kernel(self, power: int, dtype: Any) -> Kernel:
        """The kernel 1 / |i b1 + j b2|^power for all differences of occupied sites; 0 at (0, 0)."""

        def values(i: Indices, j: Indices, squares: Array) -> list[Array]:
            with np.errstate(divide="ignore"):
                nearest = np.sqrt(np.divide(1.0, squares))
            nearest[squares == 0] = 0.0
            return [nearest**power]

        return self.kernels(values, dtype)[0]

    def pulls(self, over_cube: Callable[[Array], Array]) -> list[Kernel]:
        """The odd kernels x / r^3 and y / r^3 for all differences (x, y) of two occupied sites.

        over_cube : 1 / r^3 as a function of squared distances, perhaps made smooth at small r
        """

        def values(i: Indices, j: Indices, squares: Array) -> list[Array]:
            weights = over_cube(squares)
            return [weights * away for away in self._differences(i, j)]

        return self.kernels(values, np.float64, 2, odd=True)

    def kernels(
        self, values: Values, dtype: Any, count: int = 1, *, odd: bool = False
    ) -> list[Kernel]:
        """`count` kernels with K(-d) = K(d), or K(-d) = -K(d) if `odd`, from their `values`."""
        from scipy import fft

        rows, columns = self.padded
        last = rows // 2 + 1  # the transform of row -i is, up to sign, conjugate to that of row i
        shape, whole = (last, columns // 2 + 1), np.result_type(dtype, np.complex64)
        halves = [np.empty(shape, dtype=whole) for _ in range(count)]
        squares = np.empty((count, last))  # sums of squares of each row

        def along_rows(taken: slice) -> None:
            i = np.arange(taken.start, taken.stop)
            weights = np.where((i > 0) & (2 * i < rows), 2.0, 1.0)  # row i stands for row -i, too
            laid_out = self._laid_out(values, taken, count)
            for half, square, each in zip(halves, squares, laid_out, strict=True):
                square[taken] = weights * np.einsum("ij,ij->i", each, each)
                waves = fft.rfft(each.astype(dtype, copy=False), axis=1)
                half[taken] = -1j * waves if odd else waves

        def along_columns(half: NDArray[Any]) -> NDArray[Any]:
            spectrum = np.empty((rows, shape[1]), dtype=half.real.dtype)

            def transform(each: slice) -> None:
                spectrum[:, each] = fft.hfft(half[:, each], rows, axis=0)

            threads.each(transform, in_blocks(half), self.workers)
            return spectrum

        threads.each(along_rows, threads.chunks(last, max(1, LAID_OUT // columns)), self.workers)
        norms = np.sqrt(squares.sum(axis=1)).tolist()
        return [Kernel(along_columns(halves.pop(0)), norm) for norm in norms]

    def _laid_out(self, values: Values, taken: slice, count: int) -> list[Array]:
        """The values of `count` kernels in some rows of the padded box.

        If several differences of sites share an entry of the box, its value is that of the shortest
        difference. Beyond `extent` values are 0.
        """
        (rows, columns), (height, width) = self.shape, self.padded
        squares = np.full((taken.stop - taken.start, width), np.inf)
        found = [np.zeros_like(squares) for _ in range(count)]
        right = slice(columns), np.arange(columns)
        left = slice(width + 1 - columns, width), np.arange(1 - columns, 0)
        for shift, (across, j) in product((0, height), (right, left)):
            first = max(taken.start, shift + 1 - rows)
            last = max(first, min(taken.stop, shift + rows))
            i = np.arange(first, last) - shift
            here = slice(first - taken.start, last - taken.start), across
            shorter, y = self._differences(i, j)
            shorter *= shorter
            y *= y
            shorter += y
            nearer = shorter < squares[here]
            np.copyto(squares[here], shorter, where=nearer)
            for whole, part in zip(found, values(i, j, shorter), strict=True):
                np.copyto(whole[here], part, where=nearer)
        if self.extent < np.inf:
            beyond = squares > self.extent**2
            for whole in found:
                whole[beyond] = 0.0
        return found

    def _differences(self, i: Indices, j: Indices) -> tuple[Array, Array]:
        """(len(i), len(j)) [spacing] the coordinates x and y of i b1 + j b2."""
        x, y = (np.add.outer(i * self.basis[0, k], j * self.basis[1, k]) for k in (0, 1))
        return x, y

    def field(self, dtype: Any) -> NDArray[Any]:
        """Zeros at all sites, in an array (rows, stride) with room for the transform of rows."""
        return np.zeros((self.shape[0], self.stride), dtype=dtype)

    def laid_out(self, values: NDArray[Any], places: Indices) -> NDArray[Any]:
        """The `field` with values (n,) at the flat indices `places` (n,), and zeros elsewhere."""
        field = self.field(values.dtype)
        field.ravel()[places] = values  # where points coincide, the last value remains
        return field

    def convolve(self, field: NDArray[Any], spectrum: NDArray[Any]) -> NDArray[Any]:
        """The convolution of a `field` with a kernel, in the memory of the field."""

        def multiply(waves: list[NDArray[Any]], each: slice) -> list[NDArray[Any]]:
            waves[0] *= spectrum[:, each]
            return waves

        return through_waves([field], self.padded, self.workers, multiply)[0]

    def convolve_at(
        self, places: Indices, values: NDArray[Any], spectrum: NDArray[Any]
    ) -> NDArray[Any]:
        """(n,) the convolution at the sites with the flat indices `places` of values there."""
        return self.convolve(self.laid_out(values, places), spectrum).take(places)

    def bound(self, norm: float, roundoff: float = ROUNDOFF, operations: int = 4) -> float:
        """Bound on each component of the error of `convolve`, divided by the 2-norm of the field.

        It is (1) of docs/theory/operators-lattice.md, "Rounding"; `norm` is that of the kernel.
        """
        return 1.01 * roundoff * ((2.0 + math.sqrt(2.0)) * self.loss + operations) * norm


class Kernel(NamedTuple):
    """An even kernel, whose transform is real, or an odd kernel, whose transform is imaginary."""

    spectrum: NDArray[Any]  # the transform, or the imaginary part of the transform
    norm: float  # the 2-norm of the kernel


def through_waves(
    fields: Iterable[NDArray[Any]], padded: tuple[int, int], workers: int, mix: Mix
) -> list[NDArray[Any]]:
    """Transform fields, pass the transforms to `mix`, and transform back what it returns.

    Fields are (rows, stride), as `SiteBox.field` makes them, and are read one by one. Each result
    is in the memory of its field; its columns beyond those of the sites have no meaning.
    """
    from scipy import fft

    height, width = padded
    if height * width <= threads.MANY:  # small: fewer calls count for more than the cache
        found = [*fields]
        waves = [fft.fft(fft.rfft(each[:, :width], axis=1), height, axis=0) for each in found]
        for field, wave in zip(found, mix(waves, slice(None)), strict=True):
            half = fft.ifft(wave, axis=0, overwrite_x=True)[: len(field)]
            field[:, :width] = fft.irfft(half, n=width, axis=1)
        return found
    halves: list[NDArray[Any]] = []  # the transforms of rows
    for field in fields:
        halves.append(field.view(np.result_type(field.dtype, np.complex64)))
        _row_by_row(partial(fft.rfft, axis=1), field[:, :width], halves[-1], workers)
    rows = len(halves[0])

    def work(each: slice) -> None:
        waves = mix([fft.fft(half[:, each], height, axis=0) for half in halves], each)
        for half, full in zip(halves, waves, strict=True):
            half[:, each] = fft.ifft(full, axis=0, overwrite_x=True)[:rows]

    threads.each(work, in_blocks(halves[0]), workers)
    found = [half.view(half.real.dtype) for half in halves]
    for half, field in zip(halves, found, strict=True):
        _row_by_row(partial(fft.irfft, n=width, axis=1), half, field[:, :width], workers)
    return found


def _row_by_row(
    transform: Callable[[NDArray[Any]], NDArray[Any]],
    given: NDArray[Any],
    into: NDArray[Any],
    workers: int,
) -> None:
    """Write the transforms of rows; the array `into` may use the memory of the array `given`."""

    def work(some: slice) -> None:
        into[some] = transform(given[some])

    threads.each(work, threads.chunks(len(given), max(1, IN_ROWS // given.shape[1])), workers)


def in_blocks(half: NDArray[Any]) -> Iterator[slice]:
    """Slices of columns; the columns of one slice are transformed together."""
    return threads.chunks(half.shape[1], max(1, ROW // half.itemsize))


def _least(sites: int, twice: int, length: float) -> int:
    """A padded number of sites: above `length`, at least `sites`, but never above `twice`."""
    return twice if length >= twice else max(sites, int(length) + 1)
