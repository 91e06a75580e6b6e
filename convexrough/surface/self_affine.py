"""Self-affine maps with known spectra, for tests and examples."""

from __future__ import annotations

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.errors import InputError
from convexrough.scene.asperities import checked_seed
from convexrough.surface.pixels import Moments
from convexrough.surface.surface import Surface

#: Default of the shortest wavelength, in pixels. Pixels of this size resolve tips.
RESOLVED = 8.0


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
    """A square periodic map of random heights with a self-affine spectrum.

    hurst     : Hurst exponent, from 0 to 1: the spectrum falls as q^(-2 (1 + hurst)) with the wave
        number q
    rms_slope : root mean square of the slope |grad z|
    rolloff   : [length] wavelength above which the spectrum is constant
    seed      : seed of the random phases. Amplitudes are not random: all maps have equal moments
    pixels    : number of pixels per side;  pixel : [length] size of a pixel
    cutoff    : [length] shortest wavelength; default 8 pixels
    unit      : unit of length, as in `Surface`

    With the same `cutoff`, the same size pixels * pixel and different `pixels`, maps show the same
    surface at different resolutions.

    >>> surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=256)
    >>> surface.heights.shape
    (256, 256)
    """
    numbers, variances = _waves(hurst, rms_slope, rolloff, pixels, pixel, cutoff)
    phases = np.random.default_rng(checked_seed(seed)).uniform(0.0, 2 * np.pi, len(variances))
    spectrum = np.zeros((pixels, pixels), dtype=np.complex128)
    column, row = numbers.T
    amplitudes = np.sqrt(2 * variances)  # a cosine of amplitude a has the variance a^2 / 2
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
    """The exact moments of the maps of `self_affine`, with the same arguments.

    >>> exact = cr.surface.self_affine_moments(0.8, 0.1, 32.0, pixels=256)
    >>> print(f"{exact.m2:.4f}")
    0.0050
    """
    numbers, variances = _waves(hurst, rms_slope, rolloff, pixels, pixel, cutoff)
    vectors = 2 * np.pi / (pixels * pixel) * numbers
    along = [float((vectors**power @ [0.5, 0.5] * variances).sum()) for power in (2, 4)]
    return Moments(float(variances.sum()), *along)


def _waves(
    hurst: float, rms_slope: float, rolloff: float, pixels: int, pixel: float, cutoff: float | None
) -> tuple[Indices, Array]:
    """The waves of a map, one for each pair of opposite wave vectors, in an order independent of
    `pixels`: (n, 2) numbers of wavelengths along x and y, and (n,) variances [length^2].
    """
    hurst = checks.between("hurst", hurst, 0.0, 1.0)
    rms_slope = checks.positive("rms_slope", rms_slope)
    rolloff, pixel = checks.positive("rolloff", rolloff), checks.positive("pixel", pixel)
    checks.fits_in_memory("pixels", checks.whole("pixels", pixels, 8), 64, power=2)
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
    lengths = np.hypot(*(2 * np.pi / size * numbers).T)
    spectrum = np.maximum(lengths, 2 * np.pi / rolloff) ** (-2 * (1 + hurst))
    slopes = float((lengths**2 * spectrum).sum())
    return numbers, rms_slope**2 / slopes * spectrum
