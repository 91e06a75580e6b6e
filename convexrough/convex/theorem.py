"""One theorem: how far the solution of a convex problem can be from any trial point.

docs/theory/one-theorem.md states and proves the theorem, with the symbols of this module. Let x be
a trial point, e its violations of the first-order conditions, x* the solution, and H a positive
diagonal matrix. If a box contains x and x*, and on it the Hessian is at least mu H with mu > 0,
then

    || x - x* ||_H  <=  || e ||_{H^-1} / mu.                                              (1)

If a component is fixed, x_i = x*_i is known, and e_i counts as 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, largest, summed
from convexrough.roundoff import SAFETY


def excess(residual: Ball, inside: NDArray[np.bool_]) -> Array:
    """(n,) violations e of the first-order conditions, from the `residual` F - beta of the gradient
    F of the energy and the multiplier beta of the total. `inside` is False at a lower bound; at an
    upper bound, the result |F - beta| is at least as large as the violation."""
    wrong = np.maximum(-residual.lower, 0.0)
    return np.where(inside, np.maximum(residual.upper, wrong), wrong)


def distance(excess: Array, h: Array, margin: float | Array) -> Any:
    """The right side of (1): a number, or (m, 1) for (m, n) violations e = `excess`. H has the
    diagonal h, infinite where x is fixed, and mu is the `margin`."""
    most = largest(excess)
    with np.errstate(all="ignore"):
        squared = summed((excess / np.where(most > 0, most, 1.0)) ** 2 / h)
        found = most * np.sqrt(squared) / margin * (1 + SAFETY + excess.shape[-1] * 2.0**-52)
    return np.where(most == 0, 0.0, np.where(np.isfinite(found), found, np.inf))[()]
