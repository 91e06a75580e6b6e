"""Order is proved where no indentation falls, and never where one is seen to."""

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from friction_scenes import around, on_flat, ring, shaded
from scenes import hexagonal, on_sphere
from scipy.spatial.distance import cdist

import convexrough as cr
from convexrough.arrays import Array
from convexrough.bench.scenes import scene as bench_scene
from convexrough.friction import order, sweeping
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.spacing import largest_shell, order_holds, settled_by_rings
from convexrough.friction.sweeping import swept_rates
from convexrough.influence import couple
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


def test_order_of_thousands_on_a_lattice_is_proved_by_all() -> None:
    """More than 2,000 of different heights touch; the bound of a loss is finite."""
    contact = cr.press(bench_scene("rough", 9.0), approach=5e-5)
    assert np.count_nonzero(contact.loads) > order.INVERTED
    cycle = cr.cycle(contact, maximum=0.25 * contact.load)
    assert cycle.order == "proved"
    assert cycle.loss_error <= 1e-11 * cycle.loss


def shells_of(contact: cr.Contact) -> Array:
    """The radii of the shells of theorems 1 and 2."""
    problem, loads = levels_of(contact).top.problem, levels_of(contact).top.loads.value
    return problem.influence.scale * 1.5 * np.cbrt(loads) / problem.coefficients


def assert_rates(points: Array, shells: Array, least: Any, random: np.random.Generator) -> None:
    """No rate is below its least one for these shells, for smaller ones, and for some of them."""
    n, smaller = len(points), random.random((5, len(points)))
    matrix = 1 / (cdist(points, points) + np.diag(np.full(n, np.inf)))
    for share in (1.0, *smaller, *smaller.round()):
        assert (np.linalg.solve(np.eye(n) + matrix * (shells * share), np.ones(n)) >= least).all()


@pytest.mark.sample(5)
@pytest.mark.parametrize("aim", [0.5, 0.9, 1.0, 1.5, 2.0, 2.5])
@pytest.mark.parametrize("seed", range(5))
def test_order_of_random_layouts(seed: int, aim: float) -> None:
    """Proved where contacts are far apart and no indentation falls, and never where one does."""
    contact = random_contact(seed, aim)
    levels, down = levels_of(contact), falls(contact)
    found = levels.order([NOTHING])
    assert found != "proved" if down else found == "proved" or aim > 0.9
    holds = order_holds(contact.scene, levels.top.problem.influence, shells_of(contact))
    assert not (holds and down)


@pytest.mark.parametrize("alpha", [0.0, 0.5, np.pi / 2, 2.5, np.pi])
@pytest.mark.parametrize("d", [1.1, 1.5, 3.0])
def test_lemma_of_theorem_1(d: float, alpha: float) -> None:
    """(4) by quadrature; its sides differ by the sums of the proof, which are positive."""
    p, phi = d * np.exp(1j * alpha), (np.arange(4000) + 0.5) * np.pi / 2000
    at, circle = 1 / abs(1 - p), 1 / abs(np.exp(1j * phi) - p)
    slope = -((1 - p).real) / abs(1 - p) ** 3
    right = (at - 1 / d) / 2 + np.mean((1 / np.sin(phi / 2) ** 2 - 1) * (at - circle)) / 2
    ratios = (1 - 0.5 / np.arange(1, 900)) * np.exp(1j * alpha) / d
    T = np.cumsum(np.cumprod(ratios)[::-1])[::-1]
    excess = 2 * np.sum(abs(T) ** 2) - np.sum(abs(np.cumprod(ratios)) ** 2) / 2
    np.testing.assert_allclose(slope - right, excess / d, rtol=1e-9)
    assert excess >= abs(T[0]) ** 2


