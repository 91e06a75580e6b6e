"""Load paths and closed ones: the memory curve, general steps, cone programs, and prototypes."""

from collections import Counter
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from friction_scenes import LARGEST, ONE, PAPER, TWO, follow, path_of, shaded
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from levels_reference import Bristles
from numpy.testing import assert_allclose
from scenes import random_scenes

import convexrough as cr
from convexrough.arrays import Array
from convexrough.friction import walk
from convexrough.friction.curve import MemoryCurve

#: On the paper's scene after each point: X, W, front over the largest load, how many slide and
#: how many touch. Prototypes: bristles, and a step per asperity.
VALUES = {
    "one": [
        (0, 0, None, 0, 31),
        (7.3276448474924e-06, 2.3814820748506e-14, 0.3, 12, 31),
        (7.3276448474924e-06, 2.3814820748506e-14, None, 0, 37),
        (-1.4399972915528e-06, 4.6792832656792e-14, 0.575, 6, 37),
        (-2.5831383947188e-06, 8.7606501029899e-14, 0.425, 6, 37),
        (4.7938665937403e-06, 9.1658880935531e-14, 0.525, 6, 37),
        (2.7969942282077e-06, 9.2975537297004e-14, 0.475, 0, 31),
    ],
    "two": [
        (1.5178571428571e-05, 0, None, 0, 37),
        (-4.6663907908195e-06, 9.7302648312866e-14, 0.2 / 3, 6, 19),
        (7.4348708668891e-06, 9.7302648312866e-14, None, 0, 37),
        (-1.2316486990249e-05, 1.8212590535391e-13, 9.3 / 23, 6, 37),
        (1.2989846073507e-06, 2.3011480491173e-13, 0.1 / 3, 0, 7),
        (1.7759489868342e-05, 2.3011480491173e-13, None, 0, 37),
    ],
}
POINTS = {"one": ONE, "two": TWO}

#: Q_i / (f P*) at one asperity of each ring, F E D C B A, after the fourth point.
RING = [0, 1, 7, 13, 19, 31]
FORCES = {
    "one": [-9.9418772118850e-05, -1.2070839330947e-04, -7.0973243179081e-04,
            -1.6145256766410e-03, -8.2252119475348e-03, -6.0880398078360e-03],
    "two": [-1.9297872492929e-02, -2.3160920041346e-02, -2.4555639934336e-02,
            -1.9957310529648e-02, -1.2635373055962e-02, -3.8390713005919e-03],
}  # fmt: skip


@pytest.mark.parametrize("which", VALUES)
def test_values_of_the_prototypes(which: str) -> None:
    path, largest = follow("paper", POINTS[which]), LARGEST["paper"]
    touching = (path.status != "open").sum(axis=1)
    sliding = (path.status == "sliding").sum(axis=1)
    for k, (X, W, front, slide, touch) in enumerate(VALUES[which]):
        assert path.displacements[k] == pytest.approx(X, rel=1e-12, abs=1e-19)
        assert path.losses[k] == pytest.approx(W, rel=1e-11, abs=1e-28)
        assert path.fronts[k] / largest == pytest.approx(front or np.nan, nan_ok=True)
        assert (sliding[k], touching[k]) == (slide, touch)
    assert not (path.status == "undecided").any()
    assert path.order == "proved"
    assert path.presses <= 3 * len(path.loads)
    # How well it is proved.
    assert (path.asperity_force_errors < 1e-13 * largest).all()
    assert (path.displacement_errors < 2e-12 * np.abs(path.displacements).max()).all()
    assert (path.loss_errors < 1e-10 * path.losses[-1]).all()
    assert (path.displacement_errors[1:] > 0).all()
    shares = path.asperity_forces[3, RING] / (0.5 * largest)
    assert_allclose(shares, FORCES[which], rtol=1e-11)


@pytest.mark.parametrize("name", ["paper", "rough"])
def test_constant_load_is_a_history(name: str) -> None:
    scene, P, Q = path_of(name, [(1, t) for t in (0.6, -0.2, 0.3, 0.3, -0.6, 0.9, -0.95)])
    contact = cr.press(scene, load=P[0])
    past = cr.history(contact, forces=Q)
    path = cr.load_path(scene, start=contact, loads=P, forces=Q)
    assert differs(path, past) < 1e-13
    assert_allclose(path.displacements, past.displacements, rtol=1e-13, atol=1e-18)
    assert_allclose(path.losses, past.losses, rtol=1e-12)
    difference = np.abs(path.displacements - past.displacements)
    assert (difference <= path.displacement_errors + past.displacement_errors).all()
    assert (np.abs(path.losses - past.losses) <= path.loss_errors + 1e-13 * past.losses).all()


