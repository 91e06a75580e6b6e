"""Directions of one linear system, used in the next."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from convexrough.convex import recycled as module
from convexrough.convex.newton_step import correct
from convexrough.convex.recycled import Recycled
from convexrough.influence.lattice import LatticeInfluence
from convexrough.scene.lattice import Lattice


def lattice(count: int = 2000) -> LatticeInfluence:
    steps = np.arange(-40, 41)
    sites = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    points = sites @ np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
    points = points[np.argsort((points**2).sum(axis=1))][:count]
    found = Lattice.through(points)
    assert found is not None
    return LatticeInfluence.assemble(points, found, 0.3)


def conditioned(A: Any, root: Any, shares: Any) -> tuple[Any, Any, Any]:
    """Recycled directions v, A v of a matrix and that matrix itself."""
    matrix = np.eye(len(root)) + root[:, None] * A.matrix * root
    kept = Recycled()
    for share in shares:
        v = root * share
        kept.add(v.astype(float), A.matrix @ v, float(share @ matrix @ share))
    return kept, matrix, np.linalg.inv(matrix)


@pytest.mark.parametrize("seed", range(3))
def test_the_exact_inverse_on_what_is_kept(seed: int) -> None:
    """For another W as well; symmetric and positive definite; as before beside it."""
    A, rng = lattice(60), np.random.default_rng(seed)
    root = np.sqrt(rng.random(60)) * (rng.random(60) < 0.8)
    shares = rng.standard_normal((4, 60)) * (root > 0)
    kept, _, _ = conditioned(A, root, shares)
    other = root * (1.0 + 0.3 * rng.uniform(-1, 1, 60))
    matrix = np.eye(60) + other[:, None] * A.matrix * other
    smooth = kept.deflated(lambda values: (values.copy(), 0.0), other)
    columns = np.array([smooth(row)[0] for row in np.eye(60)])
    assert_allclose(columns, columns.T, atol=1e-12)
    assert np.linalg.eigvalsh(columns).min() > 1e-3
    for share in shares:
        p = np.divide(root * share, other, out=np.zeros(60), where=other > 0)
        assert_allclose(columns @ (matrix @ p), p, atol=1e-10)


def test_those_that_open_do_no_harm() -> None:
    A, rng = lattice(60), np.random.default_rng(5)
    root = np.sqrt(rng.random(60)) + 0.1
    kept, _, _ = conditioned(A, root, rng.standard_normal((4, 60)))
    opened = np.where(np.arange(60) % 7 == 0, 0.0, root)
    smooth = kept.deflated(lambda values: (values * (opened > 0), 0.0), opened)
    columns = np.array([smooth(row)[0] for row in np.eye(60)])
    touching = opened > 0
    assert (columns[:, ~touching] == 0).all()
    inside = columns[np.ix_(touching, touching)]
    assert_allclose(inside, inside.T, atol=1e-12)
    assert np.linalg.eigvalsh(inside).min() > 1e-3


@pytest.mark.parametrize("balanced", [False, True])
def test_fewer_products_and_the_same_step(balanced: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    A, rng = lattice(), np.random.default_rng(0)
    root = np.sqrt(1.0 - (A.points**2).sum(axis=1) / 900.0)
    defects = [rng.random(len(A)) * (1.0 + A.points[:, k % 2] / 30) for k in range(3)]
    options: Any = dict(balanced=balanced, tolerance=1e-5)
    products = 0
    apply = LatticeInfluence.apply

    def counted(self: Any, loads: Any) -> Any:
        nonlocal products
        products += 1
        return apply(self, loads)

    monkeypatch.setattr(LatticeInfluence, "apply", counted)
    shells, spent = np.zeros(len(A)), []
    for kept in (None, Recycled()):
        products, steps = 0, []
        for k, defect in enumerate(defects):
            now = root * (1 + 1e-3 * k)
            steps.append(correct(A, shells, now, defect, recycled=kept, **options))
        spent.append((products, steps))
    # Where the sum is kept, the longest wave is out of the way already.
    assert spent[1][0] < spent[0][0] or (balanced and spent[1][0] == spent[0][0])
    for one, other in zip(spent[0][1], spent[1][1], strict=True):
        assert np.linalg.norm(one - other) <= 1e-3 * np.linalg.norm(one)


def test_no_more_are_kept_than_said() -> None:
    A = lattice()
    kept = Recycled()
    rng = np.random.default_rng(0)
    for _ in range(3):
        correct(
            A,
            np.zeros(len(A)),
            np.full(len(A), 0.7),
            rng.random(len(A)),
            balanced=False,
            tolerance=1e-5,
            recycled=kept,
        )
    assert len(kept.changes) == len(kept.displacements) == module.MOST
