"""Mistakes in scene files: what `run` prints, that nothing is written, and what is meant."""

from pathlib import Path
from typing import Any

import pytest
from scene_files import FRICTION, TWO_BODIES, WITHIN, put, refusal, scene_text

import convexrough as cr


def layout(keys: str, normal: str = "approach = 5e-5", more: str = "") -> str:
    """A scene with a hexagonal pattern and these keys."""
    tips = "" if "tip_radius = " in keys else "tip_radius = 0.02\n"
    return scene_text(f'pattern = "hexagonal"\n{tips}{keys}', normal, more)


def stage(table: str) -> str:
    """A scene with friction and this table."""
    return scene_text(WITHIN, "load = 3.6e-7", FRICTION + table)


VECTOR = '[shakedown]\nload = 1\nkind = "vector"\nforce_amplitudes = '
LOOPS = "[cycle]\nmaximum_fraction = [0.5]\nloop_"
PASCALS = '[units]\nlength = "m"\npressure = "Pa"\n'
DEGREES = "expected a phase in radians, from -pi to pi; 90 degrees are 1.5708"
ELLIPSE = "ellipse = {load = 1.0, force_amplitude = 0.1, phase = "

MISTAKES = [
    # [asperities]
    (layout("spacing = 1e-61"), "[asperities] spacing: found 1e-61, expected a size from 1e-60"),
    (layout("spacing = 1\nspaceing = 1"),
     '[asperities] spaceing: unknown key, did you mean "spacing"?'),
    (layout("spacing = 1\ntip_radius = [1, -2]"),
     "[asperities] tip_radius[1]: found -2, expected a positive"),
    (layout("spacing = 1\nheight_std = 1"), "[asperities] seed: missing, needed with height_std"),
    (layout("spacing = 1\nseed = 1"), "[asperities] seed: not used without height_std or tip_rad"),
    (layout("spacing = 1\ntip_radius_cv = 10\nseed = 1"),
     "[asperities] tip_radius_cv: found 10, expected a standard deviation over the mean"),
    (layout('spacing = 1\npath = "a.csv"'), "[asperities] path: not used with this pattern"),
    (scene_text('pattern = "file"\npath = "a.csv"\nheight_std = 1'),
     '[asperities] height_std: not used with pattern "file": positions and heights are in the f'),
    (layout("spacing = 1e-9\ntip_radius = 1"), "[asperities] within / spacing = 1.41e+07: found 7"),
    (layout("spacing = 0.0025\ntip_radius = 1", "approach = 0.1", '[solver]\ninfluence = "dense"'),
     "asperities that could touch"),
    # [sphere] and [material]
    (scene_text(radius="[1.0, -2.0]"), "[sphere] radius[1]: found -2.0, expected a positive num"),
    (scene_text(radius="inf"), "[asperities] within: missing, needed with a flat"),
    (scene_text(material=f"contact_modulus = 1.0\n{TWO_BODIES}"),
     "[material] contact_modulus: not used with two bodies"),
    (scene_text(material=TWO_BODIES.replace("70e3", "-70e3")),
     "[material] base.youngs_modulus: found -70000.0, expected a positive number"),
    (layout("spacing = 1\ntip_radius = [1, 2]", "load = 1"),
     "[asperities] within: missing, needed with a list of tip radii under a given load"),
    (scene_text(more=PASCALS), "[material] contact_modulus: found 1 N/m², which is 1 Pa, expected"),
    # [normal], [solver], [units], and which tables there are
    (scene_text(normal=""), "[normal] approach, load: found neither, expected exactly one of the"),
    (scene_text(more='[""]'), '[""]: unknown table, expected a name'),
    (scene_text(more="[frictoin]"), '[frictoin]: unknown table, did you mean "friction"?'),
    (scene_text(more="[gradient]\nof = 'loss'\nfraction = 0.1"),
     "[friction]: missing table, needed with the loss of [gradient]"),
    (scene_text(more="[solver]\nname = 'newtn'"),
     "[solver] name: found 'newtn', expected one of"),
    # stages
    (stage("[shear]\nfractions = [0.1, -0.1]"),
     "[shear] fractions[1]: found -0.1, expected a number from 0 to 1"),
    (stage("[history]\nfractions = [1.1]"),
     "[history] fractions[0]: found 1.1, expected a number from -1 to 1"),
    (stage("[cycle]\nmaximum_fraction = [0.1, 0.2]\nminimum_fraction = [0]"),
     "[cycle] minimum_fraction: found 1 values, expected 2, as in maximum_fraction"),
    (stage("[cycle]\nmaximum_fraction = [0.1]\nminimum_fraction = [0.1]"),
     "[cycle] maximum_fraction[0]: found 0.1, expected a number above its minimum, 0.1"),
    (stage("[cycle]\nmaximum_fraction = 0.1\ndisplacement = 1e-6"),
     "[cycle] maximum_fraction, displacement: found both, expected exactly one of the two"),
    (stage("[cycle]\ndisplacement = 1e-6\nminimum_fraction = 0.1"),
     "[cycle] minimum_fraction: not used with displacement"),
    (stage("[cycle]\ndisplacement = []"),
     "[cycle] displacement: found [], expected a positive number, or a list of these"),
    (stage("[cycle]\ndisplacement = 1.0"),
     "[cycle]: displacement: found 1: gross sliding, expected at most X = 3.0"),
    (stage(f"{LOOPS}points = 3"),
     "[cycle] loop_points: found 3, expected a whole number, at least 4"),
    (stage(f"{LOOPS}asperities = [61]"),
     "[cycle] loop_asperities[0]: found 61, expected an index from 0"),
    (stage("[path]\nloads = [1e-7]\nforces = [0.0, 0.0]"),
     "[path] loads, forces: found 1 and 2 values"),
    (stage("[path]\nloads = [1e-7]\nforces = [1e-7]"), "[path]: forces[0]"),
    (stage("[steady]\nellipse = {load = 1, load_amplitude = -2, force_amplitude = 1}"),
     "[steady] ellipse.load_amplitude: found -2, expected at most the load 1 in size"),
    (stage(f"[steady]\n{ELLIPSE}90}}"), f"[steady] ellipse.phase: found 90, {DEGREES}"),
    (stage(f"[steady]\n{ELLIPSE}0.0}}\nphases = [3.1416, 180.0]"),
     f"[steady] phases[1]: found 180.0, {DEGREES}"),
    (stage("[shakedown]\nload = 1e-8\nforce_amplitudes = [0.0]"),
     "[shakedown]: force_amplitudes: found one point, expected a path that moves"),
    (stage('[shakedown]\nload = 1\nforce_amplitudes = [1]\nkind = "x"'),
     "[shakedown] kind: found 'x', expected \"exact\", \"elastic\" or \"vector\""),
    (stage("[shakedown]\nload = 1\nforce_amplitudes = [[1, 0]]"),
     "[shakedown] force_amplitudes[0]: found [1.0, 0.0], expected a finite number, or with kind"),
    *((stage(f"[shakedown]\nload = 1\nforce = {it}\nforce_amplitudes = [1, -1]"),
       f"[shakedown] force: found {it}, expected a finite number, or with kind = \"vector\"")
      for it in ("[0.2]", "[0.2, 0.1]")),
    (stage(f"{VECTOR}[[1, 0]]\nforce = 0.1"),
     "[shakedown] force: found 0.1, expected a pair [x, y]"),
    (stage('[gradient]\nof = "los"'),
     "[gradient] of: found 'los', expected one of: loss, displacement, approach, load"),
    (stage('[gradient]\nof = "load"\nfraction = 0.1'),
     "[gradient] fraction: found 0.1, expected none with the load"),
    (stage('[gradient]\nof = "load"\nby = ["height"]'),
     "[gradient] by: found ['height'], expected a list of some of: heights, tip_radii, positions; "
     "those by sphere_radius, contact_modulus, poisson_ratio, friction are always given"),
    # files that are no TOML
    ("", "empty"),
    ("[sphere]\nradius = \n", "not a TOML file: Invalid value (at line 2, column 10)"),
    (b"\xff\xfe[sphere]", "not UTF-8"),
    ("a = " + "[" * 5000, "not a TOML file"),
]  # fmt: skip