def test_pulled_off_and_pressed_again() -> None:
    path = follow("paper", [(1, 0.5), (0, 0), (0.6, 0), (0.6, 0.3)])
    assert path.displacements[1] == 0.0
    assert (path.asperity_forces[1] == 0).all()
    assert path.status[1, 0] == "undecided"  # the highest just touches
    assert (path.status[1, 1:] == "open").all()
    fresh = follow("paper", [(0.6, 0), (0.6, 0.3)])
    assert path.displacements[3] == pytest.approx(fresh.displacements[1], rel=1e-13, abs=0.0)
    theirs = fresh.asperity_forces[1]
    assert_allclose(path.asperity_forces[3], theirs, atol=1e-14 * LARGEST["paper"])


def test_the_octagon() -> None:
    t, mean = np.arange(8) * np.pi / 4, LARGEST["paper"] / 1.4
    points = np.column_stack((1 + 0.4 * np.cos(t), 0.5 * np.sin(t + np.pi / 4))) / 1.4
    found, rough = (follow(name, points, cr.steady) for name in ("paper", "rough"))
    assert found.loss_first == pytest.approx(9.5663629049784e-14, rel=1e-12, abs=0.0)
    assert found.loss == pytest.approx(1.9339188634987e-13, rel=1e-12, abs=0.0)
    assert found.level / mean == pytest.approx(0.4318019484661, rel=1e-12)
    assert found.force_level / (0.5 * mean) == pytest.approx(-0.2146446609407, rel=1e-12)
    assert found.order == "proved"
    assert found.loss_error < 1e-10 * found.loss
    assert found.asperity_losses.sum() == pytest.approx(found.loss, rel=1e-3, abs=0.0)
    counts = {"intermittent": 6, "open": 24, "partial": 19, "sliding": 12}
    assert Counter(found.status.tolist()) == counts
    assert rough.loss == pytest.approx(1.9572569969746e-13, rel=1e-12, abs=0.0)


def test_losses_against_phase() -> None:
    """Rows are closed paths of their own; the smooth sphere has a closed form in step."""
    scene, P, phases = PAPER, 0.7 * LARGEST["paper"], [0.0, 0.7, np.pi / 2]
    ellipse = dict(load=P, load_amplitude=0.2 * P, force_amplitude=0.15 * P, chords=12)
    found = cr.phase_losses(scene, **ellipse, phases=phases, factors=[1.0, 0.5])
    assert found.phases.tolist() == phases * 2
    assert found.factors.tolist() == [1.0] * 3 + [0.5] * 3
    loads, forces = cr.elliptic_path(**ellipse, phase=0.7, friction=0.5)
    alone = cr.steady(scene, loads=loads, forces=forces)
    assert found.losses[1] == alone.loss
    assert found.levels[1] == alone.level
    assert found.sliding[1] == np.isin(alone.status, ("sliding", "intermittent")).sum()
    assert found.losses[2] < 0.5 * found.losses[0]
    assert found.order == "proved"


def differs(path: cr.LoadPath, known: cr.LoadPath) -> float:
    """The largest difference of shear forces and displacements, relative to their largest."""
    forces = np.abs(path.asperity_forces - known.asperity_forces).max()
    found = [forces / (0.5 * known.asperity_loads.max())]
    for name in ("displacements", "asperity_displacements", "drifts"):
        moved = np.abs(getattr(path, name) - getattr(known, name)).max()
        found.append(moved / np.abs(known.displacements).max())
    return float(np.max(found))  # nan if one is


@st.composite
def random_paths(
    draw: st.DrawFn, least: float, share: float, count: int = 5
) -> tuple[cr.Scene, Array, Array]:
    """A scene, loads from this part of the largest, and forces up to this share of f P."""
    scene, approach = draw(random_scenes(crowding=0.7, most=10))
    largest = cr.press(scene, approach=approach).load
    assume(largest > 0)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    P = rng.uniform(least, 1.0, count) * largest
    return replace(scene, friction=0.5), P, 0.5 * P * rng.uniform(-share, share, count)


@settings(max_examples=5, deadline=None)
@given(random_paths(0.1, 0.9, count=6))
def test_every_later_cycle_is_the_same(sampled: tuple[cr.Scene, Array, Array]) -> None:
    """Of four points, three times after two others."""
    scene, P, Q = sampled
    found, order = cr.steady(scene, loads=P[2:], forces=Q[2:]), [0, 1, *[2, 3, 4, 5] * 3, 2]
    path = cr.load_path(scene, loads=P[order], forces=Q[order])
    cost = path.losses[14] - path.losses[10]
    uncertainty = path.loss_errors[-1] + path.loss_errors[10] + found.loss_error
    assert cost == pytest.approx(found.loss, abs=uncertainty)
    assert_allclose(path.asperity_forces[10], path.asperity_forces[14], atol=1e-14 * P.max())


