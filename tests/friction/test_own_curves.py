"""Memory curves as arrays, against the exact curves of the same steps."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from convexrough.friction.curve import MemoryCurve
from convexrough.friction.own_curves import OwnCurves
from convexrough.sphere import hertz


def _force(curve: MemoryCurve, k: float) -> float:
    loads = hertz.load(np.array(curve.levels, dtype=float), k)
    return float(np.diff(loads) @ np.array(curve.slopes, dtype=float))


@pytest.mark.parametrize("ties", [True, False])
def test_steps_are_those_of_exact_curves(ties: bool) -> None:
    """Random steps with ties: to the old height, to gross sliding, to a gap and back, nowhere.

    At a tie the front may be either end of a layer, which leaves the curve as it is.
    """
    rng, n = np.random.default_rng(), 40
    k = rng.uniform(0.5, 2.0, n)
    own = rng.uniform(0.0, 1.0, n).round(1)
    curves, exact = OwnCurves.pressed(own, k), [MemoryCurve.pressed(each) for each in own]
    for _ in range(30):
        before, height = own, curves.heights[:, -1]
        own = np.where(rng.random(n) < 0.3, own, rng.uniform(0.0, 1.0, n).round(1))
        own[rng.random(n) < 0.1] = 0.0
        ends = rng.uniform(-1.0, 1.0, n) * own
        if ties:
            ends = rng.choice([-1.0, -0.5, 0.0, 0.25, 1.0], n) * own
            ends = np.where(rng.random(n) < 0.2, np.clip(height, -own, own), ends)
        step = curves.cut(np.minimum(own, before)).step(own, ends)
        exact = [curve.go(*each)[0] for curve, *each in zip(exact, own, ends, strict=True)]
        curves = step.curves
        fronts = [float(c.load if c.front is None else c.front) for c in exact]
        forces = [_force(*each) for each in zip(exact, k, strict=True)]
        if not ties:
            moved = own > 0
            assert_allclose(step.fronts[moved], np.array(fronts)[moved], atol=1e-13)
        assert_allclose(step.forces, forces, atol=1e-13)
        assert_allclose(curves.heights[:, -1], ends, atol=0)
        for i in range(n):
            s, h = (np.array(each, dtype=float) for each in (exact[i].levels, exact[i].heights))
            assert_allclose(np.interp(s, curves.levels[i], curves.heights[i]), h, atol=1e-13)
    assert curves.levels.shape[1] < 30
