"""The program of vector friction: its kernel and shift, its residual and its duality gap."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
from friction_scenes import FRICTION, cerruti, pressed, with_friction
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import random_scenes

import convexrough as cr
from convexrough import FrictionNewton
from convexrough.numbers.balls import Ball
from convexrough.vector_shear.certificate import certify_vectors
from convexrough.vector_shear.problem import VectorProblem, VectorState


def duality_gap(problem: VectorProblem, state: VectorState) -> float:
    return certify_vectors(problem, state, Ball.exact(state.total)).excess


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 40), st.floats(0, 0.5))
def test_the_shift_makes_the_kernel_semidefinite(seed: int, count: int, nu: float) -> None:
    """C + diag(c) >= 0 with the c of the neighbours' distances, over random layouts."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 2))
    if rng.random() < 0.5:  # rows and clusters
        points = np.round(points * 3) / 3 + 1e-2 * rng.standard_normal(points.shape)
    scene = cr.Scene(
        1.0, cr.Asperities(points, 0.01), cr.Material(1.0, nu), FRICTION, geometry="summit"
    )
    C = cerruti(scene).transpose(0, 2, 1, 3).reshape(2 * count, 2 * count)
    apart = np.hypot(*(points[:, None] - points).T)
    np.fill_diagonal(apart, np.inf)
    shells = apart.min(axis=1) / 2
    c = (9 / 4 * (1 - 2 * nu / 3) if nu > 0 else 1.0) / (
        np.pi * scene.material.shear_modulus * shells
    )
    root = np.repeat(1 / np.sqrt(c), 2)
    lowest = np.linalg.eigvalsh(C * root * root[:, None] + np.eye(2 * count))[0]
    assert lowest >= -1e-12


def test_the_residual_sees_every_fault() -> None:
    """The judge itself is judged: one asperity that slides, one condition broken in its turn."""
    scene = cr.Scene(
        1.0, cr.Asperities([[0.0, 0.0]], 0.01), cr.Material(1.0, 0.5), FRICTION, geometry="summit"
    )
    problem = VectorProblem.of(cr.press(scene, approach=1e-4))
    P, threshold = problem.loads[0], problem.thresholds[0]
    along_x = np.array([[1.0, 0.0]])

    def residual(share: float, slip: tuple[float, float], off: float = 0.0) -> float:
        """Of a state with displacements that balance, but for `off` across."""
        q, slips = share * P * along_x, threshold * np.array([slip])
        displacement = (problem.own(q) + slips)[0] + [0.0, off * threshold]
        return problem.residual(VectorState(q[0], q, displacement, slips, 1))

    assert residual(1.0, (0.5, 0.0)) < 1e-14
    assert residual(0.7, (0.0, 0.0)) < 1e-14
    assert residual(1.0, (0.5, 0.0), off=1e-3) > 1e-4  # balance
    assert residual(1.0, (0.5, 1e-3)) > 1e-4  # slip across the force
    assert residual(1.0, (-0.5, 0.0)) > 1e-4  # slip against it
    assert residual(0.7, (1e-3, 0.0)) > 1e-4  # slip, though friction is left
    assert residual(1.001, (0.5, 0.0)) > 1e-4  # more than friction
    q = P * along_x
    short = VectorState(1.001 * q[0], q, problem.own(q)[0], 0 * q, 1)
    assert problem.residual(short) > 1e-4  # total


@settings(max_examples=15, deadline=None)
@given(random_scenes(crowding=0.9), st.floats(1e-3, 0.999), st.floats(0, 0.5))
def test_the_duality_gap_bounds_what_forces_cost_too_much(
    sampled: tuple[cr.Scene, float], fraction: float, nu: float
) -> None:
    scene, approach = sampled
    contact = cr.press(with_friction(scene, nu=nu), approach=approach)
    if contact.load == 0 or contact.certificate.scope == "none":
        return
    problem = VectorProblem.of(contact)
    total = np.array([fraction * problem.loads.sum(), 0.0])
    best = FrictionNewton().solve(problem, total)
    least = problem.energy(best.increments, problem.couple(best.increments))
    assert 0 <= duality_gap(problem, best) <= 1e-11 * least
    short = best._replace(increments=0.99 * best.increments)
    assert duality_gap(problem, short) > 5e-3 * least  # 1 % of the total is missing
    # Forces in proportion to the loads are borne too, and have the right total.
    other = best._replace(increments=fraction * np.outer(problem.loads, [1.0, 0.0]))
    for scale in (0.5, 1.0, 2.0):
        moved = other._replace(displacement=scale * best.displacement)
        excess = problem.energy(other.increments, problem.couple(other.increments)) - least
        assert duality_gap(problem, moved) >= excess * (1 - 1e-9) - 1e-11 * least


@settings(max_examples=15, deadline=None)
@given(random_scenes(crowding=0.9), st.floats(1e-3, 0.99), st.floats(0, 0.5), st.floats(0, 6.3))
def test_the_duality_gap_counts_its_rounding(
    sampled: tuple[cr.Scene, float], fraction: float, nu: float, angle: float
) -> None:
    """The least energy is convex in the total, with the slope X: forces that add up to a little
    more cost X times that at least. The sum is exact here.
    """
    scene, approach = sampled
    contact = cr.press(with_friction(scene, nu=nu), approach=approach)
    if contact.load == 0 or contact.certificate.scope == "none":
        return
    problem = VectorProblem.of(contact)
    limit = problem.loads.sum()
    total = fraction * limit * np.array([np.cos(angle), np.sin(angle)])
    best = FrictionNewton().solve(problem, total)
    for sign in (-1, 1):
        q = best.increments.copy()
        q[0] += sign * np.spacing(q[0])
        state = best._replace(increments=q)
        excess = sum(
            Fraction(x) * (sum(map(Fraction, column)) - Fraction(part))
            for x, column, part in zip(
                best.displacement.tolist(), q.T.tolist(), total.tolist(), strict=True
            )
        )
        assert duality_gap(problem, state) >= excess


def test_no_duality_gap_without_a_proof_of_convexity() -> None:
    contact = pressed("paper", nu=0.3)
    problem = VectorProblem.of(contact)
    best = FrictionNewton().solve(problem, np.array([0.3 * problem.loads.sum(), 0.0]))
    assert 0 < duality_gap(problem, best) < 1e-13 * float(best.displacement @ best.total)
    unproved = replace(problem)
    unproved.__dict__["margin"] = 0.0
    assert duality_gap(unproved, best) == np.inf