@settings(max_examples=5, deadline=None)
@given(random_paths(0.1, 0.95), st.booleans())
def test_random_paths(sampled: tuple[cr.Scene, Array, Array], ties: bool) -> None:
    """With ties: either comes back or does not change, and on one step neither does."""
    scene, P, Q = sampled
    if ties:
        P, Q = P[[0, 0, 1, 1, 2, 0]], Q[[0, 1, 1, 1, 2, 0]] * (P.min() / P.max())
    path = cr.load_path(scene, loads=P, forces=Q)
    assume(path.order != "fails")
    assert differs(cr.load_path(scene, loads=P, forces=Q, general_steps=1), path) <= 1e-12


def test_where_order_fails() -> None:
    """The memory curve is not used, and the steps converge to the bristles."""
    contact = cr.press(shaded(), approach=1.4)
    P = np.array([0.8, 0.8, 1.0]) * contact.load
    Q = 0.5 * np.array([0.0, 0.3, 0.6]) * contact.load
    path = cr.load_path(contact.scene, loads=P, forces=Q)
    assert path.order == "fails"
    assert np.isinf(path.displacement_errors).all()
    assert set(path.status.ravel()) == {"undecided"}
    fine = cr.load_path(contact.scene, loads=P, forces=Q, general_steps=32)
    X = np.abs(path.displacements).max()
    cycle = cr.cycle(contact, displacement=X / 2)
    assert (cycle.order, cycle.displacement_error) == ("fails", np.inf)
    assert cycle.displacement_amplitude == pytest.approx(X / 2, rel=1e-4)
    state = cr.shear(contact, displacement=X / 2)
    assert state.certificate.displacement_error == np.inf
    again = cr.shear(contact, force=state.force)
    assert state.displacement == again.displacement == pytest.approx(X / 2, rel=1e-4)
    assert_allclose(path.displacements, fine.displacements, atol=2e-3 * X)
    bristles = Bristles(contact, count=260, reach=1.3)
    for k in (1, 2):
        (P_k, Q_k) = (np.linspace(each[k - 1], each[k], 41)[1:] for each in (P, Q))
        bristles.to(Q_k, P_k)
        assert bristles.displacement == pytest.approx(fine.displacements[k], abs=5e-3 * X)
        assert_allclose(bristles.forces, fine.asperity_forces[k], atol=5e-3 * Q.max())


def test_without_order_a_cycle_is_repeated_until_its_loss_settles(monkeypatch: Any) -> None:
    scene = shaded()
    load = cr.press(scene, approach=1.4).load
    loads, forces = load * np.array([1.0, 0.7]), load * np.array([0.2, 0.32])
    cycle = cr.steady(scene, loads=loads, forces=forces)
    assert cycle.order == "fails"
    many = [*range(2)] * 9
    losses = cr.load_path(scene, loads=loads[many], forces=forces[many], general_steps=64).losses
    later = np.diff(losses[2::2])
    assert later[0] > 2 * later[-1]  # the second cycle is not the steady one
    assert cycle.loss == pytest.approx(later[-1], abs=1e-3 * losses[2])
    cycle = cr.steady(scene, loads=[load] * 2, forces=load * np.array([0.25, -0.05]))
    every, some = cycle.loop(60), cycle.loop(60, asperities=[5, 2])
    assert cycle.order == "fails"
    assert every.area == pytest.approx(cycle.loss, rel=5e-3)
    assert every.displacements[0] == pytest.approx(every.displacements[-1], rel=1e-6)
    assert_allclose(some.asperity_forces, every.asperity_forces[:, [5, 2]])
    monkeypatch.setattr(walk, "STEADY", -1.0)  # it never settles
    unsettled = cr.steady(scene, loads=loads, forces=forces)
    assert np.isnan([unsettled.loss, unsettled.level]).all()
    (_, chart) = cr.plots.steady_figures(unsettled)["steady"].axes
    assert chart.get_title("left") == "the loss does not settle"


def test_integers_of_numpy() -> None:
    points = [(int(P), int(T)) for P, T in np.array([[73, 5], [7738, 8], [5, 3], [6000, -70]])]
    curve = after([(np.int64(P), np.int64(T)) for P, T in points])  # type: ignore[misc]
    assert shape(curve) == shape(after([(Fraction(P), Fraction(T)) for P, T in points]))
    scene, path = shaded(), {"loads": [1.0], "forces": [0.1]}
    counts = [cr.load_path(scene, **path, general_steps=n).displacements for n in (np.int32(4), 4)]
    assert counts[0] == counts[1]


