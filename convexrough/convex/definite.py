"""Positive definite or not: Cholesky's factorisation as a test, and as a proof.

The proof (Demmel; Rump, BIT 46 (2006) 433). Where the factorisation of a computed (n, n) matrix C
of positive diagonal runs to its end, its factor satisfies R'R = C + E with
|E_ij| <= g / (1 - g) (C_ii C_jj)^(1/2), g = (n + 1) u / (1 - (n + 1) u) and u the roundoff. The
right side is a matrix of rank one and norm g / (1 - g) trace C, and R'R >= 0. So

    C >= -(n + 2) u trace C    where 2 (n + 1) (n + 2) u <= 1: for all n that fit in a memory.

Let C be M off the diagonal and 1 - mu - s on it, and let each entry of M, as computed, be off by e
of itself at most: by a matrix whose norm is at most its largest row sum. With trace C <= n,

    s >= e max_i sum_j |M_ij| + (n + 2) n u    proves    I + M >= mu I.

A tenth more in s is for the rounding of the sums, of s and, with the n u to spare where n + 1 would
do for n + 2, of the diagonal. Entries that are not finite, or overflow, leave a diagonal of the
factor that is not: LAPACK need not see that, and no such factor counts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from convexrough.arrays import Array
from convexrough.roundoff import ROUNDOFF


def is_definite(matrix: Array) -> bool:
    """Whether Cholesky's factorisation of a symmetric matrix runs to its end: no proof yet."""
    from scipy.linalg.lapack import dpotrf  # 0.2 s to import: only when asked

    # The transpose of a symmetric matrix is itself, and in LAPACK's order.
    factor, failed = dpotrf(matrix.T, lower=1, clean=0)
    return not failed and bool(np.isfinite(factor.diagonal()).all())


def proved_margin(
    couplings: Array, margins: Sequence[float], entry_error: float, spare: float = 0.0
) -> float:
    """The first of some margins mu for which  I + M >= (mu + spare) I  is proved, as above; else 0.

    couplings   : (n, n) M as computed, symmetric, 0 on its diagonal
    margins     : each from 0 to 1
    entry_error : e, bound on the error of each entry relative to it
    """
    n = len(couplings)
    blur = entry_error * float(np.abs(couplings).sum(axis=1).max())
    slack = 1.1 * (blur + (n + 2) * n * ROUNDOFF)
    trial = couplings.copy()
    for margin in margins:
        np.fill_diagonal(trial, 1.0 - (margin + spare) - slack)
        if is_definite(trial):
            return margin
    return 0.0
