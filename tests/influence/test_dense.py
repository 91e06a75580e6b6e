"""The coupling as a matrix and on a mesh: sums over pairs, bounds on errors, the shell lemma."""

from unittest.mock import Mock

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from multiprecision import exact, inverse_sum, inverse_sums, middle, of_scene
from point_layouts import jittered
from scenes import on_sphere, rough

import convexrough as cr
from convexrough.arithmetic.pairs import Pair
from convexrough.influence.choice import couple
from convexrough.influence.coupling import inverse_distances
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.pair_sums import Product
from convexrough.influence.scattered import ScatteredInfluence
from convexrough.influence.shells import shells
from convexrough.influence.softened import Softened
from convexrough.influence.splitting import Splitting

SCALE = 0.37


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([1, 2, 3, 61, 128, 129, 257, 300, 400]),
    st.sampled_from([1e-150, 1e-9, 1.0, 1e150]),
    st.sampled_from([1e-150, 1.0, 1e7, 1e150]),
    st.sampled_from(["disc", "pairs", "grid"]),
    st.sampled_from(["plain", "uneven", "signs", "zeros"]),
)
def test_sums_are_known(
    seed: int, count: int, length: float, force: float, layout: str, kind: str
) -> None:
    """At all scales; with points in pairs, in ties, and with loads of all sizes and signs."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 2))
    if layout == "grid":
        points = np.stack(np.divmod(np.arange(count), int(np.ceil(np.sqrt(count)))), axis=1) * 1.0
    elif layout == "pairs":
        points[count // 2 :] = points[: count - count // 2] + 1e-6 * points[count // 2 :]
    high = rng.random(count) * {"uneven": 10.0 ** rng.uniform(-40, 0, count)}.get(kind, 1.0)
    if kind in ("signs", "zeros"):
        high *= rng.choice([-1, 1] if kind == "signs" else [0, 0, 1], count)
    points, high = points * length, high * force
    loads = Pair(high, high * 2.0**-54 * rng.uniform(-1, 1, count))
    operator = DenseInfluence.assemble(points, SCALE)
    found = operator.sums(loads)
    ctx.dps = 120
    for row in {0, *rng.integers(0, count, 5).tolist()}:
        places = exact(points)
        true = inverse_sum(places, exact(loads.high) + exact(loads.low), places[row])
        assert abs(middle(found[row]) - true) <= arb(float(found.radius[row]))
    most = float(operator.apply(np.abs(high)).max()) / SCALE
    if layout == "grid" and 1e-150 < most < 1e150:
        assert found.radius.max() <= (1e-25 if kind == "uneven" else 1e-26) * most


def test_sums_where_points_are_pairs() -> None:
    """Of the closest-point geometry as many digits as of summits, and of the true points."""
    scene = rough("closest")
    loads = Pair.exact(np.random.default_rng(4).random(len(scene)))
    found = couple(scene, np.arange(len(scene)), SCALE).sums(loads)
    ctx.dps = 60
    points, _, _ = of_scene(scene)
    for row in range(0, len(scene), 7):
        true = inverse_sum(points, exact(loads.high), points[row])
        assert abs(middle(found[row]) - true) <= arb(float(found.radius[row]))
    assert (found.radius < 1e-26 * found.value).all()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 40), st.floats(0.3, 4))
def test_shell_lemma(seed: int, count: int, shape: float) -> None:
    """A + diag(1 / (pi E* s_i)) is positive semidefinite for any layout."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((count, 2)) * np.abs(rng.standard_normal((count, 1))) ** shape
    matrix = inverse_distances(points, points)
    shifted = matrix + np.diag(shells(DenseInfluence.assemble(points, 1.0)))
    eigenvalues = np.linalg.eigvalsh(shifted)
    assert eigenvalues[0] >= -1e-13 * eigenvalues[-1]
    assert np.linalg.eigvalsh(matrix)[0] < 0  # so the shift is needed


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
