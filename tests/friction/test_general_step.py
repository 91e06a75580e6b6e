"""The general step: what the memory curve finds where indentations are ordered, and where not.

Where they are not, tests/attack compares it with bristles that stick or slip one by one.
"""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from path_scenes import shaded
from scenes import random_scenes

import convexrough as cr


def agree(a: cr.LoadPath, b: cr.LoadPath, within: float) -> None:
    P, X = a.loads.max(), np.abs(a.asperity_displacements).max()
    assert_allclose(a.displacements, b.displacements, atol=within * X)
    assert_allclose(a.asperity_forces, b.asperity_forces, atol=within * 0.5 * P)
    assert_allclose(a.asperity_displacements, b.asperity_displacements, atol=within * X)
    assert_allclose(a.drifts, b.drifts, atol=within * X)


@settings(max_examples=5, deadline=None)
@given(random_scenes(crowding=0.7, most=10), st.integers(0, 2**32 - 1))
def test_random_paths(sampled: tuple[cr.Scene, float], seed: int) -> None:
    scene, approach = sampled
    largest = cr.press(scene, approach=approach).load
    if largest == 0:
        return
    rng = np.random.default_rng(seed)
    P = rng.uniform(0.1, 1.0, 6) * largest
    Q = 0.5 * P * rng.uniform(-0.95, 0.95, 6)
    scene = replace(scene, friction=0.5)
    path = cr.load_path(scene, loads=P, forces=Q)
    if path.order == "fails":
        return
    agree(path, cr.load_path(scene, loads=P, forces=Q, general_steps=1), 1e-12)


def test_where_order_fails() -> None:
    """The memory curve is not used, and the steps converge."""
    scene = shaded()
    largest = cr.press(scene, approach=1.4).load
    P = np.array([0.8, 0.8, 1.0]) * largest
    Q = 0.5 * np.array([0.0, 0.3, 0.6]) * largest
    path = cr.load_path(scene, loads=P, forces=Q)
    assert path.order == "fails"
    assert np.isinf(path.displacement_errors).all()
    assert set(path.status.ravel()) == {"undecided"}
    fine = cr.load_path(scene, loads=P, forces=Q, general_steps=32)
    X = np.abs(path.displacements).max()
    assert_allclose(path.displacements, fine.displacements, atol=2e-3 * X)
