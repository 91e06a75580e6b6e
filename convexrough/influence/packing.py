"""How tightly spheres of given radii about asperities are packed.

The packing of radii t is the largest t_i / (r_ij - t_j) over pairs of asperities with a sphere: how
far sphere i fills the room up to sphere j. Spheres are apart where it is below 1. Each way to
couple looks through pairs in its own way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arrays import Array

#: Sites of a box that are looked at together: what a cache holds.
CACHED = 2**15

#: Neighbours looked at for each point before any others.
NEAREST = 8


def pair_packing(radii: Array, others: Array, distances: NDArray[np.float64] | float) -> float:
    """The largest of some pairs; no pair where one of the two radii is 0.

    The larger of the two has the larger share: x (r - x) grows up to r / 2.
    """
    smaller = np.minimum(radii, others)
    room = np.maximum(distances - smaller, 0.0)
    filled = np.zeros_like(room)
    with np.errstate(divide="ignore"):
        np.divide(np.maximum(radii, others), room, out=filled, where=smaller > 0)
    return float(filled.max(initial=0.0))


def matrix_packing(inverse: Array, radii: Array) -> float:
    """Of all pairs; inverse : (n, n) no less than 1 / r_ij, in any unit, 0 on the diagonal."""
    some = np.flatnonzero(radii)
    if len(some) < 2:
        return 0.0
    t = radii[some]
    shares = (inverse if len(some) == len(radii) else inverse[some[:, None], some]) * t
    if not shares.max() < 1:
        return np.inf
    return float((shares.T / (1.0 - shares)).max())


def lattice_packing(field: Array, pairs: Iterable[tuple[float, int, int]]) -> float:
    """Of radii on a box of sites, 0 elsewhere.

    pairs : differences of sites and no more than the distance they are apart, by that
    """
    most, worst = float(field.max()), 0.0
    for distance, i, j in pairs:
        if distance > most and most <= worst * (distance - most):
            break
        worst = max(worst, largest(partial(pair_packing, distances=distance), field, i, j))
        if not worst < 1:
            return np.inf
    return worst


def largest(of: Callable[[Array, Array], float], field: Array, i: int, j: int) -> float:
    """Of all pairs of sites that are i rows and j columns apart, some rows at a time; or 0."""
    here, there = field[i:], field[: len(field) - i]
    if j >= 0:
        here, there = here[:, j:], there[:, : there.shape[1] - j]
    else:
        here, there = here[:, :j], there[:, -j:]
    found = [0.0]

    def look(rows: slice) -> None:
        found.append(of(here[rows], there[rows]))

    rows = max(1, CACHED // max(here.shape[1], 1))
    threads.each(look, threads.chunks(len(here), rows), threads.worthwhile(here.size))
    return max(found)


def point_packing(points: Array, radii: Array, error: float) -> float:
    """Of points anywhere, by a k-d tree; error : bound on that of their distances."""
    from scipy.spatial import cKDTree  # 0.1 s to import: only when asked

    some = np.flatnonzero(radii)
    if len(some) < 2:
        return 0.0
    points, t = points[some], radii[some]
    tree = cKDTree(points)
    found = tree.query(points, k=min(len(some), NEAREST + 1))
    distances, which = (np.asarray(each) for each in found)
    worst = pair_packing(t[:, None], t[which[:, 1:]], distances[:, 1:] - error)
    if not worst < 1:
        return np.inf
    # Further pairs count only within this distance, which few of the nearest leave room for.
    matters = (t / worst + t.max()) * (1.0 + 1e-12) + error
    further = np.flatnonzero(matters > distances[:, -1])
    around = tree.query_ball_point(points[further], matters[further])
    for i, others in zip(further.tolist(), around, strict=True):
        j = np.array([k for k in others if k != i], dtype=np.intp)
        apart = np.hypot(*(points[j] - points[i]).T) - error
        worst = max(worst, pair_packing(t[i], t[j], apart))
    return worst if worst < 1 else np.inf


def clearances(points: Array, targets: Array, point_error: float) -> Array:
    """(m,) [length] from each target to the nearest point, less what their errors can hide."""
    from scipy.spatial import cKDTree

    if len(points) == 0 or len(targets) == 0:
        return np.full(len(targets), np.inf)
    distances = np.asarray(cKDTree(points).query(targets)[0])
    return np.maximum(distances * (1.0 - 1e-12) - 3.0 * point_error, 0.0)
