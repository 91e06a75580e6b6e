"""An objective as a function of jax, with a custom rule for its derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import ExtraError


def differentiable(both: Callable[[Any], tuple[float, Array]]) -> Callable[[Any], Any]:
    """A function f(x) -> number for jax.grad, jax.jit and jax.vmap, without second derivatives.

    both : function x -> (number, gradient), called outside of jax in float64. Without the option
        `jax_enable_x64` results are rounded to float32

    Raises ExtraError if jax is not installed.
    """
    try:
        import jax
    except ImportError as error:
        raise ExtraError("jax") from error

    def outside(x: Any) -> tuple[Any, Any]:
        value, slopes = both(np.asarray(x, dtype=np.float64))
        return np.asarray(value, dtype=x.dtype), np.asarray(slopes, dtype=x.dtype)

    def called(x: Any) -> Any:
        x = jax.numpy.asarray(x, dtype=float)
        shapes = jax.ShapeDtypeStruct((), x.dtype), jax.ShapeDtypeStruct(x.shape, x.dtype)
        return jax.pure_callback(outside, shapes, x, vmap_method="sequential")

    number: Any = jax.custom_vjp(lambda x: called(x)[0])
    number.defvjp(called, lambda slopes, weight: (weight * slopes,))
    found: Callable[[Any], Any] = number
    return found