@pytest.mark.sample(15)
@pytest.mark.parametrize(("scene", "message"), MISTAKES)
def test_bad_scenes(command: Any, tmp_path: Path, scene: str | bytes, message: str) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(scene if isinstance(scene, bytes) else scene.encode())
    outcome = command("run", "a.toml", "--no-figures")
    (line,) = outcome.err.splitlines()
    assert line.startswith(f"convexrough: error: a.toml: {message}")
    assert (outcome.status, outcome.out) == (2, "")
    assert [each for each in tmp_path.rglob("*") if each.is_file()] == [path]


def refused(folder: Path, text: str) -> list[str]:
    return refusal(cr.read_scene, folder / put(folder, text, "scene.toml"))


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    text = "r = 1\n[sphere]\nradius = -1\n[material]\npoisson_ratio = 0.6\n[normal]\n"
    assert [line.split(":")[0] for line in refused(tmp_path, text)] == [
        "r", "[sphere] radius", "[material] poisson_ratio",
        "[material] contact_modulus, youngs_modulus", "[normal] approach, load", "[asperities]",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "meant", "why"),
    [
        ("spacing = 2.5D-3", "spacing = 2.5e-3", "exponent"),
        ("spacing = .0025", "spacing = 0.0025", "both sides"),
        ("spacing: 0.0025", "spacing = 0.0025", "equals sign"),
        ("spacing = 0.0025;", "spacing = 0.0025", "end of the line"),
        ("pattern = hexagonal", 'pattern = "hexagonal"', "straight quotes"),
        ("pattern = “hexagonal”", 'pattern = "hexagonal"', "straight quotes"),
        ("spacing = Inf", "spacing = inf", "lower case"),
        (r'path = "C:\Users\a.csv"', r"path = 'C:\Users\a.csv'", "single quotes"),
        ("path = my summits.csv", 'path = "my summits.csv"', "straight quotes"),
    ],
)
def test_a_slip(tmp_path: Path, wrong: str, meant: str, why: str) -> None:
    text = scene_text('pattern = "hexagonal"\n' + wrong if "spacing" in wrong else wrong)
    (line,) = refused(tmp_path, text)
    number = text.split("\n").index(wrong) + 1
    assert line.startswith(f"line {number}: found {wrong}, expected {meant}: ")
    assert why in line


@pytest.mark.parametrize("number", ["1\nspacing = 2e-3", "5*10^-5", "1/400", "5e+-5", "5e\u22125"])
def test_no_number_is_invented(tmp_path: Path, number: str) -> None:
    wrong = f"spacing = {number}"
    text = scene_text('pattern = "hexagonal"\n' + wrong)
    (line,) = refused(tmp_path, text)
    last = wrong.split("\n")[-1]
    assert line.startswith("not a TOML file: ")
    assert f"line {text.split(chr(10)).index(last) + 1}" in line
    assert line.endswith(f": {last}")
    assert ("given twice" in line) == ("\n" in wrong)


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


def test_all_slips_at_once(tmp_path: Path) -> None:
    text = "[sphere]\nradius = 1,0\n[normal]\napproach = 5e-5 m\n[friction]\ncoefficient 0.5\n"
    first, second, last = refused(tmp_path, text)
    why = "a decimal point instead of a comma"
    assert first == f"line 2: found radius = 1,0, expected radius = 1.0: {why}"
    assert second.startswith("line 4: found approach = 5e-5 m, expected approach = 5e-5: ")
    assert "without unit" in second
    assert last.startswith("not a TOML file: ")
    assert last.endswith("(at line 6, column 13): coefficient 0.5")
