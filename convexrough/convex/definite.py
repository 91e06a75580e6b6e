"""Positive definite or not: Cholesky's factorisation as a test, and as a proof.

The proof (Demmel; Rump, BIT 46 (2006) 433). Where the factorisation of a computed (n, n) matrix C
of positive diagonal runs to its end, its factor satisfies R'R = C + E with
|E_ij| <= g / (1 - g) (C_ii C_jj)^(1/2), g = (n + 1) u / (1 - (n + 1) u) and u the roundoff. The
right side is a matrix of rank one and norm g / (1 - g) trace C, and R'R >= 0. So

    C >= -(n + 2) u trace C    where 2 (n + 1) (n + 2) u <= 1: for all n that fit in a memory.

Let C be M off the diagonal and 1 - mu - s on it, and let each entry of M, as computed, have a
relative error of at most e: a matrix whose norm is at most its largest row sum. With trace C <= n,

    s >= e max_i sum_j |M_ij| + (n + 2) n u    proves    I + M >= mu I.

A tenth more in s is for the rounding of the sums, of s and, with the n u to spare where n + 1 would
do for n + 2, of the diagonal. Entries that are not finite, or overflow, leave a diagonal of the
factor that is not: LAPACK need not see that, and no such factor counts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.roundoff import ROUNDOFF


def largest(margins: Sequence[float], proved: Callable[[float], bool]) -> float:
    """The largest of some margins, from small to large, that is proved; else 0. By bisection."""
    low, high = -1, len(margins)
    middle = 0  # most of the time, what is not proved with the smallest is not proved at all
    while high - low > 1:
        if proved(margins[middle]):
            low = middle
        else:
            high = middle
        middle = (low + high) // 2
    return 0.0 if low < 0 else margins[low]


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
    perturbation = entry_error * float(np.abs(couplings).sum(axis=1).max())
    slack = 1.1 * (perturbation + (n + 2) * n * ROUNDOFF)
    trial = couplings.copy()
    for margin in margins:
        np.fill_diagonal(trial, 1.0 - (margin + spare) - slack)
        if is_definite(trial):
            return margin
    return 0.0


def proved_sparse_margin(
    diagonal: Array,
    pairs: tuple[Indices, Indices],
    values: Array,
    margins: Sequence[float],
    errors: Array,
) -> float:
    """The largest mu with  S >= mu I  proved, of a symmetric sparse matrix S; else 0.

    diagonal : (n,);  pairs, values : of entries above the diagonal;  errors : bounds on theirs
    margins  : from small to large

    By elimination without exchange of rows: where L and U are computed, S = L U + E with
    |E| <= g / (1 - g) |L| |U|, g = n u (Higham, Accuracy and Stability, theorem 9.3, in any order
    of the sums). With D the diagonal of U, positive, S - L D L' = E + L (U - D L') is symmetric, so
    its norm is at most its largest row sum.
    """
    from scipy.sparse import coo_array

    n = len(diagonal)
    (i, j), every = pairs, np.arange(n)
    perturbation = np.bincount(i, errors, n) + np.bincount(j, errors, n)
    off = float(perturbation.max(initial=0.0)) + 4 * ROUNDOFF
    where = (np.concatenate((every, i, j)), np.concatenate((every, j, i)))

    def proved(margin: float) -> bool:
        # A hundredth more is for what elimination loses.
        entries = np.concatenate((diagonal - 1.01 * margin - off, values, values))
        slack = _elimination_slack(coo_array((entries, where), shape=(n, n)).tocsc())
        return 1.1 * slack < 0.01 * margin

    return largest(margins, proved)


def _elimination_slack(matrix: Any) -> float:
    """e such that  matrix >= -e I  is proved, infinite where it is not definite."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    n = matrix.shape[0]
    try:
        options = {"SymmetricMode": True, "Equil": False}
        found = splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:  # exactly singular
        return np.inf
    D = found.U.diagonal()
    if not ((found.perm_r == found.perm_c).all() and (D > 0).all()):
        return np.inf
    L, U = abs(found.L), abs(found.U)
    scaled = diags_array(D) @ found.L.T
    rounding = n * ROUNDOFF / (1.0 - n * ROUNDOFF)
    ones = np.ones(n)
    beyond = abs(found.U - scaled) @ ones + 2 * ROUNDOFF * (U @ ones + abs(scaled) @ ones)
    slack = float((L @ (rounding * (U @ ones) + beyond)).max())
    return slack if np.isfinite(slack) else np.inf
