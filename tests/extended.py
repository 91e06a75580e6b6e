"""Sums over pairs of points in pairs of float64 numbers, which arithmetic/test_pairs.py tests."""

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.pairs import Pair, two_sum

Array = NDArray[np.float64]


def inverse_sums(
    targets: Array, points: Array, loads: Array, scale: float = 1.0, power: int = 1
) -> tuple[Array, Array]:
    """scale sum_j P_j / r_ij^power, 0 from a point to itself; loads are (m,) or (m, k)."""
    columns, sums = loads.reshape(len(points), -1).T, []
    for target in targets:
        x, y = (Pair(*two_sum(target[c], -points[:, c])) for c in (0, 1))
        squares = x * x + y * y
        apart = squares.high > 0
        terms = Pair.exact(columns[:, apart])
        for _ in range(power):
            terms = terms / squares.at(apart).sqrt()
        sums.append(terms.total() * Pair.exact(np.full(len(columns), scale)))
    parts = np.array(sums).reshape(len(targets), 2, len(columns))
    high, low = (parts[:, k].reshape(len(targets), *loads.shape[1:]) for k in (0, 1))
    return high, low
