"""Self-affine maps whose spectrum is known: for tests, and to learn on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.scene.patterns import checked_seed
from convexrough.surface.moments import Moments
from convexrough.surface.surface import Surface

#: Pixels of the shortest wave where none is given: tips are resolved.
RESOLVED = 8.0


class Waves(NamedTuple):
    """The waves of a periodic map: one of each pair of opposite wave vectors.

    numbers   : (n, 2) whole waves across the map along x and y
    vectors   : (n, 2) [1/length] 2 pi times those over the size
    variances : (n,) [length^2] of each wave
    """

    numbers: Array
    vectors: Array
    variances: Array


def self_affine(
    hurst: float,
    rms_slope: float,
    rolloff: float,
    seed: int,
    *,
    pixels: int = 256,
    pixel: float = 1.0,
    cutoff: float | None = None,
    unit: str = "",
) -> Surface:
    """A square periodic map with a self-affine spectrum, white below the roll-off.

    hurst     : Hurst's exponent, from 0 to 1: the spectrum falls as q^(-2 (1 + hurst))
    rms_slope : root mean square of the slope, |grad z|
    rolloff   : [length] wave from which on longer ones are no taller
    seed      : of the phases; amplitudes are not random, so that every map has the same moments
    pixels    : along each side;  pixel : [length]
    cutoff    : [length] the shortest wave, 8 pixels unless given
    unit      : of length, only remembered

    More pixels of the same map, so that pixels * pixel stays, are the same surface seen closer, as
    long as `cutoff` is the same.

    >>> surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=256)
    >>> surface.heights.shape
    (256, 256)
    """
    waves = _waves(hurst, rms_slope, rolloff, pixels, pixel, cutoff)
    phases = np.random.default_rng(checked_seed(seed)).uniform(0.0, 2 * np.pi, len(waves.variances))
    spectrum = np.zeros((pixels, pixels), dtype=np.complex128)
    column, row = waves.numbers.T
    amplitudes = np.sqrt(2 * waves.variances)  # of cosines
    spectrum[row, column] = amplitudes * np.exp(1j * phases)
    heights = np.fft.ifft2(spectrum).real * pixels**2
    made = f"self-affine: hurst {hurst:g}, rms slope {rms_slope:g}, roll-off {rolloff:g}"
    return Surface(heights, (pixel, pixel), unit, source=f"{made}, seed {seed}")


def self_affine_moments(
    hurst: float,
    rms_slope: float,
    rolloff: float,
    *,
    pixels: int = 256,
    pixel: float = 1.0,
    cutoff: float | None = None,
) -> Moments:
    """The moments of `self_affine`, whose arguments are as there: sums over its waves, exactly.

    >>> exact = cr.surface.self_affine_moments(0.8, 0.1, 32.0, pixels=256)
    >>> print(f"{exact.m2:.4f}")
    0.0050
    """
    waves = _waves(hurst, rms_slope, rolloff, pixels, pixel, cutoff)
    along = [float((waves.vectors**power @ [0.5, 0.5] * waves.variances).sum()) for power in (2, 4)]
    return Moments(float(waves.variances.sum()), *along)


def _waves(
    hurst: float,
    rms_slope: float,
    rolloff: float,
    pixels: int,
    pixel: float,
    cutoff: float | None,
) -> Waves:
    """In an order that does not depend on how many pixels there are."""
    hurst = checks.between("hurst", hurst, 0.0, 1.0)
    rms_slope = checks.positive("rms_slope", rms_slope)
    rolloff, pixel = checks.positive("rolloff", rolloff), checks.positive("pixel", pixel)
    if not isinstance(pixels, (int, np.integer)) or isinstance(pixels, bool) or pixels < 8:
        raise InputError("pixels", found=repr(pixels), expected="a whole number, at least 8")
    checks.fits_in_memory("pixels", pixels, 64, power=2)
    shortest = RESOLVED * pixel if cutoff is None else checks.positive("cutoff", cutoff)
    size = pixels * pixel
    if shortest <= 2 * pixel * (1 + 1e-12):
        expected = f"more than two pixels of {pixel:g}"
        raise InputError("cutoff", found=f"{shortest:g}", expected=expected)
    limit = (size / shortest * (1 + 1e-12)) ** 2
    most = int(np.sqrt(limit))
    i, j = np.meshgrid(np.arange(-most, most + 1), np.arange(-most, most + 1))
    squared = i**2 + j**2
    half = (squared > 0) & (squared <= limit) & ((j > 0) | ((j == 0) & (i > 0)))
    numbers = np.column_stack((i[half], j[half]))
    if len(numbers) == 0:
        raise InputError("cutoff", found=f"{shortest:g}", expected=f"at most the size, {size:g}")
    vectors = 2 * np.pi / size * numbers
    lengths = np.hypot(*vectors.T)
    spectrum = np.maximum(lengths, 2 * np.pi / rolloff) ** (-2 * (1 + hurst))
    slopes = float((lengths**2 * spectrum).sum())
    return Waves(numbers, vectors, rms_slope**2 / slopes * spectrum)
