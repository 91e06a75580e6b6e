"""Tests and proofs that a matrix is positive definite, by triangular factorisation.

docs/theory/certificate.md, "Choice of the box", 2, gives the proof for an (n, n) matrix in float64.
It requires 2 (n + 1) (n + 2) u <= 1 with the roundoff u, which is true for all matrices that fit in
memory. LAPACK may not report overflow, or entries that are not finite. Both make the diagonal of
the factor nan or infinite, so the diagonal is checked.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy  # its parts are imported when they are used

from convexrough.arrays import Array, Indices
from convexrough.roundoff import ROUNDOFF


def largest(margins: Sequence[float], proved: Callable[[float], bool]) -> float:
    """The largest of the increasing `margins` for which `proved` is true; 0 if there is none.

    The search is by bisection. It assumes that `proved` is true below each margin for which it is.
    """
    if not proved(margins[0]):  # then no other margin needs a test
        return 0.0
    first_failed = bisect_left(margins, True, lo=1, key=lambda margin: not proved(margin))
    return margins[first_failed - 1]


def is_definite(matrix: Array) -> bool:
    """True if Cholesky's factorisation of a symmetric matrix succeeds; by itself no proof."""
    # The transpose of a symmetric matrix is equal to it and has LAPACK's memory order.
    factor, failed = scipy.linalg.lapack.dpotrf(matrix.T, lower=1, clean=0)
    return not failed and bool(np.isfinite(factor.diagonal()).all())


def proved_margin(
    couplings: Array, margins: Sequence[float], entry_error: float, spare: float = 0.0
) -> float:
    """The first margin mu for which  I + M >= (mu + spare) I  is proved; 0 if there is none.

    couplings   : (n, n) computed symmetric M, with 0 on the diagonal
    margins     : numbers from 0 to 1, in the order in which they are tried
    entry_error : bound on the relative error of each entry of M
    spare       : the part of the smallest eigenvalue that is kept in addition to mu
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
    """The largest margin mu for which  S >= mu I  is proved for a sparse symmetric S; 0 if none.

    diagonal : (n,) the diagonal of S
    pairs, values, errors : the indices of the entries of S above the diagonal, the entries, and
        bounds on their errors
    margins  : in increasing order

    docs/theory/crowded.md, "Shells that overlap", explains the proof by Gaussian elimination.
    """
    n = len(diagonal)
    (i, j), every = pairs, np.arange(n)
    perturbation = np.bincount(i, errors, n) + np.bincount(j, errors, n)
    off = float(perturbation.max(initial=0.0)) + 4 * ROUNDOFF
    where = (np.concatenate((every, i, j)), np.concatenate((every, j, i)))

    def proved(margin: float) -> bool:
        # 0.01 mu covers the errors of the elimination.
        entries = np.concatenate((diagonal - 1.01 * margin - off, values, values))
        slack = _elimination_slack(scipy.sparse.coo_array((entries, where), shape=(n, n)).tocsc())
        return 1.1 * slack < 0.01 * margin

    return largest(margins, proved)


def _elimination_slack(matrix: Any) -> float:
    """A number e for which  matrix >= -e I  is proved; infinite if the elimination fails.

    With the factors L and U, and the diagonal D > 0 of U, e is the largest row sum of a bound on
    |matrix - L D L'|. The elimination has an error of at most n u / (1 - n u) |L| |U|, where u is
    the roundoff (Higham, Accuracy and Stability, theorem 9.3).
    """
    n, options = matrix.shape[0], {"SymmetricMode": True, "Equil": False}
    try:
        found = scipy.sparse.linalg.splu(
            matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
        )
    except RuntimeError:  # exactly singular
        return np.inf
    D, ones = found.U.diagonal(), np.ones(n)
    if not ((found.perm_r == found.perm_c).all() and (D > 0).all()):
        return np.inf
    L, U, scaled = abs(found.L), abs(found.U), scipy.sparse.diags_array(D) @ found.L.T
    rounding = n * ROUNDOFF / (1.0 - n * ROUNDOFF)
    beyond = abs(found.U - scaled) @ ones + 2 * ROUNDOFF * (U @ ones + abs(scaled) @ ones)
    slack = float((L @ (rounding * (U @ ones) + beyond)).max())
    return slack if np.isfinite(slack) else np.inf
