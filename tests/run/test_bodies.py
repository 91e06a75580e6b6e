"""Scene files of two bodies, and of bases that are no sphere: what is read, refused and said."""

import json
from pathlib import Path
from typing import Any

import pytest
from scene_files import FRICTION, TWO_BODIES, WITHIN, scene_text

import convexrough as cr

INF = float("inf")


def test_bases_and_bodies(read: Any) -> None:
    radii = {"inf": INF, "[1.0, 2]": (1.0, 2.0), "[inf, 0.5]": (INF, 0.5), "[2.0, 2.0]": 2.0}
    for radius, expected in (radii | {"[inf, inf]": INF}).items():
        assert read(WITHIN, radius=radius).scene.sphere_radius == expected
    steel, soft = cr.Material.from_youngs(210e3, 0.3, 8e3), cr.Material.from_youngs(70e3, 0.33)
    assert read(WITHIN, material=TWO_BODIES).scene.material == cr.Material.pair(steel, soft)


STAGES = """[shear]
fractions = [0.3]
[cycle]
maximum_fraction = [0.1, 0.4]
[history]
fractions = [0.5, -0.2]
[gradient]
of = "loss"
fraction = 0.2
"""


@pytest.mark.sample(1)
@pytest.mark.parametrize("radius", ["inf", "[1.0, 2.5]", "[1.0, inf]"])
def test_a_whole_run(run: Any, command: Any, radius: str) -> None:
    """With a proof that the checker accepts."""
    text = scene_text(WITHIN, "load = 0.02", FRICTION + STAGES, radius, TWO_BODIES)
    outcome = run(text, "--proof")
    assert outcome.status == 0, outcome.err
    assert "Dundurs' beta = -0.117, neglected" in outcome.out
    smooth = radius == "[1.0, 2.5]"
    assert ("smooth W/W0" in outcome.out) == smooth
    assert ("no smooth reference" in outcome.out) != smooth
    summary = json.loads(Path("a-results/summary.json").read_text())
    assert summary["normal"]["mismatch"] == pytest.approx(-0.1167, abs=1e-4)
    assert (summary["cycle"][0]["loss_normalised"] is not None) == smooth
    assert summary["cycle"][0]["loss"] > 0
    assert "sphere_radius" not in summary["gradient"]["by"]
    assert command("check", "a-results/proof.json").status == 0


def test_the_slider_page_is_of_spheres(run: Any) -> None:
    text = scene_text(WITHIN, "load = 1e-7", FRICTION + STAGES, radius="inf")
    assert run(text, "--html").refuses("slider page: found a flat, expected a sphere")
