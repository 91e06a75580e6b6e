"""Spectral moments, and the summits of a Gaussian surface with these moments (McCool 1987)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from convexrough.arrays import Array
from convexrough.record import Record


@dataclass(frozen=True, repr=False)
class Moments(Record):
    """Moments of the profiles of a surface, and statistics of summits that follow from them.

    m0 : [length^2] variance of the heights
    m2 : mean square slope of profiles, averaged over profiles along x and along y
    m4 : [1/length^2] mean square second derivative of profiles, averaged likewise
    slope_ratio : rms slope along y divided by rms slope along x; 1 if the surface has no preferred
        direction

    The formulas (Nayak 1971, McCool 1987) hold for all maxima, without pruning, of an isotropic
    Gaussian surface that its pixels resolve.

    >>> moments = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=256).moments
    >>> print(f"{moments.bandwidth:.3g} {moments.m2:.4f}")
    3.96 0.0049
    """

    _shown = ("bandwidth", "density", "mean_curvature", "mean_height", "height_std")

    m0: float
    m2: float
    m4: float
    slope_ratio: float = 1.0

    @property
    def bandwidth(self) -> float:
        """Nayak's alpha = m0 m4 / m2^2: 1.5 for one wavelength, more for a broad spectrum."""
        return self.m0 * self.m4 / self.m2**2

    @property
    def density(self) -> float:
        """[1/length^2] number of maxima per area, m4 / (6 pi sqrt(3) m2)."""
        return float(self.m4 / (6 * np.pi * np.sqrt(3) * self.m2))

    @property
    def mean_curvature(self) -> float:
        """[1/length] mean curvature (k1 + k2) / 2 of the maxima, (8/3) sqrt(m4 / pi)."""
        return float(8 / 3 * np.sqrt(self.m4 / np.pi))

    @property
    def mean_height(self) -> float:
        """[length] mean height of the maxima above the mean plane, 4 sqrt(m0 / (pi alpha))."""
        return float(4 * np.sqrt(self.m0 / (np.pi * self.bandwidth)))

    @property
    def height_std(self) -> float:
        """[length] standard deviation of the maxima's heights, sqrt((1 - 0.8968 / alpha) m0)."""
        return float(np.sqrt(max(1 - 0.8968 / self.bandwidth, 0.0) * self.m0))


def moments_of(heights: Array, pixel: tuple[float, float]) -> Moments:
    """The moments of a map, from differences of neighbours, too small for waves of a few pixels."""
    across = [(1, pixel[0]), (0, pixel[1])]
    slopes = [np.mean((np.diff(heights, axis=axis) / step) ** 2) for axis, step in across]
    bends = [np.mean((np.diff(heights, 2, axis=axis) / step**2) ** 2) for axis, step in across]
    return Moments(
        m0=float(np.var(heights)),
        m2=float(np.mean(slopes)),
        m4=float(np.mean(bends)),
        slope_ratio=float(np.sqrt(slopes[1] / slopes[0])) if slopes[0] else float("inf"),
    )
