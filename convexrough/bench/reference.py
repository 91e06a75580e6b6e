"""A solution to compare solvers with: the contact law in extended precision.

Newton's method on the normal map F(delta) = delta + A P(delta) - D (convexrough.solvers.newton),
in which everything that decides the answer - the scene's data, k, D, the product A P and F itself -
is computed in the longest floating-point numbers that numpy has: 64 bits of mantissa on x86. Only
the corrections are solved for in the package's own precision, and each leaves a small part of F.
Where long double is no longer than float64, as on many other machines, there is no reference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.convex.newton_step import correct
from convexrough.errors import InputError, SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.scene import base
from convexrough.sphere import hertz

Long = np.longdouble
LongArray = NDArray[np.longdouble]
Product = Callable[[LongArray], LongArray]

#: Of more asperities the sum of all pairs takes too long.
MOST = 10_000

MOST_STEPS = 8

#: What the linear solver may leave of F in a step.
MOST_LEFT = 1e-6

#: What one unit in the last place must be at most: some thousand times better than float64.
LEAST = 2e-19

#: Entries computed at a time.
BLOCK = 2**20


@dataclass(frozen=True, eq=False)
class Reference:
    """loads   : (n,) of the candidates, in the problem's units
    residual   : max |F| over the approach
    correction : what one more step would change, max |P| over max P: about its error
    """

    loads: LongArray
    residual: float
    correction: float

    def error(self, loads: Array) -> float:
        """max |P - P_ref| / max P_ref, of loads (n,) in the problem's units."""
        return float(np.abs(loads - self.loads).max() / self.loads.max())


def refine(problem: NormalProblem, loads: Array) -> Reference:
    """The solution near these loads (n,); approach control and the "summit" geometry only.

    Raises InputError where A P cannot be computed so accurately, and SolverError where Newton's
    method does not get near the precision of the numbers.
    """
    precision = np.finfo(Long).eps
    summit = problem.approach is not None and problem.scene.geometry == "summit"
    for holds, found, expected in (
        (precision <= LEAST, f"long double of {precision:.1g}", "numbers longer than float64"),
        (summit, "another problem", 'approach control and the geometry "summit"'),
        (len(problem) <= MOST, f"{len(problem)} asperities", f"at most {MOST}"),
    ):
        if not holds:
            raise InputError("reference", found=found, expected=expected)
    k, prescribed = _law(problem)
    product = _product(problem)
    approach = float(problem.approach or 0.0)

    delta = np.where(loads > 0, hertz.indentation(loads.astype(Long), k), Long(-1))
    best: tuple[float, LongArray, LongArray] = (np.inf, delta, delta)
    for _ in range(MOST_STEPS):
        P: LongArray = hertz.load(delta, k)
        gap = product(P) - prescribed
        delta = np.where(P > 0, delta, np.minimum(-gap, 0))
        residual = float(np.abs(delta + gap).max()) / approach
        if not residual < 0.5 * best[0]:
            break
        change = _correction(problem, P, delta + gap)
        best = residual, P, change
        delta = delta + change
    residual, P, change = best
    if not residual <= 1e-14:
        raise SolverError(f"residual {residual:.2g} of the approach", solver="reference")
    slope = 1.5 * np.cbrt(P) / k
    return Reference(P, residual, float((slope * np.abs(change)).max() / P.max()))


def _law(problem: NormalProblem) -> tuple[LongArray, LongArray]:
    """(n,) k and D, from the scene's float64 numbers taken as exact."""
    scene, which, units = problem.scene, problem.candidates, problem.units
    rho = scene.asperities.tip_radii[which].astype(Long)
    x, y = scene.asperities.positions[which].astype(Long).T
    R = Long(base.sphere_radius(scene.sphere_radius, "reference"))
    modulus = Long(scene.material.contact_modulus)
    k = np.cbrt(9 / (16 * modulus * modulus) * (1 / R + 1 / rho)) * Long(units.local)
    d = (scene.asperities.heights[which].astype(Long) - (x * x + y * y) / (2 * R)) / units.length
    assert problem.approach is not None
    return k, d + Long(problem.approach)


def _correction(problem: NormalProblem, P: LongArray, defect: LongArray) -> LongArray:
    root, off = np.sqrt(1.0 / problem.stiffness(P.astype(float))), defect.astype(float)
    given = problem.influence, problem.shells, root, off
    return correct(*given, balanced=False, tolerance=MOST_LEFT).astype(Long)


def _product(problem: NormalProblem) -> Product:
    """P -> A P, the sum of all pairs in long double."""
    scene, units = problem.scene, problem.units
    modulus, pi = Long(scene.material.contact_modulus), 4 * np.arctan(Long(1))
    scale = Long(units.force) / Long(units.length) / (pi * modulus)
    points = scene.contact_points[problem.candidates]
    return partial(_pairs, points.astype(Long), scale)


def _pairs(points: LongArray, scale: Long, loads: LongArray) -> LongArray:
    touching = np.flatnonzero(loads)
    sources, strengths = points[touching], loads[touching]
    total = np.empty(len(points), dtype=Long)
    rows = max(1, BLOCK // max(1, len(touching)))
    for start in range(0, len(points), rows):
        block = slice(start, start + rows)
        squares = np.subtract.outer(points[block, 0], sources[:, 0]) ** 2
        squares += np.subtract.outer(points[block, 1], sources[:, 1]) ** 2
        squares[squares == 0] = np.inf
        total[block] = (1 / np.sqrt(squares)) @ strengths
    return scale * total
