"""`Surface`: heights over a grid of pixels, and the forms that were removed from them."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import InputError
from convexrough.plottable import Plottable
from convexrough.record import Record
from convexrough.surface import pixels
from convexrough.surface.detrend import TRENDS, Removed, Trend, fitted
from convexrough.surface.summits import Origin, Summits, fit_tips
from convexrough.tabular.units import known_unit

#: Largest ratio of the sides of a pixel; longer pixels do not resolve summits.
MOST_ASPECT = 10.0

#: A form, fitted to at most FITTED pixels along a side, causes a warning if it explains more than
#: the fraction MOST of the variance of heights.
MOST, FITTED = 0.5, 256

#: Smallest and largest rms slopes without a warning. Lapped steel has about 1e-2, polished wafers
#: have 1e-3 to 1e-4.
FLAT, STEEP = 3e-4, 1.0

#: Differences of heights below this part of the largest height are rounding errors.
ROUNDING = 64 * np.finfo(float).eps


@dataclass(frozen=True, eq=False, repr=False)
class Surface(Record, Plottable):
    """Heights over a grid of pixels; the middle of the grid is the origin.

    heights : (ny, nx) [length] heights, positive upwards; x grows with the column, y with the row
    pixel   : (dx, dy) [length], or one number for squares
    unit    : unit of all lengths, "" if unknown
    removed : forms subtracted from the heights, in this order
    filled_pixels : (ny, nx) True for pixels that were holes; None if there were none
    source  : the file, or a description
    comments : comments of the file that were not used
    flaws   : warnings about heights that look wrong; default: those found in `heights`

    Raises InputError for maps that are constant or have holes, for pixels with one side more than
    ten times the other, and for a unit that is neither "" nor a unit of length such as "mm" or
    "µm".

    >>> surface = cr.surface.Surface(np.random.default_rng(1).normal(size=(64, 64)), pixel=0.5)
    >>> surface.size
    (32.0, 32.0)
    """

    heights: Array
    pixel: tuple[float, float]
    unit: str
    removed: tuple[Removed, ...]
    filled_pixels: NDArray[np.bool_] | None
    source: str
    comments: tuple[str, ...]
    flaws: tuple[str, ...] = field(repr=False)  # `warnings` has them, too

    def __init__(
        self,
        heights: ArrayLike,
        pixel: float | tuple[float, float],
        unit: str = "",
        removed: tuple[Removed, ...] = (),
        filled_pixels: NDArray[np.bool_] | None = None,
        source: str = "",
        comments: tuple[str, ...] = (),
        flaws: tuple[str, ...] | None = None,
    ) -> None:
        grid, size = _checked(heights), checked_pixel(pixel)
        if not isinstance(unit, str):
            raise InputError("unit", found=repr(unit)[:60], expected='a name, such as "µm", or ""')
        named = known_unit("unit", unit)
        if filled_pixels is not None:
            filled_pixels = frozen(np.array(filled_pixels))
            if filled_pixels.dtype.kind != "b" or filled_pixels.shape != grid.shape:
                found = f"an array of {filled_pixels.dtype}, of shape {filled_pixels.shape}"
                expected = f"True or False for each height, of shape {grid.shape}"
                raise InputError("filled_pixels", found=found, expected=expected)
        self.__dict__.update(
            heights=grid,
            pixel=size,
            unit=named.name if named else "",
            removed=removed,
            filled_pixels=filled_pixels,
            source=source,
            comments=comments,
        )
        self.__dict__["flaws"] = tuple(pixels.flaws(self._measured)) if flaws is None else flaws

    @property
    def filled(self) -> int:
        """The number of pixels that were holes."""
        return 0 if self.filled_pixels is None else int(np.count_nonzero(self.filled_pixels))

    @property
    def _measured(self) -> Array:
        """(ny, nx) the heights, nan where they were not measured."""
        if self.filled_pixels is None:
            return self.heights
        return np.where(self.filled_pixels, np.nan, self.heights)

    @property
    def size(self) -> tuple[float, float]:
        """[length] size of the map along x and y."""
        rows, columns = self.heights.shape
        return columns * self.pixel[0], rows * self.pixel[1]

    @property
    def max_height(self) -> float:
        """[length] Sz of ISO 25178-2: height of the highest pixel above the lowest."""
        return float(np.ptp(self.heights))

    @property
    def rms_height(self) -> float:
        """[length] Sq of ISO 25178-2: root mean square of the heights, measured from the mean."""
        return float(np.std(self.heights))

    @property
    def rms_slope(self) -> float:
        """Root mean square of the slope |grad z|, from differences of neighbours."""
        return float(np.sqrt(2 * self.moments.m2))

    @cached_property
    def moments(self) -> pixels.Moments:
        """Spectral moments, and statistics of summits that follow from them."""
        return pixels.moments_of(self.heights, self.pixel)

    @cached_property
    def hills(self) -> tuple[Indices, Array]:
        """(n, 2) row and column of all maxima, the tallest first, and (n,) [length] prominences."""
        return pixels.hills(self.heights)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Warnings: of a form that explains most of the variance, and of pixels that look wrong.

        Forms are fitted to at most 256 by 256 of the pixels.

        >>> ball = np.sqrt(50.0**2 - np.square(np.mgrid[-8:9, -8:9]).sum(axis=0))
        >>> rough = ball + np.random.default_rng(1).normal(size=(17, 17)) * 1e-3
        >>> print(cr.surface.Surface(rough, pixel=1.0).warnings[0].partition(",")[0])
        a sphere of radius 49.9828
        """
        return tuple(self._doubts())

    def _doubts(self) -> Iterator[str]:
        down, across = (-(-length // FITTED) for length in self.heights.shape)
        few = self._measured[::down, ::across]
        pixel = self.pixel[0] * across, self.pixel[1] * down
        left = whole = float(np.nanvar(few)) if np.isfinite(few).any() else 0.0
        found = ""
        for kind in TRENDS if min(few.shape) >= 3 else ():
            try:
                trend, there = fitted(few, pixel, kind)
            except InputError:  # no sphere covers the map, or too few pixels are measured
                continue
            if (least := float(np.nanvar(few - there))) < (1.0 - MOST) * left:
                name, left = f"a {trend!r}".partition(" in the")[0], least
                found = f"{name}, explains {100 * (1.0 - left / whole):.3g} % of the variance of "
                found += f'the heights: detrend="{kind}", or --detrend {kind}, removes it'
        if found:
            yield found
        if (part := self.filled / self.heights.size) > 0.5:
            yield f"{part:.0%} of the pixels were holes: most of this map is not measured"
        yield from self.flaws
        if not FLAT <= self.rms_slope <= STEEP:
            rare = f"steeper than {STEEP:g}" if self.rms_slope > STEEP else f"flatter than {FLAT:g}"
            yield (
                f"rms slope {self.rms_slope:.3g}: surfaces {rare} are rare; check the units of the "
                "heights and of the pixel"
            )
        if len(places := pixels.spikes(self._measured)):
            row, column = places[0] + 1
            yield (
                f"spikes or drop-outs: {len(places):,} pixels far from their neighbours, the first "
                f"in row {row}, column {column}; make them nan and use fill=True, or --fill"
            )

    def detrend(self, kind: Trend = "plane") -> Surface:
        """The surface minus its best-fitting plane, sphere or paraboloid; `removed` describes it.

        The form is fitted to measured pixels. Pixels that were holes are filled again.

        Raises InputError if only rounding errors are left of the heights, or if the measured pixels
        do not determine the form.

        >>> ball = cr.surface.Surface(-np.hypot(*np.mgrid[-8:9, -8:9]) ** 2 / 200, pixel=1.0)
        >>> print(ball.detrend("plane").detrend("sphere").removed[1].kind)
        sphere
        """
        if kind not in TRENDS:
            expected = '"plane", "sphere" or "paraboloid"; in `read` also None'
            raise InputError("detrend", found=repr(kind), expected=expected)
        trend, there = fitted(self._measured, self.pixel, kind)
        left = pixels.filled(self.heights - there)
        if np.ptp(left) <= ROUNDING * float(np.abs(self.heights).max()):
            raise InputError("heights", found=f"nothing but a {kind}", expected="a rough surface")
        return replace(self, heights=left, removed=(*self.removed, trend))

    def to_unit(self, unit: str) -> Surface:
        """The same surface with all lengths in another unit, such as "nm" or "mm".

        Raises InputError if the unit of this surface is unknown.

        >>> scan = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, unit="µm")
        >>> print(f"{scan.to_unit('mm').size[0]:g}")
        0.256
        """
        own, into = known_unit("unit", self.unit), known_unit("unit", unit)
        if own is None or into is None:
            found = "a map without unit" if own is None else repr(unit)
            raise InputError("unit", found=found, expected="units of length")
        scale = own.into(into)
        removed = tuple(each.scaled(scale) for each in self.removed)
        heights, pixel = self.heights * scale, (self.pixel[0] * scale, self.pixel[1] * scale)
        return replace(self, heights=heights, pixel=pixel, unit=into.name, removed=removed)

    @property
    def checksum(self) -> int:
        """CRC-32 of the heights."""
        return zlib.crc32(np.ascontiguousarray(self.heights).tobytes())

    def summits(self, prune: float = 0.05, fit: int = 3) -> Summits:
        """The summits of the map as asperities, in descending order of the heights of their maxima.

        prune : hills with a prominence below this fraction of `max_height` are merged into others
            (Wolf pruning, ISO 25178-2)
        fit   : odd number of pixels along a side of the square, about each maximum, to which a
            paraboloid is fitted

        Maxima are omitted if their square does not lie in the map, or if their paraboloid has no
        top in the square; `origin` has the number of each.

        Raises InputError for maps smaller than the square, or if no summit is left.

        >>> summits = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1).summits(prune=0.05)
        >>> len(summits), summits.origin.pruned
        (129, 191)
        """
        prune = checks.between("prune", prune, 0.0, 1.0)
        checks.whole("fit", fit, 3)
        rows, width = shape = self.heights.shape[0], self.heights.shape[1]
        if fit % 2 == 0:
            raise InputError("fit", found=fit, expected="an odd number of pixels, at least 3")
        if min(shape) < fit:
            expected = f"at least {fit} by {fit}, as fit is {fit}"
            raise InputError("map", found=f"{width} by {rows} pixels", expected=expected)
        (maxima, prominences), reach = self.hills, fit // 2
        prominent = prominences >= prune * self.max_height
        inside = ((maxima >= reach) & (maxima < (rows - reach, width - reach))).all(axis=1)
        tried = maxima[prominent & inside]
        whole, columns = fit_tips(self.heights, tried, self.pixel, fit)
        same = ("source", "pixel", "unit", "removed", "filled", "checksum", "max_height", "moments")
        origin = Origin(
            **{name: getattr(self, name) for name in same},
            shape=shape,
            level=float(self.heights.mean()),
            prune=prune,
            fit=int(fit),
            maxima=len(maxima),
            pruned=int(np.count_nonzero(~prominent)),
            at_edge=int(np.count_nonzero(prominent & ~inside)),
            without_top=int(np.count_nonzero(~whole)),
        )
        if not whole.any():
            none = (
                f"none of {origin.maxima:,} maxima: {origin.pruned:,} pruned, {origin.at_edge:,} "
                f"at the edge, {origin.without_top:,} without a fitted maximum"
            )
            expected = "; ".join(("at least one", *self.warnings[:1]))
            raise InputError("summits", found=none, expected=expected)
        prominences = prominences[prominent & inside][whole]
        return Summits(prominences=prominences, pixels=tried[whole], origin=origin, **columns)


def checked_pixel(pixel: ArrayLike) -> tuple[float, float]:
    """The sizes (dx, dy) of a pixel. Raises InputError if they are not valid."""
    both: Any = pixel if np.ndim(pixel) else (pixel, pixel)
    if len(both) != 2:
        raise InputError("pixel", found=f"{np.size(both)} numbers", expected="one or two")
    dx, dy = (checks.positive("pixel", each) for each in both)
    if max(dx, dy) > MOST_ASPECT * min(dx, dy):
        found = f"{dx:g} by {dy:g}"
        raise InputError("pixel", found=found, expected=f"sides at most 1 to {MOST_ASPECT:g}")
    return dx, dy


def _checked(heights: ArrayLike) -> Array:
    grid = checks.numbers("heights", heights)
    if grid.ndim != 2 or min(grid.shape) < 3:
        expected = "rows and columns, at least 3 of each"
        raise InputError("heights", found=f"shape {grid.shape}", expected=expected)
    if holes := np.count_nonzero(np.isnan(grid)):
        found = f"{holes:,} holes (nan) in {grid.size:,} pixels"
        raise InputError("heights", found=found, expected="none: `read` can fill them")
    if not (good := np.abs(grid) <= checks.LARGEST).all():
        row, column = np.argwhere(~good)[0]
        found = f"{grid[row, column]} in row {row + 1}, column {column + 1}"
        raise InputError("heights", found=found, expected="finite numbers")
    if np.ptp(grid) <= ROUNDING * float(np.abs(grid).max()):
        raise InputError("heights", found=f"{grid[0, 0]:g} everywhere", expected="a rough surface")
    return frozen(grid)
