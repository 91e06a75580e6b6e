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
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.convex.newton_step import correct
from convexrough.errors import InputError, SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.scene.lattice import Lattice
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

Long = np.longdouble
LongArray = NDArray[np.longdouble]
Product = Callable[[LongArray], LongArray]

#: Up to so many asperities all pairs are summed; of more on a lattice, transforms do it.
FEW = 2000

#: Off a lattice nothing but the sum of all pairs is as accurate; of more it takes too long.
MOST_PAIRS = 40_000

MOST_STEPS = 8

#: What the linear solver may leave of F in a step.
MOST_LEFT = 1e-6

#: What one unit in the last place must be at most: some thousand times better than float64.
LEAST_PRECISION = 2e-19

#: Entries computed at a time.
BLOCK = 2**20


@dataclass(frozen=True, eq=False)
class Reference:
    """loads   : (n,) of the candidates, in the problem's units
    touching   : how many are positive
    residual   : max |F| over the approach
    correction : what one more step would change, max |P| over max P: about its error
    digits     : of the arithmetic
    how        : how A P was computed
    """

    loads: LongArray
    touching: int
    residual: float
    correction: float
    digits: float
    how: str

    def error(self, loads: Array) -> float:
        """max |P - P_ref| / max P_ref, of loads (n,) in the problem's units."""
        return float(np.abs(loads - self.loads).max() / self.loads.max())


def refine(problem: NormalProblem, loads: Array) -> Reference:
    """The solution near these loads (n,); approach control and the "summit" geometry only.

    Raises InputError where nothing accurate enough is known for the product A P, and SolverError
    where Newton's method does not get near the precision of the numbers.
    """
    scene = problem.scene
    if np.finfo(Long).eps > LEAST_PRECISION:
        expected = "numbers longer than float64, which this machine has not"
        raise InputError(
            "reference", found=f"long double of {np.finfo(Long).eps:.1g}", expected=expected
        )
    if problem.approach is None or scene.geometry != "summit":
        expected = 'approach control and the geometry "summit"'
        raise InputError("reference", found="another problem", expected=expected)
    approach = problem.approach
    k, prescribed = _law(problem)
    product, how = _product(problem)

    delta = np.where(loads > 0, hertz.indentation(loads.astype(Long), k), Long(-1))
    best: tuple[float, LongArray, LongArray] | None = None
    for _ in range(MOST_STEPS):
        P: LongArray = hertz.load(delta, k)
        gap = product(P) - prescribed
        delta = np.where(P > 0, delta, np.minimum(-gap, 0))
        defect = delta + gap
        residual = float(np.abs(defect).max()) / approach
        change = _correction(problem, P, defect)
        if best is not None and not residual < 0.5 * best[0]:
            break
        best = residual, P, change
        delta = delta + change
    assert best is not None
    residual, P, change = best
    if not residual <= 1e-14:
        raise SolverError(f"residual {residual:.2g} of the approach", solver="reference")
    slope = 1.5 * np.cbrt(P) / k
    return Reference(
        loads=P,
        touching=int(np.count_nonzero(P)),
        residual=residual,
        correction=float((slope * np.abs(change)).max() / P.max()),
        digits=float(-np.log10(np.finfo(Long).eps)),
        how=how,
    )


def _law(problem: NormalProblem) -> tuple[LongArray, LongArray]:
    """(n,) k and D, from the scene's float64 numbers taken as exact."""
    scene, which, units = problem.scene, problem.candidates, problem.units
    rho = scene.asperities.tip_radii[which].astype(Long)
    x, y = scene.asperities.positions[which].astype(Long).T
    R, modulus = Long(scene.sphere_radius), Long(scene.material.contact_modulus)
    k = np.cbrt(9 / (16 * modulus * modulus) * (1 / R + 1 / rho)) * Long(units.local)
    d = (scene.asperities.heights[which].astype(Long) - (x * x + y * y) / (2 * R)) / units.length
    assert problem.approach is not None
    return k, d + Long(problem.approach)


