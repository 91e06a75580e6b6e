"""The gradient of a loss over that of the smooth sphere under the same load."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, with_friction
from scenes import NAMED

import convexrough as cr


@pytest.mark.parametrize("holding", ["load", "approach"])
@pytest.mark.parametrize("name", ["rough", "rough, closest"])
def test_normalised(name: str, holding: Any) -> None:
    """By differences of `energy_normalised`: W itself is tested to 13 digits elsewhere."""
    contact = cr.press(with_friction(NAMED[name][0]), approach=NAMED[name][1])
    at, force = getattr(contact, holding), 0.6 * FRICTION * contact.load
    gradient = cr.cycle(contact, maximum=force).gradient(holding=holding).normalised
    scene, a = contact.scene, contact.scene.asperities

    def value(scene: cr.Scene, control: float = at, force: float = force) -> float:
        there = cr.press(scene, **{holding: control})
        return cr.cycle(there, maximum=force).energy_normalised

    assert gradient.value == pytest.approx(value(scene), rel=1e-12)

    def close(slope: Any, moved: Any, h: float = 1e-6) -> None:
        assert (moved(h) - moved(-h)) / (2 * h) == pytest.approx(slope, rel=2e-5)

    v = np.random.default_rng(0).choice([-1.0, 1.0], size=len(scene))
    tall = 1e-3 * contact.approach * v
    shifted = 0.0025 * v[:, None] * [1.0, -0.5]
    E, R = scene.material.contact_modulus, scene.sphere_radius

    def with_asperities(**changes: Any) -> cr.Scene:
        given = {"positions": a.positions, "tip_radii": a.tip_radii, "heights": a.heights} | changes
        return replace(scene, asperities=cr.Asperities(**given))

    close(
        (gradient.heights * tall).sum(),
        lambda h: value(with_asperities(heights=a.heights + h * tall)),
        1e-4,
    )
    close(
        (gradient.positions * shifted).sum(),
        lambda h: value(with_asperities(positions=a.positions + h * shifted)),
    )
    close(
        gradient.tip_radii @ a.tip_radii,
        lambda h: value(with_asperities(tip_radii=a.tip_radii * (1 + h))),
    )
    close(gradient.sphere_radius * R, lambda h: value(replace(scene, sphere_radius=R * (1 + h))))
    close(
        gradient.contact_modulus * E,
        lambda h: value(replace(scene, material=cr.Material(E * (1 + h), 0.3))),
    )
    close(
        gradient.friction * FRICTION, lambda h: value(replace(scene, friction=FRICTION * (1 + h)))
    )
    prescribed = gradient.load if holding == "load" else gradient.approach
    close(prescribed * at, lambda h: value(scene, control=at * (1 + h)))
    slope = gradient.maximum - gradient.minimum  # type: ignore[operator]
    close(slope * force, lambda h: value(scene, force=force * (1 + h)))
    # W and W0 go with c_t alone.
    assert gradient.poisson_ratio == pytest.approx(0.0, abs=1e-14)


def test_only_cycles_have_one() -> None:
    contact = cr.press(with_friction(NAMED["paper"][0]), approach=5e-5)
    with pytest.raises(cr.InputError, match="the gradient of a cycle"):
        _ = contact.gradient(load=1.0).normalised
