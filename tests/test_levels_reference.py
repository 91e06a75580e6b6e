"""The reference itself: its closed formulas by differences, its two losses, its bristles."""

import numpy as np
import pytest
from flint import arb, ctx
from gradient_oracle import DIGITS, exact
from levels_reference import (
    SCENES,
    Bristles,
    Holding,
    Slopes,
    cycle_loss,
    displaced,
    of_setup,
    pressed,
    reference,
)

CASES = [("rough", 0.5, "load"), ("rough, closest", 0.9, "approach"), ("dense", 0.1, "approach")]


@pytest.mark.parametrize("name", SCENES)
def test_both_losses_are_one(name: str) -> None:
    state = reference(name, 0.37)
    with ctx.workdps(DIGITS):
        assert abs(state.energies.sum() / state.energy - 1) < arb(10) ** -90
        assert abs(state.forces.sum() / (state.f * state.T) - 1) < arb(10) ** -90


@pytest.mark.sample(1)
@pytest.mark.parametrize(("name", "fraction", "holding"), CASES)
def test_slopes_are_differences(name: str, fraction: float, holding: Holding) -> None:
    """Central ones, along random directions, to 40 digits."""
    state, contact = reference(name, fraction, holding), pressed(name, holding)
    rng = np.random.default_rng(1)
    with ctx.workdps(DIGITS):
        setup, h = state.pressed.setup, arb("1e-25")
        slopes = state.loss_slopes(holding), state.displacement_slopes(holding)
        for field in Slopes._fields:
            there = "forces" if field == "force" else field
            value = getattr(setup, there)
            step = h * value * exact(rng.uniform(0.5, 1.5, np.shape(value)))
            if field == "heights":
                step = h * contact.approach * exact(rng.standard_normal(np.shape(value)))
            ends = [of_setup(setup.moved(there, sign * step), contact) for sign in (1, -1)]
            for slope, name_of in zip(slopes, ("energy", "displacement"), strict=True):
                found = (getattr(ends[0], name_of) - getattr(ends[1], name_of)) / 2
                closed = np.sum(getattr(slope, field) * step)
                assert abs(found / closed - 1) < arb(10) ** -40, (field, name_of)


def test_a_prescribed_displacement_gives_its_force() -> None:
    state, contact = reference("rough", 0.5), pressed("rough")
    moved = float(state.displacement)
    again = displaced(contact, moved, "approach")
    assert abs(float(again.T / state.T) - 1) < 1e-15
    with ctx.workdps(DIGITS):
        assert abs(again.displacement / arb(moved) - 1) < arb(10) ** -90


def test_bristles_agree_where_order_holds() -> None:
    state, contact = reference("paper", 0.5), pressed("paper")
    force = float(state.f * state.T)
    by = Bristles(contact).to(np.linspace(0, force, 5)[1:])
    true = [float(each) for each in state.forces[contact.loads > 0]]
    np.testing.assert_allclose(by.forces, true, rtol=0, atol=1e-6 * max(true))
    assert by.displacement == pytest.approx(float(state.displacement), rel=1e-6)
    assert cycle_loss(contact, force, steps=4) == pytest.approx(float(state.energy), rel=1e-5)
