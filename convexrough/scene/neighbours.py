"""Nearest neighbours of scattered points, by a k-d tree."""

from __future__ import annotations

import numpy as np

from convexrough.checks import Array
from convexrough.scene.scene import nearest_distances

#: Asperities looked at together: between two batches fewer pairs come to be worth a look.
BATCH = 256


def separations(points: Array, point_error: float = 0.0) -> Array:
    """(n,) [length] distances to the nearest neighbour, less what errors of the points can hide."""
    if len(points) < 2:
        return np.full(len(points), np.inf)
    return np.maximum(nearest_distances(points) - 3.0 * point_error, 0.0)


def crowding(points: Array, radii: Array) -> float:
    """The largest (a_i + a_j) / r_ij over all pairs.

    Each asperity with those smaller and near enough to beat the nearest neighbours.
    """
    from scipy.spatial import cKDTree

    if len(points) < 2:
        return 0.0
    tree = cKDTree(points)
    found = tree.query(points, k=2)
    distances, nearest = (np.asarray(each)[:, 1] for each in found)
    worst = float(((radii + radii[nearest]) / distances).max())
    if worst == 0:
        return 0.0
    order = np.argsort(-radii)
    for start in range(0, len(points), BATCH):
        some = order[start : start + BATCH]
        some = some[2.0 * radii[some] > worst * distances[some]]
        around = tree.query_ball_point(points[some], 2.0 * radii[some] / worst)
        for i, others in zip(some.tolist(), around, strict=True):
            j = np.array([k for k in others if k != i], dtype=np.intp)
            apart = np.hypot(*(points[j] - points[i]).T)
            worst = max(worst, float(((radii[i] + radii[j]) / apart).max(initial=0.0)))
    return worst
