"""Load paths in scene files: tables, files, figures, and mistakes in words."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

SCENE = """
[sphere]
radius = 1.0
[material]
contact_modulus = 1.0
poisson_ratio = 0.3
[asperities]
pattern = "hexagonal"
spacing = 0.0025
tip_radius = 0.02
within = 0.0102
[normal]
approach = 5e-5
[friction]
coefficient = 0.5
"""
PATHS = """
[path]
loads = [0.6, 0.6, 1.0, 1.0]
forces = [0.0, 0.15, 0.15, -0.075]
reference = 3.6085338874666633e-07
[steady]
ellipse = { load = 0.7, load_amplitude = 0.28, force_amplitude = 0.175, chords = 12 }
reference = 3.6085338874666633e-07
[shakedown]
loads = 3.6085338874666633e-07
force_amplitudes = [1.8042669437333e-07, -1.8042669437333e-07]
"""


def test_a_run(command: Any) -> None:
    Path("scene.toml").write_text(SCENE + PATHS)
    outcome = command("run", "scene.toml", "--out", "out")
    assert outcome.status == 0, outcome.err
    assert "order of indentations: proved at the levels used" in outcome.out
    summary = json.loads(Path("out/summary.json").read_text())
    assert summary["path"]["displacement"][3] == pytest.approx(-1.4399972915528e-06, rel=1e-11)
    assert summary["path"]["sliding"] == [0, 12, 0, 6]
    assert summary["steady"]["undecided"] == 0
    assert summary["shakedown"]["factor"] == pytest.approx(0.351719571750, rel=1e-10)
    with Path("out/path.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["energy"]) for row in rows] == summary["path"]["energy"]
    with Path("out/path_asperities.csv").open() as file:
        words = [row["status"] for row in csv.DictReader(file)]
    assert (len(words), words.count("sliding")) == (4 * 61, 18)
    for name in ("steady", "shakedown"):
        with Path(f"out/{name}.csv").open() as file:
            assert len(list(csv.DictReader(file))) == 61
    for stem in ("path", "path_stick_slip", "steady", "shakedown"):
        assert Path(f"out/{stem}.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[path]\nloads = [1e-7]\n", "[path] loads, forces: missing"),
        ("[path]\nloads = [1e-7]\nforces = [0.0, 0.0]\n", "found 1 and 2 values"),
        ("[path]\nloads = [-1e-7]\nforces = [0.0]\n", "expected a number that is not negative"),
        ("[path]\nloads = [1e-7]\nforces = [1e-7]\n", "[path]: forces[0]"),
        ("[steady]\nloads = []\nforces = []\n", "at least one"),
        ("[shakedown]\nloads = 1e-7\nforce_amplitudes = [0.0]\n", "expected a path that moves"),
        ('[shakedown]\nloads = 1\nforce_amplitudes = [1]\nkind = "x"\n', '"exact" or "elastic"'),
    ],
)
def test_mistakes(command: Any, table: str, message: str) -> None:
    Path("scene.toml").write_text(SCENE + table)
    outcome = command("run", "scene.toml", "--no-figures")
    assert outcome.status == 2
    assert message in outcome.err


def test_friction_is_needed(command: Any) -> None:
    without = SCENE.replace("[friction]\ncoefficient = 0.5\n", "")
    Path("scene.toml").write_text(without + PATHS)
    outcome = command("run", "scene.toml", "--no-figures")
    assert outcome.status == 2
    assert "[friction]: missing table, needed with [path]" in outcome.err


def test_multiples_of_a_reference(command: Any) -> None:
    table = "[path]\nloads = [0.5]\nforces = [0.1]\nreference = 2e-7\n"
    Path("scene.toml").write_text(SCENE + table)
    outcome = command("run", "scene.toml", "--no-figures", "--json")
    path = json.loads(outcome.out)["path"]
    assert np.allclose([path["load"][0], path["force"][0]], [1e-7, 2e-8])
