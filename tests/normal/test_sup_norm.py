"""The bound in the sup norm, against inverses of matrices, areas of caps and proved solutions."""

from typing import Any

import multiprecision
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scenes import CASES, NAMED, reference
from scipy.optimize import minimize_scalar

import convexrough as cr
from convexrough.influence import Kind
from convexrough.influence.coupling import inverse_distances
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.lattice import LatticeInfluence
from convexrough.influence.scattered import ScatteredInfluence
from convexrough.normal import judgement
from convexrough.normal.sup_norm import SIZES, SupNorm, firmness
from convexrough.scene.lattice import Lattice

Array = NDArray[np.float64]

SCALE = 0.37


def layout(rng: np.random.Generator, count: int, lattice: bool) -> Array:
    """Points of a random lattice with holes, or anywhere with a least distance."""
    if lattice:
        basis = np.array([[1.0, 0.0], [rng.uniform(-0.5, 0.5), rng.uniform(0.9, 1.5)]])
        steps = np.arange(-12, 13)
        sites = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        sites = sites[np.argsort((sites**2).sum(axis=1))][: count + count // 4]
        middle = min(count, 9)  # no holes here: this is where a lattice is looked for
        holes = middle + rng.permutation(len(sites) - middle)[: count // 4]
        sites = np.delete(sites, holes, axis=0)
        return np.asarray(sites @ basis)
    points = [np.zeros(2)]
    while len(points) < count:
        point = rng.uniform(-1, 1, 2) * np.sqrt(count)
        if min(float(np.hypot(*(point - other))) for other in points) > 0.7:
            points.append(point)
    return np.array(points)


def stiffness(rng: np.random.Generator, points: Array, crowding: float, spread: float) -> Array:
    """h of discs of random sizes, the most crowded pair of which has this crowding."""
    radii = rng.lognormal(0.0, spread, len(points))
    inverse = inverse_distances(points, points)
    radii *= crowding / float((np.add.outer(radii, radii) * inverse).max())
    return np.asarray(SCALE / (2.0 / np.pi * radii))


@example(seed=0, lattice=False, count=5, crowding=1.0, spread=1.0)  # discs of all sizes touch
@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.booleans(),
    st.integers(2, 150),
    st.floats(0.05, 1.15),
    st.sampled_from([0.0, 0.2, 1.0]),
)
def test_no_residual_does_more(
    seed: int, lattice: bool, count: int, crowding: float, spread: float
) -> None:
    """Row sums of |M^-1|, |A M^-1| and its continuation are the most that any |f| <= 1 can do."""
    rng = np.random.default_rng(seed)
    points = layout(rng, count, lattice)
    h = stiffness(rng, points, crowding, spread)
    A = DenseInfluence.assemble(points, SCALE)
    sup = SupNorm.of(A, h)
    if sup is None:
        assert crowding > 1.0  # discs that do not overlap are always proved
        return
    stiffer = h * (1.0 + rng.random(len(h)) * rng.choice([0.0, 1.0]))
    inverse = np.linalg.inv(np.diag(stiffer) + A.matrix)
    ones = np.ones(len(h))
    assert (np.abs(inverse).sum(axis=1) <= sup.load_errors(ones, 1.0)).all()
    assert (np.abs(inverse).sum(axis=1) * h <= sup.growth).all()
    assert (np.abs(A.matrix @ inverse).sum(axis=1) <= sup.moves(A, 1.0)).all()
    elsewhere = points[rng.integers(len(points), size=50)] + rng.normal(0, 0.3, (50, 2))
    coupling = A.onto(elsewhere)
    moved = SCALE * inverse_distances(elsewhere, points) @ inverse
    assert (np.abs(moved).sum(axis=1) <= sup.moves_at(coupling, 1.0)).all()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 40), st.floats(0.1, 1.1))
