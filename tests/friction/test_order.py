"""Order is proved where no indentation falls, and never where one is seen to.

The judges are the levels in between, and the rates (I + A C)^-1 1 of numpy at softnesses within the
bounds that the proof speaks of.
"""

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from friction_scenes import with_friction
from levels_reference import SCENES
from path_scenes import shaded
from scenes import MATERIAL

import convexrough as cr
from convexrough.bench.scenes import scene as bench_scene
from convexrough.friction import order
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.onset import enclosed
from convexrough.friction.sweeping import NEIGHBOURS, swept_rates

NOTHING = Fraction(0)


def levels_of(contact: cr.Contact) -> FrictionLevels:
    return contact.cached(FrictionLevels)


def grazing() -> cr.Contact:
    """One of six around a higher one touches with a load of 1e-12 of the largest, or not at all."""
    turn = np.pi * np.arange(6) / 3
    points = 0.01 * np.vstack(([0.0, 0.0], np.column_stack((np.cos(turn), np.sin(turn)))))
    heights = np.r_[0.0, np.full(6, -2e-5)]

    def pressed() -> cr.Contact:
        scene = cr.Scene(
            1.0, cr.Asperities(points, 0.02, heights), MATERIAL, friction=0.5, geometry="summit"
        )
        return cr.press(scene, approach=8e-5)

    low, high = heights[1] - 8e-5, heights[1]
    for _ in range(50):
        heights[1] = (low + high) / 2
        low, high = (heights[1], high) if pressed().loads[1] == 0 else (low, heights[1])
    return pressed()


def hexagonal(within: float, tip_radius: float, approach: float) -> cr.Contact:
    tips = cr.Asperities.hexagonal(
        spacing=0.0025, tip_radius=tip_radius, within=within, height_std=1e-6, seed=3
    )
    return cr.press(
        cr.Scene(1.0, tips, MATERIAL, friction=0.5, geometry="summit"), approach=approach
    )


def around(load: float) -> cr.Contact:
    """Three equal contacts around a shorter one, crowded by 1.1 to 1.7."""
    turn = 2 * np.pi * np.arange(3) / 3
    points = np.vstack(([0.0, 0.0], np.column_stack((np.cos(turn), np.sin(turn)))))
    asperities = cr.Asperities(points, 1.0, [-0.05, 0.0, 0.0, 0.0])
    return cr.press(cr.Scene(1e6, asperities, MATERIAL, friction=0.5, geometry="summit"), load=load)


def crowding(contact: cr.Contact) -> float:
    """The largest (a_i + a_j) / r_ij."""
    a, points = contact.contact_radii, contact.scene.contact_points
    apart = np.hypot(*np.moveaxis(points[:, None] - points, -1, 0))
    np.fill_diagonal(apart, np.inf)
    both = np.add.outer(a, a) * np.outer(a > 0, a > 0)
    return float((both / apart).max())


def random_contact(seed: int, aim: float) -> cr.Contact:
    """Up to nine anywhere, of different sizes, pressed until they are as crowded, or a bit less."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 10))
    tips = cr.Asperities(
        rng.uniform(0, np.sqrt(n), (n, 2)),
        10.0 ** rng.uniform(-1, 0, n),
        rng.uniform(-1, 0, n) * 10.0 ** rng.uniform(-3, 0),
    )
    scene = cr.Scene(1e6, tips, MATERIAL, friction=0.5, geometry="summit")
    low, high = 1e-6, 10.0
    best = cr.press(scene, approach=low - float(tips.heights.max()))
    for _ in range(16):
        middle = float(np.sqrt(low * high))
        contact = cr.press(scene, approach=middle - float(tips.heights.max()))
        if contact.certificate.scope != "none" and crowding(contact) < aim:
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


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("influence", ["dense", "scattered"])
def test_order_is_proved(name: str, influence: cr.influence.Kind) -> None:
    scene, approach = SCENES[name]
    contact = cr.press(with_friction(scene), approach=approach, influence=influence)
    assert levels_of(contact).order([NOTHING]) == "proved"


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    "patch", [(0.0102, 0.07, 3e-5), (0.02, 0.07, 1e-4), (0.03, 0.02, 4e-4), (0.03, 0.03, 4e-4)]
)
def test_order_of_crowded_lattices_is_proved(
    patch: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Row sums alone do not do: 21 to 259 touch, with crowding 0.78 to 1."""
    contact = hexagonal(*patch)
    assert 0.78 < crowding(contact) < 1.0
    levels = levels_of(contact)
    rising, bottom = ~levels.top.open, levels.at(NOTHING)
    assert order.proved_between(levels.top, bottom, rising)  # by an inverse
    monkeypatch.setattr(order, "INVERTED", 0)
    assert not order.proved_between(levels.top, bottom, rising, 0)
    assert order.proved_between(levels.top, bottom, rising)  # by sweeping


