"""How negative the coupling of the points of a lattice can be.

docs/theory/operators-lattice.md, "The symbol". Loads v on some sites of a lattice have
sum_{i != j} v_i v_j / r_ij >= min f  sum v_i^2,  with the symbol f(k) of all sites, k a wave vector
(sigma(q) on that page). Split at any alpha (Ewald), with E(q) = erfc(q / 2 alpha) / q,

    f(k) = sum_d cos(k d) erfc(alpha |d|) / |d| + (2 pi / V) sum_G E(|k + G|) - 2 alpha / sqrt(pi)

over all d but 0 of the lattice, with cells of area V, and all G of its dual. Terms of the second
sum that are left out are positive.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from convexrough.arrays import Array

#: How far the bound may be below the least value found: what is lost of it, for speed.
TOLERANCE = 1e-3

#: Lattices whose cells are longer than this many of their shortest vectors are given up: they take
#: many terms.
LONGEST = 50.0

#: alpha |d| from which erfc is left out, 3e-17 of it; the same of the dual, where that is allowed.
REACH = 6.0

#: What the terms left out and the rounding of some hundred terms below 10 can amount to.
LOST = 1e-9

#: Cells along each direction of the dual that are looked at first, and halvings of them at most.
FIRST, MOST_HALVINGS = 8, 12

#: From the middle of a cell to those of its quarters, in sizes of these.
QUARTERS = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) / 2.0


def least_symbol(basis: Array) -> float:
    """No more than the least of f, for a reduced basis (2, 2) whose shorter vector has length 1.

    Cells of the dual are halved until the bound on f in all of them is within the tolerance of the
    least value found. -inf where the cells of the lattice are too long.
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
    """The terms of f that count."""

    alpha: float
    area: float  # V
    dual: Array  # (2, 2) rows g1 and g2, with b_m g_n = 2 pi where m = n, else 0
    sites: Array  # (m, 2) d
    distances: Array  # (m,) |d|
    images: Array  # (n, 2) G

    @classmethod
    def of(cls, basis: Array) -> _Symbol:
        """With the alpha that both sums need about as many terms for."""
        area = abs(float(np.linalg.det(basis)))
        alpha = float(np.sqrt(np.pi / area))
        dual = np.asarray(2.0 * np.pi * np.linalg.inv(basis).T, dtype=np.float64)
        sites = _points(basis, 1.0 + REACH / alpha)
        distances = np.hypot(*sites.T)
        images = _points(dual, 2.0 * REACH * alpha)
        return cls(alpha, area, dual, sites[distances > 0], distances[distances > 0], images)

    def over(self, cells: Array, size: float) -> tuple[Array, Array]:
        """(m,) f in the middle of some cells of the dual, and lower bounds on it in all of each.

        f(c) - |grad f(c)| rho - bend rho^2 / 2  within rho of c, where no second derivative is
        below -bend; or the first sum at its least, and E where it is: it falls.

        cells : (m, 2) middles, in parts of g1 and g2;  size : of each, in these parts
        """
        from scipy.special import erfc

        rho = size / 2.0 * max(np.hypot(*(self.dual[0] + self.dual[1])),
                               np.hypot(*(self.dual[0] - self.dual[1])))  # fmt: skip
        own = 2.0 * self.alpha / np.sqrt(np.pi)
        weights = erfc(self.alpha * self.distances) / self.distances
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
        """(2 pi / V) E(q), and how fast it falls."""
        from scipy.special import erfc

        share, x = 2.0 * np.pi / self.area, q / (2.0 * self.alpha)
        value = share * erfc(x) / q
        gauss = share / (np.sqrt(np.pi) * self.alpha) * np.exp(-x * x)
        return value, (value + gauss) / q


def _points(basis: Array, radius: float) -> Array:
    """(n, 2) all points i b1 + j b2 no further from 0 than this, and some more."""
    i, j = (np.arange(-n, n + 1) for n in _counts(basis, radius))
    points = np.stack(np.meshgrid(i, j, indexing="ij"), axis=-1).reshape(-1, 2) @ basis
    return np.asarray(points[np.hypot(*points.T) <= radius * (1.0 + 1e-9)])


def _counts(basis: Array, radius: float) -> list[int]:
    """How many times b1 and b2 a point within the radius can be away, at most."""
    columns = np.linalg.inv(basis).T
    return [int(np.ceil(radius * float(np.hypot(*column)))) for column in columns]
