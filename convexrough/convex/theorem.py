r"""One theorem: how far the solution of a convex problem can be from any trial point.

Let F(x) = phi'(x) + A x - b on a box K of the reals, with phi a sum of convex functions of one
component each and A symmetric. A solution is an x* in K with a number beta* for which F(x*) - beta*
is 0 inside K, at least 0 on lower faces and at most 0 on upper faces, and sum x* = T. If no total
is prescribed, beta* = 0. On a box that holds x and x* let the Hessian be at least mu H, H diagonal,
H > 0 and mu > 0. Then for every x in K with sum x = T and every beta (0 without a total),

    || x - x* ||_H  <=  || e ||_{H^-1} / mu,                                                   (1)

where the violation e_i is |F_i(x) - beta| inside K, the negative part of F_i(x) - beta on a lower
face and its positive part on an upper face. So |x_i - x*_i| is at most the right side of (1) over
h_i^(1/2).

Proof. Let d = x - x* and F(x) - beta = v + w with |w_i| = e_i, so that -v lies in the normal cone
of K at x, as -(F(x*) - beta*) does at x*. Normal cones are monotone:
(v - F(x*) + beta*)'d <= 0, hence

    (F(x) - F(x*))'d  <=  sum e_i |d_i| + (beta - beta*) sum d_i,

whose last term is 0. The left side is at least mu || d ||_H^2 by the Hessian's bound along the
segment from x* to x, and the sum on the right is at most || e ||_{H^-1} || d ||_H.

A component that is fixed, or known from elsewhere, takes no part: e_i = 0 and d_i = 0. Where x_i is
a vector that is bounded in length, the same holds with lengths in place of absolute values.
If F(x) is a ball, e_i is the largest violation of its numbers, and (1) holds for the true data.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, largest, summed
from convexrough.numbers.balls import Ball
from convexrough.roundoff import SAFETY


def excess(residual: Ball, inside: NDArray[np.bool_]) -> Array:
    """(n,) violations e, given F - beta and True for components inside K, False on a lower face."""
    wrong = np.maximum(-residual.lower, 0.0)
    return np.where(inside, np.maximum(residual.upper, wrong), wrong)


def distance(excess: Array, stiffness: Array, margin: float | Array) -> Any:
    """|| e ||_{H^-1} / mu, the right side of (1): a number, or (m, 1) for (m, n) violations.

    excess : (n,) e;  stiffness : (n,) the diagonal of H, infinite where x is fixed;  margin : mu
    """
    most = largest(excess)
    with np.errstate(all="ignore"):
        squared = summed((excess / np.where(most > 0, most, 1.0)) ** 2 / stiffness)
        found = most * np.sqrt(squared) / margin * (1 + SAFETY + excess.shape[-1] * 2.0**-52)
    return np.where(most == 0, 0.0, np.where(np.isfinite(found), found, np.inf))[()]
