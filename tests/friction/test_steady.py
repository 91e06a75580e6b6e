"""Closed paths: values of the prototypes, and today's cycles as the special case."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from path_scenes import LARGEST, SCENES, path_of
from scenes import random_scenes

import convexrough as cr


def octagon(name: str) -> cr.Cycle:
    t = np.arange(8) * np.pi / 4
    points = np.column_stack((1 + 0.4 * np.cos(t), 0.5 * np.sin(t + np.pi / 4))) / 1.4
    scene, P, Q = path_of(name, points)
    return cr.steady(scene, loads=P, forces=Q)


def test_the_octagon() -> None:
    found = octagon("paper")
    mean = LARGEST["paper"] / 1.4
    assert found.loss_first == pytest.approx(9.5663629049784e-14, rel=1e-12, abs=0.0)
    assert found.loss == pytest.approx(1.9339188634987e-13, rel=1e-12, abs=0.0)
    assert found.level / mean == pytest.approx(0.4318019484661, rel=1e-12)
    assert found.force_level / (0.5 * mean) == pytest.approx(-0.2146446609407, rel=1e-12)
    assert found.order == "proved"
    assert found.loss_error < 1e-10 * found.loss
    assert found.asperity_losses.sum() == pytest.approx(found.loss, rel=1e-3, abs=0.0)
    statuses, counts = np.unique(found.status, return_counts=True)
    assert dict(zip(statuses.tolist(), counts.tolist(), strict=True)) == {
        "intermittent": 6, "open": 24, "partial": 19, "sliding": 12,
    }  # fmt: skip
    assert octagon("rough").loss == pytest.approx(1.9572569969746e-13, rel=1e-12, abs=0.0)


CONSTANT = [("paper", 0.7, -0.3), ("rough", 0.7, -0.3)]
CONSTANT += [("paper", high, -high) for high in (1e-6, 1e-5, 1e-4)]


@pytest.mark.parametrize(("name", "high", "low"), CONSTANT)
def test_constant_load_is_a_cycle(name: str, high: float, low: float) -> None:
    scene, P, Q = path_of(name, [(1, high), (1, low)])
    contact = cr.press(scene, load=P[0])
    cycle = cr.cycle(contact, maximum=Q[0], minimum=Q[1])
    found = cr.steady(scene, loads=P, forces=Q)
    assert found.loss == pytest.approx(cycle.loss, rel=1e-11 if high > 1e-4 else 1e-8, abs=0.0)
    assert found.loss_error <= 1e-8 * cycle.loss
    assert_allclose(
        found.asperity_losses, cycle.asperity_losses, rtol=1e-8, atol=1e-12 * cycle.loss
    )
    assert (found.status == cycle.status).all()
    first = cr.shear(contact, force=0.5 * (Q[0] - Q[1]))
    assert_allclose(found.slips, 2 * first.slips, atol=1e-12 * first.displacement)
    sticking = found.status == "partial"
    assert_allclose(found.stick_radii[sticking], first.stick_radii[sticking], rtol=1e-9)


@settings(max_examples=5, deadline=None)
@given(random_scenes(crowding=0.7, most=12), st.integers(0, 2**32 - 1))
def test_every_later_cycle_is_the_same(sampled: tuple[cr.Scene, float], seed: int) -> None:
    scene, approach = sampled
    largest = cr.press(scene, approach=approach).load
    assume(largest > 0)
    rng = np.random.default_rng(seed)
    P = rng.uniform(0.1, 1.0, 4)
    T = P * rng.uniform(-0.9, 0.9, 4)
    scene = replace(scene, friction=0.4)
    found = cr.steady(scene, loads=P * largest, forces=0.4 * T * largest)
    past = rng.uniform(0.1, 1.0, 2)
    loads = np.concatenate((past, *[P] * 3, P[:1])) * largest
    forces = np.concatenate((0.9 * past, *[T] * 3, T[:1])) * 0.4 * largest
    path = cr.load_path(scene, loads=loads, forces=forces)
    cost = path.losses[14] - path.losses[10]
    uncertainty = path.loss_errors[-1] + path.loss_errors[10] + found.loss_error
    assert cost == pytest.approx(found.loss, abs=uncertainty)
    assert_allclose(path.asperity_forces[10], path.asperity_forces[14], atol=1e-14 * largest)


def test_losses_against_phase() -> None:
    """Rows are closed paths of their own; the smooth sphere has a closed form in step."""
    scene, P, phases = SCENES["paper"], 0.7 * LARGEST["paper"], [0.0, 0.7, np.pi / 2]
    ellipse = dict(load=P, load_amplitude=0.2 * P, force_amplitude=0.15 * P, chords=12)
    found = cr.phase_losses(scene, **ellipse, phases=phases, factors=[1.0, 0.5])
    assert found.phases.tolist() == phases * 2
    assert found.factors.tolist() == [1.0] * 3 + [0.5] * 3
    loads, forces = cr.elliptic_path(**ellipse, phase=0.7, friction=0.5)
    alone = cr.steady(scene, loads=loads, forces=forces)
    assert found.losses[1] == alone.loss
    assert found.levels[1] == alone.level
    assert found.sliding[1] == np.isin(alone.status, ("sliding", "intermittent")).sum()
    assert found.losses[2] < 0.5 * found.losses[0]
    assert found.order == "proved"
