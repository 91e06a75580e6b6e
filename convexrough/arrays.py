"""The arrays that everything here is made of."""

from __future__ import annotations

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


def among_zeros(values: NDArray[Any], places: Indices, count: int) -> NDArray[Any]:
    """(count, ...) values set at their places, and zeros (or False) everywhere else."""
    full = np.zeros((count, *values.shape[1:]), dtype=values.dtype)
    full[places] = values
    return full
