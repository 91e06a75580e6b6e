"""Where loads and losses are differentiable once, and no more: across contact and onset."""

from dataclasses import replace

import numpy as np
import pytest
from friction_scenes import with_friction
from scenes import NAMED

import convexrough as cr
from convexrough.arrays import Array


def raised(scene: cr.Scene, which: int, by: float) -> cr.Scene:
    a = scene.asperities
    heights = a.heights.copy()
    heights[which] += by
    return replace(scene, asperities=cr.Asperities(a.positions, a.tip_radii, heights))


def order(steps: Array, jumps: list[float]) -> float:
    """The slope of log jump over log step."""
    return float(np.polyfit(np.log(steps), np.log(jumps), 1)[0])


def test_across_making_contact_gradients_go_with_the_root() -> None:
    scene, approach = NAMED["rough"]
    scene = with_friction(scene)
    contact = cr.press(scene, approach=approach)
    nearest = int(np.argmin(np.where(contact.loads > 0, np.inf, contact.gaps)))
    grazing = raised(scene, nearest, contact.gaps[nearest])  # but for its rounding
    steps = approach * 10.0 ** np.arange(-9, -3)

    def gradient(by: float) -> Array:
        there = cr.press(raised(grazing, nearest, by), approach=approach)
        assert (there.loads[nearest] > 0) == (by > 0)
        return cr.cycle(there, maximum=0.2 * contact.load).gradient().heights

    jumps = [float(np.abs(gradient(h) - gradient(-h)).max()) for h in steps]
    assert order(steps, jumps) == pytest.approx(0.5, abs=0.02)
    assert jumps[0] < 1e-2 * np.abs(gradient(steps[0])).max()  # it is continuous


def test_across_onset_of_sliding_too() -> None:
    contact = cr.press(with_friction(NAMED["rough"][0]), approach=NAMED["rough"][1])
    loaded = np.flatnonzero(contact.loads)
    onset = cr.onset_of_sliding(contact, which=[loaded[10]])[0]
    steps = 10.0 ** np.arange(-10.0, -5)

    def gradient(by: float) -> Array:
        return cr.shear(contact, force=onset * (1 + by)).gradient(displacement=1.0).heights

    jumps = [float(np.abs(gradient(h) - gradient(-h)).max()) for h in steps]
    assert order(steps, jumps) == pytest.approx(0.5, abs=0.02)


def test_loads_themselves_have_no_corner() -> None:
    """Across contact a load differs from its tangent by the power 3/2 of the step."""
    scene, approach = NAMED["rough"]
    contact = cr.press(scene, approach=approach)
    nearest = int(np.argmin(np.where(contact.loads > 0, np.inf, contact.gaps)))
    grazing = raised(scene, nearest, contact.gaps[nearest])
    start = cr.press(raised(grazing, nearest, -1e-12 * approach), approach=approach)
    slope = start.gradient(load=1.0).heights[nearest]
    assert slope == 0.0
    steps = approach * 10.0 ** np.arange(-5, -1)
    off = [
        abs(cr.press(raised(grazing, nearest, h), approach=approach).load - start.load)
        for h in steps
    ]
    assert order(steps, off) == pytest.approx(1.5, abs=0.05)
