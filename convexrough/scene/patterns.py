"""Sites of regular patterns, and random numbers that do not change when sites are added."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.errors import InputError

#: Random heights and logarithms of radii are normally distributed. They are clipped at this many
#: standard deviations, so that only finitely many asperities can touch.
CUT_DEVIATIONS = 6.0


@dataclass(frozen=True)
class Pattern:
    """The sites i b1 + j b2 of a lattice with the spacing 1.

    skew   : coefficient in the norm of a site, |i b1 + j b2|^2 = i^2 + skew i j + j^2
    second : b2; b1 is (1, 0)
    """

    skew: int
    second: tuple[float, float]

    @property
    def basis(self) -> Array:
        return np.array([[1.0, 0.0], self.second])

    @property
    def density(self) -> float:
        """The number of sites per unit area."""
        return 1.0 / self.second[1]

    def within(self, limit: float) -> tuple[NDArray[np.int32], Indices]:
        """(n, 2) the sites (i, j) with norms of at most `limit`, and (n,) indices that sort them.

        The sites are ordered by norm and then by angle; the indices sort them by i and then by j.
        """
        top = int(np.sqrt(limit / (1.0 - self.skew**2 / 4.0))) + 1
        steps = np.arange(-top, top + 1)
        norms = np.add.outer(steps * steps, steps * steps)
        if self.skew:
            norms += np.multiply.outer(self.skew * steps, steps)
        taken = norms <= limit
        i, j = (each - top for each in np.nonzero(taken))
        x, y = self.coordinates(i, j)
        turns = np.arctan2(y, x) % (2 * np.pi) / 7.0  # below 1, the least difference of norms
        order = np.argsort(norms[taken] + turns)
        back = np.empty_like(order)
        back[order] = np.arange(len(order))
        return np.stack((i[order], j[order]), axis=1).astype(np.int32), back

    def coordinates(self, i: NDArray[Any], j: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """The coordinates x and y of the sites i b1 + j b2."""
        return i + self.second[0] * j, self.second[1] * j


#: The lattice in which each site has six nearest neighbours, and the one in which it has four.
HEXAGONAL = Pattern(1, (0.5, float(np.sqrt(0.75))))
SQUARE = Pattern(0, (0.0, 1.0))


def checked_seed(seed: int | None) -> int:
    if not isinstance(seed, (int, np.integer)) or isinstance(seed, bool) or seed < 0:
        expected = "a whole number that is not negative, as heights or tip radii are random"
        raise InputError("seed", found=seed, expected=expected)
    return int(seed)


def cut_normal(count: int, seed: int, *, stream: int) -> Array:
    """(count,) clipped standard normal numbers. A `stream` is independent of all others."""
    numbers = np.random.default_rng([seed, stream]).standard_normal(count)
    return np.clip(numbers, -CUT_DEVIATIONS, CUT_DEVIATIONS)
