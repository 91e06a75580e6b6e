"""Types of arrays, and small operations on arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]

#: A float or a float64 array. A function of a `Number` returns a result of the same shape.
Number: TypeAlias = Any


def frozen(values: NDArray[Any]) -> NDArray[Any]:
    """The array itself, made read-only."""
    values.flags.writeable = False
    return values


def summed(values: NDArray[Any]) -> Any:
    """The sum along the last axis: a number for a vector, or an array (m, 1) for m rows."""
    return values.sum(axis=-1, keepdims=values.ndim > 1)


def largest(values: NDArray[Any]) -> Any:
    """The maximum along the last axis, but at least 0: a number, or an array (m, 1) for m rows."""
    return values.max(axis=-1, initial=0.0, keepdims=values.ndim > 1)


def even(value: float, *shape: int) -> Array:
    """A read-only array of equal values, which stores only one number."""
    return np.ndarray(shape, np.float64, np.float64(value), strides=(0,) * len(shape))


def evenly(function: Callable[[Array], Array], values: Array) -> Array:
    """function(values) for an elementwise function, evaluated only once if `even` made `values`."""
    if values.strides == (0,) and len(values):
        return even(function(values[:1])[0], len(values))
    return function(values)


def taken(values: Array, which: Indices) -> Array:
    """values[which]. If `even` made `values`, the result also stores only one number."""
    if values.strides == (0,) and len(values):
        return even(values[0], len(which))
    return np.asarray(values[which])


def among_zeros(
    values: NDArray[Any], places: Indices, count: int, *, axis: int = 0
) -> NDArray[Any]:
    """An array of length `count` along `axis`: `values` at `places`, 0 or False elsewhere."""
    shape = list(values.shape)
    shape[axis] = count
    full = np.zeros(shape, dtype=values.dtype)
    where: tuple[Any, ...] = (slice(None),) * (axis % values.ndim)
    full[*where, places] = values
    return full
