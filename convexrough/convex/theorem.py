r"""One theorem: how far the solution of a convex problem can be from any trial point.

Let F(x) = phi'(x) + A x - b on a box K, with a sum phi of convex functions of one component each
and a symmetric A. A *solution* is a point x* in K with a number beta* for which F(x*) - beta* is 0
inside K, at least 0 on lower faces and at most 0 on upper faces. It has a prescribed total
sum x* = T; if no total is prescribed, beta* = 0. Let the Hessian be at least mu H on a box that
contains x and x*, with H diagonal, H > 0 and mu > 0. Then for every x in K with sum x = T and every
number beta (0 if no total is prescribed),

    || x - x* ||_H  <=  || e ||_{H^-1} / mu.                                                   (1)

The violation e_i is |F_i(x) - beta| inside K, the negative part of F_i(x) - beta on a lower face
and its positive part on an upper face. By (1), |x_i - x*_i| is at most the right side / h_i^(1/2).

Proof.
1. Let d = x - x*. Write F(x) - beta = v + w with |w_i| = e_i and -v in the normal cone of K at x.
2. -(F(x*) - beta*) is in the normal cone at x*. Normal cones are monotone, so
   (v - F(x*) + beta*)'d <= 0.
3. Hence (F(x) - F(x*))'d <= sum e_i |d_i| + (beta - beta*) sum d_i, and the last term is 0.
4. The left side is at least mu || d ||_H^2, by the bound on the Hessian between x* and x.
5. sum e_i |d_i| is at most || e ||_{H^-1} || d ||_H.

A component that is known has e_i = 0 and d_i = 0. If x_i is a vector of bounded length, the theorem
holds with lengths in place of absolute values. If F(x) is a ball, e_i is the largest violation of
the numbers in it, and (1) holds for the true data.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, largest, summed
from convexrough.numbers.balls import Ball
from convexrough.roundoff import SAFETY


def excess(residual: Ball, inside: NDArray[np.bool_]) -> Array:
    """(n,) violations e for residuals F - beta; `inside` is False on a lower face of K."""
    wrong = np.maximum(-residual.lower, 0.0)
    return np.where(inside, np.maximum(residual.upper, wrong), wrong)


def distance(excess: Array, stiffness: Array, margin: float | Array) -> Any:
    """|| e ||_{H^-1} / mu, the right side of (1): a number, or (m, 1) for (m, n) violations.

    excess    : (n,) e
    stiffness : (n,) the diagonal of H, infinite where x is fixed
    margin    : mu
    """
    most = largest(excess)
    with np.errstate(all="ignore"):
        squared = summed((excess / np.where(most > 0, most, 1.0)) ** 2 / stiffness)
        found = most * np.sqrt(squared) / margin * (1 + SAFETY + excess.shape[-1] * 2.0**-52)
    return np.where(most == 0, 0.0, np.where(np.isfinite(found), found, np.inf))[()]
