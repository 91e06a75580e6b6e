"""Sums over pairs of points in pairs of float64 numbers: 30 digits, on any processor."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Pair: TypeAlias = tuple[Array, Array]


def inverse_sums(
    targets: Array, points: Array, loads: Array, scale: float = 1.0, power: int = 1
) -> Pair:
    """scale sum_j P_j / r_ij^power, 0 from a point to itself; loads are (m,) or (m, k)."""
    total = np.zeros((2, len(targets), *loads.shape[1:]))
    for i, target in enumerate(targets):
        x, y = (_two_sum(target[c], -points[:, c]) for c in (0, 1))
        squares = _add(_product(x, x), _product(y, y))
        apart = squares[0] > 0
        root = _inverse_root((squares[0][apart], squares[1][apart]))
        falling = root
        for _ in range(power - 1):
            falling = _product(falling, root)
        high, low = (each.reshape(-1, *[1] * (loads.ndim - 1)) for each in falling)
        summed = _sum(_product((high, low), _exactly(loads[apart])))
        total[:, i] = _product(summed, _exactly(np.array(scale)))
    return total[0], total[1]


def _exactly(values: Array) -> Pair:
    return values, np.zeros_like(values)


def _two_sum(a: Array, b: Array) -> Pair:
    total = a + b
    back = total - a
    return total, (a - (total - back)) + (b - back)


def _add(a: Pair, b: Pair) -> Pair:
    high, low = _two_sum(a[0], b[0])
    return _two_sum(high, low + a[1] + b[1])


def _product(a: Pair, b: Pair) -> Pair:
    """Dekker's: of halves of 26 bits, whose products are exact."""
    halves = []
    for value in (a[0], b[0]):
        large = 134217729.0 * value
        top = large - (large - value)
        halves.append((top, value - top))
    (a1, a2), (b1, b2) = halves
    high = a[0] * b[0]
    low = ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2
    return _two_sum(high, low + a[0] * b[1] + a[1] * b[0])


def _inverse_root(squares: Pair) -> Pair:
    """One of Newton's steps from the root in float64."""
    root = _exactly(1 / np.sqrt(squares[0]))
    high, low = _product(squares, _product(root, root))
    return _two_sum(root[0], root[0] * ((1 - high) - low) / 2)


def _sum(terms: Pair) -> Pair:
    """By halves, along the first axis."""
    high, low = terms
    while len(high) > 1:
        half = len(high) // 2
        rest = high[2 * half :], low[2 * half :]
        high, low = _add((high[:half], low[:half]), (high[half : 2 * half], low[half : 2 * half]))
        high, low = np.concatenate((high, rest[0])), np.concatenate((low, rest[1]))
    return (high.sum(axis=0), low.sum(axis=0))
