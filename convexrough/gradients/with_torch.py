"""An objective as a function of torch."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import ExtraError


def differentiable(both: Callable[[Any], tuple[float, Array]]) -> Callable[[Any], Any]:
    """A function f(x) -> number that supports `backward`, without second derivatives.

    both : function x -> (number, gradient), called outside of torch in float64 on the CPU

    Raises ExtraError if torch is not installed.
    """
    try:
        import torch
    except ImportError as error:
        raise ExtraError("torch") from error

    class Number(torch.autograd.Function):  # type: ignore[misc, name-defined, unused-ignore]
        @staticmethod
        def forward(ctx: Any, x: Any) -> Any:
            value, slopes = both(x.detach().cpu().numpy().astype(np.float64))
            ctx.save_for_backward(torch.as_tensor(slopes.copy(), dtype=x.dtype, device=x.device))
            return x.new_tensor(value)

        @staticmethod
        @torch.autograd.function.once_differentiable  # type: ignore[untyped-decorator, unused-ignore]
        def backward(ctx: Any, weight: Any) -> Any:
            return weight * ctx.saved_tensors[0]

    found: Callable[[Any], Any] = Number.apply
    return found