@pytest.mark.sample(2)
@pytest.mark.parametrize("aim", [0.5, 0.9, 1.5, 2.5])
def test_sweeping_says_what_an_inverse_says(aim: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """It proves order of all random layouts of at most nine up to 0.9, and of none that fall."""
    monkeypatch.setattr(order, "INVERTED", 0)
    for seed in range(8):
        contact = random_contact(seed, aim)
        levels = levels_of(contact)
        proved = order.proved_between(levels.top, levels.at(NOTHING), ~levels.top.open)
        assert proved or aim > 0.9
        assert not (proved and falls(contact))


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", ["rough", "dense", "rough, closest"])
def test_swept_rates_bound_those_of_all_softer_contacts(name: str) -> None:
    """For any 0 <= C <= C~, also where a bound is negative: here one of each third touches."""
    scene, approach = SCENES[name]
    contact = cr.press(with_friction(scene), approach=approach)
    problem, rng = levels_of(contact).top.problem, np.random.default_rng(7)
    c = 1.0 / problem.stiffness(np.maximum(levels_of(contact).top.loads.value, 1e-3))
    c = np.where(rng.random(len(c)) < 1 / 3, c, 0.0)
    spare = np.full(len(c), 0.05)
    bounds = swept_rates(problem.influence, c, spare, 1000)
    assert (bounds[c > 0] > 0).all()
    assert (bounds > -0.05).all()
    A = problem.influence.matrix
    for _ in range(20):
        softer = c * rng.random(len(c)) ** rng.integers(0, 4)
        rates = np.linalg.solve(np.eye(len(c)) + A * softer, np.ones(len(c)))
        assert (rates >= bounds).all()


def test_a_singular_system_ends_the_search_for_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only weights of least energy are left, and nothing false is proved."""
    solve, found = np.linalg.solve, []

    def singular(a: Any, b: Any) -> Any:
        if a.ndim == 3 and a.shape[-1] != NEIGHBOURS + 5:
            found.append(a.shape)
            raise np.linalg.LinAlgError
        return solve(a, b)

    monkeypatch.setattr(np.linalg, "solve", singular)
    contact = cr.press(bench_scene("scattered", 1.5), approach=5e-5)
    problem = levels_of(contact).top.problem
    c = np.where(contact.loads[problem.candidates] > 0, 1.0, 0.0) / problem.stiffness(
        np.maximum(levels_of(contact).top.loads.value, 1e-3)
    )
    bounds = swept_rates(problem.influence, c, np.zeros(len(c)), 1000)
    rates = solve(np.eye(len(c)) + problem.influence.matrix * c, np.ones(len(c)))
    assert found
    assert (bounds <= rates).all()


def test_order_of_thousands_is_proved_without_an_inverse() -> None:
    """1,162 of 2,083 touch; the bound of a loss is finite, and no inverse is made."""
    contact = cr.press(bench_scene("scattered", 6.0), approach=5e-5)
    assert np.count_nonzero(contact.loads) > order.INVERTED
    cycle = cr.cycle(contact, maximum=0.25 * contact.load)
    assert cycle.order == "proved"
    assert cycle.loss_error <= 1e-11 * cycle.loss


def test_order_where_one_just_touches_is_proved() -> None:
    contact = grazing()
    assert contact.loads[1] < 1e-11 * contact.loads.max()
    assert levels_of(contact).order([NOTHING]) == "proved"


@pytest.mark.sample(1)
@pytest.mark.parametrize("aim", [0.5, 0.7, 0.9])
def test_order_of_random_layouts_is_proved(aim: float) -> None:
    for seed in range(5):
        contact = random_contact(seed, aim)
        found = levels_of(contact).order([NOTHING])
        assert found == ("fails" if falls(contact) else "proved")


@pytest.mark.sample(2)
@pytest.mark.parametrize("aim", [1.0, 1.5, 2.0, 2.5])
def test_no_proof_where_an_indentation_falls(aim: float) -> None:
    for seed in range(5):
        contact = random_contact(100 + seed, aim)
        if falls(contact):
            assert levels_of(contact).order([NOTHING]) == "fails"


@pytest.mark.sample(3)
@pytest.mark.parametrize("load", [2.5, 3.0, 3.5, 4.0])
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_no_proof_where_the_middle_is_lifted_out(load: float, share: float) -> None:
    for contact in (around(load), cr.press(shaded(), load=load)):
        found = levels_of(contact).order([Fraction(share * load)])
        assert (found == "fails") == falls(contact, share)


def test_ordered_ends_are_no_order() -> None:
    """Every load at the upper level is above that at the lower, and the middle one falls."""
    contact = cr.press(shaded(), load=2.96)
    levels = levels_of(contact)
    middle = Fraction(1.48)
    ends = levels.top.loads - levels.at(middle).loads
    assert ends.positive.all()
    assert falls(contact, 0.5)
    assert levels.order([middle]) == "fails"


def test_onsets_are_enclosed_by_proofs() -> None:
    """An asperity is proved open just below its onset, and to touch just above."""
    scene, approach = SCENES["paper"]
    contact = cr.press(with_friction(scene), approach=approach)
    levels, which = levels_of(contact), np.flatnonzero(contact.loads)
    for asperity, found in enclosed(levels, which.tolist()).items():
        assert found.lower <= found.load <= found.upper
        assert found.upper - found.lower <= Fraction(1e-11) * levels.load
        assert levels.snapshot(found.upper).touching[asperity]
        assert found.load == 0 or levels.snapshot(found.lower).open[asperity]
