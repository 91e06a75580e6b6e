"""Sites of regular patterns, and random numbers that more sites leave as they were."""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.errors import InputError

#: Random heights and log radii are normal, cut at this many standard deviations (a chance of
#: 2e-9 per asperity), so that "every asperity that could touch" is a finite set.
CUT_DEVIATIONS = 6.0


def hexagonal_sites(limit: float) -> tuple[Array, Indices]:
    """Sites (i + j/2, sqrt(3)/2 j) with i^2 + i j + j^2 <= limit, and these squared distances."""
    top = int(np.sqrt(4 * limit / 3)) + 1
    i, j = _integers(top)
    norms = i * i + i * j + j * j
    keep = norms <= limit
    i, j = i[keep], j[keep]
    return np.column_stack((i + 0.5 * j, np.sqrt(0.75) * j)), norms[keep]


def square_sites(limit: float) -> tuple[Array, Indices]:
    """Sites (i, j) with i^2 + j^2 <= limit, and these squared distances."""
    i, j = _integers(int(np.sqrt(limit)) + 1)
    norms = i * i + j * j
    keep = norms <= limit
    return np.column_stack((i[keep], j[keep])).astype(np.float64), norms[keep]


def _integers(top: int) -> tuple[Indices, Indices]:
    i, j = np.meshgrid(np.arange(-top, top + 1), np.arange(-top, top + 1))
    return i.ravel(), j.ravel()


def checked_seed(seed: int | None) -> int:
    if not isinstance(seed, (int, np.integer)) or isinstance(seed, bool) or seed < 0:
        expected = "a whole number that is not negative, as heights or tip radii are random"
        raise InputError("seed", found=seed, expected=expected)
    return int(seed)


def cut_normal(count: int, seed: int, *, stream: int) -> Array:
    """Standard normal numbers; heights and radii have a stream each, so one leaves the other."""
    numbers = np.random.default_rng([seed, stream]).standard_normal(count)
    return np.clip(numbers, -CUT_DEVIATIONS, CUT_DEVIATIONS)
