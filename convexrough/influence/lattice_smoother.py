"""An approximate inverse of I + W A W on a lattice, for conjugate gradients.

Long waves make this matrix hard: there A is large. They see W^2 only as an average over blocks of
m x m sites. So let q_b be W on block b, scaled to length 1, and Q = (q_1, q_2, ...). Beside the
range of Q the matrix is taken to be 1, and on it

    Q' (I + W A W) Q  =  I + D A_b D,      D_b^2 = sum of W^2 over the block,

with A_b the mean of A over pairs of blocks: a lattice again, where D varies little. Its inverse is
(1 + d A_b)^-1 by Fourier transforms of the blocks, d the median of D^2, cut to those that touch:

    M  =  I - Q Q' + Q (1 + d A_b)^-1 Q',

symmetric and positive definite. Where W is smooth m is 1, and Q Q' = I on the contact.
(docs/theory/newton.md, "Many".) The constants are heuristics: conjugate gradients take more steps
where they are off, and end at the same answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arrays import Array, Indices
from convexrough.influence.convolution import in_blocks
from convexrough.influence.coupling import Smoother

Single = NDArray[np.float32]

#: Blocks are so large that the sums of W^2 in them scatter by at most about this, squared.
SCATTER = 0.06

#: How large the blocks are on which the scatter of W^2 is looked at.
WINDOW = 8

#: The spectrum of A is negative at short waves; in the convex range 1 + d A stays above 0.
LEAST = 0.2


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Blocks of m x m sites that cover a box, and where asperities are.

    shape  : (rows, columns) of blocks
    places : (n,) of the asperities, in the box filled up to whole blocks
    which  : (n,) blocks that they are in
    """

    m: int
    shape: tuple[int, int]
    places: Indices
    which: Indices

    @classmethod
    def of(cls, shape: tuple[int, int], sources: Indices, m: int) -> _Blocks:
        blocks = (-(-shape[0] // m), -(-shape[1] // m))
        if m == 1:
            return cls(m, blocks, sources, sources)
        columns = blocks[1] * m
        places = sources // shape[1] * columns + sources % shape[1]
        return cls(m, blocks, places, places // columns // m * blocks[1] + places % columns // m)

    def sums(self, values: NDArray[Any]) -> Single:
        """Of values (n,) over each block."""
        m = self.m
        field = np.zeros((self.shape[0] * m, self.shape[1] * m), dtype=np.float32)
        field.ravel()[self.places] = values
        if m == 1:
            return field
        parts = (field[i::m, j::m] for i in range(m) for j in range(m))
        total = next(parts).copy()
        for part in parts:
            total += part
        return total


def block_smoother(
    shape: tuple[int, int],
    basis: Array,
    sources: Indices,
    scale: float,
    root: Array,
    workers: int,
) -> Smoother:
    """M for the asperities at places `sources` of a box of sites; root (n,) is W."""
    from scipy import fft

    squares = np.zeros(shape[0] * shape[1], dtype=np.float32)
    squares[sources] = root * root
    blocks = _Blocks.of(shape, sources, _block_size(squares.reshape(shape)))
    D = np.sqrt(blocks.sums(root * root))
    touching = D > 0
    count = 1.0 if blocks.m == 1 else float(blocks.sums(root > 0)[touching].mean())
    w = root.astype(np.float32)
    touched = (w > 0).astype(np.float32)
    q = np.divide(w, D.ravel()[blocks.which], out=np.zeros_like(w), where=w > 0)

    size, spectrum = _block_spectrum(blocks.shape, basis, blocks.m, count, workers)
    middle = np.float32(np.median(D[touching]))
    displacement = np.float32(scale) * middle * spectrum  # of A_b D
    removed = 1.0 - 1.0 / np.maximum(1.0 + middle * displacement, np.float32(LEAST))
    energies = displacement * displacement
    energies[:, 1 : (size[1] + 1) // 2] *= 2  # each wave stands for its conjugate, too
    energies *= np.float32(blocks.m * blocks.m / (size[0] * size[1]))

    rows, columns = blocks.shape

    def smooth(values: NDArray[Any]) -> tuple[NDArray[Any], float]:
        half = fft.rfft(blocks.sums(q * values), size[1], axis=1, workers=workers)
        left = np.zeros(half.shape[1])

        def remove(each: slice) -> None:
            waves = fft.fft(half[:, each], size[0], axis=0)
            power = np.square(waves.real)
            power += np.square(waves.imag)
            left[each] = np.einsum("ij,ij->j", power, energies[:, each])
            waves *= removed[:, each]
            waves = fft.ifft(waves, axis=0, overwrite_x=True)
            half[:, each] = waves[:rows]

        threads.each(remove, in_blocks(half), workers)
        field = fft.irfft(half, size[1], axis=1, overwrite_x=True, workers=workers)
        averages = np.ascontiguousarray(field[:, :columns]).ravel()[blocks.which]
        averages *= q
        np.subtract(values, averages, out=averages)
        averages *= touched
        return averages, float(np.sqrt(left.sum()))

    return smooth


def _block_size(squares: Single) -> int:
    """The smallest m for which sums of W^2 over blocks vary little from one to the next."""
    m = WINDOW
    rows, columns = (max(1, length // m) for length in squares.shape)
    inside = squares[: rows * m, : columns * m]
    height, width = (min(m, length) for length in inside.shape)
    windows = inside.reshape(rows, height, columns, width)
    mean = windows.mean(axis=(1, 3), dtype=np.float64)
    variance = (windows * windows).mean(axis=(1, 3), dtype=np.float64) - mean * mean
    if not mean.any():
        return 1
    scatter = float(variance.sum() / (mean * mean).sum())
    return max(1, int(np.ceil(np.sqrt(scatter / SCATTER)))) if scatter > SCATTER else 1


def _block_spectrum(
    blocks: tuple[int, int], basis: Array, m: int, count: float, workers: int
) -> tuple[tuple[int, int], Single]:
    """Size and spectrum of the mean of 1 / r over pairs of blocks, as if the box were repeated.

    count : touching asperities in a block: a part 1 / count of pairs in one block are no pairs
    """
    from scipy import fft

    rows, columns = (fft.next_fast_len(length, real=True) for length in blocks)
    i, j = differences(rows), differences(columns)
    x = np.add.outer(i * (m * basis[0, 0]), j * (m * basis[1, 0]))
    y = np.add.outer(i * (m * basis[0, 1]), j * (m * basis[1, 1]))
    x[0, 0] = np.inf
    mean = (1.0 / np.hypot(x, y)).astype(np.float32)
    if m > 1:
        site = np.stack(np.meshgrid(np.arange(m), np.arange(m)), axis=-1).reshape(-1, 2)
        pairs = (site[:, None] - site).reshape(-1, 2)
        for a in range(-min(2, (rows - 1) // 2), min(2, (rows - 1) // 2) + 1):
            for b in range(-min(2, (columns - 1) // 2), min(2, (columns - 1) // 2) + 1):
                r = np.hypot(*((pairs + np.array([a * m, b * m])) @ basis).T)
                apart = r > 0
                mean[a, b] = float((1.0 / r[apart]).sum()) / int(apart.sum())
        mean[0, 0] *= max(0.0, 1.0 - 1.0 / count)
    else:
        mean[0, 0] = 0.0
    spectrum: Any = fft.rfft2(mean, workers=workers).real
    return (rows, columns), np.ascontiguousarray(spectrum)


def differences(length: int) -> NDArray[np.int64]:
    """0, 1, ..., -2, -1: whole numbers modulo the length, nearest to 0."""
    i = np.arange(length)
    return np.where(i <= (length - 1) // 2, i, i - length)
