"""The cone program of vector friction: against Newton's method, and its cones by themselves."""

import re
from functools import cache
from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, VECTOR_FRACTIONS, found, lengths, pressed, with_friction
from numpy.testing import assert_allclose
from scenes import PAPER_APPROACH, hexagonal

import convexrough as cr
from convexrough import FrictionConic, shear_vector
from convexrough.vector_shear import cones
from convexrough.vector_shear.problem import FrictionProblem


@pytest.mark.sample(3)
@pytest.mark.parametrize("fraction", [1e-40, *VECTOR_FRACTIONS, 0.9999])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_cones_and_newton_agree(nu: float, fraction: float) -> None:
    """On the paper's scene; and the multipliers of the friction cones are the slips."""
    newton, conic = found("paper", nu, fraction), found("paper", nu, fraction, True)
    size = lengths(newton.forces).max()
    assert lengths(newton.forces - conic.forces).max() < 1e-6 * size
    travel = newton.displacement[0]
    # What Clarabel leaves of the total moves X by more, the nearer gross sliding is.
    tolerance = 1e-10 if 0.6 < fraction < 0.9 else 1e-7 if fraction < 0.99 else 1e-6
    assert lengths(newton.slips - conic.slips).max() < tolerance * travel
    within = dict(rtol=max(tolerance, 1e-7), atol=max(tolerance, 1e-7) * travel)
    assert_allclose(newton.displacement, conic.displacement, **within)
    assert (newton.status == conic.status).all()
    assert (newton.solver, conic.solver) == ("newton", "conic")


@cache
def blunt(tip_radius: float) -> cr.Contact:
    scene = with_friction(hexagonal(tip_radius=tip_radius), nu=0.5)
    return cr.press(scene, approach=PAPER_APPROACH)


@pytest.mark.sample(3)
@pytest.mark.parametrize("fraction", [1e-6, 0.2, 0.5, 0.9])
@pytest.mark.parametrize("tip_radius", [0.3, 0.5])
def test_five_cones(tip_radius: float, fraction: float) -> None:
    contact = blunt(tip_radius)
    assert 21 / 25 < contact.cached(FrictionProblem).share < 1
    force = fraction * FRICTION * contact.load
    newton = shear_vector(contact, force=force)
    conic = shear_vector(contact, force=force, solver=FrictionConic())
    assert lengths(newton.forces - conic.forces).max() < 1e-6 * lengths(newton.forces).max()


def test_too_dense_for_a_convex_program() -> None:
    contact = blunt(5.0)
    assert contact.crowding > 1
    force = 0.1 * FRICTION * contact.load
    expected = (
        r"too dense.* is 1\.\d+ of the local compliance.*convexity numbers.*: \d+ \(\d\.\d+\), "
    )
    with pytest.raises(cr.SolverError, match=expected) as caught:
        shear_vector(contact, force=force, solver=FrictionConic())
    named = re.findall(r"(\d+) \((\d\.\d+)\)", str(caught.value))
    worst = np.array([int(index) for index, _ in named])
    numbers = contact.contact_radii / (np.pi / 4 * 0.0025)
    assert_allclose([float(number) for _, number in named], numbers[worst], rtol=1e-3)
    assert numbers[worst[0]] == numbers.max()


def test_an_answer_is_judged_and_not_the_word_of_its_solver(monkeypatch: Any) -> None:
    honest = cones.run_clarabel

    def boastful(*arguments: Any, **settings: Any) -> Any:
        raw = honest(*arguments, **settings)
        return raw._replace(x=1.01 * raw.x, status="Solved")

    monkeypatch.setattr(cones, "run_clarabel", boastful)
    contact = pressed("paper")
    with pytest.raises(cr.SolverError, match="with Solved"):
        shear_vector(contact, force=0.5 * FRICTION * contact.load, solver=FrictionConic())
