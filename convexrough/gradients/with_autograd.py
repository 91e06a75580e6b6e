"""An objective as a function of autograd, the package that differentiates numpy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import ExtraError


def differentiable(both: Callable[[Any], tuple[float, Array]]) -> Callable[[Any], Any]:
    """A function f(x) -> number for `autograd.grad`, without second derivatives.

    both : function x -> (number, gradient)

    Raises ExtraError if autograd is not installed.
    """
    try:
        from autograd.extend import defvjp, primitive
    except ImportError as error:
        raise ExtraError("autograd") from error

    known: dict[bytes, Array] = {}  # the gradient at the last point, for the backward pass

    def number(x: Any) -> float:
        value, slopes = both(np.asarray(x, dtype=np.float64))
        known.clear()
        known[np.asarray(x, dtype=np.float64).tobytes()] = slopes
        return value

    def slopes(x: Any) -> Array:
        here = np.asarray(x, dtype=np.float64)
        return known[here.tobytes()] if here.tobytes() in known else both(here)[1]

    found: Callable[[Any], Any] = primitive(number)
    defvjp(found, lambda value, x: lambda weight: weight * slopes(x))
    return found
