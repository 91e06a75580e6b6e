"""Bounds on derivatives by heights: at least the true error, and not by much more."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from flint import arb
from friction_scenes import FRICTION, in_doubt, with_friction
from gradient_oracle import Judge, Setup, Sheared, exact, press, sheared
from scenes import NAMED

import convexrough as cr
from convexrough.arrays import Array


def pressed(name: str, control: str) -> cr.Contact:
    scene, approach = NAMED[name]
    contact = cr.press(with_friction(scene), approach=approach)
    return contact if control == "approach" else cr.press(contact.scene, load=contact.load)


def given(contact: cr.Contact, holding: str, forces: Any = ()) -> Setup:
    """With the load that was prescribed, of which the sum of all loads is a roundoff off."""
    setup = Setup.of(contact, holding, forces)
    if contact.prescribed_load is None:
        assert holding == "approach"
        return setup
    return replace(setup, control=arb(contact.prescribed_load))


def loss(contact: cr.Contact, holding: str, force: float) -> Judge:
    solved = sheared(contact, holding, force)

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        state = solved(setup, near)
        return state.loss, state

    return Judge(given(contact, holding, [force]), value)


def displacement(contact: cr.Contact, holding: str, force: float) -> Judge:
    solved = sheared(contact, holding, force)

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        state = solved(setup, near)
        return state.displacement, state

    return Judge(given(contact, holding, [force]), value)


def normalised(contact: cr.Contact, holding: str, force: float) -> Judge:
    solved = sheared(contact, holding, force)

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        state = solved(setup, near)
        return state.loss / state.oracle.smooth_loss, state

    return Judge(given(contact, holding, [force]), value)


def approach(contact: cr.Contact, holding: str) -> Judge:
    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        oracle = press(contact, setup, near)
        return (oracle.approach if holding == "load" else oracle.P.sum()), oracle

    return Judge(given(contact, holding), value)


def dragged() -> cr.Contact:
    """Six crowded asperities drag a lower one in the middle backwards, until it slides."""
    angles = np.pi / 3 * np.arange(6)
    ring = 0.0025 * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    heights = np.append(-4.86e-5, 4e-7 * np.arange(6))
    asperities = cr.Asperities(np.vstack(([[0.0, 0.0]], ring)), 0.02, heights)
    return cr.press(
        with_friction(cr.Scene(1.0, asperities, cr.Material(1.0, 0.3))), approach=3.5e-4
    )


def true_errors(judge: Judge, gradient: cr.Gradient, every: int = 5) -> tuple[Array, Array]:
    """Of some asperities: what the derivatives are off, and the bounds on that."""
    some = np.flatnonzero(gradient.contact.loads)[::every]
    size, found = gradient.contact.approach, []
    for i in some:
        one = np.zeros(len(gradient.heights))
        one[i] = size
        found.append(judge.off("heights", exact(one), gradient.heights) / size)
    return np.array(found), gradient.height_errors[some]


@pytest.mark.parametrize("name", ["paper", "rough, closest"])
@pytest.mark.parametrize("holding", ["load", "approach"])
@pytest.mark.parametrize("fraction", [1e-9, 0.1, 0.5, 0.99])
def test_bounds_of_losses_and_displacements(name: str, holding: Any, fraction: float) -> None:
    contact = pressed(name, holding)
    force = fraction * FRICTION * contact.load
    cycle, state = cr.cycle(contact, maximum=force), cr.shear(contact, force=force)
    for judge, gradient in (
        (loss(contact, holding, force), cycle.gradient()),
        (displacement(contact, holding, force), state.gradient(displacement=1.0)),
    ):
        true, bounds = true_errors(judge, gradient, every=9)
        assert (true <= bounds).all()
        assert (bounds <= 2e-13 * np.abs(gradient.heights).max()).all()


@pytest.mark.parametrize("name", ["paper", "rough", "steel"])
@pytest.mark.parametrize("fraction", [1e-3, 0.1, 0.5, 0.9, 0.99])
def test_bounds_of_losses_are_near_the_truth(name: str, fraction: float) -> None:
    contact = pressed(name, "load")
    force = fraction * FRICTION * contact.load
    gradient = cr.cycle(contact, maximum=force).gradient()
    true, bounds = true_errors(loss(contact, "load", force), gradient, every=9)
    assert (true <= bounds).all()
    assert bounds.max() <= 100 * true.max()


@pytest.mark.parametrize("name", ["paper", "rough, closest"])
@pytest.mark.parametrize("fraction", [1e-3, 0.5, 0.99])
def test_bounds_of_normalised_losses(name: str, fraction: float) -> None:
    """Where the load is held they are as near as those of the loss itself: W0 is a factor."""
    contact = pressed(name, "load")
    force = fraction * FRICTION * contact.load
    gradient = cr.cycle(contact, maximum=force).gradient()
    found = gradient.normalised
    true, bounds = true_errors(normalised(contact, "load", force), found, every=9)
    assert (true <= bounds).all()
    ratio = found.value / gradient.value
    assert found.height_errors.max() <= 10 * ratio * gradient.height_errors.max()
    assert (found.height_errors > ratio * gradient.height_errors).any()  # W0 is rounded
    contact = pressed(name, "approach")
    found = cr.cycle(contact, maximum=force).gradient().normalised
    true, bounds = true_errors(normalised(contact, "approach", force), found, every=9)
    assert (true <= bounds).all()


def test_slips_backward_sliding_and_uneven_cycles_too() -> None:
    contact, weights = dragged(), np.linspace(1.0, -0.5, 7)
    force = 0.1 * FRICTION * contact.load
    state = cr.shear(contact, force=force)
    assert (state.slips < 0).any()
    solved = sheared(contact, "approach", force)

    def slipped(setup: Setup, near: Any) -> tuple[Any, Any]:
        there = solved(setup, near)
        return (exact(weights) * there.slips).sum(), there

    def pushed(setup: Setup, near: Any) -> tuple[Any, Any]:
        there = solved(setup, near)
        return (exact(weights) * there.forces).sum(), there

    setup = given(contact, "approach", [force])
    for value, gradient in (
        (slipped, state.gradient(slips=weights)),
        (pushed, state.gradient(forces=weights)),
    ):
        true, bounds = true_errors(Judge(setup, value), gradient, every=1)
        assert (true <= bounds).all()
        assert (bounds <= 1e-11 * np.abs(gradient.heights).max()).all()  # of rounded weights
    uneven = cr.cycle(contact, maximum=1.3 * force, minimum=-0.6 * force).gradient()
    half = (Fraction(1.3 * force) + Fraction(0.6 * force)) / 2
    judge = loss(contact, "approach", float(half))
    exactly = replace(judge.setup, forces=np.array([arb(half.numerator) / arb(half.denominator)]))
    true, bounds = true_errors(Judge(exactly, judge.value), uneven, every=1)
    assert (true <= bounds).all()
    assert (bounds <= 2e-13 * np.abs(uneven.heights).max()).all()


@pytest.mark.parametrize("weight", ["gaps", "loads"])
def test_bounds_of_gaps_and_loads(weight: Any) -> None:
    contact = pressed("rough", "approach")
    weights = np.random.default_rng(1).uniform(-1.0, 1.0, len(contact.scene))
    gradient = contact.gradient(**{weight: weights})

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        oracle = press(contact, setup, near)
        return (exact(weights) * getattr(oracle, weight)).sum(), oracle

    true, bounds = true_errors(Judge(given(contact, "approach"), value), gradient, every=6)
    assert (true <= bounds).all()
    assert (bounds <= 1e-13 * np.abs(gradient.heights).max()).all()


@pytest.mark.parametrize("name", ["rough", "steel"])
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_bounds_of_contacts(name: str, holding: Any) -> None:
    contact = pressed(name, holding)
    weights: Any = {"approach": 1.0} if holding == "load" else {"load": 1.0}
    gradient = contact.gradient(**weights)
    true, bounds = true_errors(approach(contact, holding), gradient)
    assert (true <= bounds).all()
    assert (bounds <= 1e-14 * np.abs(gradient.heights).max()).all()


@pytest.mark.parametrize("digits", [7, 10])
@pytest.mark.parametrize("fraction", [1e-6, 0.3, 0.8])
def test_doubt_about_the_loads_is_counted(digits: int, fraction: float) -> None:
    """Of rounded loads, whose certificate knows."""
    contact = pressed("rough", "approach")
    doubtful = in_doubt(contact, digits, "approach")
    force = fraction * FRICTION * contact.load
    true = cr.cycle(contact, maximum=force).gradient().heights
    found = cr.cycle(doubtful, maximum=force).gradient(holding="approach")
    off = np.abs(found.heights - true)
    assert off.max() > 10.0 ** (-digits - 1) * np.abs(true).max()
    assert (off <= found.height_errors).all()
    assert (found.height_errors <= 1.01 * off + 1e-12 * np.abs(true).max()).all()


def test_bounds_go_with_the_force() -> None:
    """Relative to the largest derivative they are the same down to any force."""
    contact = pressed("rough", "load")
    parts = []
    for fraction in (1e-12, 1e-9, 1e-6, 1e-3):
        gradient = cr.cycle(contact, maximum=fraction * contact.load).gradient()
        parts.append(gradient.height_errors.max() / np.abs(gradient.heights).max())
    assert max(parts) < 1.2 * min(parts)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_undecided_asperity_costs_the_root_of_its_doubt(side: float) -> None:
    scene, depth = NAMED["rough"]
    scene = with_friction(scene)
    contact = cr.press(scene, approach=depth)
    nearest = int(np.argmin(np.where(contact.loads > 0, np.inf, contact.gaps)))

    def raised(by: float) -> cr.Contact:
        a = scene.asperities
        heights = a.heights.copy()
        heights[nearest] += by
        tall = replace(scene, asperities=cr.Asperities(a.positions, a.tip_radii, heights))
        return cr.press(tall, approach=depth)

    grazing = raised(contact.gaps[nearest] * (1 + side * 1e-15))
    assert grazing.status[nearest] == "undecided"
    doubt = grazing.certificate.gap_errors[nearest]
    found = cr.cycle(grazing, maximum=0.2 * contact.load).gradient()
    errors, largest = found.height_errors, np.abs(found.heights).max()
    assert np.isfinite(errors).all()
    assert errors.max() < 100 * np.sqrt(doubt / depth) * largest
    for shift in (-0.4, 0.4):  # states that the loads do not tell apart
        there = raised(contact.gaps[nearest] + shift * doubt)
        other = cr.cycle(there, maximum=0.2 * contact.load).gradient().heights
        assert (np.abs(other - found.heights) <= errors).all()


def test_bounds_in_gross_sliding() -> None:
    contact = pressed("rough", "load")
    force, weights = FRICTION * contact.load, np.random.default_rng(3).normal(size=91)

    def gross(number: Any) -> Judge:
        def value(setup: Setup, near: Any) -> tuple[Any, Any]:
            oracle = press(contact, setup, near)
            felt = oracle.inner @ oracle.P
            rise = max(oracle.ceilings + felt)
            return number(Sheared(oracle, oracle.P.sum(), rise - felt, oracle.P, rise)), oracle

        return Judge(given(contact, "load"), value)

    on, state = np.flatnonzero(contact.loads), cr.shear(contact, force=force)
    for judge, gradient in (
        (gross(lambda there: there.loss), cr.cycle(contact, maximum=force).gradient()),
        (gross(lambda there: there.displacement), state.gradient(displacement=1.0)),
        (
            gross(lambda there: exact(weights[on]) @ (there.forces + there.slips)),
            state.gradient(forces=weights, slips=weights),
        ),
    ):
        true, bounds = true_errors(judge, gradient)
        assert (true <= bounds).all()
        assert (bounds <= 1e-12 * np.abs(gradient.heights).max()).all()


def test_nothing_is_bounded_where_nothing_is_proved() -> None:
    contact = pressed("paper", "load")
    unproved = replace(contact, certificate=replace(contact.certificate, scope="none"))
    assert np.isinf(unproved.gradient(approach=1.0).height_errors).all()
    assert np.isinf(cr.onset_gradient(contact, 3).height_errors).all()


@pytest.mark.parametrize("kind", ["lattice", "scattered"])
def test_what_is_left_of_a_linear_system_is_counted(kind: Any) -> None:
    scene, depth = NAMED["rough"]
    dense = cr.press(with_friction(scene), approach=depth)
    true = cr.cycle(dense, maximum=0.1 * dense.load).gradient().heights
    contact = cr.press(with_friction(scene), approach=depth, influence=kind)
    for tolerance in (1e-4, 1e-9):
        found = cr.cycle(contact, maximum=0.1 * dense.load).gradient(tolerance=tolerance)
        off = np.abs(found.heights - true)
        assert (off <= found.height_errors).all()
        assert (found.height_errors <= 1.01 * off + 1e-12 * np.abs(true).max()).all()


def test_products_of_whole_numbers_serve_where_no_matrix_is_stored(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene, depth = NAMED["rough"]
    dense = cr.press(with_friction(scene), approach=depth)
    true = cr.cycle(dense, maximum=0.1 * dense.load).gradient().heights
    monkeypatch.setattr("convexrough.gradients.sharp.MOST", 0)
    contact = cr.press(with_friction(scene), approach=depth, influence="lattice")
    found = cr.cycle(contact, maximum=0.1 * dense.load).gradient()
    assert (np.abs(found.heights - true) <= found.height_errors + 1e-14 * np.abs(true).max()).all()
    # Bounds that are not of twice the digits are some 7e-10.
    assert found.height_errors.max() <= 2e-10 * np.abs(true).max()


def test_histories_have_bounds_too() -> None:
    contact = pressed("rough", "load")
    past = cr.history(contact, forces=contact.load * np.array([0.3, -0.2, 0.1]))
    gradient = past.gradient(energy=[0.0, 0.0, 1.0], displacements=[0.0, 1e-8, 0.0])
    assert gradient.height_errors.max() < 1e-13 * np.abs(gradient.heights).max()
    cycle = cr.cycle(contact, maximum=0.2 * contact.load).gradient()
    assert cycle.normalised.height_errors.max() < 1e-7 * np.abs(cycle.normalised.heights).max()


def test_the_smallest_forces() -> None:
    """Losses go with the third power of the force there: so do derivatives, and what bounds them.

    Below, squares vanish and bounds with them: that is refused.
    """
    contact = cr.press(with_friction(NAMED["rough"][0]), load=3.6e-7)
    limit, power = FRICTION * contact.load, 2.0**-60
    cycle = cr.cycle(contact, maximum=1e-20 * limit)
    first, small = cycle.gradient(), cr.cycle(contact, maximum=1e-20 * power * limit).gradient()
    np.testing.assert_allclose(small.heights, power**3 * first.heights, rtol=1e-13)
    bounds = first.height_errors
    np.testing.assert_allclose(small.height_errors / power**3, bounds, atol=0.1 * bounds.max())
    slight = 1e-51 * limit
    history = cr.history(contact, forces=[0.1 * limit, 0.0, slight])
    state = cr.shear(contact, force=slight)
    for ask in (
        cr.cycle(contact, maximum=slight).gradient,
        lambda: state.gradient(displacement=1.0),
        lambda: state.change(cr.Direction(heights=1e-9)),
        lambda: history.gradient(displacements=1.0),
    ):
        with pytest.raises(cr.InputError, match=r"e-5\d f P, expected 0, or at least 1e-40 f P"):
            ask()
    assert cr.cycle(contact, maximum=0.0).gradient().heights.max() == 0.0
