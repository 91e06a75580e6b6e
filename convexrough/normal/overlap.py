"""Bounds on the convexity of crowded contacts, by overlapping shells about the asperities.

docs/theory/crowded.md, "Shells that overlap", derives them. Local compliances h are given as
lengths t_i = 1 / (pi E* h_i). For distances r_ij, any radii s_i, and the energy U_ij of two shells
of charge 1 with these radii, the matrix

    S_ij = (1 - t_i / s_i) on the diagonal,  (t_i t_j)^(1/2) (1 / r_ij - U_ij) off it,

is sparse, and  H^(-1/2) (H + A) H^(-1/2) >= S  for H = diag(h) and the compliance operator A.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.convex.definite import proved_sparse_margin
from convexrough.influence.coupling import Influence
from convexrough.roundoff import ROUNDOFF

#: WIDTHS are radii of shells divided by t, the cheapest first. WIDENED is a factor for the shells
#: of nearly singular pairs. LESS is the largest difference between the radii of two neighbours,
#: divided by their distance. Heuristics: any radii give valid bounds.
WIDTHS, WIDENED, LESS = (4.0, 8.0), 3.0, 0.5

#: Number of nearest neighbours that set the radii of shells.
NEAREST = 8

#: Largest number of pairs of shells for each asperity, limited by memory.
MOST_PAIRS = 200

#: Overlaps of shells wider than this many times the median are searched one by one, for speed only.
WIDE = 2.0

#: Largest number of asperities for which a proof is tried: it needs several eliminations, and one
#: takes 5 s for 100,000 asperities.
MOST_ELIMINATED = 200_000


class Overlaps(NamedTuple):
    """Pairs of overlapping shells, and the entries of S for these pairs."""

    first: Indices  # one asperity i of each pair
    second: Indices  # the other asperity j
    values: Array  # (t_i t_j)^(1/2) (1 / r_ij - U_ij)
    sizes: Array  # (t_i t_j)^(1/2) / r_ij


def overlapping_margin(influence: Influence, lengths: Array, margins: Sequence[float]) -> float:
    """The largest of `margins` mu for which  H + A >= mu H  is proved; 0 if there is none.

    lengths : (n,) t_i = 1 / (pi E* h_i)
    """
    points = influence.points
    if len(points) > MOST_ELIMINATED:
        return 0.0
    error = 2.0 * influence.entry_error + 32 * ROUNDOFF
    near = Nearest.of(points, lengths)
    if not near.closest.max(initial=0.0) < 1:
        return 0.0
    for width in WIDTHS:
        radii = near.wide_radii(lengths, width)
        pairs = overlaps(points, lengths, radii)
        if pairs is None:
            return 0.0
        indices = pairs.first, pairs.second
        diagonal, errors = 1.0 - lengths / radii, error * pairs.sizes
        margin = proved_sparse_margin(diagonal, indices, pairs.values, margins, errors)
        if margin > 0:
            return margin
    return 0.0


class Nearest(NamedTuple):
    """The nearest neighbours of each asperity."""

    distances: Array  # (n, m) to the m nearest neighbours
    which: Indices  # (n, m) indices of these neighbours
    closest: Array  # (n,) the largest (t_i t_j)^(1/2) / r_ij with a neighbour
    meeting: NDArray[np.bool_]  # (n,) true if t_i + t_j > r_ij with a neighbour

    @classmethod
    def of(cls, points: Array, lengths: Array) -> Nearest:
        from scipy.spatial import cKDTree

        if len(points) < 2:
            none = np.zeros((len(points), 0))
            alone = np.zeros(len(points))
            return cls(none, none.astype(np.intp), alone, alone > 0)
        found = cKDTree(points).query(points, k=min(len(points), NEAREST + 1))
        distances, which = (np.asarray(each)[:, 1:] for each in found)
        closest = (np.sqrt(lengths[:, None] * lengths[which]) / distances).max(axis=1)
        meeting = (lengths[:, None] + lengths[which] > distances).any(axis=1)
        return cls(distances, which, closest, meeting)

    def wide_radii(self, lengths: Array, width: float) -> Array:
        """(n,) radii of shells, `width` times `lengths` or more; each `closest` must be below 1."""
        radii: Array = np.maximum(width, WIDENED / np.sqrt(1.0 - self.closest)) * lengths
        covering: Array = (radii[self.which] - LESS * self.distances).max(axis=1, initial=0.0)
        return np.asarray(np.maximum(radii, covering))


def overlaps(points: Array, lengths: Array, radii: Array) -> Overlaps | None:
    """All pairs of asperities whose shells overlap; None if these may be too many to store."""
    from scipy.spatial import cKDTree  # takes 0.1 s to import

    tree = cKDTree(points)
    usual = WIDE * float(np.median(radii)) if len(radii) else 0.0
    wide = np.flatnonzero(radii > usual)  # searched one by one
    reach = radii[wide] + float(radii.max(initial=0.0))
    counts = tree.query_ball_point(points[wide], reach, return_length=True)
    many = tree.count_neighbors(tree, 2.0 * usual) + int(np.sum(counts))
    if many > MOST_PAIRS * len(points):
        return None
    around = tree.query_ball_point(points[wide], reach)
    i = np.repeat(wide, counts)
    j = np.concatenate([np.asarray(each, dtype=np.intp) for each in around] or [wide])
    once = (radii[j] <= usual) | (i < j)
    both = tree.query_pairs(2.0 * usual, output_type="ndarray")
    both = both[(radii[both] <= usual).all(axis=1)]
    i, j = np.concatenate((i[once], both[:, 0])), np.concatenate((j[once], both[:, 1]))
    r = np.hypot(*(points[i] - points[j]).T)
    near = radii[i] + radii[j] > r
    i, j, r = i[near], j[near], r[near]
    large, small = np.maximum(radii[i], radii[j]), np.minimum(radii[i], radii[j])
    # U_ij r_ij: the energy of two shells, divided by that of two points.
    crossing = 1.0 - (large + small - r) ** 2 / (4.0 * large * small)
    energy = np.where(r <= large - small, r / large, crossing)
    sizes = np.sqrt(lengths[i] * lengths[j]) / r
    return Overlaps(i, j, sizes * (1.0 - energy), sizes)
