"""The memory curve: exact plane geometry, without any elasticity."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import convexrough as cr
from convexrough.friction.curve import MemoryCurve

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
    """Of a made-up V(s) = -s^3, in the closed form that load paths use: a cubic is exact."""
    curve, total = curve or MemoryCurve(), Fraction(0)
    for point in path:
        curve, pieces = curve.go(*point)
        for piece in pieces:
            total += (1 - piece.sign * piece.slope) * _cubic(piece)
    return total


def _cubic(piece: object) -> Fraction:
    """The integral of (P - L) D'(L) - D(P) + D(L) over the front, D(s) = -3 s^2: by Simpson."""
    _, _, top, bottom, before, after_ = piece  # type: ignore[misc]

    def at(part: Fraction) -> Fraction:
        level, load = top + part * (bottom - top), before + part * (after_ - before)
        return 3 * (load - level) ** 2

    return (top - bottom) * (at(Fraction(0)) + 4 * at(Fraction(1, 2)) + at(Fraction(1))) / 6


@given(paths, st.lists(st.fractions(0, 1), max_size=3))
def test_splitting_segments_changes_nothing(path: list[Point], cuts: list[Fraction]) -> None:
    split: list[Point] = []
    here: Point = (Fraction(0), Fraction(0))
    for target in path:
        for part in sorted(cuts):
            split.append(tuple(a + part * (b - a) for a, b in zip(here, target, strict=True)))  # type: ignore[arg-type]
        split.append(target)
        here = target
    assert shape(after(split)) == shape(after(path))
    assert loss(split) == loss(path)


@given(paths)
def test_the_curve_is_a_path_without_slip_to_the_same_state(path: list[Point]) -> None:
    curve = after(path)
    again, cost = MemoryCurve(), []
    for point in zip(curve.levels[1:], curve.heights[1:], strict=True):
        again, pieces = again.go(*point)
        cost += pieces
    assert shape(again) == shape(curve)
    assert cost == []


@given(paths)
def test_the_curve_is_well_formed(path: list[Point]) -> None:
    curve, cost = MemoryCurve(), Fraction(0)
    for point in path:
        curve, pieces = curve.go(*point)
        assert (curve.load, curve.height) == point
        assert all(a < b for a, b in zip(curve.levels, curve.levels[1:], strict=False))
        assert all(-1 <= slope <= 1 for slope in curve.slopes)
        assert all(a != b for a, b in zip(curve.slopes, curve.slopes[1:], strict=False))
        assert curve.front is None or 0 < curve.front <= curve.load or curve.load == 0
        for piece in pieces:
            assert piece.bottom < piece.top <= piece.load_before
            assert piece.bottom <= piece.load_after
            cost += _cubic(piece)
    assert cost >= 0


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
    pairs = list(zip(curve.levels, curve.heights, strict=True))
    below = [pair for pair in pairs if pair[0] < level]
    k = len(below) - 1
    height = curve.heights[k] + curve.slopes[k] * (level - curve.levels[k])
    return [*below, (level, height)]


def test_constant_load_is_masing() -> None:
    """L = P - T of the virgin curve and P - T of half the range of every branch."""
    one = Fraction(1)
    path = [(one, Fraction(t, 10)) for t in (0, 6, -2, 3)]
    assert after(path[:2]).front == Fraction(4, 10)
    assert after(path[:3]).front == Fraction(6, 10)
    assert after(path).front == Fraction(75, 100)
    forgotten = [*path, (one, Fraction(7, 10))]
    assert shape(after(forgotten)) == shape(after([path[0], forgotten[-1]]))


@pytest.mark.parametrize(
    ("path", "fronts"),
    [
        (
            [(0.6, 0), (0.6, 0.3), (1, 0.3), (1, -0.15), (0.7, -0.15), (0.7, 0.2), (0.5, 0.1)],
            [None, 0.3, None, 0.575, 0.425, 0.525, 0.475],
        ),
        (
            [(1, 0.5), (0.3, -0.2), (0.9, 0.35), (0.9, -0.6), (0.05, 0), (0.8, 0.6)],
            [None, 0.2 / 3, None, 9.3 / 23, 0.1 / 3, None],
        ),
    ],
)
def test_fronts_of_two_paths(path: list[tuple[float, float]], fronts: list[float | None]) -> None:
    curve = MemoryCurve()
    for point, front in zip(path, fronts, strict=True):
        curve, _ = curve.go(*point)
        if front is None:
            assert curve.front is None
        else:
            assert float(curve.front or 0.0) == pytest.approx(front)


def test_pulled_off_everything_is_forgotten() -> None:
    curve = after([(Fraction(1), Fraction(1, 2)), (Fraction(0), Fraction(0))])
    assert shape(curve) == shape(MemoryCurve())


def test_gross_sliding_is_refused() -> None:
    with pytest.raises(cr.InputError, match="at most the load"):
        MemoryCurve().go(1.0, 1.5)


@settings(max_examples=20)
@given(st.fractions(0, 1), points(), st.integers(-3, 3))
def test_running_back_costs_nothing(part: Fraction, point: Point, steep: int) -> None:
    load, height = point
    slope = Fraction(steep, 4)
    if load == 0:
        return
    start = after([(load, height)])
    out = start.go(load + 1, height + slope)[0]
    back, pieces = out.go(load + part, height + slope * part)
    assert pieces == []
    assert back.height == height + slope * part
