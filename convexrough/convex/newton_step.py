"""The linear system of a Newton step on a normal map, solved directly or by conjugate gradients.

The normal maps of pressing and of shear (docs/theory/newton.md, "The normal map") have the Jacobian
I + A diag(c) with c >= 0, where A is the compliance operator. With W = diag(c)^(1/2), the step from
a point with the defect F is

    d = beta - F - A W y,     (I + W A W) y = W (beta - F).

If the loads must keep their sum, beta is the number for which sum W y = 0; otherwise beta is 0. The
matrix I + W A W is positive definite where the energy is convex. If it is not, diag(`shells`) is
added to A. By the shell lemma (docs/theory/convexity.md) the sum is positive semidefinite, so I + W
(A + diag(`shells`)) W is positive definite. Cholesky's method factorises diag(1 / c) + A instead,
with the unknown W y.
"""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.errors import SolverError
from convexrough.influence.coupling import Influence, Smoother

#: Largest number of touching asperities for which Cholesky's factorisation is cheapest, with and
#: without a stored matrix. Heuristics, from timings.
FACTORISED, FACTORISED_UNSTORED = 4000, 100

#: Least relative residual to which conjugate gradients run, in single and in double precision.
SINGLE_LIMIT, DOUBLE_LIMIT = 2e-6, 1e-13

#: Conjugate gradients also end if (r'M r)^(1/2), with the residual r and the preconditioner M, is
#: below ENERGY times SINGLE_LIMIT or DOUBLE_LIMIT times its first value.
ENERGY = 1e-2

#: A step gets a second part if it leaves more than TWICE times its tolerance. Corrections of loads
#: aim at a tenth of the rounding error (`normal.refine.ENOUGH`), so they may leave 8 times that.
TWICE = 8.0

MOST_ITERATIONS = 500

#: Asperities move as open ones do if their entry of W is at most SMALL times the largest.
SMALL = 1e-3

#: Smaller slopes dP/d(delta), in scaled units, count as 0.
LEAST_SLOPE = 2.0**-500

Values = NDArray[Any]  # of single or double precision


class _System(NamedTuple):
    """The matrix I + W (A + diag(shells)) W, and whether the loads must keep their sum."""

    influence: Influence
    shells: Array | None  # None for 0
    root: Array  # (n,) the diagonal of W
    balanced: bool


def correct(
    influence: Influence,
    shells: Array,
    root: Array,
    defect: Array,
    *,
    balanced: bool,
    tolerance: float,
) -> Array:
    """(n,) the Newton step d by (1) of docs/theory/newton.md.

    shells    : (n,) diagonal to add to A if I + W A W is not positive definite
    root      : (n,) diagonal of W, 0 where open
    defect    : (n,) F
    balanced  : True to keep the sum of the loads to first order
    tolerance : largest accepted 2-norm of F + J d, divided by that of F, with the Jacobian J; used
        only by conjugate gradients

    Raises SolverError if rounding errors make the matrix indefinite even with the shells.
    """
    touching = root.nonzero()[0]
    if len(touching) == 0:
        return -defect
    direct = len(touching) <= (FACTORISED if influence.stored else FACTORISED_UNSTORED)
    for extra in (None, shells):
        system = _System(influence, extra, root, balanced)
        if direct:
            step = _factorise(system, touching, defect)
        else:
            with threads.one_thread() if not influence.stored else nullcontext():
                step = _in_two_parts(system, defect, tolerance)
        if step is not None:
            return step
    raise SolverError("the matrix of a step is not positive definite", solver="newton")


def _factorise(system: _System, touching: Indices, defect: Array) -> Array | None:
    """The step by Cholesky's factorisation; None if the matrix is not positive definite."""
    influence, shells, root, balanced = system
    matrix, softness = influence.submatrix(touching), softness_of(root[touching] ** 2)
    matrix.ravel()[:: len(matrix) + 1] = softness if shells is None else softness + shells[touching]
    # The symmetric matrix equals its transpose, which has LAPACK's order: no copy.
    factor, info = scipy.linalg.lapack.dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
    if info != 0:
        return None
    x = scipy.linalg.lapack.dpotrs(factor, defect[touching], lower=1)[0]
    shift = 0.0
    if balanced:
        border = scipy.linalg.lapack.dpotrs(factor, np.ones(len(x)), lower=1, overwrite_b=1)[0]
        shift = float(x.sum()) / float(border.sum())
        x -= shift * border
    return shift - defect + influence.apply(among_zeros(x, touching, len(root)))


