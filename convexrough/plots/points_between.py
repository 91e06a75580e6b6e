"""`between`: a path with additional points, with which figures show curved loops.

Figures call it only if they are not given such a path, because it solves normal problems.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from convexrough.friction.path import LoadPath, history, load_path

#: Largest numbers: of points; of asperities times points; of steps between two given points.
MOST_POINTS, AFFORDABLE, MOST_BETWEEN = 500, 16_000, 40

#: Number of segments at varying load up to which points are added; each needs a solution.
MOST_SEGMENTS = 24


def between(path: LoadPath) -> LoadPath:
    """The path with points added between the given ones, or unchanged if these cost too much."""
    m, touching = len(path.forces), max(1, int(np.count_nonzero(path.contact.loads)))
    each = min(MOST_POINTS, AFFORDABLE // touching) // max(1, m)
    if not path.load_constant:
        each = min(each, 8) if m <= MOST_SEGMENTS else 1
    each = min(each, MOST_BETWEEN)
    follows_on = path.load_constant or path.start == 0.0  # it does not start from another contact
    if each < 2 or path.order == "fails" or not path.contact.loads.any() or not follows_on:
        return path
    corners = np.column_stack((path.loads, path.forces))
    part = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, each) / each)  # denser at the ends
    pieces = [
        np.vstack((a + part[:, None] * (b - a), b))
        for a, b in pairwise(np.vstack(([path.start, 0.0], corners)))
    ]
    P, Q = np.concatenate(pieces).T
    if path.load_constant:
        return history(path.contact, forces=Q)
    limit = (path.scene.friction or 1.0) * P
    return load_path(path.scene, loads=P, forces=np.clip(Q, -limit, limit))
