"""Balls against ball arithmetic of 4,000 bits: no number of an operand leaves the result."""

import itertools
import operator
from collections.abc import Callable
from math import fsum, isfinite
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from multiprecision import middle

from convexrough.arithmetic.balls import Ball, residual, stacked
from convexrough.arithmetic.pairs import CHUNK, Pair, two_sum

#: Bits that hold sums and products of any float64 numbers.
BITS = 4000

INF = float("inf")


@st.composite
def numbers(draw: st.DrawFn) -> tuple[float, float, float]:
    """A midpoint (high, low) and a radius: of all sizes, at all distances from 0."""
    kind = draw(st.sampled_from(["plain"] * 6 + ["zero", "subnormal", "huge"]))
    high = draw(st.floats(1, 10)) * 10.0 ** draw(st.integers(-150, 150))
    sizes = {"zero": 0.0, "subnormal": 5e-324 * int(draw(st.integers(1, 99))), "huge": 1e305}
    high = sizes.get(kind, high) * draw(st.sampled_from([-1, 1]))
    high, low = two_sum(high, high * 2.0**-54 * draw(st.sampled_from([0.0, -0.9, 0.3])))
    share = draw(st.sampled_from([0.0, 1e-30, 1e-17, 0.3, 1.0, 7.0, INF]))
    radius = share * abs(high) if high else draw(st.sampled_from([0.0, 1e-200, 1.0, INF]))
    return float(high), float(low), radius


def balls(rows: list[tuple[float, float, float]]) -> Ball:
    high, low, radius = np.array(rows).T
    return Ball(Pair(high, low), radius)


def samples(ball: Ball, i: int) -> list[arb]:
    """The middle, both ends and others; where the radius is infinite, numbers of many sizes."""
    mid, radius = middle(ball[i]), ball.radius[i]
    if radius == INF:
        return [mid, arb(0), arb(1), arb(-1), arb("1e200"), arb("-1e-200")]
    return [mid + arb(radius) * share for share in (-1, arb(-1) / 3, 0, arb(1) / 2, 1)]


def holds(ball: Ball, i: int, number: arb) -> bool:
    """Whether the number, known to many digits, is in the ball; what is none asks for all."""
    radius = ball.radius[i]
    assert isfinite(ball.mid.high[i] + ball.mid.low[i])
    if radius == INF:
        return True
    return bool(number.is_finite() and abs(number - middle(ball[i])) <= arb(radius))


@pytest.fixture(autouse=True)
def many_bits() -> Any:
    with ctx.workprec(BITS):
        yield


some = st.lists(numbers(), min_size=6, max_size=6)
operations = st.sampled_from([operator.add, operator.sub, operator.mul, operator.truediv])


@settings(max_examples=80, deadline=None)
@given(some, some, operations, st.booleans())
def test_arithmetic(first: Any, second: Any, operation: Any, near: bool) -> None:
    """Also of numbers that all but cancel."""
    x, y = balls(first), balls(second)
    if near:
        y = Ball.exact(x.mid + Pair(1e-20 * x.mid.high, 1e-40 * x.mid.low))
    found = operation(x, y)
    for i in range(len(x)):
        for a, b in itertools.product(samples(x, i), samples(y, i)):
            if operation is operator.truediv and b == 0:
                assert found.radius[i] == INF
            else:
                assert holds(found, i, operation(a, b))


FUNCTIONS: dict[str, Callable[[arb], arb]] = {
    "positive_part": lambda x: x.max(0),
    "sqrt": lambda x: x.max(0).sqrt(),
    "cbrt": lambda x: x.max(0).root(3),
    "two_thirds": lambda x: x.max(0).root(3) ** 2,
    "__neg__": lambda x: -x,
}


@settings(max_examples=50, deadline=None)
@given(some, st.sampled_from(sorted(FUNCTIONS)))
def test_functions(rows: Any, name: str) -> None:
    x = balls(rows)
    found = getattr(x, name)()
    for i in range(len(x)):
        assert all(holds(found, i, FUNCTIONS[name](a)) for a in samples(x, i))