@pytest.mark.parametrize("seed", range(20))
def test_theorem_1(seed: int) -> None:
    """Rates are positive where the discs of radius 3 R nearly touch; where they meet, no proof."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 60))
    points, shells = random.random((n, 2)), 10.0 ** random.uniform(-2, 0, n)
    shells *= random.random(n) < 0.8
    if seed % 2:  # equal ones around one that is small
        points, shells = ring(n % 5 + 2), np.r_[random.choice([0, 1e-9, 0.2]), np.ones(n % 5 + 2)]
        points = points + 1e-3 * random.random(points.shape)  # on no lattice
    influence = DenseInfluence.assemble(points, 1.0)
    scene = on_flat(points, 1.0, 0.0)
    shells[0] = shells[0] or 1e-3
    shells /= 3.0 * influence.crowding(shells)
    assert order_holds(scene, influence, 0.999 * shells)
    assert not order_holds(scene, influence, 1.001 * shells)
    assert_rates(points, 0.999 * shells, 0.0, random)


LATTICES = {
    "hexagonal": ((1.0, 0.0), (0.5, 0.75**0.5), 0.425),
    "square": ((1.0, 0.0), (0.0, 1.0), 0.478),
    "1:2": ((1.0, 0.0), (0.0, 2.0), 0.49),
    "1:3": ((0.0, 3.0), (1.0, 0.0), 0.49),
    "oblique": ((1.0, 0.0), (0.3, 1.4), 0.49),
    "nearly hexagonal": ((1.0, 0.0), (-0.45, 0.95), 0.43),
}


@pytest.mark.parametrize("name", LATTICES)
def test_theorem_2(name: str) -> None:
    """Up to the number of a lattice (5) holds and rates are positive; it is as large as it says."""
    random = np.random.default_rng(0)
    first, second, least = LATTICES[name]
    steps = np.stack(np.meshgrid(*2 * [np.arange(-6, 7)]), axis=-1).reshape(-1, 2)
    points = steps @ np.array([first, second])
    largest = largest_shell(on_flat(1e-3 * points, 1.0, 0.0)) / 1e-3
    assert least < largest < 0.5
    b, c = (complex(*each) for each in (first, second))
    inner = (b.conjugate() * c).real
    z = np.array([b, c, b - np.sign(inner) * c if inner else b + c])
    w = np.array([abs(c) ** 2 - abs(inner), abs(b) ** 2 - abs(inner), abs(inner)])
    z, w = np.r_[z, -z], np.r_[w, w] / w.sum() / 2
    assert abs((w * z * z).sum()) < 1e-12
    x = points @ [1, 1j]
    apart = abs(x[:, None] - z)
    left = (w / np.where(apart > 0.1, apart, largest)).sum(axis=1)
    assert (left * abs(x) > 1)[abs(x) > 0].all()
    if largest < 0.49:
        left = (w / np.where(apart > 0.1, apart, 1.01 * largest)).sum(axis=1)
        assert (left * abs(x) < 1)[abs(x) > 0].any()
    for k in range(20):
        shells = largest * random.random(len(x)) ** random.choice([0.1, 1, 10])
        shells *= random.random(len(x)) < (0.9 if k % 2 else 0.5)
        assert_rates(points, shells, 0.0, random)


def test_large_shells_among_rings() -> None:
    """Some shells exceed the number of the lattice. Where rings and weights prove all, rates are
    positive; near the largest shells they prove nothing.
    """
    random, proved, scene = np.random.default_rng(3), 0, hexagonal(1.0, 1.0, 11.0)
    points, limit = scene.asperities.positions, largest_shell(scene)
    A = couple(scene, np.arange(len(scene)), 1.0, "lattice")
    for _ in range(30):
        shells = limit * random.uniform(0.2, 0.9, len(points)) * (random.random(len(points)) < 0.9)
        large = random.integers(0, len(points), 5)
        shells[large] = limit * random.uniform(1.0, 1.4)
        rings = settled_by_rings(scene, A, shells)
        assert not rings[np.hypot(*points.T) > 10.5].any()
        known = np.where(rings, 1e-12, 1.0 - A.apply(shells))
        bounds = swept_rates(A, shells, known, np.zeros(len(points)))
        if (bounds > 0).all():
            proved += 1
            assert_rates(points, shells, 0.0, random)
    assert proved > 10


def test_theorem_3() -> None:
    """Where the bounds (6) on the support are positive, no rate is below its bound; the last of the
    asperities may be off the support. Many draws: few have weights that would be negative.
    """
    random, found = np.random.default_rng(7), 0
    for _ in range(2000):
        n = int(random.integers(3, 9))
        s = n - int(random.integers(2))
        points = random.integers(-3, 4, (n, 2)) / 3 + random.normal(0, 0.02, (n, 2))
        A = DenseInfluence.assemble(points, 1.0).matrix
        c = random.uniform(0.1, 0.6, n) / A.max(axis=1)
        c[s:] = 0.0
        bounds = order.rates_from(c[None, :s], A[None, :, :s], np.full((1, 1), 1e-15))[0]
        if (bounds[:s] > 0).all():
            found += 1
            assert_rates(points, c, bounds - 1e-12, random)
    assert found > 200


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("moved", [0.0, 0.15])
def test_swept_rates_of_many(seed: int, moved: float) -> None:
    """Rates are above their bounds for random stiffnesses, and where all are the largest."""
    random = np.random.default_rng(seed)
    lattice = (cr.Asperities.hexagonal, cr.Asperities.square)[seed % 2]
    points = lattice(spacing=1.0, tip_radius=1.0, within=11.0).positions
    points = points + moved * random.normal(size=points.shape)
    influence, n = DenseInfluence.assemble(points, 1.0), len(points)
    c = influence.separations() * random.uniform(0.05, 0.3, n) * (random.random(n) > 0.1)
    spare = np.full(n, 0.3 * seed)  # bounds below 0 must hold, too
    bounds = swept_rates(influence, c, 1.0 - influence.matrix @ c, spare)
    assert (bounds[c > 0] > 0).all()
    assert_rates(points, c, bounds, random)


@pytest.mark.sample(5)
@pytest.mark.parametrize("seed", range(40))
def test_far_potentials_exceed_their_bound(seed: int) -> None:
    """(8) holds for random weights, at all distances and directions."""
    random = np.random.default_rng(seed)
    points = cr.Asperities.hexagonal(spacing=1.0, tip_radius=1.0, within=11.0).positions
    points = (points + 0.1 * random.normal(size=points.shape)) * [1.0, random.uniform(0.6, 1.0)]
    influence, n = DenseInfluence.assemble(points, 1.0), len(points)
    everyone, far = np.arange(n), random.integers(50, 90)
    swept = sweeping._Swept(influence, everyone, 0.3 * random.random(n))
    near, order = swept.neighbours(everyone, 10), swept.neighbours(everyone, n - 1)
    weights = swept.weights(sweeping.around, everyone, near)
    weights *= random.uniform(1 - 1e-4, 1.0, weights.shape) ** random.choice([0, 1, 10])
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)
    gains = swept.gains(everyone, near, weights, order[:, far])
    ratios = swept._ratios(everyone, near, weights, order[:, far:]).min(axis=1)
    assert (ratios >= 1.0 + 2.0 * gains - 1e-13)[gains > 0].all()
    assert (gains > 0).any()


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


@pytest.mark.parametrize("load", [2.5, 3.0, 3.5, 4.0])
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_no_proof_where_the_middle_is_lifted_out(load: float, share: float) -> None:
    for contact in (around(load), cr.press(shaded(), load=load)):
        found = levels_of(contact).order([Fraction(share * load)])
        assert (found == "fails") == falls(contact, share)


def test_order_is_proved_when_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """1,097 of 1,945 touch, on no lattice. Under a limit of 1,000 no loss is proved."""
    contact = cr.press(bench_scene("scattered", 5.8), approach=5e-5)
    monkeypatch.setattr(FrictionLevels.order, "__defaults__", (1000,))
    assert np.isinf(cr.cycle(contact, maximum=0.1 * contact.load).loss_error)
    assert cr.prove_order(contact, most=1000) == "proved for one step"
    assert cr.prove_order(contact) == "proved"
    cycle = cr.cycle(contact, maximum=0.1 * contact.load)
    assert cycle.loss_error < 1e-11 * cycle.loss


@pytest.mark.parametrize("second", [(0, 2), (0, 3), (0.3, 1.4)])
def test_order_on_lattices_that_are_found(second: Any) -> None:
    """Positions that lie on a lattice up to rounding; and moved by more, on none."""
    places = np.multiply.outer(np.arange(-40, 41), (1, 0))[:, None]
    places = 0.0025 * (places + np.multiply.outer(np.arange(-20, 21), second)).reshape(-1, 2)
    contact = cr.press(on_sphere(places, radius=40.0, friction=0.5), approach=4.5e-4)
    assert 0.5 < contact.crowding < 1.3
    assert np.count_nonzero(contact.loads) > 400
    problem, shells = levels_of(contact).top.problem, shells_of(contact)
    assert order_holds(contact.scene, problem.influence, shells)
    unknown = np.where(np.arange(len(shells)) == 0, np.nan, shells)
    assert not order_holds(contact.scene, problem.influence, unknown)
    moved = places + 1e-9 * np.random.default_rng(0).normal(size=places.shape)
    assert not order_holds(on_sphere(moved, radius=40.0), problem.influence, shells)
