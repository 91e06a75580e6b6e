"""What points off their sites change to first order, against 200 bits."""

import numpy as np
import pytest
from flint import arb, ctx

from convexrough.influence.convolution import Box
from convexrough.influence.off_sites import first_order

BASES = {
    "hexagonal": [[1.0, 0.0], [0.5, 0.8660254037844386]],
    "square": [[1.0, 0.0], [0.0, 1.0]],
    "turned": [[0.9, 0.31], [-0.4, 1.1]],
}


@pytest.mark.parametrize("name", BASES)
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (8, 1), (9, 11), (12, 16), (24, 31)])
@pytest.mark.parametrize("kind", ["even", "steep", "few"])
def test_first_order(name: str, shape: tuple[int, int], kind: str) -> None:
    """In each component within the bound, which is small."""
    box = Box(shape, np.array(BASES[name]))
    rng = np.random.default_rng(3)
    sources = np.flatnonzero(rng.random(shape).ravel() < 0.8)
    if len(sources) == 0:
        sources = np.array([0])
    n = len(sources)
    shares = rng.random(n)
    if kind == "steep":
        shares = 10.0 ** rng.uniform(-30, 0, n)
    elif kind == "few":
        shares *= rng.random(n) < 0.1
    angles, sizes = rng.uniform(0, 2 * np.pi, n), rng.random(n)
    off = sizes * np.cos(angles), sizes * np.sin(angles)
    found, error = first_order(box, sources, shares, off)
    places = np.stack(np.divmod(sources, shape[1]), axis=1)
    size = 0.0
    with ctx.workprec(200):
        for m in {0, n // 2, n - 1}:
            exact = arb(0)
            for k in range(n):
                if k != m:
                    i, j = (int(each) for each in places[m] - places[k])
                    x, y = (i * arb(box.basis[0, c]) + j * arb(box.basis[1, c]) for c in (0, 1))
                    along = (arb(off[0][m]) - arb(off[0][k])) * x
                    along += (arb(off[1][m]) - arb(off[1][k])) * y
                    exact -= along / (x * x + y * y).sqrt() ** 3 * arb(shares[k])
            assert abs(arb(float(found[m])) - exact) <= arb(error)
            size = max(size, abs(float(exact.mid())))
    assert error <= 3e-4 * float(np.linalg.norm(shares))
    assert size > 10 * error or n < 3 or kind != "even"


def test_the_error_is_that_of_single_precision() -> None:
    """And not zero: what the bound counts is there."""
    box = Box((24, 31), np.array(BASES["hexagonal"]))
    n = 24 * 31
    rng = np.random.default_rng(1)
    shares, x = rng.random(n), rng.uniform(-0.7, 0.7, n)
    found, error = first_order(box, np.arange(n), shares, (x, 0.0 * x))
    i, j = np.divmod(np.arange(n), 31)
    d = np.stack((i, j), axis=1) @ box.basis
    apart = d[:, None] - d
    r = np.hypot(*np.moveaxis(apart, -1, 0))
    np.fill_diagonal(r, np.inf)
    exact = -((x[:, None] - x) * apart[..., 0] / r**3) @ shares
    off = float(np.abs(found - exact).max())
    assert 1e-4 * error < off < 0.1 * error


@pytest.mark.parametrize("shape", [(64, 2048), (7, 17000)])
def test_rows_that_no_difference_falls_on(shape: tuple[int, int]) -> None:
    """Of a box whose middle rows, where two periods meet, are a block of their own."""
    box = Box(shape, np.eye(2))
    found, error = first_order(box, np.array([0]), np.ones(1), (np.ones(1), np.zeros(1)))
    assert abs(found[0]) <= error < 1e-3
