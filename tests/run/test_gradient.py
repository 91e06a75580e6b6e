"""[gradient] in scene files: its table, numbers, words, figure, and mistakes."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from scene_files import FRICTION, WITHIN, rows, scene_text

import convexrough as cr


def scene(table: str) -> str:
    return scene_text(WITHIN, "load = 3.60853389e-7", FRICTION + table)


def printed(out: str) -> dict[str, str]:
    """The lines of the gradient, by their first words."""
    lines = out.split("gradient of the ")[1].split("\n\n")[0].splitlines()[1:]
    return {line[:22].strip(): line[22:] for line in lines}


def test_what_is_written_and_printed(run: Any) -> None:
    """Names apart from numbers, what is held, how far heights are known, and what was asked by."""
    text = scene('[gradient]\nof = "loss"\nfraction = 0.5\nby = ["heights", "positions"]\n')
    outcome = run(text, "--out", "out")
    assert outcome.status == 0, outcome.err
    assert "gradient of the loss at Q/(fP) = 0.5, at constant load and force" in outcome.out
    summary = json.loads(Path("out/summary.json").read_text())["gradient"]
    contact = cr.read_scene("a.toml").press()
    gradient = cr.cycle(contact, maximum=0.25 * contact.load).gradient()
    found = rows("out/gradient.csv")
    table = {key: np.array([float(row[key]) for row in found]) for key in found[0]}
    np.testing.assert_array_equal(table["by_height"], gradient.heights)
    np.testing.assert_array_equal(table["by_height_error"], gradient.height_errors)
    np.testing.assert_array_equal(table["by_y"], gradient.positions[:, 1])
    assert summary["by"]["contact_modulus"] == gradient.contact_modulus
    assert summary["largest_by_height"] == gradient.heights[summary["largest_at"]]
    assert abs(summary["largest_by_height"]) == np.abs(gradient.heights).max()
    lines = printed(outcome.out)
    for name, slope in summary["by"].items():
        assert lines[f"by {name}"] == f"{slope + 0.0:.8g}"
    known = float(lines["by height"].split("error at most ")[1].rstrip(")"))
    assert summary["height_error"] <= known <= 1.2 * summary["height_error"]
    far = np.hypot(table["by_x"], table["by_y"])
    at = int(lines["by position"].split("asperity ")[1].rstrip(")"))
    assert far[at] == far.max()
    assert lines["by position"].startswith(f"up to ({table['by_x'][at]:.8g}, ")
    assert "by tip_radius" not in lines
    lines = printed(run(scene('[gradient]\nof = "approach"\nby = ["tip_radii"]\n')).out)
    assert "by height" not in lines
    assert lines["by friction"] == "0"
    assert lines["by tip_radius"].startswith("up to ")


def test_where_there_is_none(run: Any) -> None:
    """All else is computed and written; what is missing is said, and the status says so."""
    keys = 'of = "loss"\nfraction = 1.0\nholding = "approach"'
    said = "[gradient] fraction: found 1, a force of 1.804266945e-07: gross sliding, expected a "
    said += "force below f P: at constant approach f P may fall below the force"
    text = scene(f"[gradient]\n{keys}\n[cycle]\nmaximum_fraction = [0.5]\n")
    outcome = run(text, "--out", "out")
    assert outcome.status == 3
    summary = json.loads(Path("out/summary.json").read_text())
    assert said in summary["gradient"]["none_because"]
    assert f"none, {said}" in outcome.out
    assert "warning: no gradient of the" in outcome.err
    assert summary["cycle"][0]["loss"] > 0
    assert Path("out/cycle.csv").exists()
    assert not Path("out/gradient.csv").exists()
