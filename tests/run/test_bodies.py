"""Scene files: how wide arrays are, two bodies, and bases that are no sphere."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import FRICTION, HEXAGONAL, STAGES, TWO_BODIES, WITHIN, scene_text

import convexrough as cr


@pytest.mark.sample(2)
@pytest.mark.parametrize("geometry", ["summit", "closest"])
@pytest.mark.parametrize("pattern", ["hexagonal", "square"])
@pytest.mark.parametrize("normal", ["approach = 2e-5", "load = 2e-7", "load = 1e-9"])
@pytest.mark.parametrize("rough", ["", "height_std = 4e-6\ntip_radius_cv = 0.3\nseed = 5"])
def test_the_default_within_loses_no_asperity(
    read: Any, geometry: str, pattern: str, normal: str, rough: str
) -> None:
    text = HEXAGONAL.replace("hexagonal", pattern).replace("summit", geometry) + f"{rough}\n"
    file = read(text, normal)
    generous = read(text + "within = 0.05", normal)
    n = len(file.scene)
    assert n < len(generous.scene) / 4
    same, far = file.press(), generous.press()
    assert same.certificate.all_proved
    assert far.certificate.all_proved
    assert np.allclose(far.loads[:n], same.loads, rtol=1e-12, atol=0)
    assert not far.loads[n:].any()


def test_bases_and_bodies(read: Any) -> None:
    radii = {"inf": np.inf, "[1.0, 2]": (1.0, 2.0), "[inf, 0.5]": (np.inf, 0.5), "[2.0, 2.0]": 2.0}
    for radius, expected in (radii | {"[inf, inf]": np.inf}).items():
        assert read(WITHIN, radius=radius).scene.sphere_radius == expected
    steel, soft = cr.Material.from_youngs(210e3, 0.3, 8e3), cr.Material.from_youngs(70e3, 0.33)
    assert read(WITHIN, material=TWO_BODIES).scene.material == cr.Material.pair(steel, soft)


MORE = f'{FRICTION}{STAGES}[gradient]\nof = "loss"\nfraction = 0.2\n'


@pytest.mark.sample(1)
@pytest.mark.parametrize("radius", ["inf", "[1.0, 2.5]", "[1.0, inf]"])
def test_a_whole_run(run: Any, command: Any, radius: str) -> None:
    """With a proof that the checker accepts."""
    text = scene_text(WITHIN, "load = 0.02", MORE, radius, TWO_BODIES)
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
    text = scene_text(WITHIN, "load = 1e-7", MORE, radius="inf")
    assert run(text, "--html").refuses("slider page: found a flat, expected a sphere")
