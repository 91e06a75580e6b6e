"""Products on a box of sites with any number of digits, by exact convolutions.

Loads and kernel are divided into slices of whole numbers and a small rest. From one slice to the
next, the unit is divided by the same power of two. The products of a slice of the loads and a slice
of the kernel that have the same unit add up to a *level*. Fourier transforms compute a level with
an error below one half, so rounding to whole numbers makes it exact
(docs/theory/operators-lattice.md, "Slices").
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import TINY, Ball
from convexrough.arithmetic.pairs import PAIR_ROUNDOFF, Pair, in_parts, two_sum
from convexrough.arrays import Array, Indices
from convexrough.influence.convolution import Kernel, SiteBox, through_waves
from convexrough.roundoff import ROUNDOFF

#: Largest error allowed in a computed level; below 1/2, rounding to whole numbers removes it.
SURE = 0.45

#: Number of slices. One more slice is used on boxes of more than LARGE sites in a press. Elsewhere
#: one more is used for each of the numbers MANY that the sites exceed. On 6.6 million sites, error
#: bounds of loads are 7e-13 of the largest load with three slices, and 3e-15 with four.
SLICES, LARGE, MANY = 3, 2**22, (2**14, 2**17)

#: Number of slices of the kernels in derivatives by positions.
PULLED = 2

#: Largest number of bits in a slice; with 53, float64 would have no bits left for a rest.
MOST_BITS = 48


@dataclass(frozen=True)
class Distances:
    """The even kernel 1 / |i b1 + j b2| for integers i and j; 0 for i = j = 0."""

    odd: ClassVar[bool] = False
    #: (3, 3) slices (rows) of b1 b1, 2 b1 b2 and b2 b2 (columns). The first two have so few bits
    #: that sums of their products with i^2, i j and j^2 are exact.
    gram: Array
    error: float  # bound on the relative error of each value

    @classmethod
    def of(cls, basis: list[list[Fraction]], largest: int) -> Distances:
        """For |i|, |j| below `largest`, in a unit of 0.5 to 1 times the shorter of both vectors."""
        (a, b), (c, d) = basis
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
        # The third slices are at most 2^(above - 2 bits). Their sums lose at most four roundoffs of
        # i^2 + |i j| + j^2; for a reduced basis, r^2 is at least a third of this sum.
        return cls(slices, PAIR_ROUNDOFF + 12 * ROUNDOFF * 2.0 ** (above - 2 * bits))

    def at(self, i: Indices, j: Indices) -> Pair:
        """(len(i), len(j)) values at the differences (i, j) of sites."""
        i, j = i.astype(np.float64), j.astype(np.float64)
        parts = []
        for one, both, two in self.gram.tolist():
            part = np.multiply.outer(i * both, j)
            part += j * j * two
            part += (i * i * one)[:, None]
            parts.append(part)
        high, low = two_sum(parts[0], parts[1])
        return Pair(*two_sum(high, low + parts[2])).inverse_root()


@dataclass(frozen=True)
class Pulls(Distances):
    """The odd kernel x / r^3, r = |i b1 + j b2|, for one coordinate x of i b1 + j b2; 0 at r = 0.

    The error of each value is at most `error` / r^2.
    """

    odd: ClassVar[bool] = True
    along: tuple[Pair, Pair]  # this coordinate of b1 and b2

    def at(self, i: Indices, j: Indices) -> Pair:
        inverse, (one, two) = super().at(i, j), self.along
        across = Pair.exact(i.astype(np.float64)[:, None]) * one
        return (across + Pair.exact(j.astype(np.float64)) * two) * (inverse * inverse * inverse)


def cut(values: Pair, bits: int, more: int, count: int) -> list[Array]:
    """`count` arrays v_1, v_2, ... with values = sum_s 2^-(bits + s more) v_{s+1}, s = 0, 1, ...

    The last array is the rest; all others contain whole numbers. |v_1| is at most about 2^bits max
    |values|. Of the other slices, |v_s| is at most 2^(more - 1).
    """
    high, low = values.high * 2.0**bits, values.low * 2.0**bits
    slices = []
    for _ in range(count - 1):
        slices.append(np.rint(high))
        high, low = two_sum(high - slices[-1], low)
        high *= 2.0**more
        low *= 2.0**more
    return [*slices, np.asarray(high + low)]


@dataclass(frozen=True, eq=False)
class Sliced:
    """A kernel on a box of sites, divided into slices for products with any loads."""

    box: SiteBox
    unit: float  # [length] the unit of distances, a power of two
    kernels: list[Kernel]  # the slices K_1, K_2, ...
    bits: int
    more: int  # the unit of K_{t+1} is 2^-(bits + t more)
    lost: float  # bound on the 2-norm of all errors of the values, and of adding levels up
    odd: bool  # True if the kernel is odd: its transform is i times the `spectrum` of the slices
    budget: float  # largest product of the 2-norms of a slice of loads and a slice of the kernel

    @classmethod
    def of(cls, box: SiteBox, values: Distances, norm: float, unit: float, count: int) -> Sliced:
        """The kernel divided into `count` slices; its 2-norm is at most 1.01 `norm`, and that of
        the errors of its values at most `norm` times `values.error`."""
        rows, columns = box.shape
        places = math.sqrt((2.0 * rows - 1.0) * (2.0 * columns - 1.0))
        sites = math.sqrt(float(rows * columns))
        budget = SURE / ((count - 1) * box.bound(1.0, operations=_operations(count)))
        # Slices of the kernel should have about equal norms, and so should slices of the loads.
        most = math.sqrt(budget * places / sites)
        bits = min(max(math.floor(math.log2(0.95 * most / max(norm, 1.0))), 1), MOST_BITS)
        more = min(1 + math.floor(math.log2(budget / (places * sites)) / 2.0), MOST_BITS)

        def slices(i: Indices, j: Indices, _: Array) -> list[Array]:
            return cut(values.at(i, j), bits, more, count)

        while True:
            kernels = box.kernels(slices, np.float64, count, odd=values.odd)
            largest = max(each.norm for each in kernels[:-1])
            # For any loads, slices after the first are at most 2^(more - 1).
            if count == 2 or largest * 2.0 ** (more - 1) * sites <= budget:
                lost = 1.01 * (values.error + 1.01 * count * PAIR_ROUNDOFF) * norm
                return cls(box, unit, kernels, bits, more, lost, values.odd, budget)
            more -= 1

    def sums(self, loads: Pair, at: Indices) -> Ball:
        """(n,) sums over j of g_ij P_j / unit with the kernel g, for loads at flat indices `at`."""
        count = len(self.kernels)
        top = float(np.abs(loads.high).max(initial=0.0))
        if top == 0.0:
            return Ball.exact(loads)
        size = 2.0 ** np.ceil(np.log2(top))
        loaded = loads.high.nonzero()[0]
        shares = Pair(*(part / size for part in loads.at(loaded)))  # exact
        slices, bits = self._cut(shares)
        sizes = [float(np.linalg.norm(each)) for each in slices]
        fields = (self.box.laid_out(slices.pop(0), at[loaded]) for _ in range(count))
        levels = through_waves(fields, self.box.padded, self.box.workers, self._levels)
        unit = size / self.unit
        units = [2.0 ** -(self.bits + bits + level * self.more) for level in range(count)]

        def add_up(some: slice) -> Pair:
            high = low = np.zeros(some.stop - some.start)
            for level, each in zip(levels[::-1], units[::-1], strict=True):
                part = level.ravel()[at[some]]
                if level is not levels[-1]:
                    part = np.rint(part)
                high, lost = two_sum(part * (each * unit), high)
                low = low + lost
            return Pair(*two_sum(high, low))

        left = behind = 0.0  # norms of the products that `_levels` adds up in its last field
        for kernel, norm in zip(self.kernels, sizes[::-1], strict=True):
            behind = behind * 2.0**-self.more + norm
            left += kernel.norm * behind
        # Cauchy's inequality bounds the effect of errors of values and of operations on pairs.
        radius = self.box.bound(left, operations=_operations(count)) * units[-1]
        radius += self.lost * 1.01 * float(np.linalg.norm(shares.high))
        return Ball.around(in_parts(len(at), add_up), 1.01 * radius * unit + TINY)

    def _cut(self, shares: Pair) -> tuple[list[Array], int]:
        """Slices of loads up to 1 for which levels are exact, and the bits of the first slice."""
        most = self.budget / max(1.0, *(each.norm for each in self.kernels[:-1]))
        guess = math.floor(math.log2(most / float(np.linalg.norm(shares.high))))
        bits = min(guess, MOST_BITS)
        while float(np.linalg.norm(np.rint(shares.high * 2.0**bits))) > most:
            bits -= 1
        return cut(shares, bits, self.more, len(self.kernels)), bits

    def _levels(self, waves: list[NDArray[Any]], each: slice) -> list[NDArray[Any]]:
        """The transforms of the levels of whole numbers, and of the sum of all other products."""
        spectra = [kernel.spectrum[:, each] for kernel in self.kernels]
        last = len(waves) - 1
        levels: list[NDArray[Any]] = []
        for level in range(last):
            total = waves[0] * spectra[level]
            for s in range(1, level + 1):
                total += waves[s] * spectra[level - s]
            levels.append(total)
        behind = waves[last].copy()
        left = behind * spectra[0]
        for t in range(1, last + 1):
            behind *= 2.0**-self.more
            behind += waves[last - t]
            left += behind * spectra[t]
        levels.append(left)
        if self.odd:
            for product in levels:
                product *= 1j
        return levels


def _operations(count: int) -> int:
    # Replaces 4 in (1) of docs/theory/operators-lattice.md: up to `count` products are added up
    # before the inverse transform, and last slices are rounded.
    return 2 * count + 6
