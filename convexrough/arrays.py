"""The arrays that everything here is made of."""

from __future__ import annotations

import math
from collections.abc import Callable
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


def summed(values: NDArray[Any]) -> Any:
    """The sum along the last axis: a number, or (m, 1) of rows."""
    return values.sum(axis=-1, keepdims=values.ndim > 1)


def largest(values: NDArray[Any]) -> Any:
    """The largest along the last axis, at least 0: a number, or (m, 1) of rows."""
    return values.max(axis=-1, initial=0.0, keepdims=values.ndim > 1)


def even(value: float, length: int) -> Array:
    """(length,) read-only, this value everywhere: one number in memory stands for all."""
    return np.broadcast_to(np.float64(value), (length,))


def evenly(function: Callable[[Array], Array], values: Array) -> Array:
    """function(values), of each on its own: worked out once where one number stands for all."""
    if values.strides == (0,) and len(values):
        return even(function(values[:1])[0], len(values))
    return function(values)


def taken(values: Array, which: Indices) -> Array:
    """values[which]; still one number where that stands for all."""
    if values.strides == (0,) and len(values):
        return even(values[0], len(which))
    return np.asarray(values[which])


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
