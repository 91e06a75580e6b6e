"""An approximate inverse of I + W A W for arbitrary points, to precondition conjugate gradients.

docs/theory/operators-mesh.md, "Approximate inverse", derives it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.influence.coupling import Smoother
from convexrough.influence.dense import dense_matrix

#: Approximate number of nodes of the coarse mesh, and least number of touching points for its use.
#: Heuristics: they change the number of steps of conjugate gradients, not the answer.
COARSE, FEW_TOUCHING = 1000, 200


def coarse_inverse(points: Array, scale: float, root: Array) -> Smoother | None:
    """(I + T K T^t)^-1 in single precision, where T K T^t approximates W A W; None for few points.

    root : (n,) diagonal of W
    """
    from scipy.linalg.lapack import dpotrf, dpotri, spotrs
    from scipy.sparse import csr_array

    touching = np.flatnonzero(root > 0)
    if len(touching) < FEW_TOUCHING:
        return None
    spacing = _coarse_spacing(points[touching], min(COARSE, len(touching) // 6))
    nodes, weights, places = _linear(points[touching], spacing)
    weights *= root[touching, None]
    starts = np.arange(0, nodes.size + 1, 4)
    shape = (len(touching), len(places))
    T = csr_array((weights.ravel(), nodes.ravel(), starts), shape=shape)
    K = dense_matrix(places, scale)
    np.fill_diagonal(K, 2.0 * scale / spacing)
    factor, failed = dpotrf(K, lower=1)
    if failed:
        return None
    inverse = np.tril(dpotri(factor, lower=1)[0])
    factor, failed = dpotrf(inverse + (T.T @ T).toarray(), lower=1)
    if failed:
        return None
    small, coarse, coupling = (each.astype(np.float32) for each in (T, factor, K))
    w = root[touching].astype(np.float32)
    # Estimate of |A W r|: long waves by the nodes, short waves as if signs in a cell were random.
    counts = np.bincount(nodes.ravel(), weights.ravel() / np.repeat(root[touching], 4))
    per_cell = max(len(touching) / len(places), 1.0)
    rough = scale / spacing * np.sqrt(np.pi * per_cell * np.log(per_cell))

    def smooth(values: Array) -> tuple[Array, float]:
        mine = values[touching].astype(np.float32, copy=False)
        loads = small.T @ mine
        field = coupling @ loads
        left = np.hypot(np.sqrt(counts @ (field * field)), rough * np.linalg.norm(w * mine))
        result: Any = np.zeros(len(values), dtype=np.float32)
        result[touching] = mine - small @ spotrs(coarse, loads, lower=1)[0]
        return result, float(left)

    return smooth


def _coarse_spacing(points: Array, most: int) -> float:
    """The spacing [length] of a square mesh in which about `most` cells contain points."""
    low, widest = points.min(axis=0), float(np.ptp(points, axis=0).max())
    spacing = widest
    while True:
        finer = 0.8 * spacing
        cells = ((points - low) / finer).astype(np.int64)
        columns = int(cells[:, 1].max()) + 1
        if len(np.unique(cells[:, 0] * columns + cells[:, 1])) > most:
            return spacing
        spacing = finer


def _linear(points: Array, spacing: float) -> tuple[Indices, Array, Array]:
    """(n, 4) nodes around each point, (n, 4) weights, and (m, 2) [length] all nodes."""
    away = (points - points.min(axis=0)) / spacing
    cells = away.astype(np.intp)
    shares = away - cells
    columns = int(cells[:, 1].max()) + 2
    key = cells[:, 0] * columns + cells[:, 1]
    corners = key[:, None] + np.array([0, 1, columns, columns + 1])
    x = np.stack((1.0 - shares[:, 0], shares[:, 0]), axis=1)
    y = np.stack((1.0 - shares[:, 1], shares[:, 1]), axis=1)
    weights = (x[:, :, None] * y[:, None, :]).reshape(-1, 4)
    used, nodes = np.unique(corners, return_inverse=True)
    places = np.stack((used // columns, used % columns), axis=1) * spacing
    return nodes.reshape(-1, 4), weights, places
