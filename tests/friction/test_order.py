"""Order is proved where no indentation falls, and never where one is seen to."""

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from friction_scenes import SCENES
from path_scenes import around, on_flat, shaded
from point_layouts import on_lattice
from scenes import on_sphere

import convexrough as cr
from convexrough.bench.scenes import scene as bench_scene
from convexrough.friction import order, sweeping
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.sweeping import swept_rates
from convexrough.influence.dense import DenseInfluence

NOTHING = Fraction(0)


def levels_of(contact: cr.Contact) -> FrictionLevels:
    return contact.cached(FrictionLevels)


def random_contact(seed: int, aim: float) -> cr.Contact:
    """Up to nine anywhere, of different sizes, pressed until they are as crowded, or a bit less."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 10))
    scene = on_flat(
        rng.uniform(0, np.sqrt(n), (n, 2)),
        10.0 ** rng.uniform(-1, 0, n),
        rng.uniform(-1, 0, n) * 10.0 ** rng.uniform(-3, 0),
    )
    low, high, highest = 1e-6, 10.0, float(scene.asperities.heights.max())
    best = cr.press(scene, approach=low - highest)
    for _ in range(16):
        middle = float(np.sqrt(low * high))
        contact = cr.press(scene, approach=middle - highest)
        if contact.certificate.scope != "none" and contact.crowding < aim:
            low, best = middle, contact
        else:
            high = middle
    return best


def falls(contact: cr.Contact, low: float = 0.0) -> bool:
    """Whether an indentation that counts falls between some of many levels."""
    levels = levels_of(contact)
    shares = low + (1 - low) * np.linspace(0, 1, 33)[1:] ** 1.5
    here = [levels.at(levels.load * Fraction(share)) for share in shares.tolist()]
    rising = ~levels.top.open
    down = any(((b.indentation - a.indentation).negative & rising).any() for a, b in pairwise(here))
    return down or any((level.indentation.positive & ~rising).any() for level in here)


def test_order_of_thousands_is_proved_without_an_inverse() -> None:
    """1,162 of 2,083 touch; the bound of a loss is finite, and no inverse is made."""
    contact = cr.press(bench_scene("scattered", 6.0), approach=5e-5)
    assert np.count_nonzero(contact.loads) > order.INVERTED
    cycle = cr.cycle(contact, maximum=0.25 * contact.load)
    assert cycle.order == "proved"
    assert cycle.loss_error <= 1e-11 * cycle.loss


@pytest.mark.sample(5)
@pytest.mark.parametrize("aim", [0.5, 0.9, 1.0, 1.5, 2.0, 2.5])
@pytest.mark.parametrize("seed", range(5))
def test_order_of_random_layouts(seed: int, aim: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Proved where contacts are far apart and no indentation falls, and never where one does."""
    contact = random_contact(seed, aim)
    levels, down = levels_of(contact), falls(contact)
    found = levels.order([NOTHING])
    assert found == "fails" if down else found == "proved" or aim > 0.9
    monkeypatch.setattr(order, "INVERTED", 0)
    monkeypatch.setattr(order, "SWEPT", 1)
    proved = order.proved_between(levels.top, levels.at(NOTHING), ~levels.top.open)
    assert proved or aim > 0.9
    assert not (proved and down)
    problem, n = levels.top.problem, len(levels.candidates)
    stiffness = 1.5 * np.cbrt(levels.top.loads.value) / problem.coefficients
    known = 1.0 - problem.influence.matrix @ stiffness
    bounds = swept_rates(problem.influence, stiffness, known, np.zeros(n))
    for part in (0.3, 1.0) if aim <= 0.9 else ():  # regular for all smaller stiffnesses
        matrix = np.eye(n) + problem.influence.matrix * (part * stiffness)
        assert (bounds <= np.linalg.solve(matrix, np.ones(n)) + 1e-12).all()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("moved", [0.0, 0.15])
def test_swept_rates_of_many(seed: int, moved: float) -> None:
    """Rates are above their bounds for random stiffnesses, and where all are the largest."""
    random = np.random.default_rng(seed)
    lattice = (cr.Asperities.hexagonal, cr.Asperities.square)[seed % 2]
    points = lattice(spacing=1.0, tip_radius=1.0, within=11.0).positions
    influence = DenseInfluence.assemble(points + moved * random.normal(size=points.shape), 1.0)
    n, matrix = len(points), influence.matrix
    c = influence.separations() * random.uniform(0.05, 0.3, n) * (random.random(n) > 0.1)
    bounds = swept_rates(influence, c, 1.0 - matrix @ c, np.zeros(n))
    assert (bounds[c > 0] > 0).all()
    for share in (1.0, *random.random((5, n))):
        y = np.linalg.solve(np.eye(n) + matrix * (c * share), np.ones(n))
        assert (y >= bounds).all()


