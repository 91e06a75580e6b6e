"""The default initial indentations of Newton's method."""

from __future__ import annotations

import math

import numpy as np

from convexrough.arrays import Array
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.mean_field import mean_field_indentation, smooth_contact_radius

#: If more than FEW asperities could touch, the start uses no product with A, for speed only.
FEW = 1000

#: Squared contact radius of a rough sphere over that of a smooth one. It affects speed only.
WIDER = 1.1


def start_indentation(problem: NormalProblem) -> Array:
    """(n,) initial indentations of all asperities that could touch; negative where open."""
    if len(problem) > FEW:
        return mean_field_indentation(problem)
    return _on_hertz_pressure(problem)


def _on_hertz_pressure(problem: NormalProblem) -> Array:
    """(n,) initial indentations D - A P for loads P distributed like the pressure of a sphere.

    P = x^3 s with s = (1 - r^2 / a^2)^(1/2), the distance r from the axis, and the contact radius
    a. The number x follows from a prescribed load. At a prescribed approach it minimises the
    energy:  x^2 sum k s^(5/3) + x^3 s'A s = D's.
    """
    reach = smooth_contact_radius(problem) or 1.0
    squares = problem.scene.asperities.distances[problem.candidates] ** 2
    inside = np.maximum(1.0 - squares / (WIDER * reach**2), 0.0)
    s = np.sqrt(inside)
    displacement = problem.influence.apply(s)
    prescribed = problem.approach_bound + problem.offsets
    total, work = float(s.sum()), float(s @ prescribed)
    if not (total > 0 and work > 0):  # no asperity where the smooth sphere would touch
        return problem.smooth_indentation()
    if problem.load is not None:
        return prescribed - problem.load / total * displacement
    local, coupled = float(s @ (problem.coefficients * np.cbrt(inside))), float(s @ displacement)
    x = math.sqrt(work / local)
    for _ in range(8):  # Newton's method from the right of the root
        x -= (x * x * (local + coupled * x) - work) / (x * (2.0 * local + 3.0 * coupled * x))
    return np.asarray(prescribed - x**3 * displacement)
