"""Scene files of two bodies, and of bases that are no sphere, from file to proof."""

import json
from pathlib import Path
from typing import Any

import pytest
from scene_files import HEXAGONAL, scene_text

import convexrough as cr

ONE = "contact_modulus = 1.0\npoisson_ratio = 0.3\n"
TWO = """[material.sphere]
youngs_modulus = 210e3
poisson_ratio = 0.3
hardness = 8e3
[material.base]
youngs_modulus = 70e3
poisson_ratio = 0.33
"""


STAGES = """[friction]
coefficient = 0.5
[shear]
fractions = [0.3]
[cycle]
maximum_fraction = [0.1, 0.4]
[history]
fractions = [0.5, -0.2]
[gradient]
of = "loss"
fraction = 0.2
[shakedown]
loads = 0.02
force_amplitudes = [[0.0, 1e-3], [0.0, -1e-3]]
kind = "vector"
"""


@pytest.mark.sample(1)
@pytest.mark.parametrize("radius", ["inf", "[1.0, 2.5]", "[1.0, inf]"])
def test_a_whole_run(command: Any, tmp_path: Path, radius: str) -> None:
    """With a proof that the checker accepts."""
    text = scene_text(f"{HEXAGONAL}within = 0.0102\n", "load = 0.02", STAGES).replace(ONE, TWO)
    (tmp_path / "scene.toml").write_text(text.replace("radius = 1.0", f"radius = {radius}", 1))
    bodies = cr.Material.from_youngs(210e3, 0.3, 8e3), cr.Material.from_youngs(70e3, 0.33)
    assert cr.read_scene("scene.toml").scene.material == cr.Material.pair(*bodies)
    outcome = command("run", "scene.toml", "--out", "found", "--proof", "--no-figures")
    assert outcome.status == 0, outcome.err
    assert "Dundurs' beta = -0.117, neglected" in outcome.out
    smooth = radius == "[1.0, 2.5]"
    assert ("smooth W/W0" in outcome.out) == smooth
    assert ("no smooth reference" in outcome.out) != smooth
    summary = json.loads((tmp_path / "found" / "summary.json").read_text())
    assert summary["normal"]["mismatch"] == pytest.approx(-0.1167, abs=1e-4)
    assert (summary["cycle"][0]["loss_normalised"] is not None) == smooth
    assert summary["cycle"][0]["loss"] > 0
    assert "sphere_radius" not in summary["gradient"]["by"]
    assert command("check", "found/proof.json").status == 0
    columns = (tmp_path / "found" / "shakedown.csv").read_text().splitlines()[0].split(",")
    assert columns[-4:] == ["slip_0_x", "slip_0_y", "slip_1_x", "slip_1_y"]