def test_each_residual_counts_for_its_own_load(seed: int, count: int, crowding: float) -> None:
    """Residuals of very different sizes: bounds on each load from its own and the largest."""
    rng = np.random.default_rng(seed)
    points = layout(rng, count, False)
    h = stiffness(rng, points, crowding, 0.3)
    A = DenseInfluence.assemble(points, SCALE)
    sup = SupNorm.of(A, h)
    if sup is None:
        return
    residuals = 10.0 ** rng.uniform(-6, 0, count)
    worst = np.abs(np.linalg.inv(np.diag(h) + A.matrix)) @ residuals
    assert (worst <= sup.load_errors(residuals, float(residuals.max()))).all()


def test_the_bound_is_not_far_from_the_truth() -> None:
    """On a lattice as in the paper: within a factor of 2 of the worst residual, at any number."""
    for count in (60, 700):
        points = layout(np.random.default_rng(1), count, True)
        h = stiffness(np.random.default_rng(1), points, 0.57, 0.0)
        A = DenseInfluence.assemble(points, SCALE)
        worst = float((np.abs(np.linalg.inv(np.diag(h) + A.matrix)).sum(axis=1) * h).max())
        sup = SupNorm.of(A, h)
        assert sup is not None
        assert 0.5 * sup.growth < worst < sup.growth < 3.2


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("packing", [0.01, 0.2, 0.45, 0.7])
def test_firmness(packing: float, size: float) -> None:
    """The least over caps of V / K (tau - q) - 1 + 2 alpha, by quadrature of Poisson's kernel."""
    heights = np.linspace(-1.0, 1.0, 200_001)
    kernel = (1.0 - packing**2) / 2.0 / (1.0 + packing**2 - 2.0 * packing * heights) ** 1.5
    steps = np.append(0.0, np.cumsum((kernel[1:] + kernel[:-1]) / 2.0 * np.diff(heights)))

    def value(height: float) -> float:
        measure = steps[-1] - float(np.interp(height, heights, steps))
        area = (1.0 - height) / 2.0
        return 2.0 * (1.0 - measure) / (1.0 - packing) * (size - packing) - 1.0 + 2.0 * area

    least = minimize_scalar(value, bounds=(-1.0, 1.0), method="bounded").fun
    least = min(least, value(-1.0), value(1.0))
    assert firmness(packing, size) == pytest.approx(least, abs=1e-6)


@pytest.mark.parametrize("count", [6, 12, 24])
def test_in_space_the_bound_is_nearly_reached(count: int) -> None:
    """The theorem holds in space: one charge in a cage of others is worse than any in a plane."""
    rng = np.random.default_rng(count)
    around = rng.standard_normal((count, 3))
    for _ in range(2000):  # pushed apart on the sphere
        apart = around[:, None] - around
        cubes = (apart**2).sum(axis=2) ** 1.5 + np.eye(count)
        around += 1e-2 * (apart / cubes[:, :, None]).sum(axis=1)
        around /= np.linalg.norm(around, axis=1)[:, None]
    points = np.vstack((np.zeros(3), around))
    r = np.linalg.norm(points[:, None] - points, axis=2)
    inverse = np.divide(1.0, r, out=np.zeros_like(r), where=r > 0)
    A = DenseInfluence(points, SCALE, SCALE * inverse, 0.0, 1e-15)
    nearest = 1.0 / inverse[1:, 1:].max()
    h = SCALE / (0.3 * np.append(1.0, np.full(count, min(nearest, 1.0))))
    sup = SupNorm.of(A, h)
    assert sup is not None
    found = np.linalg.inv(np.diag(h) + A.matrix)
    assert (np.abs(found).sum(axis=1) <= sup.load_errors(np.ones(len(h)), 1.0)).all()
    assert (np.abs(A.matrix @ found).sum(axis=1) <= sup.moves(A, 1.0)).all()
    assert (np.abs(found).sum(axis=1) * h).max() > 0.3 * sup.growth


