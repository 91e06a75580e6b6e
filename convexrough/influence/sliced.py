"""A product on a lattice to some thirty digits, by exact convolutions of whole numbers.

docs/theory/sliced.md. Loads and kernel are cut in two: whole numbers of a coarse unit, and a small
rest. The transforms' product of the whole parts is off by less than a half, so that rounding makes
it exact; the other products are small, and so are their errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arrays import Array, Indices
from convexrough.influence.convolution import Box, Kernel, in_blocks
from convexrough.influence.coupling import Sums
from convexrough.roundoff import ROUNDOFF

#: The product of whole parts may be off by at most this, to be rounded to what it is.
SURE = 0.45

#: Bounds on the error of each value of the kernel: over the largest, and of its rest as a number.
VALUE_ERROR, REST_ERROR = 2.0**-69, 2.0**-53


class Values(Protocol):
    """An even kernel of size 1 at most, at differences of sites."""

    def sliced(self, i: Indices, j: Indices) -> tuple[Array, Array]:
        """(len(i), len(j)) values as float32 numbers and rests, to `VALUE_ERROR`."""
        ...

    def norm(self, shape: tuple[int, int]) -> float:
        """About the 2-norm over all differences of two sites of a box."""
        ...


@dataclass(frozen=True)
class Distances:
    """1 / |i b1 + j b2| for whole i and j, of a basis over a power of two.

    gram : three slices (3, 3) of b1 b1, 2 b1 b2 and b2 b2, the first two of so few bits that their
        sums over i^2, i j and j^2 are exact
    """

    gram: Array

    @classmethod
    def of(cls, basis: Array, unit: float, largest: int) -> Distances:
        (a, b), (c, d) = ([Fraction(x) / Fraction(unit) for x in row] for row in basis.tolist())
        bits = 52 - (4 * largest * largest).bit_length()
        slices = np.zeros((3, 3))
        products = a * a + b * b, 2 * (a * c + b * d), c * c + d * d
        above = math.floor(max(map(abs, products))).bit_length()
        for k, value in enumerate(products):
            finest = Fraction(2) ** (above - bits)
            for s in (0, 1):
                part = round(value / finest) * finest
                slices[s, k] = float(part)
                value, finest = value - part, finest / 2 ** (bits - 1)
            slices[2, k] = float(value)
        return cls(slices)

    def sliced(self, i: Indices, j: Indices) -> tuple[Array, Array]:
        """To 2^-70 of each; 0 for no difference."""
        squares, cross = np.square(j, dtype=np.float64), j.astype(np.float64)
        parts = []
        for one, both, two in self.gram.tolist():
            part = np.multiply.outer(i * both, cross)
            part += squares * two
            part += (np.square(i, dtype=np.float64) * one)[:, None]
            parts.append(part)
        high = parts[0] + parts[1]
        low = parts[1] - (high - parts[0])
        low += parts[2]
        nowhere = (i[:, None] == 0) & (j == 0) if (i == 0).any() else None
        if nowhere is not None:
            high[nowhere] = 1.0
        head = (1.0 / np.sqrt(high)).astype(np.float32).astype(np.float64)
        rest = _correction(high, low, head)
        if nowhere is not None:
            head[nowhere] = rest[nowhere] = 0.0
        return head, rest

    def norm(self, shape: tuple[int, int]) -> float:
        one, both, two = (float(each) for each in self.gram.sum(axis=0))
        i, j = np.arange(-8, 9)[:, None], np.arange(-8, 9)
        squares = one * i * i + both * i * j + two * j * j
        squares[8, 8] = np.inf
        near = float((1.0 / squares).sum())
        area = math.sqrt(max(one * two - both * both / 4.0, 1e-300))
        wide = max(shape) / 8.0
        return math.sqrt(near + 2.0 * math.pi / area * max(math.log(wide), 0.0) + 1.0)


def _correction(high: Array, low: Array, head: Array) -> Array:
    """What 1 / sqrt(high + low) is more than `head`, which is it to 2^-22."""
    square = head * head  # exact, as head has 24 bits
    a1 = square.astype(np.float32).astype(np.float64)
    a2 = square - a1
    s1 = high.astype(np.float32).astype(np.float64)
    s2 = high - s1
    missing = 1.0 - s1 * a1
    missing -= s1 * a2
    missing -= s2 * a1
    missing -= s2 * a2 + low * square
    factor = missing * (5.0 / 16.0)
    factor += 3.0 / 8.0
    factor *= missing
    factor += 0.5
    factor *= missing
    factor *= head
    return factor


def sliced_sums(
    box: Box, values: Values, spacing: float, loads: Array, rest: Array | float = 0.0
) -> Sums | None:
    """sum_j P_j g_ij / spacing over the sites of a box; None where no slices are small enough.

    loads : of the whole box, 0 where there is no asperity;  rest : less than a roundoff of the
        largest of them, if they are known so well;  spacing : the unit of `values`, a power of two
    """
    top = float(np.abs(loads).max(initial=0.0))
    if top == 0.0:
        return Sums(np.zeros(box.shape), np.zeros(box.shape), 1.0, 0.0, 0.0)
    size = 2.0 ** np.ceil(np.log2(top))
    shares = loads / size  # exact
    kernel_bits, load_bits = _bits(box, values, shares)
    if kernel_bits < 1 or load_bits < 1:
        return None
    fine = shares * 2.0**load_bits
    first = np.rint(fine)
    second = fine - first
    second += rest * (2.0**load_bits / size)
    whole, left = _kernels(box, values, kernel_bits)
    sizes = [float(np.linalg.norm(each)) for each in (first, second)]
    loss = each_loss(box)
    if not loss * whole.norm * sizes[0] < SURE:
        return None
    exact, remaining = _convolve(box, (first, second), (whole, left))
    error = loss * (whole.norm * sizes[1] + left.norm * (sizes[0] + sizes[1]))
    of_values = VALUE_ERROR * 2.0**kernel_bits + REST_ERROR
    error += of_values * float(np.abs(first).sum() + np.abs(second).sum()) * (1 + 1e-9)
    unit = 2.0 ** -(kernel_bits + load_bits) * size / spacing
    count = math.sqrt(box.shape[0] * box.shape[1])
    return Sums(np.rint(exact), remaining, unit, 1.01 * error, 1.01 * error * count)


def each_loss(box: Box, roundoff: float = ROUNDOFF) -> float:
    """Of a component of a product, over both 2-norms: (2) of docs/theory/operators-lattice.md.

    9 roundoffs instead of 4, as two products are added up before the inverse transform, and loads
    that are known better than to a roundoff have a rest to be added.
    """
    return 1.01 * roundoff * ((2.0 + math.sqrt(2.0)) * box.loss + 9.0)


def _bits(box: Box, values: Values, shares: Array) -> tuple[int, int]:
    """Of the kernel's and of the loads' whole parts: all that are exact, shared out evenly."""
    rows, columns = box.shape
    norm, size = values.norm(box.shape), float(np.linalg.norm(shares))
    bits = np.floor(np.log2(0.9 * SURE / (each_loss(box) * norm * size)))
    count, places = float(np.count_nonzero(shares)), 4.0 * rows * columns
    more = np.log2(np.sqrt(places) * size / (norm * np.sqrt(count)))
    of_kernel = int(np.clip(np.rint((bits + more) / 2.0), 1, max(bits - 1, 1)))
    return min(of_kernel, 22), int(bits) - min(of_kernel, 22)


def _kernels(box: Box, kernel: Values, bits: int) -> tuple[Kernel, Kernel]:
    """The whole part of 2^bits g, and the rest."""

    def values(i: Indices, j: Indices) -> tuple[Array, Array]:
        head, rest = kernel.sliced(i, j)
        head *= 2.0**bits
        rest *= 2.0**bits
        whole = np.rint(head)
        head -= whole
        head += rest
        return whole, head

    whole, rest = box.kernels(values, np.float64)
    return whole, rest


def _convolve(
    box: Box, fields: tuple[Array, Array], kernels: tuple[Kernel, Kernel]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """whole * first, and whole * second + rest * (first + second)."""
    from scipy import fft

    rows, columns = box.padded
    halves = [fft.rfft(each, columns, axis=1, workers=box.workers) for each in fields]

    def multiply(each: slice) -> None:
        first, second = (fft.fft(half[:, each], rows, axis=0) for half in halves)
        both = first + second
        both *= kernels[1].spectrum[:, each]
        first *= kernels[0].spectrum[:, each]
        second *= kernels[0].spectrum[:, each]
        second += both
        for half, full in zip(halves, (first, second), strict=True):
            full = fft.ifft(full, axis=0, overwrite_x=True)
            half[:, each] = full[: box.shape[0]]

    threads.each(multiply, in_blocks(halves[0]), box.workers)
    exact, remaining = (
        fft.irfft(half, columns, axis=1, workers=box.workers)[:, : box.shape[1]] for half in halves
    )
    return exact, remaining
