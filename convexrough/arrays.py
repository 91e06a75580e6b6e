"""The arrays that everything here is made of."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]

#: A float or a float64 array; a result of this type has the shape of the arguments.
Number: TypeAlias = Any


def frozen(values: NDArray[Any]) -> NDArray[Any]:
    """The array itself, made read-only."""
    values.flags.writeable = False
    return values


def among_zeros(
    values: NDArray[Any], places: Indices, count: int, *, axis: int = 0
) -> NDArray[Any]:
    """Values set at their places of `count` along an axis, among zeros (or False)."""
    shape = list(values.shape)
    shape[axis] = count
    full = np.zeros(shape, dtype=values.dtype)
    where: tuple[Any, ...] = (slice(None),) * (axis % values.ndim)
    full[*where, places] = values
    return full


def row_sums(values: Array) -> Array:
    """(m,) the sums of the rows of (m, n), each rounded once."""
    return np.array([math.fsum(row) for row in values])
