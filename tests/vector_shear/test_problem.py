"""The program of vector friction: its duality gap."""

import numpy as np
from friction_scenes import with_friction
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import random_scenes

import convexrough as cr
from convexrough import FrictionNewton
from convexrough.arithmetic.balls import Ball
from convexrough.vector_shear.certificate import certify_vectors
from convexrough.vector_shear.problem import VectorProblem, VectorState


def duality_gap(problem: VectorProblem, state: VectorState) -> float:
    return certify_vectors(problem, state, Ball.exact(state.total)).excess


@settings(max_examples=8, deadline=None)
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
