"""The gradient of a loss over that of the smooth sphere under the same load."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, with_friction
from gradient_oracle import Judge, Setup, assert_slopes, close, exact, sheared
from scenes import NAMED

import convexrough as cr

#: What float64 leaves, over the largest term.
CLOSE = 2e-13


@pytest.mark.parametrize("holding", ["load", "approach"])
@pytest.mark.parametrize("name", ["rough", "rough, closest", "steel"])
@pytest.mark.parametrize("fraction", [1e-6, 0.6])
def test_normalised(name: str, holding: Any, fraction: float) -> None:
    scene, depth = with_friction(NAMED[name][0]), NAMED[name][1]
    contact = cr.press(scene, approach=depth)
    if holding == "load":
        contact = cr.press(scene, load=contact.load)
    force = fraction * FRICTION * contact.load
    gradient = cr.cycle(contact, maximum=force).gradient().normalised
    assert gradient.holding == holding
    solved = sheared(contact, holding, force)

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        amplitude = (setup.forces[0] - setup.forces[1]) / 2
        state = solved(replace(setup, forces=np.array([amplitude])), near)
        return state.loss / state.oracle.smooth_loss, state

    judge = Judge(Setup.of(contact, holding, [force, -force]), value)
    assert gradient.value == pytest.approx(float(judge.at), rel=2e-14)
    # W and W0 go with c_t alone, so that the ratio of both knows no Poisson's ratio.
    assert gradient.poisson_ratio == pytest.approx(0.0, abs=1e-14)
    assert_slopes(judge, replace(gradient, poisson_ratio=None), CLOSE)
    for direction, slope in (([force, 0], gradient.maximum), ([0, force], gradient.minimum)):
        close(judge.slope("forces", exact(direction)), np.array([slope * force]), CLOSE, "forces")


def test_only_cycles_have_one() -> None:
    contact = cr.press(with_friction(NAMED["paper"][0]), approach=5e-5)
    with pytest.raises(cr.InputError, match="the gradient of a cycle"):
        _ = contact.gradient(load=1.0).normalised
