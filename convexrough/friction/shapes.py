"""Smooth load paths as chords, with corners where the slip front starts, stops or turns."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, frozen


def elliptic_path(
    *,
    load: float,
    load_amplitude: float,
    force: float = 0.0,
    force_amplitude: float,
    phase: float = 0.0,
    friction: float,
    chords: int = 96,
) -> tuple[Array, Array]:
    """(m,) loads P and (m,) shear forces Q [force] at points of an ellipse.

        P = load + load_amplitude cos t,    Q = force + force_amplitude sin(t + phase)

    phase  : [rad] from -pi to pi. At 0 the axes of the ellipse are parallel to those of P and Q; at
        pi/2 the ellipse is a straight line, as P and Q are in phase
    friction : coefficient of friction f of the scene. The extremes of P, P + Q/f and P - Q/f are
        points of the path, so that `Cycle.level` is exact
    chords : approximate number of chords that replace the ellipse. In tests the loss was smaller
        than that of the ellipse by a fraction of at most 12 / chords^2

    Raises InputError for other phases, or if `friction` is not positive.
    >>> loads, forces = cr.elliptic_path(
    ...     load=1.0, load_amplitude=0.5, force_amplitude=0.1, friction=0.5, chords=8
    ... )
    >>> len(loads), float(loads.max())
    (12, 1.5)
    """
    checks.fits_in_memory("chords", checks.whole("chords", chords, 6), 200)
    p, q = (
        checks.finite("load_amplitude", load_amplitude),
        checks.finite("force_amplitude", force_amplitude),
    )
    t = q / checks.positive("friction", friction)
    phase = checks.phase("phase", phase)
    across, along = t * np.cos(phase), t * np.sin(phase)
    corners = [0.0, np.arctan2(across, p + along), np.arctan2(-across, p - along)]
    halves = np.sort(np.mod(corners, np.pi))
    ends = np.append(np.concatenate((halves, halves + np.pi)), halves[0] + 2 * np.pi)
    arcs = [
        np.linspace(a, b, max(1, int(np.ceil(chords * (b - a) / (2 * np.pi)))), endpoint=False)
        for a, b in pairwise(ends)
        if b - a > 1e-9
    ]
    angles = np.concatenate(arcs)
    loads = checks.finite("load", load) + p * np.cos(angles)
    forces = checks.finite("force", force) + q * np.sin(angles + phase)
    return frozen(loads), frozen(forces)
