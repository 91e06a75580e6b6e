"""The cone program of vector friction: against Newton's method, and its cones by themselves."""

import re
import sys
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from friction_scenes import (
    FRICTION,
    VECTOR_FRACTIONS,
    assert_solves,
    found,
    lengths,
    pressed,
    with_friction,
)
from numpy.testing import assert_allclose
from scenes import PAPER_APPROACH, scattered

import convexrough as cr
from convexrough import FrictionConic, shear_vector
from convexrough.convex import cones
from convexrough.vector_shear import cones as friction_cones
from convexrough.vector_shear.problem import VectorProblem


def test_without_poissons_ratio_the_cones_agree_too() -> None:
    for fraction in VECTOR_FRACTIONS:
        assert found("paper", 0.0, fraction, True).disagreement < 1e-7


@pytest.mark.parametrize("fraction", [1e-40, *VECTOR_FRACTIONS, 0.9999])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_cones_and_newton_agree(nu: float, fraction: float) -> None:
    """On the paper's scene; and the multipliers of the friction cones are the slips."""
    newton, conic = found("paper", nu, fraction), found("paper", nu, fraction, True)
    size = lengths(newton.forces).max()
    assert lengths(newton.forces - conic.forces).max() < 1e-6 * size
    travel = newton.displacement[0]
    tolerance = 1e-10 if 0.6 < fraction < 0.9 else 1e-7
    assert lengths(newton.slips - conic.slips).max() < tolerance * travel
    assert_allclose(newton.displacement, conic.displacement, rtol=1e-7, atol=1e-7 * travel)
    assert (newton.status == conic.status).all()
    assert_solves(conic, 1e-6)
    assert newton.solver == "newton"
    assert conic.solver == "conic"


@cache
def blunt(tip_radius: float) -> cr.Contact:
    lattice = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=tip_radius, within=0.0102)
    scene = cr.Scene(1.0, lattice, cr.Material(1.0, 0.5), FRICTION)
    return cr.press(scene, approach=PAPER_APPROACH)


@pytest.mark.parametrize("fraction", [1e-6, 0.2, 0.5, 0.9])
@pytest.mark.parametrize("tip_radius", [0.3, 0.5])
def test_five_cones(tip_radius: float, fraction: float) -> None:
    contact = blunt(tip_radius)
    assert 21 / 25 < VectorProblem.of(contact).shift.shares.max() < 1
    force = fraction * FRICTION * contact.load
    newton = shear_vector(contact, force=force)
    conic = shear_vector(contact, force=force, solver=FrictionConic())
    assert lengths(newton.forces - conic.forces).max() < 1e-6 * lengths(newton.forces).max()
    assert_solves(newton, 1e-11)


def test_too_dense_for_a_convex_program() -> None:
    contact = blunt(5.0)
    assert contact.crowding > 1
    force = 0.1 * FRICTION * contact.load
    expected = (
        r"too dense.* is 1\.\d+ of the local stiffness.*convexity numbers.*: \d+ \(\d\.\d+\), "
    )
    with pytest.raises(cr.SolverError, match=expected) as caught:
        shear_vector(contact, force=force, solver=FrictionConic())
    named = re.findall(r"(\d+) \((\d\.\d+)\)", str(caught.value))
    worst = np.array([int(index) for index, _ in named])
    numbers = contact.contact_radii / (np.pi / 4 * 0.0025)
    assert_allclose([float(number) for _, number in named], numbers[worst], rtol=1e-3)
    assert numbers[worst[0]] == numbers.max()