@pytest.mark.parametrize(("family", "count"), [("hexagonal", 6), ("square", 4)])
def test_rings_of_lattices(family: str, count: int) -> None:
    """With equal weights (6) holds for all of the support, and hardly for smaller q."""
    random = np.random.default_rng(count)
    points = getattr(cr.Asperities, family)(spacing=1e-3, tip_radius=1.0, within=0.012).positions
    influence, n = on_lattice(points, 1.0), len(points)
    c = 1e-3 * random.uniform(0.05, 0.45, n) * (random.random(n) > 0.03)
    c[points[:, 0] > 0] *= 0.3  # there, farther asperities determine q
    swept = sweeping._Swept(influence, np.flatnonzero(c), c)
    bounds = swept.rings(influence)
    which = np.flatnonzero(np.isfinite(bounds))
    near, others = swept.neighbours(which, count), swept.neighbours(which, np.count_nonzero(c) - 1)
    ratios = swept._ratios(which, near, np.full(near.shape, 1.0 / count), others)
    assert len(which) > n / 3
    assert (1.0 - bounds[which] >= 1.0 / ratios.min(axis=1)).all()
    assert (1.0 - bounds[which]).min() < 1.001 / ratios.min()


@pytest.mark.sample(5)
@pytest.mark.parametrize("seed", range(40))
def test_far_potentials_exceed_their_bound(seed: int) -> None:
    """(7) holds for random weights on neighbours on one side, at all distances and directions."""
    random = np.random.default_rng(seed)
    points = cr.Asperities.hexagonal(spacing=1.0, tip_radius=1.0, within=11.0).positions
    points = (points + 0.1 * random.normal(size=points.shape)) * [1.0, random.uniform(0.3, 1.0)]
    points = points[points[:, 0] < random.uniform(-5, 11)]
    influence, n = DenseInfluence.assemble(points, 1.0), len(points)
    everyone, far = np.arange(n), random.integers(20, 90)
    swept = sweeping._Swept(influence, everyone, 0.3 * random.random(n))
    near, found = swept.neighbours(everyone, 10), 0
    order = swept.neighbours(everyone, n - 1)
    for moments in (sweeping.around, sweeping.edge, sweeping.corner):
        weights = swept.weights(moments, everyone, near)
        weights *= random.uniform(0.9, 1.0, weights.shape) ** random.choice([0, 1, 10])
        weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)
        gains = swept.gains(everyone, near, weights, order[:, far])
        ratios = swept._ratios(everyone, near, weights, order[:, far:])
        rho = np.abs(swept.places[order[:, far:]] - swept.places[:, None])
        least = 1.0 + 2.0 * gains[:, None] * (swept.extent / rho) ** 2
        assert (ratios >= least - 1e-13)[gains > 0].all()
        found += np.count_nonzero(gains > 0)
    assert found > 0


def test_weights_of_the_linear_program_are_not_negative() -> None:
    """Shells much smaller than distances, for which solvers return some weights below 0."""
    for seed in (5, 7, 9):
        random = np.random.default_rng(seed)
        influence = DenseInfluence.assemble(random.random((60, 2)), 1.0)
        c = 1e-6 * influence.separations() * random.random(60)
        support = np.arange(60)
        swept = sweeping._Swept(influence, support, c)
        weights = swept.lightest(support, swept.neighbours(support, 40))
        assert (weights >= 0).all()
        assert weights.any()


@pytest.mark.sample(2)
@pytest.mark.parametrize("load", [2.5, 3.0, 3.5, 4.0])
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_no_proof_where_the_middle_is_lifted_out(load: float, share: float) -> None:
    for contact in (around(load), cr.press(shaded(), load=load)):
        found = levels_of(contact).order([Fraction(share * load)])
        assert (found == "fails") == falls(contact, share)


def test_order_is_proved_when_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither row sums nor the cheap search prove it here, so no loss is; asked once, all."""
    scene, approach = SCENES["dense"]

    def loss_error(contact: cr.Contact) -> float:
        return cr.cycle(contact, maximum=0.1 * contact.load).loss_error

    asked, unasked = (cr.press(scene, approach=approach) for _ in range(2))
    monkeypatch.setattr(order, "INVERTED", 0)
    monkeypatch.setattr(order, "SWEPT", 1)
    monkeypatch.setattr(FrictionLevels.order, "__defaults__", (5,))
    assert np.isinf(loss_error(unasked))
    assert cr.prove_order(asked, most=5) == "proved for one step"
    assert cr.prove_order(asked) == "proved"
    assert loss_error(asked) < 1e-12 * cr.cycle(asked, maximum=0.1 * asked.load).loss


@pytest.mark.parametrize(
    ("first", "second", "approach"),
    [((1, 0), (0, 2), 4.5e-4), ((1, 0), (0, 3), 4.5e-4), ((1, 0), (0.3, 1.4), 4.5e-4),
     ((0.6, 0.8), None, 3e-4)],
    ids=["1:2", "1:3", "oblique", "slanted line"],
)  # fmt: skip
def test_order_on_lattices_of_other_shapes(first: Any, second: Any, approach: float) -> None:
    """Rims are not at right angles to the direction from the middle, and lines have no width."""
    places = np.multiply.outer(np.arange(-250, 251), first)
    if second:
        places = places[210:291, None] + np.multiply.outer(np.arange(-20, 21), second)
    radius = 40.0 if second else 600.0
    scene = on_sphere(0.0025 * places.reshape(-1, 2), radius=radius, friction=0.5)
    contact = cr.press(scene, approach=approach)
    levels = levels_of(contact)
    assert 0.3 < contact.crowding < 1.3
    assert np.count_nonzero(contact.loads) > order.SWEPT
    problem, n = levels.top.problem, len(levels.candidates)
    c = 1.5 * np.cbrt(levels.top.loads.value) / problem.coefficients
    bounds = swept_rates(problem.influence, c, 1.0 - problem.influence.apply(c), np.full(n, np.inf))
    assert (bounds[c > 0] > 0).all()