def _correction(problem: NormalProblem, P: LongArray, defect: LongArray) -> LongArray:
    root = np.sqrt(1.0 / problem.stiffness(P.astype(np.float64)))
    step = correct(
        problem.influence,
        problem.shells,
        root,
        defect.astype(np.float64),
        balanced=False,
        tolerance=MOST_LEFT,
    )
    return step.astype(Long)


def _product(problem: NormalProblem) -> tuple[Product, str]:
    """P -> A P, and how."""
    scene, units, n = problem.scene, problem.units, len(problem)
    modulus, pi = Long(scene.material.contact_modulus), 4 * np.arctan(Long(1))
    scale = Long(units.force) / Long(units.length) / (pi * modulus)
    points = scene.contact_points[problem.candidates]
    if n > FEW and (lattice := scene.lattice) is not None:
        return _OnLattice(points, lattice, scale).apply, "transforms"
    if n <= MOST_PAIRS:
        return partial(_pairs, points.astype(Long), scale), "sum over pairs"
    found = f"{n} asperities off a lattice"
    raise InputError("reference", found=found, expected=f"at most {MOST_PAIRS}")


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


class _OnLattice:
    """A P by transforms in extended precision, of the points as they are.

    Computed points are off their sites X by rounding, e. Near neighbours feel that in the 12th
    digit of large lattices, so the first order in it is added, with G(X) = -X / |X|^3:

        sum_j P_j / |x_i - x_j|  =  sum_j [K(X_ij) P_j  +  G(X_ij).(e_i - e_j) P_j]  +  O(e^2).
    """

    def __init__(self, points: Array, lattice: Lattice, scale: Long) -> None:
        sites = lattice.sites(points)
        assert sites is not None  # the lattice is that of these points
        basis = lattice.basis.astype(Long)
        self.scale = scale
        self.off = points.astype(Long) - lattice.origin.astype(Long) - sites.astype(Long) @ basis
        low = sites.min(axis=0)
        self.index: Indices = sites - low
        self.shape = tuple(int(size) for size in self.index.max(axis=0) + 1)
        self.padded = tuple(_fast(2 * size - 1) for size in self.shape)
        i, j = (_differences(size) for size in self.padded)
        x, y = (np.add.outer(i * basis[0, axis], j * basis[1, axis]) for axis in (0, 1))
        r = np.sqrt(x * x + y * y)
        r[0, 0] = np.inf
        self.kernel = _forward(1 / r)
        self.gradient = [_forward((-axis / r**3).astype(np.float64)) for axis in (x, y)]

    def apply(self, loads: LongArray) -> LongArray:
        total = self._back(self.kernel * self._spread(loads))
        small = self._spread(loads.astype(np.float64))
        for axis, kernel in enumerate(self.gradient):
            e = self.off[:, axis].astype(np.float64)
            here = e * self._back(kernel * small)
            there = self._back(kernel * self._spread(e * loads.astype(np.float64)))
            total = total + (here - there)
        return self.scale * total

    def _spread(self, values: NDArray[Any]) -> NDArray[Any]:
        field = np.zeros(self.padded, dtype=values.dtype)
        field[self.index[:, 0], self.index[:, 1]] = values
        return _forward(field)

    def _back(self, spectrum: NDArray[Any]) -> NDArray[Any]:
        from scipy import fft

        field = fft.irfft2(spectrum, s=self.padded, workers=-1)
        values: NDArray[Any] = field[self.index[:, 0], self.index[:, 1]]
        return values


def _forward(field: NDArray[Any]) -> NDArray[Any]:
    from scipy import fft  # 0.1 s to import: only when used

    spectrum: NDArray[Any] = fft.rfft2(field, workers=-1)
    return spectrum


def _fast(length: int) -> int:
    from scipy.fft import next_fast_len

    return int(next_fast_len(length, real=True))


def _differences(length: int) -> LongArray:
    """0, 1, ..., -2, -1, as exact numbers."""
    i = np.arange(length)
    return np.where(i <= (length - 1) // 2, i, i - length).astype(Long)


def measurable(scene: Scene) -> bool:
    """Whether a reference is within reach."""
    return len(scene) <= MOST_PAIRS or scene.lattice is not None