def softness_of(slopes: Array) -> Array:
    """1 / c for slopes c = dP/d(delta); large but finite where c is 0."""
    return np.asarray(1.0 / np.maximum(slopes, LEAST_SLOPE))


def _in_two_parts(system: _System, defect: Array, tolerance: float) -> Array | None:
    """The step by `_iterate`; in two parts only where single precision is not enough."""
    influence, shells, root, balanced = system
    smooth = influence.smoother(root)
    step, reached = _iterate(system, smooth, defect, tolerance)
    if step is None or shells is not None or influence.stored or reached <= TWICE * tolerance:
        return step
    slopes = root**2
    left, missing = defect + step + influence.apply(slopes * step), 0.0
    if balanced:
        left -= float(slopes @ left) / float(slopes.sum())  # beta
        missing = -float(slopes @ step)
    size = float(np.linalg.norm(defect))
    if size == 0.0 or not left.any():
        return step
    share = float(np.linalg.norm(left)) / size
    rest, _ = _iterate(system, smooth, left, tolerance / share, missing)
    return None if rest is None else step + rest


def _iterate(
    system: _System, smooth: Smoother | None, defect: Array, tolerance: float, total: float = 0.0
) -> tuple[Array | None, float]:
    """The step by preconditioned conjugate gradients (docs/theory/newton.md, "Many asperities"),
    and about what part of F it leaves; None for the step if the matrix is not positive definite.

    The step is beta - F - A W y where an asperity is open, and (I + W diag(`shells`) W) y / W where
    one touches. Without shells F + F' d is then beta, minus r / W where asperities touch, with the
    residual r of the linear system.

    If balanced, the results of the preconditioner M are projected onto the plane sum W y = 0
    (Gould, Hribar and Nocedal, SIAM J. Sci. Comput. 23 (2001) 1376). Each projection also adds a
    factor times the diagonal of W to the residual, so that single precision is enough. The sum of
    these factors is beta of the step, divided by the scale of the defect.
    """
    influence, shells, root, balanced = system
    single = not influence.stored
    dtype: Any = np.float32 if single else np.float64
    limit = SINGLE_LIMIT if single else DOUBLE_LIMIT
    size = float(np.abs(defect).max()) or 1.0
    norm = float(np.linalg.norm(defect)) / size
    enough = max(tolerance, limit) * norm
    w: Values = root.astype(dtype)
    diagonal = dtype(1) if shells is None else (1.0 + root * shells * root).astype(dtype)
    border = smooth(w) if smooth and balanced else w
    weight, beta = float(w @ border), 0.0
    inverse = np.divide(1, w, out=np.zeros_like(w), where=w > SMALL * w.max())

    def smoothed(residual: Values) -> tuple[Values, float]:
        """M r for the residual r, projected; and r' M r without projection. If balanced, `residual`
        is changed in place.
        """
        nonlocal beta
        z = smooth(residual) if smooth else residual.copy()
        whole = float(residual @ z)
        if balanced:
            off = -float(w @ z) / weight
            beta += off
            residual += dtype(off) * w
            z += dtype(off) * border
        return z, whole

    y = dtype(total / (size * weight)) * border
    product = influence.apply(w * y) if total else np.zeros_like(w)  # A W y
    residual: Values = -w * ((defect / size).astype(dtype) + product) - diagonal * y
    z, first = smoothed(residual)
    p = z.copy()
    squared = float(residual @ z)  # r' M r
    for _ in range(MOST_ITERATIONS):
        left = float(np.linalg.norm(residual * inverse))
        if left <= enough or squared <= (ENERGY * limit) ** 2 * first:
            break
        q = influence.apply(w * p)
        bent = w * q
        bent += diagonal * p
        curvature = float(p @ bent)
        if curvature <= 0:
            return None, np.inf
        length = dtype(squared / curvature)
        y += length * p
        q *= length
        product += q
        bent *= length
        residual -= bent
        z, _ = smoothed(residual)
        before, squared = squared, float(residual @ z)
        p *= dtype(squared / before)
        p += z
    step = np.where(inverse > 0, diagonal * y * inverse, beta - product - defect / size)
    return np.asarray(size * step), left / (norm or 1.0)
