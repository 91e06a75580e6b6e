"""Linear solves at a level against the same in 100 digits: no radius is too small."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import FRICTION
from gradient_oracle import DIGITS, exact, solve
from levels_reference import SCENES, pressed, reference

import convexrough as cr
from convexrough.contact import levels_of
from convexrough.normal.level import Level
from convexrough.numbers.balls import Ball


def level_of(contact: cr.Contact, fraction: float) -> Level:
    """At P - fraction P, as `levels_reference.reference` has it."""
    levels = contact.cached(levels_of)
    force = Fraction(fraction * FRICTION * contact.load)
    return levels.below(Ball.exact(force / Fraction(FRICTION * levels.problem.units.force)))


def holds(ball: Ball, true: Any) -> bool:
    """Whether the truth is within the radii."""
    parts = (np.atleast_1d(part) for part in (ball.mid.high, ball.mid.low, ball.radius))
    return all(
        abs(arb(float(high)) + arb(float(low)) - each) <= float(radius)
        for high, low, radius, each in zip(*parts, np.atleast_1d(true), strict=True)
    )


@pytest.mark.parametrize("name", SCENES)
def test_a_response_solves_its_system(name: str) -> None:
    contact, state = pressed(name, "load"), reference(name, 0.37, "load").held
    level = level_of(contact, 0.37)
    units, rng = level.problem.units, np.random.default_rng(4)
    right, total = rng.normal(size=len(level.problem)), float(rng.normal())
    found = level.response(Ball.exact(right), Ball.exact(total))
    places = np.searchsorted(level.problem.candidates, state.touching)
    with ctx.workdps(DIGITS):
        stiffness = 2 * state.thresholds / (3 * state.P)
        matrix = (state.inner + np.diag(stiffness)) * (arb(units.force) / arb(units.length))
        n = len(places)
        bordered = np.block([[matrix, np.full((n, 1), arb(-1))], [np.full((1, n), arb(1)), arb(0)]])
        true = solve(bordered, np.append(exact(right[places]), arb(total)))
        assert holds(found.loads[places], true[:n])
        assert holds(found.approach, true[n])
    assert not np.delete(found.loads.size, places).any()
    assert found.loads.radius.max() <= 1e-20 * np.abs(found.loads.value).max()


def test_the_tangent_is_a_response() -> None:
    level = level_of(pressed("rough", "load"), 0.2)
    zero, one = Ball.exact(np.zeros(len(level.problem))), Ball.exact(1.0)
    again, q = level.response(zero, one), level.tangent
    assert (np.abs((again.loads - q.loads).value) <= again.loads.radius + q.loads.radius).all()
    assert q.loads.sum().value == pytest.approx(1.0, abs=1e-15)


def test_what_is_not_convex_has_no_response() -> None:
    """Slopes that are too large: the energy has no least."""
    level = level_of(pressed("paper", "load"), 0.2)
    springs = level.springs
    level.__dict__["springs"] = springs._replace(
        slopes=1e3 * springs.slopes, stiffness=springs.stiffness / 1e3
    )
    right = Ball.exact(np.random.default_rng(0).normal(size=len(level.problem)))
    with pytest.raises(cr.SolverError, match="press less hard"):
        level.response(right, Ball.exact(0.0))
