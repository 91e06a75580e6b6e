"""Derivatives of contacts, friction states, histories and onsets, against 130 digits."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flint import arb
from friction_scenes import FRICTION, with_friction
from gradient_oracle import (
    Judge,
    Setup,
    assert_slopes,
    close,
    exact,
    press,
    remembered,
    sheared,
)
from scenes import NAMED

import convexrough as cr

CLOSE, NEAR_GROSS = 2e-13, 1e-12


def pressed(name: str, control: str) -> cr.Contact:
    scene, approach = NAMED[name]
    contact = cr.press(with_friction(scene), approach=approach)
    return contact if control == "approach" else cr.press(contact.scene, load=contact.load)


def of_contact(contact: cr.Contact, holding: str, number: Callable[[Any], Any]) -> Judge:
    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        oracle = press(contact, setup, near)
        return number(oracle), oracle

    return Judge(Setup.of(contact, holding), value)


def of_state(
    contact: cr.Contact, holding: str, force: float, number: Callable[[Any], Any]
) -> Judge:
    solved = sheared(contact, holding, force)

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        state = solved(setup, near)
        return number(state), state

    return Judge(Setup.of(contact, holding, [force]), value)


@pytest.mark.parametrize("name", ["paper", "rough", "rough, closest", "steel"])
def test_the_approach_under_a_load(name: str) -> None:
    contact = pressed(name, "load")
    judge = of_contact(contact, "load", lambda oracle: oracle.approach)
    gradient = contact.gradient(approach=1.0)
    assert_slopes(judge, gradient, CLOSE)
    assert gradient.value == contact.approach
    assert gradient.heights.sum() == pytest.approx(-1.0, abs=1e-12)


@pytest.mark.parametrize("name", ["paper, closest", "rough", "steel"])
def test_the_load_under_an_approach(name: str) -> None:
    contact = pressed(name, "approach")
    judge = of_contact(contact, "approach", lambda oracle: oracle.P.sum())
    gradient = contact.gradient(load=1.0)
    assert_slopes(judge, gradient, CLOSE)
    assert gradient.heights.sum() == pytest.approx(gradient.approach, rel=1e-12)


@pytest.mark.parametrize("name", ["rough", "rough, closest"])
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_any_sum_of_loads_and_gaps(name: str, holding: Any) -> None:
    contact, rng = pressed(name, "load"), np.random.default_rng(5)
    n = len(contact.scene)
    loads, gaps = rng.normal(size=n), contact.load / contact.approach * rng.normal(size=n)

    def number(oracle: Any) -> Any:
        return exact(loads) @ oracle.loads + exact(gaps) @ oracle.gaps

    judge = of_contact(contact, holding, number)
    gradient = contact.gradient(loads=loads, gaps=gaps, holding=holding)
    assert gradient.value == pytest.approx(float(judge.at), rel=1e-12)
    assert gradient.balance_defect < 1e-14
    assert_slopes(judge, gradient, NEAR_GROSS)  # random terms cancel in part


def test_reference_values_of_the_approach_and_the_displacement() -> None:
    contact = cr.press(with_friction(NAMED["paper"][0]), load=3.60853389e-7)
    approach = contact.gradient(approach=1.0)
    found = (approach.value, *approach.heights[[0, 31]], approach.sphere_radius, approach.load)
    known = (5.00000000209e-05, -2.31956320517e-02, -2.36765395214e-02, -1.59179824221e-05)
    assert found == pytest.approx((*known, 82.3405580819), rel=1e-11)
    assert approach.contact_modulus == pytest.approx(-2.97128694360e-05, rel=1e-11)
    moved = cr.shear(contact, force=9e-8).gradient(displacement=1.0)
    found = (moved.value, *moved.heights[[0, 31]], moved.friction, moved.force, moved.load)
    known = (9.85362640859e-06, 6.90994620863e-03, -1.43750418523e-02, -2.69821434420e-06)
    assert found == pytest.approx((*known, 124.474817563, -12.2449270891), rel=1e-11)


STATES = [
    ("paper", "load", 1e-9),
    ("rough", "approach", 1e-6),
    ("rough", "load", 0.5),
    ("rough, closest", "approach", 0.95),
    ("steel", "load", 0.3),
]


@pytest.mark.parametrize(("name", "holding", "fraction"), STATES)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_displacement(name: str, holding: Any, fraction: float, sign: float) -> None:
    contact = pressed(name, holding)
    force = fraction * FRICTION * contact.load
    judge = of_state(contact, holding, force, lambda state: state.displacement)
    state = cr.shear(contact, force=sign * force)
    gradient = state.gradient(displacement=sign)
    assert gradient.value == pytest.approx(float(judge.at), rel=1e-13)
    assert_slopes(judge, gradient, CLOSE)
    close(
        judge.slope("forces", exact([force])), np.array([sign * gradient.force * force]), CLOSE, "Q"
    )
    assert gradient.balance_defect < 1e-13


@pytest.mark.parametrize(("name", "holding", "fraction"), STATES)
def test_any_sum_of_forces_and_slips(name: str, holding: Any, fraction: float) -> None:
    contact, rng = pressed(name, holding), np.random.default_rng(11)
    force, on = fraction * FRICTION * contact.load, np.flatnonzero(contact.loads)
    forces = rng.normal(size=len(contact.scene))
    slips = rng.normal(size=len(contact.scene)) * contact.load / contact.approach

    def number(state: Any) -> Any:
        return exact(forces[on]) @ state.forces + exact(slips[on]) @ state.slips

    judge = of_state(contact, holding, force, number)
    gradient = cr.shear(contact, force=force).gradient(forces=forces, slips=slips)
    assert gradient.value == pytest.approx(float(judge.at), rel=1e-11)
    assert_slopes(judge, gradient, NEAR_GROSS)


#: In the paper's scene a ring of six starts to slide together, but for the rounding of its points:
#: by those 1e-16 they are apart, and derivatives follow with the root of that.
ONSETS = [("rough", 1e-11), ("paper", 1e-8)]


@pytest.mark.parametrize(("name", "tolerance"), ONSETS)
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_onset(name: str, tolerance: float, holding: Any) -> None:
    contact = pressed(name, holding)
    asperity = int(np.flatnonzero(contact.loads)[-4])
    onset = float(cr.onset_of_sliding(contact, which=[asperity])[0])
    place = int(np.searchsorted(np.flatnonzero(contact.loads), asperity))
    solved = sheared(contact, holding, onset)

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        """The root in Q of eta = ceiling, by the secant of two states beside it."""
        ends = []
        low = arb(onset) if near is None else near[1]
        for trial in (low, low * (1 + arb("1e-30"))):
            state = solved(
                replace(setup, forces=np.array([trial])), None if near is None else near[0]
            )
            ends.append((trial, state.eta[place] - state.oracle.ceilings[place], state))
        for _ in range(3):
            (q0, m0, _), (q1, m1, last) = ends[-2:]
            trial = (q1 - m1 * (q1 - q0) / (m1 - m0)).mid()
            state = solved(replace(setup, forces=np.array([trial])), last)
            ends.append((trial, state.eta[place] - state.oracle.ceilings[place], state))
            if abs(ends[-1][1]) < arb("1e-90"):
                break
        return ends[-1][0], (ends[-1][2], ends[-1][0])

    judge = Judge(Setup.of(contact, holding, [onset]), value)
    gradient = cr.onset_gradient(contact, asperity, holding=holding)
    assert gradient.value == pytest.approx(float(judge.at), rel=1e-12)
    assert_slopes(judge, gradient, tolerance)


def test_onset_of_the_last_is_that_of_gross_sliding() -> None:
    contact = pressed("rough", "load")
    onsets = cr.onset_of_sliding(contact)
    last = int(np.nanargmax(onsets))
    gradient = cr.onset_gradient(contact, last)
    assert gradient.load == pytest.approx(FRICTION, rel=1e-12)
    assert np.abs(gradient.heights).max() * contact.approach < 1e-12 * gradient.value


HISTORIES = {
    "loops closed": [0.3, -0.3, 0.3, -0.1, 0.45],
    "inner loops": [0.4, -0.2, 0.3, 0.1, 0.2, -0.35],
    "over and back": [0.2, 0.2, -0.4, 0.1, 0.0],
}


@pytest.mark.parametrize("fractions", HISTORIES.values(), ids=HISTORIES)
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_history(fractions: list[float], holding: Any) -> None:
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025, tip_radius=0.02, within=0.0076, height_std=1e-6, tip_radius_cv=0.1, seed=7
    )
    scene = with_friction(cr.Scene(1.0, asperities, cr.Material(1.0, 0.3)))
    contact = cr.press(scene, approach=2e-5)
    assert 10 < np.count_nonzero(contact.loads) < len(scene)
    if holding == "load":
        contact = cr.press(scene, load=contact.load)
    forces = contact.load * np.array(fractions)
    m = len(forces)
    rng = np.random.default_rng(2)
    spent, far = rng.normal(size=m), rng.normal(size=m) * 1e-9
    history = cr.history(contact, forces=forces)
    gradient = history.gradient(energy=spent, displacements=far)
    assert gradient.forces is not None
    assert gradient.balance_defect < 1e-13
    solved = remembered(contact)

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        past = solved(setup, near)
        return exact(spent) @ past.energies + exact(far) @ past.displacements, past

    judge = Judge(Setup.of(contact, holding, forces), value)
    assert gradient.value == pytest.approx(float(judge.at), rel=1e-13)
    assert_slopes(judge, gradient, CLOSE)
    inside = rng.uniform(0.5, 1.0, size=m) * forces
    inside[1:][np.diff(forces) == 0] = inside[:-1][np.diff(forces) == 0]  # else it would turn back
    close(judge.slope("forces", exact(inside)), gradient.forces * inside, CLOSE, "forces")


def test_the_energy_of_a_history_is_that_of_its_cycles() -> None:
    contact = pressed("rough", "load")
    Q = 0.3 * contact.load
    past = cr.history(contact, forces=[Q, -Q, Q])
    twice = past.gradient(energy=[-1.0, 0.0, 1.0])
    cycle = cr.cycle(contact, maximum=Q).gradient()
    np.testing.assert_allclose(twice.heights, cycle.heights, rtol=1e-11)
    assert twice.friction == pytest.approx(cycle.friction, rel=1e-12)
    assert twice.forces is not None
    # The first quarter is taken off again; what is left is the cycle, whose ends are Q and -Q.
    assert twice.forces.sum() == pytest.approx(cycle.maximum + cycle.minimum, abs=1e-18)
    assert (twice.forces[0] + twice.forces[2]) == pytest.approx(cycle.maximum, rel=1e-12)


def test_slips_and_forces_in_gross_sliding() -> None:
    contact = pressed("rough", "load")
    force, on = FRICTION * contact.load, np.flatnonzero(contact.loads)
    rng = np.random.default_rng(0)
    w = rng.normal(size=len(contact.scene))
    state = cr.shear(contact, force=force)
    gradient = state.gradient(forces=w)
    judge = of_contact(contact, "load", lambda o: arb(FRICTION) * (exact(w[on]) @ o.P))
    assert_slopes(judge, replace(gradient, friction=None, load=None), CLOSE)
    moved = state.gradient(displacement=1.0)
    assert (moved.force, moved.load, moved.friction) == (np.inf, -np.inf, -np.inf)

    def displacement(oracle: Any) -> Any:
        rise = max(oracle.ceilings + oracle.inner @ oracle.P)
        return oracle.ratio * oracle.setup.friction * rise

    judge = of_contact(contact, "load", displacement)
    assert_slopes(judge, replace(moved, friction=None, load=None), CLOSE)


def test_what_has_no_derivative() -> None:
    scene = with_friction(NAMED["paper"][0])
    contact = pressed("paper", "load")
    with pytest.raises(cr.InputError, match="a contact that carries some load"):
        cr.press(scene, approach=-1e-5).gradient(load=1.0)
    with pytest.raises(cr.InputError, match="at least one: weights"):
        contact.gradient()
    with pytest.raises(cr.InputError, match='expected "load" or "approach"'):
        contact.gradient(load=1.0, holding="both")  # type: ignore[arg-type]
    with pytest.raises(cr.InputError, match="others never slide"):
        cr.onset_gradient(contact, 60)
    with pytest.raises(cr.InputError, match="where all slide, a history has no derivative"):
        cr.history(contact, forces=[FRICTION * contact.load]).gradient(energy=[1.0])
    with pytest.raises(cr.InputError, match="61 values, one per asperity"):
        contact.gradient(loads=[1.0, 2.0])
    past = cr.history(contact, forces=[1e-8, -1e-8, 0.0])
    with pytest.raises(cr.InputError, match=r"energy: .* 3 values, one per force"):
        past.gradient(energy=[1.0, 2.0])
    tolerances: list[Any] = [float("nan"), -1.0, 0.0, "x", None, 1.0]
    for tolerance in tolerances:
        with pytest.raises(cr.InputError, match=r"tolerance: found .*, expected a number"):
            contact.gradient(load=1.0, tolerance=tolerance)


def test_an_unstable_contact_has_no_derivative() -> None:
    """Two deeply overlapping contacts: neither loads nor their derivatives are those of a least."""
    from convexrough.gradients.system import System
    from convexrough.shearing.problem import TangentialProblem

    contact = pressed("paper", "load")
    problem = TangentialProblem.of(contact)
    with pytest.raises(cr.SolverError, match="press less hard"):
        System(problem, 100.0 * problem.stiffest).solve(np.ones(len(problem)))
