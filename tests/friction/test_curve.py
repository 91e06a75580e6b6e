"""The memory curve: exact plane geometry, without any elasticity."""

from fractions import Fraction
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

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
    pairs = list(zip(curve.levels, curve.heights, strict=True))
    below = [pair for pair in pairs if pair[0] < level]
    k = len(below) - 1
    height = curve.heights[k] + curve.slopes[k] * (level - curve.levels[k])
    return [*below, (level, height)]
