"""Nearest neighbours of points."""

from __future__ import annotations

from itertools import chain

import numpy as np
import scipy  # its parts are imported when they are used

from convexrough.arrays import Array
from convexrough.checks import SIZED, SMALLEST
from convexrough.errors import InputError

#: Number of points up to which all distances are computed. It affects speed only.
FEW = 400


def crowding(points: Array, radii: Array) -> float:
    """The largest (a_i + a_j) / r_ij over all pairs, with contact radii a and distances r."""
    if len(points) < 2:
        return 0.0
    tree = scipy.spatial.cKDTree(points)
    found = tree.query(points, k=2)
    distances, nearest = (np.asarray(each)[:, 1] for each in found)
    worst = float(((radii + radii[nearest]) / distances).max())
    if worst == 0:
        return 0.0
    some = np.flatnonzero(2.0 * radii > worst * distances)
    around = tree.query_ball_point(points[some], 2.0 * radii[some] / worst)
    i = np.repeat(some, [len(others) for others in around])
    j = np.fromiter(chain.from_iterable(around), np.intp, len(i))
    i, j = i[i != j], j[i != j]
    apart = np.hypot(*(points[j] - points[i]).T)
    return max(worst, float(((radii[i] + radii[j]) / apart).max(initial=0.0)))


def refuse_coincident(points: Array, distances: Array) -> None:
    """Raise InputError if two asperities coincide, or are too near to each other for float64, given
    the distances (n,) [length] of nearest neighbours."""
    if len(points) < 2:
        return
    rounding = 16 * np.finfo(float).eps * np.abs(points).max()  # far above the rounding of points
    if (worst := float(distances.min())) <= rounding or worst < SMALLEST:
        first = int(np.argmin(distances))
        others = np.hypot(*(points[first + 1 :] - points[first]).T)
        second = first + 1 + int(np.argmin(others))
        expected = "distinct positions" if worst == 0 else f"a distance of {SIZED}"
        if 0 < worst <= rounding:
            expected = f"more than {rounding:.2g}, the rounding of such large coordinates"
        found = f"asperities {first} and {second} (from 0) at a distance of {worst:g}"
        raise InputError("positions", found=found, expected=expected)


def nearest_distances(points: Array) -> Array:
    """(n,) [length] distance of each point to its nearest neighbour."""
    if len(points) <= FEW:
        apart = np.hypot(*(points.T[:, None] - points.T[:, :, None]))
        np.fill_diagonal(apart, np.inf)
        return np.asarray(apart.min(axis=0))

    return np.asarray(scipy.spatial.cKDTree(points).query(points, k=2)[0])[:, 1]
