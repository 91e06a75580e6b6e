"""What points that are a little off their sites change in a product on a lattice, to first order.

docs/theory/sliced.md, "Points off their sites". Asperity i is at its site and a little further, by
eps_i. With d the difference of two sites, and eta no less than any |eps_i - eps_j|,

    1 / |d + eps_i - eps_j| = 1 / |d| - (eps_i - eps_j) d / |d|^3,  but for  eta^2 / (|d| - eta)^3,

and the sum of the second term times P_j is made of convolutions with d / |d|^3. Single precision is
enough for them: they are 10^-13 of the product.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arrays import Array, Indices
from convexrough.influence.convolution import Box, in_blocks
from convexrough.influence.coupling import cubed
from convexrough.influence.sliced import each_loss
from convexrough.influence.slopes import pulls
from convexrough.roundoff import ROUNDOFF
from convexrough.scene.lattice import Lattice, Sites
from convexrough.twofold import exact_product, exact_sum

#: Of single precision.
SINGLE_ROUNDOFF = 2.0**-24

#: Points looked at together where each is in many operations: what a cache holds.
CHUNK = 2**14

#: Rows of a box that are laid out together hold about so many numbers: what a cache holds.
LAID_OUT = 2**18

Spectra = list[NDArray[np.float32]]


def off_sites(
    lattice: Lattice, array: Array, members: Indices, places: Sites
) -> tuple[Array, Array, float]:
    """(n,) and (n,) [length] how far points are off, but for a common shift; and its error.

    x - o - i b1 - j b2: sums and products are exact, but for what is left of them.
    """
    away = np.empty((2, len(members)))

    def look(some: slice) -> None:
        steps = places[some].astype(np.float64)
        for k in (0, 1):
            high, low = exact_sum(array[members[some], k], -lattice.origin[k])
            for n in (0, 1):
                step, rest = exact_product(steps[:, n], lattice.basis[n, k])
                high, left = exact_sum(high, -step)
                low = low + (left - rest)
            away[k, some] = high + low

    threads.each(look, threads.chunks(len(members), CHUNK), threads.worthwhile(len(members)))
    steps_most = float(np.abs(places).max(initial=0))
    reach = float(np.abs(lattice.origin).max() + steps_most * np.abs(lattice.basis).sum())
    return away[0], away[1], 96 * ROUNDOFF**2 * reach


def first_order(
    box: Box, sources: Indices, shares: Array, off: tuple[Array, Array]
) -> tuple[Array, float]:
    """(n,) the sum over j of -(eps_i - eps_j) d / |d|^3 P_j; and a bound on each one's error.

    In units of the spacing, of the largest load and of the largest |eps|.

    shares : (n,) P, at most 1;  off : (n,) and (n,) eps, at most 1 in length
    """
    spectra, norm = _odd_spectra(box)
    fields = [shares, off[0] * shares, off[1] * shares]
    pulls = [each.ravel()[sources] for each in _convolve(box, sources, fields, spectra)]
    total = pulls[2].astype(np.float64)
    total -= off[0] * pulls[0]
    total -= off[1] * pulls[1]
    # (2) of docs/theory/operators-lattice.md, once for the pull on i and once for that of all j.
    loss = each_loss(box, SINGLE_ROUNDOFF)
    return total, 2.0 * loss * norm * float(np.linalg.norm(shares))


def _odd_spectra(box: Box) -> tuple[Spectra, float]:
    """The imaginary parts of the transforms of d / |d|^3, and the 2-norm of both together."""
    from scipy import fft

    rows, columns = box.padded
    halves = [np.zeros((rows, columns // 2 + 1), dtype=np.complex64) for _ in range(2)]
    block, total = max(1, LAID_OUT // columns), 0.0
    for start in range(0, rows // 2 + 1, block):
        taken = slice(start, min(start + block, rows // 2 + 1))
        i = np.arange(taken.start, taken.stop)
        weights = np.where((i > 0) & (2 * i < rows), 2.0, 1.0)  # i and -i
        for half, part in zip(halves, box.laid_out(pulls(box, cubed), taken), strict=True):
            total += float(weights @ np.einsum("ij,ij->i", part, part))
            half[taken] = fft.rfft(part.astype(np.float32), axis=1, workers=box.workers)
    return [_imaginary(box, half) for half in halves], math.sqrt(total)


def _imaginary(box: Box, half: NDArray[Any]) -> NDArray[np.float32]:
    """The transform of an odd kernel, over i, from the transforms of its first rows."""
    from scipy import fft

    last = (box.padded[0] - 1) // 2
    if last:
        half[-last:] = -np.conj(half[last:0:-1])  # row -i is minus row i read backwards
    spectrum = np.empty(half.shape, dtype=np.float32)

    def transform(each: slice) -> None:
        spectrum[:, each] = fft.fft(half[:, each], axis=0).imag

    threads.each(transform, in_blocks(half), box.workers)
    return spectrum


def _convolve(
    box: Box, sources: Indices, fields: list[Array], spectra: Spectra
) -> list[NDArray[np.float32]]:
    """Of the first field with both kernels, and of the other two with one each, added up."""
    from scipy import fft

    rows, columns = box.padded
    halves = []
    for values in fields:
        field = np.zeros(box.shape, dtype=np.float32)
        field.ravel()[sources] = values
        halves.append(fft.rfft(field, columns, axis=1, workers=box.workers))

    def multiply(each: slice) -> None:
        loads, *moments = (fft.fft(half[:, each], rows, axis=0) for half in halves)
        loads *= np.complex64(1j)
        both = np.zeros_like(loads)
        pulls = []
        for spectrum, moment in zip(spectra, moments, strict=True):
            pulls.append(loads * spectrum[:, each])
            moment *= spectrum[:, each]
            both += moment
        both *= np.complex64(1j)
        for half, full in zip(halves, (*pulls, both), strict=True):
            full = fft.ifft(full, axis=0, overwrite_x=True)
            half[:, each] = full[: box.shape[0]]

    threads.each(multiply, in_blocks(halves[0]), box.workers)
    return [
        fft.irfft(half, columns, axis=1, overwrite_x=True, workers=box.workers)[:, : box.shape[1]]
        for half in halves
    ]
