"""A lower bound on the eigenvalues of the compliance operator of points on a lattice.

In units of scale / spacing, such a bound is the least value of the symbol f(k) at all wave vectors
k. The symbol is the Fourier transform of 1 / |d| on the lattice. docs/theory/operators-lattice.md,
"The symbol", calls it sigma(q). With any alpha > 0 and E(q) = erfc(q / 2 alpha) / q,

    f(k) = sum_d cos(k d) erfc(alpha |d|) / |d| + (2 pi / V) sum_G E(|k + G|) - 2 alpha / sqrt(pi)

where d are all lattice vectors except 0, G all vectors of the dual lattice, and V the area of a
cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts are imported when they are used

from convexrough.arrays import Array

#: Largest difference of the lower bound from the least value found. A heuristic.
TOLERANCE = 1e-3

#: Ratio of the longer to the shorter basis vector above which the sums have too many terms.
LONGEST = 50.0

#: All terms with alpha |d| or |G| / 2 alpha up to this are included. In omitted terms of the first
#: sum, erfc is below 3e-17. Omitted terms of the second sum are positive, so a lower bound holds
#: without them.
REACH = 6.0

#: Bound on the omitted terms of the first sum and on the rounding errors of some hundred terms
#: below 10.
LOST = 1e-9

#: Number of parts into which each side of a cell of the dual lattice is divided first, and largest
#: number of times that the sides of these parts are halved.
FIRST, MOST_HALVINGS = 8, 12

#: Vectors from the middle of a part to the middles of its quarters, in units of a quarter's side.
QUARTERS = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) / 2.0


def least_symbol(basis: Array) -> float:
    """A lower bound on f for a reduced basis (2, 2) whose shorter vector has length 1.

    A cell of the dual lattice is divided into smaller and smaller parts, until the bounds in all
    parts are within the tolerance of the least value found. The result is -inf if the longer vector
    exceeds `LONGEST`, or if `MOST_HALVINGS` halvings are not enough.
    """
    if np.hypot(*basis.T).max() > LONGEST:
        return -np.inf
    symbol = _Symbol.of(basis)
    steps = (np.arange(FIRST) + 0.5) / FIRST
    x, y = np.meshgrid(steps - 0.5, steps[: FIRST // 2], indexing="ij")  # f(k) = f(-k)
    cells, size, found = np.stack((x.ravel(), y.ravel()), axis=1), 1.0 / FIRST, np.inf
    for _ in range(MOST_HALVINGS):
        values, bounds = symbol.over(cells, size)
        found = min(found, float(values.min()))
        poor = bounds < found - TOLERANCE
        if not poor.any():
            return found - TOLERANCE - LOST
        size /= 2.0
        cells = (cells[poor][:, None] + size * QUARTERS).reshape(-1, 2)
    return -np.inf


@dataclass(frozen=True)
class _Symbol:
    """The terms of f that are not omitted."""

    alpha: float
    area: float  # V
    dual: Array  # (2, 2) rows g1 and g2, with b_m g_n = 2 pi where m = n, else 0
    sites: Array  # (m, 2) d
    distances: Array  # (m,) |d|
    images: Array  # (n, 2) G

    @classmethod
    def of(cls, basis: Array) -> _Symbol:
        """The terms for an alpha with which both sums have about the same number of terms."""
        area = abs(float(np.linalg.det(basis)))
        alpha = float(np.sqrt(np.pi / area))
        dual = np.asarray(2.0 * np.pi * np.linalg.inv(basis).T, dtype=np.float64)
        sites = _points(basis, 1.0 + REACH / alpha)
        distances = np.hypot(*sites.T)
        images = _points(dual, 2.0 * REACH * alpha)
        return cls(alpha, area, dual, sites[distances > 0], distances[distances > 0], images)

    def over(self, cells: Array, size: float) -> tuple[Array, Array]:
        """(m,) f in the middles c of parts of the dual lattice, and lower bounds on f in each part.

        The middles are `cells` (m, 2), and the sides of parts `size`, in units of g1 and g2. Each
        bound is the larger of two bounds. All points of a part are within rho of c, and no second
        derivative of f is below -bend there. So f(c) - |grad f(c)| rho - bend rho^2 / 2 is a bound.
        For the other bound, each cosine is replaced by -1, and each |k + G| by an upper bound,
        because E decreases.
        """
        g1, g2 = self.dual
        rho = size / 2.0 * max(np.hypot(*(g1 + g2)), np.hypot(*(g1 - g2)))
        own = 2.0 * self.alpha / np.sqrt(np.pi)
        weights = scipy.special.erfc(self.alpha * self.distances) / self.distances
        waves = cells @ self.dual
        phases = waves @ self.sites.T
        away = waves[:, None] + self.images
        q = np.hypot(away[..., 0], away[..., 1])
        far, fall = self._image(q)
        values = np.cos(phases) @ weights + far.sum(axis=1) - own
        slopes = np.sin(phases) @ (weights[:, None] * self.sites)
        slopes += ((fall / q)[..., None] * away).sum(axis=1)
        near = np.maximum(q - rho, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            bend = (self._image(near)[1] / near).sum(axis=1) + weights @ self.distances**2
        taylor = values - np.hypot(*slopes.T) * rho - bend * rho**2 / 2.0
        falling = self._image(q + rho)[0].sum(axis=1) - weights.sum() - own
        return values, np.fmax(taylor, falling)

    def _image(self, q: Array) -> tuple[Array, Array]:
        """(2 pi / V) E(q), and minus the derivative of this with respect to q."""
        share, x = 2.0 * np.pi / self.area, q / (2.0 * self.alpha)
        value = share * scipy.special.erfc(x) / q
        gauss = share / (np.sqrt(np.pi) * self.alpha) * np.exp(-x * x)
        return value, (value + gauss) / q


def _points(basis: Array, radius: float) -> Array:
    """The points i b1 + j b2 (n, 2) within this radius of 0."""
    most = (int(np.ceil(radius * float(np.hypot(*each)))) for each in np.linalg.inv(basis).T)
    i, j = (np.arange(-n, n + 1) for n in most)
    points = np.stack(np.meshgrid(i, j, indexing="ij"), axis=-1).reshape(-1, 2) @ basis
    return np.asarray(points[np.hypot(*points.T) <= radius * (1.0 + 1e-9)])