def test_no_firmness_without_room() -> None:
    """Shells that meet, and shells that are too close, prove nothing."""
    points = np.array([[0.0, 0.0], [1.0, 0.0]])
    A = DenseInfluence.assemble(points, SCALE)
    for radius, proved in ((0.3, True), (0.45, False), (0.6, False)):
        assert (SupNorm.of(A, np.full(2, SCALE / radius)) is not None) == proved
    assert firmness(0.8, 1.0) < 0


def test_within_the_shell_of_another() -> None:
    """An asperity that carries nothing in either state may be anywhere, and feel more than K."""
    points = np.array([[0.0, 0.0], [0.01, 0.0], [1.0, 0.0]])
    A = DenseInfluence.assemble(points, SCALE)
    h = np.array([SCALE / 0.2, np.inf, SCALE / 0.2])
    sup = SupNorm.of(A, h)
    assert sup is not None
    v = np.linalg.solve(np.diag(h[[0, 2]]) + A.matrix[np.ix_([0, 2], [0, 2])], [1.0, -1.0])
    moved = float(A.matrix[1, [0, 2]] @ v)
    assert sup.moves(A, 1.0)[0] < abs(moved) <= sup.moves(A, 1.0)[1]


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.booleans(),
    st.integers(1, 120),
    st.floats(0.1, 1.0),
    st.sampled_from([0.0, 0.3, 3.0]),
)
def test_packing(seed: int, lattice: bool, count: int, coverage: float, spread: float) -> None:
    """Of all pairs, through every operator: also of few asperities of very different sizes."""
    rng = np.random.default_rng(seed)
    points = layout(rng, count, lattice)
    radii = rng.lognormal(0.0, spread, len(points)) * (rng.random(len(points)) < coverage)
    inverse = inverse_distances(points, points)
    if (largest := float((np.add.outer(radii, radii) * inverse).max())) > 0:
        radii *= rng.uniform(0.2, 1.1) / largest
    pairs = radii * (radii[:, None] > 0) * inverse
    with np.errstate(divide="ignore"):
        true = float(np.where(pairs < 1, pairs.T / (1.0 - pairs), np.inf).max())
    operators: list[Any] = [
        DenseInfluence.assemble(points, SCALE),
        ScatteredInfluence(points, SCALE),
    ]
    found = Lattice.through(points)
    if found is not None:
        operators.append(LatticeInfluence.assemble(points, found, SCALE))
    for A in operators:
        packing = A.packing(radii)
        if true < 1 - 1e-9:
            assert true * (1 - 1e-14) <= packing <= true * (1 + 1e-9)
        else:
            assert packing >= 1 - 1e-9


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("name", "kind"), CASES)
def test_any_weights_bound_the_approach(
    name: str, kind: Kind, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Weights that do not ride on anything prove less, and nothing wrong."""
    scene, approach = NAMED[name]
    contact = cr.press(scene, approach=approach)
    exact = reference(scene, load=contact.load)
    sharp = cr.certify(scene, contact.loads, load=contact.load, influence=kind)
    assert sharp.approach_error <= 1e-13 * approach
    rng, riding = np.random.default_rng(seed), judgement.riding_weights
    spread = 10.0 ** rng.uniform(-4, 0)

    def poor(problem: Any, loads: Array) -> Array:
        return riding(problem, loads) * rng.lognormal(0, spread, len(loads))

    monkeypatch.setattr(judgement, "riding_weights", poor)
    wrong = contact.loads * (1 + 10.0 ** rng.uniform(-15, -3) * rng.standard_normal(len(scene)))
    judged = cr.certify(scene, wrong, load=contact.load, influence=kind)
    drift = abs(float(multiprecision.errors([judged.approach], [exact.approach])[0]))
    assert drift <= judged.approach_error
    errors = np.abs(multiprecision.errors(wrong, exact.loads))
    assert (errors <= judged.load_errors).all()
