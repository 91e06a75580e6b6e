"""Shells about asperities that may overlap: how definite the coupling of crowded contacts is.

docs/theory/crowded.md, "Shells that overlap". For asperities of lengths t_i = scale / h_i and any
radii s_i, with U the energy of two shells of charge 1, the matrix

    S_ij = (1 - t_i / s_i) on the diagonal,  (t_i t_j)^(1/2) (1 / r_ij - U_ij) off it,

is sparse, and  H^(-1/2) (H + A) H^(-1/2) >= S.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.convex.definite import proved_sparse_margin
from convexrough.influence.coupling import Influence
from convexrough.roundoff import ROUNDOFF

#: Radii of shells over t that are tried, the cheapest first; wider for a pair that is nearly as
#: close as can be. Heuristics: any radii prove what they say.
WIDTHS = (4.0, 8.0)

#: No more pairs of shells are looked at than so many for each asperity: what memory holds.
MOST_PAIRS = 200

#: Nor at more asperities than this: elimination would take minutes, where a press takes a second.
MOST_ELIMINATED = 50_000


class Overlaps(NamedTuple):
    """Pairs of shells that overlap."""

    first: Indices
    second: Indices
    values: Array  # (t_i t_j)^(1/2) (1 / r_ij - U_ij)
    sizes: Array  # (t_i t_j)^(1/2) / r_ij


def overlapping_margin(influence: Influence, lengths: Array, margins: Sequence[float]) -> float:
    """The largest mu for which  H + A >= mu H  is proved, else 0; t (n,) [length] of H."""
    points = influence.points
    if len(points) > MOST_ELIMINATED:
        return 0.0
    error = 2.0 * influence.entry_error + 32 * ROUNDOFF
    closest = _closest(points, lengths)
    if not closest.max(initial=0.0) < 1:
        return 0.0
    for width in WIDTHS:
        widths = np.maximum(width, 1.2 / np.sqrt(1.0 - closest))
        pairs = overlaps(points, lengths, widths * lengths)
        if pairs is None:
            return 0.0
        indices = pairs.first, pairs.second
        diagonal, errors = 1.0 - 1.0 / widths, error * pairs.sizes
        margin = proved_sparse_margin(diagonal, indices, pairs.values, margins, errors)
        if margin > 0:
            return margin
    return 0.0


def _closest(points: Array, lengths: Array) -> Array:
    """(n,) the largest (t_i t_j)^(1/2) / r_ij with any of the nearest neighbours."""
    from scipy.spatial import cKDTree

    if len(points) < 2:
        return np.zeros(len(points))
    found = cKDTree(points).query(points, k=min(len(points), 9))
    distances, which = (np.asarray(each)[:, 1:] for each in found)
    return np.asarray((np.sqrt(lengths[:, None] * lengths[which]) / distances).max(axis=1))


def overlaps(points: Array, lengths: Array, radii: Array) -> Overlaps | None:
    """All pairs whose shells overlap; None if they are too many."""
    from scipy.spatial import cKDTree  # 0.1 s to import: only when asked

    tree, widest = cKDTree(points), 2.0 * float(radii.max(initial=0.0))
    if tree.count_neighbors(tree, widest) > MOST_PAIRS * len(points):
        return None
    i, j = tree.query_pairs(widest, output_type="ndarray").T
    r = np.hypot(*(points[i] - points[j]).T)
    near = radii[i] + radii[j] > r
    i, j, r = i[near], j[near], r[near]
    large, small = np.maximum(radii[i], radii[j]), np.minimum(radii[i], radii[j])
    # The energy of two shells, over that of two points.
    crossing = 1.0 - (large + small - r) ** 2 / (4.0 * large * small)
    energy = np.where(r <= large - small, r / large, crossing)
    sizes = np.sqrt(lengths[i] * lengths[j]) / r
    return Overlaps(i, j, sizes * (1.0 - energy), sizes)