@settings(max_examples=20, deadline=None)
@given(some, some, some, some, some)
def test_residual(k: Any, P: Any, v: Any, d: Any, D: Any) -> None:
    """The kernel: k P^(2/3) + v - d - D."""
    operands = [balls(rows) for rows in (k, P, v, d, D)]
    found = residual(*operands)
    for i in range(6):
        ks, Ps, vs, ds, Ds = (samples(each, i)[::2] for each in operands)
        powers = [P.max(0).root(3) ** 2 for P in Ps]
        for a, x, b, c, e in itertools.product(ks, powers, vs, ds, Ds):
            assert holds(found, i, a * x + b - c - e)


@settings(max_examples=60, deadline=None)
@given(st.lists(numbers(), max_size=40), st.integers(0, 2**32 - 1))
def test_sums_of_products(rows: Any, seed: int) -> None:
    """`sum` and `dot` along the last axis, also of nothing."""
    x = balls(rows) if rows else balls([(0.0, 0.0, 0.0)])[:0]
    y = x[np.random.default_rng(seed).permutation(len(x))]
    one, two = x.sum(), stacked([x * y, x]).sum()
    for k in range(5):
        a, b = ([samples(z, i)[k] for i in range(len(z))] for z in (x, y))
        assert holds(one[None], 0, sum(a, arb(0)))
        assert holds(two, 1, sum(a, arb(0)))
        assert holds(x.dot(y)[None], 0, sum(map(operator.mul, a, b), arb(0)))


@settings(max_examples=50, deadline=None)
@given(some)
def test_ends(rows: Any) -> None:
    x = balls(rows)
    for i in range(len(x)):
        for a in samples(x, i):
            for end, sign in ((x.lower[i], -1), (x.upper[i], 1)):
                assert abs(end) == INF or sign * (arb(end) - a) >= 0
            assert x.size[i] == INF or abs(a) <= arb(x.size[i])
            assert x.error[i] == INF or abs(a - arb(x.value[i])) <= arb(x.error[i])
            assert not (x.positive[i] and a <= 0)
            assert not (x.negative[i] and a >= 0)
    finite = np.isfinite(x.lower) & np.isfinite(x.upper)
    between = Ball.between(x.lower[finite], x.upper[finite])
    for i, j in enumerate(np.flatnonzero(finite)):
        assert holds(between, i, arb(x.lower[j]))
        assert holds(between, i, arb(x.upper[j]))


def test_what_is_no_number_is_unknown() -> None:
    one = Ball.exact(np.ones(4))
    for bad in (
        Ball.exact(np.full(4, 1e300)) * np.full(4, 1e300),
        one / np.zeros(4),
        one / Ball.around(np.full(4, 0.5), 0.6),
        Ball.around(np.array([INF, -INF, np.nan, INF]), 0.0),
        Ball.around(np.ones(4), np.nan),
        Ball.between(np.full(4, -INF), np.ones(4)),
    ):
        assert (bad.radius == INF).all()
        assert np.isfinite(bad.value).all()
        assert (bad + 1.0).radius[0] == INF


@pytest.mark.parametrize("count", [1000, CHUNK + 3])
def test_long_sums(count: int) -> None:
    """Of sizes that differ; and of more numbers than are added at once."""
    rng = np.random.default_rng(0)
    high = rng.choice([-1, 1], (2, count)) * 10.0 ** rng.uniform(-3, 3, (2, count))
    x = Pair(*two_sum(high, 2.0**-54 * high * rng.uniform(-1, 1, high.shape)))
    for row, found in zip(zip(*x, strict=True), Ball.exact(x).sum(), strict=True):
        off = fsum([*row[0], *row[1], -found.mid.high, -found.mid.low])
        assert abs(off) <= found.radius <= 1e-28 * np.abs(row[0]).sum()
