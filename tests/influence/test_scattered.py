"""The coupling on a mesh: the sum over pairs, bounds on the error."""

from unittest.mock import Mock

import numpy as np
import pytest
from extended import inverse_sums
from point_layouts import jittered
from scenes import on_sphere

import convexrough as cr
from convexrough.influence.coupling import inverse_distances
from convexrough.influence.pair_sums import Product
from convexrough.influence.scattered import ScatteredInfluence
from convexrough.influence.softened import Softened
from convexrough.influence.splitting import Splitting

SCALE = 0.37


def test_upper_bounds_on_sums() -> None:
    """Also where what is computed is too low, as on a mesh that is coarse enough."""
    rng = np.random.default_rng(13)
    points = rng.uniform(0, 1.2, (300, 2))
    splitting = Splitting(Softened(3, 16, 1.0), 1.0 / 20, 8)
    product = Product.assemble(points, splitting, np.float64)
    inverse = inverse_distances(points, points) ** 3
    too_low = 0
    for i in range(20):
        strengths = np.zeros(len(points))
        strengths[i] = 1.0
        assert (product.above(strengths) >= inverse[i]).all()
        relative = product.rounding(strengths).relative
        low = product.apply(strengths) < (1 - relative) * inverse[i]
        too_low += int(low[inverse[i] > 0].sum())
    assert too_low > 100


def test_point_error_is_counted() -> None:
    rng = np.random.default_rng(8)
    points = jittered(rng)
    moved = points + rng.choice([-1e-13, 1e-13], points.shape)
    operator = ScatteredInfluence(points, SCALE, 1e-13)
    loads = rng.random(len(points))
    computed = operator.apply(loads)
    true, rest = inverse_sums(moved[:60], moved, loads, SCALE)
    assert (np.abs(computed[:60] - true - rest) <= operator.rounding(loads).of(computed)[:60]).all()
    exactly = ScatteredInfluence(points, SCALE).rounding(loads)
    assert (operator.rounding(loads).of(computed) >= 10 * exactly.of(computed)).all()
    far = points + rng.choice([-2e-6, 2e-6], points.shape)
    rough = ScatteredInfluence(points, SCALE, 2e-6)
    for power in (1, 2, 3):
        above = rough.falloff(loads, power)[:60]
        assert (above >= inverse_sums(far[:60], far, loads, power=power)[0]).all()
    assert (operator.separations() < ScatteredInfluence(points, SCALE).separations()).all()


def test_presses_of_points_in_distant_clusters() -> None:
    """Newton's method takes as few steps as for one cluster."""
    rng = np.random.default_rng(10)
    patch = np.stack(np.meshgrid(np.arange(30), np.arange(30)), -1).reshape(-1, 2)
    patch = patch + rng.uniform(-0.3, 0.3, patch.shape)
    far = np.array([[2e4, 1e4]])
    for points in (np.vstack((patch, patch + far)), np.vstack((patch, far))):
        scene = on_sphere(points, 10.0, radius=np.inf)
        assert cr.press(scene, approach=0.02, influence="scattered").iterations <= 8


def test_an_interrupted_mesh_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the operator would fall back to a matrix, which may not fit in memory."""
    operator = ScatteredInfluence(jittered(np.random.default_rng(2)), SCALE)
    with monkeypatch.context() as patch:
        patch.setattr(Product, "assemble", Mock(side_effect=KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            operator.apply(np.ones(len(operator)))
    assert operator._double is not None