@pytest.mark.parametrize("form", ["four", "five"])
def test_the_cones_in_increments_are_those_of_cones(form: str) -> None:
    """Same determinants x y - w^2 for any lift, and the same energy, not only on the curve."""
    lift = friction_cones.FOUR if form == "four" else friction_cones.FIVE
    theirs = cones.FOUR_CONES if form == "four" else cones.FIVE_CONES
    rng = np.random.default_rng(1)
    nodes, weights = rng.uniform(0, 1, 9), rng.dirichlet(np.ones(9))  # any measure on [0, 1]
    u, t = 1 - nodes, nodes
    moments = [1 + 0 * t, t, t**2, t**3, t**4, t**5, t**5 - t**6]
    if form == "four":
        powers = [1 + 0 * t, (1 - t**2) ** 2, t**2 * u, t**2 * u**2, t**2 * u**3, t**3 * u**3]
    else:
        powers = [u**k for k in range(6)] + [t**3 * u**3]
    values, other = (np.array(each) @ weights for each in (powers, moments))

    def determinants(forms: np.ndarray, at: np.ndarray) -> np.ndarray:
        x, y, w = np.moveaxis(forms @ at, 1, 0)
        return np.asarray(x * y - w * w)

    mine, known = determinants(lift.cones, values), determinants(theirs, other)
    assert (known > 1e-6).all()
    assert_allclose(np.sort(mine), np.sort(known), rtol=1e-10)
    assert lift.share @ values == pytest.approx(1 - other[3], rel=1e-12)
    for S in (0.0, 0.4, 0.84):
        energy = (3 / 5 - S / 3) * other[5] + S / 3 * other[6] - (1 - 2 * S / 3) * other[3]
        energy += 2 / 5 - S / 3
        assert (lift.energy[0] + S * lift.energy[1]) @ values == pytest.approx(energy, rel=1e-10)
    # Each variable is of the order it is said to be of.
    u, t = 1e-4, 1 - 1e-4
    single = [1, (1 - t**2) ** 2, t**2 * u, t**2 * u**2, t**2 * u**3, t**3 * u**3]
    if form == "five":
        single = [1, u, u**2, u**3, u**4, u**5, t**3 * u**3]
    assert_allclose(np.log(single) / np.log(u), lift.orders, atol=0.2)


def test_an_answer_is_judged_and_not_the_word_of_its_solver(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import clarabel

    class Boastful:
        def __init__(self, *data: object) -> None:
            self.real = clarabel.DefaultSolver(*data)

        def solve(self) -> SimpleNamespace:
            answer = self.real.solve()
            x = np.array(answer.x) * 1.01
            return SimpleNamespace(x=x, z=answer.z, status="Solved", iterations=1)

    names = ("DefaultSettings", "ZeroConeT", "SecondOrderConeT")
    fake = SimpleNamespace(
        DefaultSolver=Boastful, **{each: getattr(clarabel, each) for each in names}
    )
    monkeypatch.setitem(sys.modules, "clarabel", fake)
    contact = pressed("paper")
    with pytest.raises(cr.SolverError, match="with Solved"):
        shear_vector(contact, force=0.5 * FRICTION * contact.load, solver=FrictionConic())


def test_scattered_contacts_by_both_solvers() -> None:
    """Twelve random scenes, any force, any direction: cones against Newton."""
    rng = np.random.default_rng(3)
    for seed in range(12):
        scene, approach = scattered(seed, 12, 0.7, 0.3)
        contact = cr.press(with_friction(scene, nu=rng.uniform(0, 0.5)), approach=approach)
        fraction, angle = 10.0 ** rng.uniform(-6, -0.01), rng.uniform(0, 2 * np.pi)
        Q = fraction * FRICTION * contact.load * np.array([np.cos(angle), np.sin(angle)])
        newton = shear_vector(contact, force=Q)
        conic = shear_vector(contact, force=Q, solver=FrictionConic())
        assert lengths(newton.forces - conic.forces).max() < 1e-6 * lengths(newton.forces).max()
        assert lengths(newton.slips - conic.slips).max() < 1e-6 * np.hypot(*newton.displacement)
        # The rounding of B q, some 10 n roundoffs, is part of both.
        assert newton.duality_gap <= 1e-3 * conic.duality_gap + 5e-14 * np.hypot(*Q) * np.hypot(
            *newton.displacement
        )
