"""Positions, heights and tip radii of the asperities."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.record import Record
from convexrough.scene.lattice import Lattice
from convexrough.scene.layout import HEXAGONAL, SQUARE, Layout

#: Random heights and logarithms of radii are normally distributed. They are clipped at this many
#: standard deviations, so that only finitely many asperities of an unbounded array can touch.
CUT_DEVIATIONS = 6.0

#: The last layouts of at most about this many points are kept, with what they store.
FEW = 300
_kept_layout = lru_cache(maxsize=8)(Layout.of)


@dataclass(frozen=True, eq=False, repr=False)
class Asperities(Record):
    """Spherical asperities on a half-space, in the order of the given positions.

    positions : (n, 2) [length] x and y of the summits; the axis of the pressed body is at (0, 0)
    tip_radii : (n,) [length] radii of the tips, or one number for all
    heights   : (n,) [length] heights of the summits, or one number for all; positive is taller

    Raises InputError for wrong shapes or values, and for two asperities at one place.

    >>> asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    >>> len(asperities)
    61
    """

    positions: Array
    tip_radii: Array
    heights: Array
    #: The positions, with data that depend only on them.
    layout: Layout = field(init=False, repr=False)

    def __init__(
        self, positions: ArrayLike, tip_radii: ArrayLike, heights: ArrayLike = 0.0
    ) -> None:
        points = _points(positions)
        checks.same_index(positions=positions, tip_radii=tip_radii, heights=heights)
        if hasattr(positions, "iloc"):  # any index will do, as it is that of all
            tip_radii, heights = (
                np.asarray(each) if hasattr(each, "iloc") else each for each in (tip_radii, heights)
            )
        self._set(Layout(points), tip_radii, heights)

    def _set(self, layout: Layout, tip_radii: ArrayLike, heights: ArrayLike) -> None:
        n, least = len(layout.points), checks.SMALLEST
        radii = checks.array("tip_radii", tip_radii, length=n, sign="positive", smallest=least)
        tall = checks.array("heights", heights, length=n, smallest=least)
        self.__dict__.update(positions=layout.points, tip_radii=radii, heights=tall, layout=layout)

    def with_tips(self, tip_radii: ArrayLike, heights: ArrayLike = 0.0) -> Asperities:
        """Asperities with other tips at the same positions; arguments as for `Asperities`.

        The new asperities share all data that depend only on the positions, such as distances.
        Raises InputError for values that are not valid.

        >>> array = scene.asperities
        >>> rougher = array.with_tips(0.02, heights=1e-6 * np.sin(np.arange(61)))
        >>> rougher.positions is array.positions
        True
        """
        return self._on(self.layout, tip_radii, heights)

    def roughened(
        self, *, height_std: float = 0.0, tip_radius_cv: float = 0.0, seed: int | None = None
    ) -> Asperities:
        """These asperities with random changes of heights and tip radii.

        Random numbers are added to the heights, and the tip radii are multiplied by random factors
        of mean 1. The arguments are those of `hexagonal`. The random numbers depend only on the
        seed: a second change with the same seed adds the same numbers again. Raises InputError for
        bad values, and if heights or tip radii are changed without a seed.

        >>> regular = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
        >>> rough = [regular.roughened(height_std=1e-6, seed=seed) for seed in range(3)]
        >>> print([f"{asperities.heights[0]:.1e}" for asperities in rough])
        ['1.3e-07', '3.5e-07', '1.9e-07']
        """
        height_std = checks.non_negative("height_std", height_std)
        tip_radius_cv = checks.variation("tip_radius_cv", tip_radius_cv)
        if height_std == 0 and tip_radius_cv == 0:
            return self
        n, seed, heights, radii = len(self), checked_seed(seed), self.heights, self.tip_radii
        if height_std > 0:
            heights = heights + height_std * cut_normal(n, seed, stream=0)
        if tip_radius_cv > 0:
            width = np.sqrt(np.log1p(tip_radius_cv**2))
            radii = radii * np.exp(width * cut_normal(n, seed, stream=1) - width**2 / 2)
        return self.with_tips(radii, heights)

    @staticmethod
    def _on(layout: Layout, tip_radii: ArrayLike, heights: ArrayLike) -> Asperities:
        asperities = object.__new__(Asperities)
        asperities._set(layout, tip_radii, heights)
        return asperities

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def lattice(self) -> Lattice | None:
        """The lattice on which all summits lie; None if there is no such lattice.

        >>> scene.asperities.lattice.spacing
        0.0025
        """
        return self.layout.lattice

    @property
    def distances(self) -> Array:
        """(n,) [length] distance of each summit from the axis."""
        return self.layout.distances

    @classmethod
    def hexagonal(
        cls,
        *,
        spacing: float,
        tip_radius: ArrayLike,
        within: float,
        height_std: float = 0.0,
        tip_radius_cv: float = 0.0,
        seed: int | None = None,
    ) -> Asperities:
        """Asperities on a hexagonal lattice (six nearest neighbours), with one on the axis.

        spacing       : [length] distance of nearest neighbours
        tip_radius    : [length] a number, or one per asperity in the order of the result
        within        : [length] largest distance of asperities from the axis
        height_std    : [length] standard deviation of heights, which are normal random numbers
        tip_radius_cv : coefficient of variation of tip radii, which are lognormal random numbers
            with the mean `tip_radius`
        seed          : whole number that fixes the random numbers; required if heights or tip radii
            are random

        Random heights, and logarithms of random tip radii, are clipped at 6 standard deviations.
        Asperities are ordered by distance from the axis, then by angle. A larger `within` appends
        asperities; the others keep their random heights and random tip radii. If there are more
        than 5000 asperities, the spacing is changed by less than 1e-11 of it, so that coordinates
        are exact.

        Raises InputError for bad values, and for more asperities than fit in memory.
        """
        regular = cls._lattice(HEXAGONAL, spacing, tip_radius, within)
        return regular.roughened(height_std=height_std, tip_radius_cv=tip_radius_cv, seed=seed)

    @classmethod
    def square(
        cls,
        *,
        spacing: float,
        tip_radius: ArrayLike,
        within: float,
        height_std: float = 0.0,
        tip_radius_cv: float = 0.0,
        seed: int | None = None,
    ) -> Asperities:
        """Asperities on a square lattice, with one on the axis; arguments as for `hexagonal`.

        >>> cr.Asperities.square(spacing=0.5, tip_radius=5.0, within=0.5).positions.tolist()
        [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [-0.5, 0.0], [0.0, -0.5]]
        """
        regular = cls._lattice(SQUARE, spacing, tip_radius, within)
        return regular.roughened(height_std=height_std, tip_radius_cv=tip_radius_cv, seed=seed)

    @classmethod
    def _lattice(
        cls, second: tuple[float, float], spacing: float, tip_radius: ArrayLike, within: float
    ) -> Asperities:
        spacing = checks.positive("spacing", spacing)
        within = checks.non_negative("within", within)
        ratio = within / spacing
        count = np.pi / second[1] * ratio**2 + 1
        checks.fits_in_memory(f"within / spacing = {ratio:.3g}", count, 300)
        make = _kept_layout if count <= FEW else Layout.of
        layout = make(second, spacing, ratio**2 * (1 + 1e-12))
        n = len(layout.points)
        radii = checks.array("tip_radius", tip_radius, length=n, sign="positive")
        return cls._on(layout, radii, 0.0)


def largest_tip_radius(tip_radius: ArrayLike, tip_radius_cv: float) -> float:
    """[length] the largest random tip radius that `hexagonal` and `square` can produce."""
    width = np.sqrt(np.log1p(tip_radius_cv**2))
    return float(np.max(tip_radius) * np.exp(CUT_DEVIATIONS * width - width**2 / 2))


def checked_seed(seed: int | None) -> int:
    if not isinstance(seed, (int, np.integer)) or isinstance(seed, bool) or seed < 0:
        expected = "a whole number that is not negative, as heights or tip radii are random"
        raise InputError("seed", found=seed, expected=expected)
    return int(seed)


def cut_normal(count: int, seed: int, *, stream: int) -> Array:
    """(count,) clipped standard normal numbers. Different streams are independent."""
    numbers = np.random.default_rng([seed, stream]).standard_normal(count)
    return np.clip(numbers, -CUT_DEVIATIONS, CUT_DEVIATIONS)


def _points(positions: ArrayLike) -> Array:
    names = getattr(positions, "columns", ())  # of a data frame
    if any(isinstance(name, str) for name in names):
        bare = [re.split(r"[\s\[(]", str(name).strip().lower())[0] for name in names]
        if bare != ["x", "y"]:
            found = f"columns {', '.join(map(str, names))}"
            raise InputError("positions", found=found, expected="columns x, y, or an array")
    points = checks.numbers("positions", positions)
    if points.size == 0:
        raise InputError("positions", found="no asperity", expected="at least one")
    if points.ndim != 2 or points.shape[1] != 2:
        found = f"shape {points.shape}"
        raise InputError("positions", found=found, expected="shape (n, 2): x and y of each")
    if not (good := (np.abs(points) <= checks.LARGEST).all(axis=1)).all():
        first = int(np.argmin(good))
        expected = f"numbers of size at most {checks.LARGEST:g}"
        raise InputError(f"positions[{first}]", found=str(points[first]), expected=expected)
    points.flags.writeable = False
    return points
