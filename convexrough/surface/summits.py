"""Summits of a map as asperities: paraboloids fitted about maxima, and data on the search."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import InputError
from convexrough.plottable import Plottable
from convexrough.record import Along, Record, Table
from convexrough.scene.asperities import Asperities
from convexrough.sphere import ellipse
from convexrough.surface.detrend import Removed
from convexrough.surface.pixels import Moments, centres

#: A maximum is a ridge, without a top, if the product of the fitted principal curvatures is at most
#: this part of their squared sum; on maps of coarse steps it may be 0, and positive by rounding.
RIDGE = 1e-9


@dataclass(frozen=True, repr=False)
class Origin(Record):
    """The map of some summits, and the settings and counts of the search for them.

    source, pixel, unit, removed, filled : as in `Surface`
    shape      : (ny, nx) numbers of pixels
    level      : [length] mean height of the map;  max_height : [length] Sz of the map
    checksum   : CRC-32 of the heights, to distinguish maps
    moments    : spectral moments of the map
    prune      : least prominence of the hills that are left, as a fraction of Sz
    fit        : number of pixels along a side of the square to which each paraboloid is fitted
    maxima     : number of pixels higher than their eight neighbours
    pruned     : number of these maxima whose hills were merged into taller ones
    at_edge    : number of maxima omitted because they are too near to the edge of the map
    without_top : number of maxima omitted because their paraboloid has no top in its square

    `Summits.pruned` updates `pruned`, but neither `at_edge` nor `without_top`.

    >>> cr.surface.self_affine(0.8, 0.1, 32.0, seed=1).summits().origin.maxima
    328
    """

    source: str
    shape: tuple[int, int]
    pixel: tuple[float, float]
    unit: str
    removed: tuple[Removed, ...]
    filled: int
    level: float
    checksum: int
    max_height: float
    moments: Moments
    prune: float
    fit: int
    maxima: int
    pruned: int
    at_edge: int
    without_top: int

    @property
    def threshold(self) -> float:
        """[length] the least prominence of the hills that are left."""
        return self.prune * self.max_height

    @property
    def area(self) -> float:
        """[length^2] area of the map without the margin in which no paraboloid can be fitted."""
        rows, columns = self.shape
        margin = 2 * (self.fit // 2)
        return (rows - margin) * self.pixel[1] * (columns - margin) * self.pixel[0]


class Statistics(NamedTuple):
    """Statistics of summits, with the names and units of `Moments`."""

    density: float
    mean_curvature: float
    mean_height: float
    height_std: float


@dataclass(frozen=True, eq=False, repr=False)
class Summits(Table, Asperities, Plottable):
    """The summits of a map as asperities, in descending order of the heights of their maxima.

    positions, heights : [length] (n, 2) positions and (n,) heights of tops of fitted paraboloids
    tip_radii   : (n,) [length] 1 / sqrt(k1 k2), with the principal curvatures k1 and k2 of the
        paraboloid
    prominences : (n,) [length] height of the maximum above the highest pass to a taller maximum;
        for the tallest maximum, above the lowest pixel
    largest_curvatures, smallest_curvatures : (n,) [1/length] principal curvatures k1 and k2
    deviations  : (n,) [length] root-mean-square distance of the pixels from the sphere of the tip
    pixels      : (n, 2) row and column of the maximum
    origin      : the map, and the numbers of omitted maxima

    >>> summits = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1).summits()
    >>> scene = cr.Scene(1e4, summits, cr.Material(1.0, 0.3))
    >>> cr.press(scene, load=10.0).certificate.scope
    'global'
    """

    _along: ClassVar[Along] = {
        ("asperity",): (
            "x", "y", "heights", "tip_radii", "prominences", "largest_curvatures",
            "smallest_curvatures", "eccentricities", "elliptic_loads", "deviations",
        ),
    }  # fmt: skip

    prominences: Array
    largest_curvatures: Array
    smallest_curvatures: Array
    deviations: Array
    pixels: Indices
    origin: Origin

    def __init__(
        self,
        positions: ArrayLike,
        tip_radii: ArrayLike,
        heights: ArrayLike,
        *,
        origin: Origin,
        **own: NDArray[Any],
    ) -> None:
        super().__init__(positions, tip_radii, heights)
        columns = {name: frozen(np.array(values)) for name, values in own.items()}
        self.__dict__.update(columns, origin=origin)

    @property
    def x(self) -> Array:
        """(n,) [length] x of the tops."""
        return self.positions[:, 0]

    @property
    def y(self) -> Array:
        """(n,) [length] y of the tops."""
        return self.positions[:, 1]

    @property
    def eccentricities(self) -> Array:
        """(n,) sqrt(1 - k2 / k1), which is 0 for a sphere and nearly 1 for a ridge."""
        return frozen(np.sqrt(1 - self.smallest_curvatures / self.largest_curvatures))

    @property
    def elliptic_loads(self) -> Array:
        """(n,) load of the elliptic tip divided by that of the sphere, at the same indentation."""
        ratios = ellipse.load_ratio(self.largest_curvatures / self.smallest_curvatures)
        return frozen(np.maximum(ratios, 1.0))  # exactly 1 for a sphere, in spite of rounding

    @property
    def statistics(self) -> Statistics:
        """Statistics of the summits, to be compared with those of `origin.moments`."""
        return Statistics(
            density=len(self) / self.origin.area,
            mean_curvature=float(np.mean(self.largest_curvatures + self.smallest_curvatures) / 2),
            mean_height=float(self.heights.mean()) - self.origin.level,
            height_std=float(self.heights.std()),
        )

    @property
    def unit(self) -> str:
        """The unit of all lengths; "" if unknown."""
        return self.origin.unit

    def _attributes(self) -> dict[str, Any]:
        return {"unit": self.unit}

    def pruned(self, prune: float) -> Summits:
        """The summits that are left at a stronger pruning.

        prune : least prominence, as a fraction of Sz

        Raises InputError for a weaker pruning, or if no summit is left.

        >>> summits = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1).summits(0.05)
        >>> len(summits), len(summits.pruned(0.3))
        (129, 16)
        """
        prune = checks.between("prune", prune, self.origin.prune, 1.0)
        keep = self.prominences >= prune * self.origin.max_height
        more = self.origin.pruned + int(np.count_nonzero(~keep))
        origin = replace(self.origin, prune=prune, pruned=more)
        if not keep.any():
            found = f"none of {origin.maxima:,} maxima is left"
            raise InputError("summits", found=found, expected="at least one: prune less")
        columns = self.__getstate__()
        del columns["origin"], columns["layout"]
        return Summits(**{name: values[keep] for name, values in columns.items()}, origin=origin)


def fit_tips(
    heights: Array, pixels: Indices, pixel: tuple[float, float], across: int
) -> tuple[NDArray[np.bool_], dict[str, Array]]:
    """Least-squares paraboloids over `across` by `across` pixels about each maximum in `pixels`,
    rows and columns (n, 2) that are at least across // 2 from the edges of the map.

    Returns a mask (n,), True for those with a top in these pixels, and their columns of `Summits`.
    """
    reach = across // 2
    down, right = (each.ravel() for each in np.mgrid[-reach : reach + 1, -reach : reach + 1])
    u, v = right.astype(np.float64), down.astype(np.float64)  # in pixels, so terms are about 1
    terms = np.column_stack((np.ones(len(u)), u, v, u * u / 2, u * v, v * v / 2))
    around = heights[pixels[:, :1] + down, pixels[:, 1:] + right]
    fitted = np.linalg.pinv(terms) @ around.T
    _, gu, gv, huu, huv, hvv = fitted
    determinant = huu * hvv - huv**2
    round_top = determinant > RIDGE * (huu + hvv) ** 2
    solid = np.where(round_top, determinant, np.inf)
    top = np.stack(((huv * gv - hvv * gu) / solid, (huv * gu - huu * gv) / solid))
    whole = round_top & (huu < 0) & (np.abs(top) <= reach).all(axis=0)

    z0, gu, gv, huu, huv, hvv = fitted[:, whole]
    (u0, v0), (dx, dy) = top[:, whole], pixel
    hxx, hxy, hyy = huu / dx**2, huv / (dx * dy), hvv / dy**2
    middle, half = -(hxx + hyy) / 2, np.hypot((hxx - hyy) / 2, hxy)
    product = determinant[whole] / (dx * dy) ** 2
    larger = middle + half
    smaller = np.minimum(product / larger, larger)  # avoids cancellation
    summits = z0 + (gu * u0 + gv * v0) / 2
    x, y = (right - u0[:, None]) * dx, (down - v0[:, None]) * dy
    sphere = summits[:, None] - np.sqrt(product)[:, None] * (x * x + y * y) / 2
    (column_x, row_y), (row, column) = centres(heights.shape, pixel), pixels[whole].T
    return whole, {
        "positions": np.stack((column_x[column] + u0 * dx, row_y[row] + v0 * dy), 1),
        "tip_radii": 1 / np.sqrt(larger * smaller),
        "heights": summits,
        "largest_curvatures": larger,
        "smallest_curvatures": smaller,
        "deviations": np.sqrt(np.mean((around[whole] - sphere) ** 2, axis=1)),
    }
