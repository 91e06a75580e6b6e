"""A box of sites of a lattice, and convolutions on it by Fourier transforms of known rounding."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.influence.lattice_smoother import differences

#: Roundoffs, relative in the 2-norm, of one pass of a transform with this radix p: 4.5 for the
#: twiddle factors and the products with them, and sqrt(p) ((p - 1) / 2 + 4) for the sums of p terms
#: (1 for p = 2). Radices 4 and 8 cost less than two and three passes of radix 2. "One pass" of
#: docs/theory/operators.md, "On a lattice: Fourier transforms".
PASS_ROUNDOFFS = {2: 6, 3: 14, 5: 18, 7: 24, 11: 35}

#: Transforms of more numbers than this use every core.
PARALLEL = 2**18

#: Columns transformed at a time: what a cache holds.
COLUMNS = 256


@dataclass(frozen=True, eq=False)
class Box:
    """A box of sites, and convolutions on it.

    shape : (rows, columns) of sites;  basis : (2, 2) rows b1 and b2, in units of the spacing: so
        single precision holds the kernel whatever the scene's units
    """

    shape: tuple[int, int]
    basis: Array

    @cached_property
    def padded(self) -> tuple[int, int]:
        """The size of the transforms."""
        from scipy.fft import next_fast_len  # 0.1 s to import: only where there is a lattice

        rows, columns = self.shape
        return next_fast_len(2 * rows - 1), next_fast_len(2 * columns - 1, real=True)

    @property
    def workers(self) -> int:
        """Threads: all cores (-1) where that pays."""
        return -1 if self.padded[0] * self.padded[1] > PARALLEL else 1

    @cached_property
    def loss(self) -> float:
        """Roundoffs of one two-dimensional transform, relative in the 2-norm."""
        return float(sum(_pass_roundoffs(length) for length in self.padded))

    def kernel(self, power: int, dtype: Any) -> Kernel:
        """1 / |i b1 + j b2|^power for every difference of two sites of the box, 0 for none."""

        def values(i: Indices, j: Indices) -> tuple[Array]:
            x = np.add.outer(i * self.basis[0, 0], j * self.basis[1, 0])
            y = np.add.outer(i * self.basis[0, 1], j * self.basis[1, 1])
            x *= x
            y *= y
            x += y
            np.sqrt(x, out=x)
            x[np.ix_(i == 0, j == 0)] = np.inf
            each = 1.0 / x
            if power > 1:
                each **= power
            return (each,)

        return self.transformed(values, dtype)[0]

    def transformed(
        self, values: Callable[[Indices, Indices], tuple[Array, ...]], dtype: Any
    ) -> list[Kernel]:
        """Kernels from their values at differences (i, j) of sites; even, each of the other."""
        from scipy import fft

        rows, columns = self.padded
        i, j = differences(rows), differences(columns)
        j_used = np.abs(j) < self.shape[1]
        halves: list[NDArray[Any]] = []
        sums: list[list[float]] = []
        block = max(1, 2**20 // columns)
        for start in range(0, self.shape[0], block):
            taken = slice(start, min(start + block, self.shape[0]))
            weights = np.where(i[taken] > 0, 2.0, 1.0)  # i and -i
            for k, each in enumerate(values(i[taken], j)):
                if k == len(halves):
                    shape = (rows, columns // 2 + 1)
                    halves.append(np.zeros(shape, dtype=np.result_type(dtype, np.complex64)))
                    sums.append([0.0, 0.0])
                each *= j_used
                sums[k][0] += float(weights @ each.sum(axis=1))
                sums[k][1] += float(weights @ (each * each).sum(axis=1))
                halves[k][taken] = fft.rfft(each.astype(dtype), axis=1, workers=self.workers)
        return [
            Kernel(self._spectrum(half, dtype), total, float(np.sqrt(square)))
            for half, (total, square) in zip(halves, sums, strict=True)
        ]

    def _spectrum(self, half: NDArray[Any], dtype: Any) -> NDArray[Any]:
        """The real transform of an even kernel from the transforms of its first rows."""
        from scipy import fft

        last = self.shape[0] - 1
        if last:
            half[-last:] = np.conj(half[last:0:-1])  # row -i is row i read backwards
        spectrum = np.empty(half.shape, dtype=dtype)
        for each in self.blocks(half.shape[1]):
            spectrum[:, each] = fft.fft(half[:, each], axis=0, workers=self.workers).real
        return spectrum

    def convolve(self, field: NDArray[Any], spectrum: NDArray[Any]) -> NDArray[Any]:
        """The convolution of a field (rows, columns) with a kernel, on the box."""
        from scipy import fft

        rows, columns = self.padded
        half = fft.rfft(field, columns, axis=1, workers=self.workers)
        for each in self.blocks(half.shape[1]):
            full = fft.fft(half[:, each], rows, axis=0, workers=self.workers)
            full *= spectrum[:, each]
            full = fft.ifft(full, axis=0, overwrite_x=True, workers=self.workers)
            half[:, each] = full[: self.shape[0]]
        result: NDArray[Any] = fft.irfft(half, columns, axis=1, workers=self.workers)
        return result[:, : self.shape[1]]

    @staticmethod
    def blocks(width: int) -> Iterator[slice]:
        """Columns transformed at a time."""
        for start in range(0, width, COLUMNS):
            yield slice(start, min(start + COLUMNS, width))

    def bound(self, kernel: Kernel, roundoff: float) -> float:
        """Bound on the 2-norm of the error of `convolve`, relative to that of the field.

        (1) of docs/theory/operators.md, "On a lattice: Fourier transforms".
        """
        size = float(np.sqrt(float(self.padded[0]) * self.padded[1]))
        spectral = self.loss * size * kernel.norm
        return 1.01 * roundoff * ((2 * self.loss + 4) * kernel.total + spectral)

    def bound_each(self, kernel: Kernel, roundoff: float) -> float:
        """Bound on each component of that error, relative to the 2-norm of the field: (2) there.

        What the two forward transforms lose reaches a component through the other's 2-norm, and
        the inverse transform loses at most so much of the mean modulus of what it adds up, which
        is at most the product of both.
        """
        inverse = float(np.sqrt(2.0)) * self.loss
        return 1.01 * roundoff * (2 * self.loss + inverse + 4) * kernel.norm


@dataclass(frozen=True, eq=False)
class Kernel:
    """spectrum : of its transform, real as the kernel is even; total, norm : its sum and 2-norm."""

    spectrum: NDArray[Any]
    total: float
    norm: float


def _pass_roundoffs(length: int) -> int:
    total = 0
    for radix, cost in PASS_ROUNDOFFS.items():
        while length % radix == 0:
            length //= radix
            total += cost
    assert length == 1  # what next_fast_len gives
    return total


def neighbours(box: Box) -> Iterator[tuple[float, int, int]]:
    """Differences of two sites, one of each pair +-, by increasing distance."""
    rows, columns = box.shape
    reach = 1
    done = 0.0
    while True:
        i = np.arange(0, min(reach, rows - 1) + 1)
        j = np.arange(-min(reach, columns - 1), min(reach, columns - 1) + 1)
        i, j = (each.ravel() for each in np.meshgrid(i, j, indexing="ij"))
        half = (i > 0) | (j > 0)
        i, j = i[half], j[half]
        distances = np.hypot(*(box.basis.T @ np.stack((i, j))))
        # On a reduced basis every difference beyond the square is longer than this.
        whole = reach >= max(rows, columns) - 1
        sure = np.inf if whole else 0.8 * (reach + 1) * float(np.hypot(*box.basis[0]))
        order = np.argsort(distances)
        for k in order[(distances[order] > done) & (distances[order] <= sure)]:
            yield float(distances[k]), int(i[k]), int(j[k])
        if whole:
            return
        done, reach = sure, 2 * reach
