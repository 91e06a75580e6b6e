"""The conic step against Newton's method and the memory curve, and the three side by side."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from path_scenes import ONE, TWO, path_of, shaded
from scenes import random_scenes

import convexrough as cr


@pytest.mark.sample(1)
@pytest.mark.parametrize("points", [ONE, TWO])
def test_three_ways_to_one_path(points: list[tuple[float, float]]) -> None:
    scene, P, Q = path_of("paper", points)
    found = cr.compare_paths(scene, loads=P, forces=Q)
    assert [each.way for each in found.entries] == ["general step", "memory curve", "conic step"]
    assert [each.outcome for each in found.entries] == ["answered"] * 3
    apart = [(each.force_disagreement, each.displacement_disagreement) for each in found.entries]
    assert apart[0] == (0.0, 0.0)
    assert max(apart[1]) < 1e-12
    assert max(apart[2]) < 1e-5


@settings(max_examples=4, deadline=None)
@given(random_scenes(crowding=0.7, most=10), st.integers(0, 2**32 - 1))
def test_random_paths_as_cone_programs(sampled: tuple[cr.Scene, float], seed: int) -> None:
    scene, approach = sampled
    largest = cr.press(scene, approach=approach).load
    if largest == 0:
        return
    rng = np.random.default_rng(seed)
    P = rng.uniform(0.2, 1.0, 5) * largest
    Q = 0.5 * P * rng.uniform(-0.9, 0.9, 5)
    found = cr.compare_paths(replace(scene, friction=0.5), loads=P, forces=Q)
    conic = found.entries[2]
    assert conic.outcome == "answered" or "dense" in conic.message
    if conic.outcome == "answered":
        assert conic.force_disagreement < 1e-4
        assert conic.displacement_disagreement < 1e-4


def test_without_order_the_curve_is_refused_and_the_steps_agree() -> None:
    scene = shaded()
    largest = cr.press(scene, approach=1.0).load
    P, Q = np.array([0.8, 1.0]) * largest, 0.5 * np.array([0.2, 0.5]) * largest
    found = cr.compare_paths(scene, loads=P, forces=Q)
    assert found.order == "fails"
    assert found.entries[1].outcome == "refused"
    assert found.entries[1].path is None
    conic = found.entries[2]
    assert conic.outcome == "answered", conic.message
    assert conic.force_disagreement < 1e-4
    assert "refused: an indentation falls" in repr(found)
    assert np.isnan(found.to_xarray()["asperity_forces"][1]).all()
    found.plot()