def test_a_displacement_at_gross_sliding_or_just_below() -> None:
    """The shear force is f P up to rounding."""
    contact = cr.press(shaded(), approach=0.5)
    gross = cr.shear(contact, force=0.5 * contact.load)
    for part in (1.0, 1.0 - 1e-14, 1.0 - 1e-12):
        state = cr.shear(contact, displacement=-part * gross.displacement)
        assert state.displacement == pytest.approx(-part * gross.displacement, rel=1e-14)
        assert state.force == pytest.approx(-gross.force, rel=1e-15)
        assert_allclose(state.forces, -gross.forces, rtol=1e-9)
    with pytest.raises(cr.InputError, match="gross sliding, expected at most X"):
        cr.shear(contact, displacement=1.001 * gross.displacement)


@pytest.mark.parametrize("points", [ONE, TWO])
def test_three_ways_to_one_path(points: list[tuple[float, float]]) -> None:
    scene, P, Q = path_of("paper", points)
    curve, step, conic = three_ways(scene, P, Q)
    assert curve.order == "proved"
    assert differs(step, curve) <= 1e-12
    assert 0 < differs(conic, curve) <= 1e-5


@settings(max_examples=4, deadline=None)
@example((shaded(), np.array([2.4, 3.0]), np.array([0.3, 0.75])))  # where order fails
@given(random_paths(0.2, 0.9))
def test_random_paths_as_cone_programs(sampled: tuple[cr.Scene, Array, Array]) -> None:
    try:
        _, step, conic = three_ways(*sampled)
    except cr.SolverError as error:
        if "dense" not in str(error):
            raise
        return
    assert differs(conic, step) < 1e-4


def three_ways(scene: cr.Scene, P: Array, Q: Array) -> tuple[cr.LoadPath, ...]:
    """By the memory curve, a general step for each segment, and this step as a cone program."""
    ways: list[Any] = [{}, {"general_steps": 1}, {"general_steps": 1, "solver": "conic"}]
    return tuple(cr.load_path(scene, loads=P, forces=Q, **way) for way in ways)


Point = tuple[Fraction, Fraction]


@st.composite
def points(draw: st.DrawFn) -> Point:
    """Some (P, T) with |T| < P, in twelfths: retracing and closed loops are frequent."""
    load = draw(st.integers(0, 36))
    shear = draw(st.integers(-load + 1, load - 1)) if load else 0
    return Fraction(load, 12), Fraction(shear, 12)


paths = st.lists(points(), min_size=1, max_size=12)


def after(path: list[Point], curve: MemoryCurve | None = None) -> MemoryCurve:
    curve = curve or MemoryCurve()
    for point in path:
        curve, _ = curve.go(*point)
    return curve


def shape(curve: MemoryCurve) -> tuple[object, ...]:
    return curve.levels, curve.heights, curve.slopes


def loss(path: list[Point], curve: MemoryCurve | None = None) -> Fraction:
    """Of a made-up V(s) = -s^3: the integral of 3 (P - L)^2 over each front, P and L linear."""
    curve, total = curve or MemoryCurve(), Fraction(0)
    for point in path:
        curve, pieces = curve.go(*point)
        for piece in pieces:
            a, b = piece.load_before - piece.top, piece.load_after - piece.bottom
            squares = (piece.top - piece.bottom) * (a * a + a * b + b * b)
            total += (1 - piece.sign * piece.slope) * squares
    return total


@given(paths, st.lists(st.fractions(0, 1), max_size=3))
def test_splitting_segments_changes_nothing(path: list[Point], cuts: list[Fraction]) -> None:
    split = [
        (P + part * (to_P - P), T + part * (to_T - T))
        for (P, T), (to_P, to_T) in pairwise([(Fraction(0), Fraction(0)), *path])
        for part in (*sorted(cuts), 1)
    ]
    assert shape(after(split)) == shape(after(path))
    assert loss(split) == loss(path)


@given(paths, st.lists(points(), min_size=2, max_size=6))
def test_a_closed_path_is_periodic_after_one_cycle(past: list[Point], cycle: list[Point]) -> None:
    closed = [*cycle, cycle[0]]
    first = after(closed, after(past))
    assert shape(after(closed, first)) == shape(first)
    fresh = after(closed)
    assert loss(closed, fresh) == loss(closed, first)
    high, low = min(p + t for p, t in cycle), min(p - t for p, t in cycle)
    still = (high + low) / 2
    assert still <= min(p for p, _ in cycle)
    curve = first
    for point in cycle:
        curve, pieces = curve.go(*point)
        assert all(piece.bottom >= still for piece in pieces)
        assert cut(curve, still) == cut(first, still)
    assert cut(first, still)[-1] == (still, (high - low) / 2)


def cut(curve: MemoryCurve, level: Fraction) -> list[Point]:
    """The vertices below a level of the curve, and the point there."""
    if level == 0:
        return [(level, level)]
    below = [pair for pair in zip(curve.levels, curve.heights, strict=True) if pair[0] < level]
    k = len(below) - 1
    height = curve.heights[k] + curve.slopes[k] * (level - curve.levels[k])
    return [*below, (level, height)]
