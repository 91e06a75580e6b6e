"""Sums over pairs of points in 160 bits, as pairs of float64 numbers."""

from typing import Any

import numpy as np
from flint import arb, ctx
from multiprecision import exact
from numpy.typing import NDArray

Array = NDArray[np.float64]


def middle(ball: Any) -> Any:
    """The middle of a ball of the package, or of each, at working precision."""
    return exact(ball.mid.high) + exact(ball.mid.low)


def inverse_sums(
    targets: Array, points: Array, loads: Array, scale: float = 1.0, power: int = 1
) -> tuple[Array, Array]:
    """scale sum_j P_j / r_ij^power, 0 from a point to itself; loads are (m,) or (m, k)."""
    with ctx.workprec(160):
        forces = arb(scale) * exact(loads)
        places, total = exact(points), np.zeros((2, len(targets), *loads.shape[1:]))
        for i, target in enumerate(targets):
            x, y = (exact(target) - places).T
            squares = x * x + y * y
            apart = np.flatnonzero(squares != 0)
            falling = np.array([square.rsqrt() ** power for square in squares[apart]])
            sums = falling @ forces[apart]
            total[0, i] = sums
            total[1, i] = sums - exact(total[0, i])
    return total[0], total[1]


def pulled(points: Array, loads: Array, i: int, scale: float) -> list[arb]:
    """The derivatives of scale sum_j P_j / r_ij with respect to the coordinates of point i."""
    with ctx.workprec(160):
        x, y = (exact(points[i]) - exact(points)).T
        squares = x * x + y * y
        apart = np.flatnonzero(squares != 0)
        falling = [-arb(scale) * arb(loads[j]) * squares[j].rsqrt() ** 3 for j in apart]
        return [
            sum((a * b for a, b in zip(z[apart], falling, strict=True)), arb(0)) for z in (x, y)
        ]
