"""Forward derivatives: against differences in 130 digits."""

from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import FRICTION, pressed
from gradient_oracle import DIGITS, NAMES, STEP, Setup, exact
from levels_reference import of_setup

import convexrough as cr


def direction(contact: cr.Contact, holding: str, force: float, seed: int = 0) -> cr.Direction:
    """A change of everything at once, each by about its own size."""
    rng, scene = np.random.default_rng(seed), contact.scene
    n, f = len(scene), scene.friction or 1.0
    control: Any = {holding: getattr(contact, holding) * 0.7}
    return cr.Direction(
        heights=contact.approach * rng.normal(size=n),
        tip_radii=scene.asperities.tip_radii * rng.normal(size=n),
        positions=0.0025 * rng.normal(size=(n, 2)) * (np.ptp(scene.asperities.positions) / 0.02),
        sphere_radius=-0.3 * scene.sphere_radius,
        contact_modulus=0.4 * scene.material.contact_modulus, poisson_ratio=0.2, friction=-0.6 * f,
        force=0.8 * force, **control,
    )  # fmt: skip


CASES = [
    ("paper", "load", 0.5), ("rough", "approach", 1e-6), ("rough, closest", "load", 0.3),
    ("rough, closest", "approach", 0.9), ("steel", "approach", 0.5),
]  # fmt: skip

CHANGED = ["pressed.loads", "pressed.gaps", "pressed.load", "pressed.approach"]
CHANGED += ["forces", "slips", "displacement"]


@pytest.mark.sample(2)
@pytest.mark.parametrize(("name", "holding", "fraction"), CASES)
def test_everything_that_changes(name: str, holding: str, fraction: float) -> None:
    contact = pressed(name, control=holding)
    force = fraction * FRICTION * contact.load
    along = direction(contact, holding, force)
    change = cr.shear(contact, force=force).change(along)
    setup = Setup.of(contact, holding, [force])
    steps = {name: exact(getattr(along, name))[()] for name in NAMES}
    steps |= {"control": arb(getattr(along, holding)), "forces": exact([along.force])}
    with ctx.workdps(DIGITS):
        h = arb(STEP)
        there = (setup.moved(**{name: s * h * it for name, it in steps.items()}) for s in (1, -1))
        up, down = (of_setup(each, contact) for each in there)

        for name in CHANGED:
            number = attrgetter(name)
            true = np.array((number(up) - number(down)) / (2 * h), dtype=float)
            most = np.abs(true).max()
            np.testing.assert_allclose(number(change), true, rtol=0, atol=2e-13 * most)


def test_both_prescriptions_are_held_unless_told_otherwise() -> None:
    by_load, by_approach = pressed("rough", control="load"), pressed("rough")
    raised = cr.Direction(heights=1e-9)
    assert by_load.change(raised).approach == pytest.approx(-1e-9, rel=1e-12)
    assert abs(by_load.change(raised).load) < 1e-12 * by_approach.change(raised).load
    same = by_load.change(replace(raised, approach=0.0))
    np.testing.assert_allclose(same.loads, by_approach.change(raised).loads, rtol=1e-10, atol=1e-25)
