"""Scene files that are no TOML, or that mutants brought to light: the line, and what is meant."""

from pathlib import Path
from typing import Any

import pytest
from scene_files import FRICTION, scene_text

import convexrough as cr
from convexrough.run.scene_file import read_scene


def refused(folder: Path, text: str) -> list[str]:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(cr.ConvexroughError) as caught:
        read_scene(path)
    lines = str(caught.value).split("\n")
    assert all(line.startswith(f"{path}: ") for line in lines)
    return [line.removeprefix(f"{path}: ") for line in lines]


@pytest.mark.parametrize(
    ("wrong", "meant", "why"),
    [
        ("spacing = 0,0025", "spacing = 0.0025", "a decimal point"),
        ("spacing=2,5e-3 # mm", "spacing = 2.5e-3", "a decimal point"),
        ("spacing = 0.0025 m", "spacing = 0.0025", "without unit"),
        ("spacing = 2.5mm", "spacing = 2.5", "without unit"),
        ("spacing = 2.5 µm", "spacing = 2.5", "without unit"),
        ("spacing = 2.5D-3", "spacing = 2.5e-3", "exponent"),
        ("spacing = .0025", "spacing = 0.0025", "both sides"),
        ("spacing = 5.", "spacing = 5.0", "both sides"),
        ("spacing: 0.0025", "spacing = 0.0025", "equals sign"),
        ("spacing = 0.0025;", "spacing = 0.0025", "end of the line"),
        ("spacing = 0.0025,", "spacing = 0.0025", "end of the line"),
        ("pattern = hexagonal", 'pattern = "hexagonal"', "straight quotes"),
        ("pattern = “hexagonal”", 'pattern = "hexagonal"', "straight quotes"),
        ("path = my summits.csv", 'path = "my summits.csv"', "straight quotes"),
    ],
)
def test_a_slip(tmp_path: Path, wrong: str, meant: str, why: str) -> None:
    text = scene_text('pattern = "hexagonal"\n' + wrong if "spacing" in wrong else wrong)
    (line,) = refused(tmp_path, text)
    number = text.split("\n").index(wrong) + 1
    assert line.startswith(f"line {number}: found {wrong}, expected {meant}: ")
    assert why in line


@pytest.mark.sample(1)
@pytest.mark.parametrize("unit", ["1", "a", " ", "1,", "a ", "= "])
def test_a_long_line_is_shown_in_part(tmp_path: Path, unit: str) -> None:
    lines = refused(tmp_path, "radius = x" + unit * 1_000_000)
    assert all(len(line) < 300 for line in lines)


@pytest.mark.parametrize("text", ["{key} = 1", "[{key}]\na = 1", "a = {{ {key} = 1 }}"])
def test_a_key_of_many_parts(tmp_path: Path, text: str) -> None:
    """tomllib takes the square of their number, in time and memory."""
    (said, *_) = refused(tmp_path, scene_text() + text.format(key="a." * 100_000 + "b"))
    assert "a key of more than 100 parts" in said
    assert "line 1" in said


STEADY = FRICTION + "[steady]\nreference = 1e60\n"
STEADY += "ellipse = {load = 1.0, force_amplitude = 0.1, chords = 6}\n"


def test_a_steady_state_of_which_nothing_is_proved(run: Any) -> None:
    """Nothing times an infinite error is nothing: a warning of numpy's, and no number, was it."""
    layout = 'pattern = "hexagonal"\nspacing = 0.0025\ntip_radius = 0.02\nwithin = 0.006'
    outcome = run(scene_text(layout, more=STEADY))
    assert outcome.status == 3
    assert "nan" not in outcome.out


def test_all_slips_at_once(tmp_path: Path) -> None:
    text = "[sphere]\nradius = 1,0\n[normal]\napproach = 5e-5 m\n[friction]\ncoefficient 0.5\n"
    first, second, last = refused(tmp_path, text)
    why = "a decimal point instead of a comma"
    assert first == f"line 2: found radius = 1,0, expected radius = 1.0: {why}"
    assert second.startswith("line 4: found approach = 5e-5 m, expected approach = 5e-5: ")
    assert last.startswith("not a TOML file: ")
    assert last.endswith("(at line 6, column 13): coefficient 0.5")
