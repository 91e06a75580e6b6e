"""Initial indentations of many asperities: docs/theory/newton.md, "The start".

Asperities are grouped in rings about the axis. All asperities of a ring are assumed to be displaced
by the same w by the loads on other asperities. Their indentations are D - w with
D = approach + offsets, and by Hertz's law the total loads of the rings are P(w). K_rs is the
displacement of ring r by a unit load that is spread evenly over ring s, without the displacement of
an asperity by its own load. Newton's method solves w = K P(w) (Greenwood and Tripp, J. Appl. Mech.
34 (1967) 153, here for any heights and radii).
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts are imported when they are used

from convexrough.arrays import Array
from convexrough.normal.law import on_hertz_pressure, smooth_reach
from convexrough.normal.load_control import shifted_to_load
from convexrough.normal.problem import NormalProblem
from convexrough.sphere import hertz

#: Largest number of rings, and least mean number of asperities in a ring. Heuristics.
RINGS, LEAST = 128, 150

#: Of more asperities than this, only every k-th is used, with the largest k that leaves so many.
SAMPLE = 50_000

#: The method begins with the displacement by a smooth body times SUNK: a little less, because its
#: steps are too long where indentations are nearly 0. It ends when a step is at most ENOUGH times
#: the approach, and fails after STEPS steps. Heuristics.
SUNK, ENOUGH, STEPS = 0.98, 1e-4, 20

#: The evenly spread load of a ring includes each asperity's own load, spread over the asperity's
#: share of the area. The displacement of the asperity by this part must be subtracted. It is
#: OWN_SHARE times the displacement of the centre of a uniformly loaded disc of the same area.
#: Ewald's sums give 1.1002 for square and 1.1061 for hexagonal arrays; for other layouts the value
#: is a heuristic.
OWN_SHARE = 1.10


def mean_field_indentation(problem: NormalProblem) -> Array:
    """(n,) initial indentations in scaled units, negative where open.

    If the rings lead to no solution, because contacts are too crowded, the result is that of
    `on_hertz_pressure`.
    """
    count = max(4, min(RINGS, len(problem) // LEAST))
    # Rings of equal area: sphere and displacement are nearly linear in the squared distance.
    squares = problem.scene.asperities.distances[problem.candidates] ** 2  # not kept in memory
    limits = float(squares.max()) * np.linspace(0.0, 1.0, count + 1)
    edges, middle = np.sqrt(limits), np.sqrt((limits[1:] + limits[:-1]) / 2.0)
    some = slice(None, None, max(1, len(problem) // SAMPLE))
    places = squares / limits[1]
    ring = np.minimum(places.astype(np.intp), count - 1)
    numbers, areas = np.bincount(ring, minlength=count), np.pi * np.diff(limits)
    share = numbers / np.maximum(np.bincount(ring[some], minlength=count), 1)

    def between(w: Array, x: Array) -> Array:
        """Values at the places x, interpolated between the middles of the rings."""
        first = np.clip((x - 0.5).astype(np.intp), 0, count - 2)
        return np.asarray(w[first] + (x - 0.5 - first) * np.diff(w)[first])

    def sums(values: Array) -> Array:
        """(count,) sums over the rings, estimated from the sample."""
        return share * np.bincount(ring[some], values, count)

    # K: displacement of each ring by a unit load on each ring, without an asperity's own share.
    K = np.diff(_disc(middle[:, None], edges[1:]), axis=1, prepend=0.0)
    K[:, 0] = _disc(middle, edges[1])
    K /= areas
    K.ravel()[:: count + 1] -= OWN_SHARE * 2.0 * np.sqrt(np.pi / (areas * np.maximum(numbers, 1.0)))
    K *= problem.influence.scale

    offsets, coefficients = problem.offsets[some], problem.coefficients[some]
    approach = problem.approach_bound
    smooth = np.full(count, approach)
    if problem.scene.curved:
        touching = np.sqrt(smooth_reach(problem)), problem.scene.mean_radius
        smooth = hertz.surface_displacement(middle, *touching) / problem.units.length
    w = SUNK * smooth
    if problem.load is not None:
        bare = offsets - between(w, places[some])
        part = problem.load * len(bare) / len(problem)
        approach = float((shifted_to_load(bare, coefficients, part) - bare)[0])
    for _ in range(STEPS):
        indentation = approach + offsets - between(w, places[some])
        loads = hertz.load(indentation, coefficients)
        slopes = 1.5 * loads / np.where(loads > 0, indentation, 1.0)
        P, c = sums(loads), sums(slopes)
        defect = w - K @ P
        system, right = np.eye(count) + K * c, -defect
        if problem.load is not None:
            # The change of the approach is one more unknown, the load one more equation.
            system = np.block([[system, -(K @ c)[:, None]], [-c[None, :], c.sum()]])
            right = np.append(right, problem.load - float(P.sum()))
        try:
            step = np.linalg.solve(system, right)
        except np.linalg.LinAlgError:
            break
        w, approach = w + step[:count], approach + float(step[count:].sum())
        if np.abs(step).max() < ENOUGH * abs(approach):  # False for nan
            return np.asarray(approach + problem.offsets - between(w, places))
    return on_hertz_pressure(problem)


def _disc(distance: Array, radius: Array) -> Array:
    """The integral of 1 / r over a disc; r is measured from a point `distance` off the centre."""
    r, a = np.broadcast_arrays(distance, radius)
    inside = r < a
    m = (np.minimum(r, a) / np.maximum(r, a)) ** 2
    outer = np.where(
        inside,
        0.0,
        r * (scipy.special.ellipe(m) - (1.0 - m) * scipy.special.ellipk(np.minimum(m, 1 - 1e-15))),
    )
    return 4.0 * np.where(inside, a * scipy.special.ellipe(m), outer)
