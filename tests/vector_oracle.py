"""A proved multiprecision friction state with the full tangential kernel: the test oracle.

Loads P_i > 0 are given as balls, float64 inputs are exact numbers. Forces over f and displacements
over c_t f, with bias = nu / (2 - nu) and d the unit vector between two asperities, solve

    F = ( eta_i + sum_j A_ij [(1 - bias) I + 2 bias d d'] q_j - X,    sum_j q_j - T ) = 0,

where q_i is along eta_i and of the length P_i [1 - (1 - min(|eta_i| / kappa_i, 1))^(3/2)]: what an
asperity must take up, its slip included, is eta
(docs/theory/vector-friction.md, "Newton's method"). Newton finds the point; an interval Newton step
proves it, as in `multiprecision`, which this shares the arithmetic of. It is the only one where the
energy is convex, which is not tested here.
"""

from dataclasses import dataclass
from typing import Any

import multiprecision as mp
import numpy as np
from flint import arb, ctx
from multiprecision import Balls, NotProved, exact, mid

import convexrough as cr


@dataclass(frozen=True)
class VectorReference:
    """A proved state of the loaded asperities; every ball contains the true value.

    forces : (n, 2) over f [force];  slips : (n, 2) over c_t f [length]
    displacement : (2,) X over c_t f [length]
    sliding : (n,)
    """

    forces: Balls
    slips: Balls
    displacement: Balls
    sliding: list[bool]


@dataclass(frozen=True)
class VectorMap:
    """F and its derivative; the unknowns are eta_x, eta_y of each asperity, then X."""

    loads: Balls
    thresholds: Balls
    kernel: Balls  # (2n, 2n)
    total: Balls  # (2,) T
    unit: Any  # a length over a force, so that every row of F is a length

    def force(self, i: int, eta: Balls) -> tuple[Balls, Balls]:
        """q_i (2,) and its derivative (2, 2)."""
        length = (eta @ eta).sqrt()
        if not length > 0:
            raise NotProved("a displacement may be zero")
        share = length / self.thresholds[i]
        if share > 1:
            size, slope = self.loads[i], arb(0)
        elif share < 1:
            root = (1 - share).sqrt()
            size = self.loads[i] * (1 - root**3)
            slope = arb(3) / 2 * self.loads[i] / self.thresholds[i] * root
        else:
            raise NotProved("an asperity slides or sticks, by less than its ball")
        along = np.outer(eta, eta) / (length * length)
        across = np.array([[arb(1), arb(0)], [arb(0), arb(1)]]) - along
        return size / length * eta, slope * along + size / length * across

    def forces(self, x: Balls) -> tuple[Balls, Balls]:
        """q (n, 2) and their derivatives (n, 2, 2)."""
        pairs = [self.force(i, eta) for i, eta in enumerate(x[:-2].reshape(-1, 2))]
        q, slopes = (np.array(each) for each in zip(*pairs, strict=True))
        return q, slopes

    def residual(self, x: Balls) -> Balls:
        q, n = self.forces(x)[0], len(self.loads)
        moved = x[:-2] + self.kernel @ q.reshape(-1) - np.tile(x[-2:], n)
        return np.append(moved, self.unit * (q.sum(axis=0) - self.total))

    def jacobian(self, x: Balls) -> Balls:
        n, slopes = len(self.loads), self.forces(x)[1]
        stiff, together = np.full((2 * n, 2 * n), arb(0)), exact(np.tile(np.eye(2), (n, 1)))
        for i, slope in enumerate(slopes):
            stiff[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = slope
        own = self.kernel @ stiff + exact(np.eye(2 * n))
        balance = self.unit * (together.T @ stiff)
        return np.block([[own, -together], [balance, np.full((2, 2), arb(0))]])


def solve_vectors(
    scene: cr.Scene, loads: list[Any], force: Any, start: Any, displacement: Any, digits: int = 50
) -> VectorReference:
    """The friction state of the asperities with loads > 0, under the force (2,), to `digits`.

    start : (n, 2) forces [force] near the solution;  displacement : (2,) near it
    """
    with ctx.workdps(digits + mp.GUARD_DIGITS):
        problem, x = _problem(scene, loads, force, start, displacement)
        size = max(float(abs(value)) for value in x)
        x = mp.newton(problem, x, tolerance=arb(size) * arb(10) ** (-digits - mp.GUARD_DIGITS // 2))
        return _state(problem, mp.prove(problem, x, radius=arb(size) * arb(10) ** (-digits)))


def _problem(
    scene: cr.Scene, loads: list[Any], force: Any, start: Any, displacement: Any
) -> tuple[VectorMap, Balls]:
    touching = [i for i, load in enumerate(loads) if load > 0]
    P = np.array([loads[i] for i in touching])
    E, nu = arb(scene.material.contact_modulus), arb(scene.material.poisson_ratio)
    points, _, law = (each[touching] for each in mp.of_scene(scene))
    thresholds = law * mp.cube_root(P * P)
    friction = arb(scene.friction)
    kernel = tangential_kernel(points, mp.coupling(points, E), nu / (2 - nu))
    total = np.array([arb(float(each)) for each in force]) / friction
    q = exact(np.asarray(start)[touching].reshape(-1)) / friction
    X = (
        exact(displacement) / mp.travel_of(friction, nu)
        if np.isfinite(displacement).all()
        else _near_the_limit(P, kernel, total)
    )
    eta = np.tile(X, len(P)) - kernel @ q
    unit = (X @ X).sqrt() / (total @ total).sqrt()
    return VectorMap(P, thresholds, kernel, total, mid(unit)), mid(np.concatenate((eta, X)))


def _near_the_limit(P: Balls, kernel: Balls, total: Balls) -> Balls:
    """X from what is missing of the total, where all slide: the last formula of friction.md."""
    size = (total @ total).sqrt()
    along, missing = total / size, P.sum() - size
    if not missing > 0:
        raise NotProved("the force is not below what friction can bear")
    across = np.array([-along[1], along[0]])
    side = (kernel @ np.outer(P, along).reshape(-1)).reshape(-1, 2) @ across
    spread = (P * (side - (P * side).sum() / P.sum()) ** 2).sum()
    return along * (spread / (2 * missing)).sqrt()


def tangential_kernel(points: Balls, influence: Balls, bias: Any) -> Balls:
    """(2n, 2n) A_ij [(1 - bias) I + 2 bias d d']."""
    d = points[:, None] - points
    squares = (d * d).sum(axis=2)
    np.fill_diagonal(squares, arb(1))  # where A is 0
    along = 2 * bias * d[..., None] * d[..., None, :] / squares[..., None, None]
    blocks = influence[..., None, None] * (along + (1 - bias) * exact(np.eye(2)))
    return blocks.transpose(0, 2, 1, 3).reshape(2 * len(points), -1)


def _state(problem: VectorMap, x: Balls) -> VectorReference:
    eta = x[:-2].reshape(-1, 2)
    lengths = np.sqrt((eta * eta).sum(axis=1))
    sliding = lengths > problem.thresholds
    beyond = 1 - problem.thresholds / lengths
    slips = np.where(sliding[:, None], beyond[:, None] * eta, arb(0))
    return VectorReference(problem.forces(x)[0], slips, x[-2:], sliding.tolist())
