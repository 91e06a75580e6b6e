"""The coupling on a mesh: the sum over pairs, bounds on the error."""

import numpy as np
import pytest
from extended import inverse_sums
from numpy.testing import assert_allclose
from point_layouts import LAYOUTS, disc, jittered
from scenes import MATERIAL

import convexrough as cr
from convexrough.influence import couple
from convexrough.influence.coupling import JointCoupling, inverse_distances
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.pair_sums import Product
from convexrough.influence.scattered import ScatteredInfluence
from convexrough.influence.softened import Softened
from convexrough.influence.splitting import Splitting

SCALE = 0.37


def meshed(operator: ScatteredInfluence) -> bool:
    return operator._double is not None


@pytest.mark.sample(1)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_product_and_its_bound(layout: str) -> None:
    rng = np.random.default_rng(1)
    points = LAYOUTS[layout](rng)
    rows = rng.integers(0, len(points), 60)
    operator = ScatteredInfluence(points, SCALE)
    assert meshed(operator)
    smooth, rough = np.ones(len(points)), rng.standard_normal(len(points))
    few = np.where(rng.random(len(points)) < 0.01, rng.random(len(points)), 0.0)
    for loads in (smooth, rough, few):
        true, rest = inverse_sums(points[rows], points, loads, SCALE)
        sizes = operator.apply(np.abs(loads))
        error = np.abs(operator.apply(loads)[rows] - true - rest)
        assert error.max() <= 1e-13 * sizes.max()
        rounding = operator.rounding(loads)
        assert (error <= rounding.of(sizes)[rows]).all()
        # Never so weak that nothing could be proved with it.
        assert rounding.each <= 1e-10 * sizes.max()
        assert rounding.relative <= 1e-12


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


@pytest.mark.sample(1)
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("power", [2, 3])
def test_falloff(layout: str, power: int) -> None:
    rng = np.random.default_rng(5)
    points = LAYOUTS[layout](rng)
    rows = rng.integers(0, len(points), 60)
    operator = ScatteredInfluence(points, SCALE)
    for strengths in (rng.random(len(points)), np.where(rng.random(len(points)) < 0.1, 1.0, 0.0)):
        true, _ = inverse_sums(points[rows], points, strengths, power=power)
        above = operator.falloff(strengths, power)[rows]
        assert (above >= true).all()
        if layout != "coincident":
            assert (above <= 1.05 * true + 0.02 * np.median(true[true > 0])).all()


def test_among_and_onto() -> None:
    rng = np.random.default_rng(6)
    points = disc(rng)
    operator = ScatteredInfluence(points, SCALE)
    which = np.flatnonzero(points[:, 0] > 0.1)
    loads = rng.random(len(which))
    part = operator.restricted(which)
    assert len(part) == len(which)
    assert_allclose(part.apply(loads), DenseInfluence.assemble(points[which], SCALE).apply(loads))
    others = np.concatenate((rng.uniform(-2, 2, (60, 2)), points[:5]))
    loads = rng.random(len(points))
    few = operator.onto(others)
    true, rest = inverse_sums(others, points, loads, SCALE)
    together = ScatteredInfluence(np.concatenate((others, points)), SCALE)
    joint = JointCoupling(together, len(others))
    for coupling in (few, joint):
        rounding = coupling.rounding(loads)
        error = np.abs(coupling.apply(loads) - true - rest)
        assert (error <= rounding.of(coupling.apply(loads))).all()
        above = coupling.falloff(loads, 2)
        exactly, _ = inverse_sums(others, points, loads, power=2)
        assert ((above >= exactly) & (above <= 1.05 * exactly + 0.01 * exactly.max())).all()


def test_the_most_crowded_pair_is_not_one_of_nearest_neighbours() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [-1.3, 0.0], [-2.2, 0.0]])
    operator = ScatteredInfluence(points, SCALE)
    radii = np.array([1.0, 0.5, 1.0, 0.1])
    assert operator.crowding(radii) == pytest.approx(2.0 / 1.3)


def test_point_error_is_counted() -> None:
    rng = np.random.default_rng(8)
    points = jittered(rng)
    error = 1e-13
    moved = points + rng.choice([-error, error], points.shape)
    operator = ScatteredInfluence(points, SCALE, error)
    loads = rng.random(len(points))
    computed = operator.apply(loads)
    true, rest = inverse_sums(moved[:60], moved, loads, SCALE)
    error = np.abs(computed[:60] - true - rest)
    assert (error <= operator.rounding(loads).of(computed)[:60]).all()
    exactly = ScatteredInfluence(points, SCALE).rounding(loads)
    assert (operator.rounding(loads).of(computed) >= 10 * exactly.of(computed)).all()
    far = points + rng.choice([-2e-6, 2e-6], points.shape)
    rough = ScatteredInfluence(points, SCALE, 2e-6)
    for power in (2, 3):
        above = rough.falloff(loads, power)[:60]
        assert (above >= inverse_sums(far[:60], far, loads, power=power)[0]).all()
    assert (operator.separations() < ScatteredInfluence(points, SCALE).separations()).all()


@pytest.mark.parametrize("count", [0, 1, 2, 3, 50])
def test_few_points(count: int) -> None:
    rng = np.random.default_rng(count)
    points = rng.uniform(-1, 1, (count, 2))
    operator = ScatteredInfluence(points, SCALE)
    loads = rng.random(count)
    true, rest = inverse_sums(points, points, loads, SCALE)
    error = np.abs(operator.apply(loads) - true - rest)
    assert (error <= operator.rounding(loads).of(operator.apply(loads))).all()
    assert operator.apply(loads.astype(np.float32)).dtype == np.float32
    assert (operator.falloff(loads, 2) >= inverse_sums(points, points, loads, power=2)[0]).all()
    assert len(operator.separations()) == count
    assert operator.crowding(np.ones(count)) >= 0


def test_presses_of_points_in_distant_clusters() -> None:
    """Newton's method takes as few steps as for one cluster."""
    rng = np.random.default_rng(10)
    patch = np.stack(np.meshgrid(np.arange(30), np.arange(30)), -1).reshape(-1, 2)
    patch = patch + rng.uniform(-0.3, 0.3, patch.shape)
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    far = np.array([[2e4, 1e4]])
    for points in (np.vstack((patch, patch + far)), np.vstack((patch, far))):
        scene = cr.Scene(np.inf, cr.Asperities(points, 10.0), material, geometry="summit")
        assert cr.press(scene, approach=0.02, influence="scattered").iterations <= 8


def test_slopes_on_a_mesh() -> None:
    rng = np.random.default_rng(1)
    asperities = cr.Asperities(rng.uniform(-1, 1, size=(3000, 2)), 1e-3)
    scene = cr.Scene(1.0, asperities, MATERIAL, geometry="summit")
    loads = rng.uniform(0.5, 1.0, size=3000)
    mesh, matrix = (couple(scene, np.arange(3000), 1.0, kind) for kind in ("scattered", "dense"))
    assert meshed(mesh)  # type: ignore[arg-type]
    found, expected = mesh.slopes(loads), matrix.slopes(loads)
    off = np.abs(found - expected).max(axis=1)
    assert (off <= 1e-10 * np.median(np.abs(expected))).all()
