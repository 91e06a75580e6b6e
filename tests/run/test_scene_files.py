"""Scene files: arrays, bodies, bases, load paths, gradients; mistakes, and what is meant."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from friction_scenes import shaded
from scene_files import (
    EVERYTHING,
    FRICTION,
    HEXAGONAL,
    LOAD,
    ONE_BODY,
    STAGES,
    TWO_BODIES,
    WITHIN,
    put,
    refusal,
    rows,
    scene_text,
)

import convexrough as cr
from convexrough.friction import general_step
from convexrough.progress import logged

SHADED = 'pattern = "file"\npath = "shaded.csv"\ngeometry = "summit"', "approach = 1.4"


def test_nothing_is_proved_where_order_fails(run: Any, command: Any, monkeypatch: Any) -> None:
    """A small low asperity between five crowded ones loses load as the load rises."""
    for name in ("SETTLED", "SETTLED_MOTION"):
        monkeypatch.setattr(general_step, name, np.inf)
    low = shaded().asperities
    x, y = low.positions.T
    columns = {"x": x, "y": y, "height": low.heights, "tip_radius": low.tip_radii}
    put(Path(), columns, "shaded.csv")
    load = json.loads(run(scene_text(*SHADED, FRICTION, "1e6"), "--json").out)["normal"]["load"]
    stages = EVERYTHING.replace(repr(LOAD), repr(load)).replace("[0.1, 0.37, 0.5]", "[0.3]")
    outcome = run(scene_text(*SHADED, stages, "1e6"), "--out", "out")
    assert outcome.status == 3
    assert repr(str(Path().absolute())) in Path("out/scene.toml").read_text().splitlines()[0]
    summary = json.loads(Path("out/summary.json").read_text())
    for stage in ("path", "steady", "shakedown"):
        assert summary[stage]["order"] == "fails"
    for stage in ("shear", "cycle", "history", "path", "steady", "shakedown"):
        said = "not proved: that indentations increase with the load, which the proof of "
        assert f"{said}[{stage}] needs" in outcome.err
    assert summary["steady"]["loss_error"] is None
    assert summary["steady"]["undecided"] > 0
    assert summary["shakedown"]["proved"] is False
    assert summary["shakedown"]["upper"] is None
    assert "not proved: bounds on the limit of [shakedown]" in outcome.err
    total = repr(summary["shear"][0]["force"])
    claimed = ("verify", "a.toml", "out/asperities.csv", "--shear", "out/shear.csv")
    said = command(*claimed, "--shear-force", total)
    assert said.status == 3
    assert "statuses not proved\nindentations increase with the load: fails\n" in said.out
    assert "force error       no bound is proved (1 % allowed)" in said.out


def test_what_is_only_checked_is_not_certified(read: Any) -> None:
    """Each stage rests on its order, and shakedown on its bounds, too."""
    file = read(WITHIN, more=EVERYTHING)
    contact, said = file.press(), list[str]()
    with logged(lambda record: said.append(record.getMessage())):
        results = {result.name: result for result in file.compute(contact)}
    assert [f"[{name}]" for name in file.stages] == [it for it in said if it.startswith("[")]
    assert all(result.certified for result in results.values())
    for name in ("cycle", "history", "path", "steady", "shakedown"):
        result = results[name]
        for k, found in enumerate(result.found):
            wrong = {"order": "checked"} if result.name != "shakedown" else {"upper": np.inf}
            several = [*result.found]
            several[k] = replace(found, **wrong)
            doubtful = replace(result, found=tuple(several))
            assert not doubtful.certified
            assert f"[{result.name}]" in " ".join(doubtful.doubts())
            if result.name != "shakedown":  # states follow from one step, losses do not
                several[k] = replace(found, order="proved for one step")
                (said,) = replace(result, found=tuple(several)).doubts()
                assert said.startswith(f"not proved: the losses of [{result.name}],")


def test_an_array_for_the_largest_load_of_a_path(read: Any) -> None:
    """The pattern is wide enough for loads above that of [normal]; too narrow ones are told."""

    def run(within: str) -> Any:
        path = FRICTION + "[path]\nloads = [1.2e-6, 1.2e-6]\nforces = [0.0, 1e-8]\n"
        scene = read(HEXAGONAL + within, "load = 3e-8", path)
        contact = scene.press()
        return contact, scene.compute(contact)[1].found[0], list(scene.cautions(contact))

    (pressed, grown, said), (_, whole, _) = run(""), run("within = 0.03")
    assert (len(pressed.scene), (pressed.loads > 0).sum()) == (127, 13)
    assert not said
    assert grown.losses[-1] == pytest.approx(whole.losses[-1], rel=1e-12)
    *_, narrow = run("within = 0.0067")
    under = "under the largest load of [path]: "
    assert [each for each in narrow if under + "contact reaches the rim" in each]


def test_every_warning_at_the_largest_load_of_a_path(read: Any) -> None:
    soft = f"{ONE_BODY}\nhardness = 0.012"
    path = FRICTION + "[path]\nloads = [1.2e-6]\nforces = [1e-7]\n"
    found = {}
    for load in ("3e-8", "1.2e-6"):
        scene = read(f"{HEXAGONAL}within = 0.03", f"load = {load}", path, material=soft)
        contact = scene.press()
        found[load] = [*scene.cautions(contact)], contact.warnings
    (low, none), (nothing, warned) = found.values()
    assert "exceeds the hardness" in warned[0]
    assert low == [f"under the largest load of [path]: {each}" for each in warned]
    assert (none, nothing) == ((), [])


def test_a_path_that_starts_and_ends_at_the_load_0(run: Any) -> None:
    """There the highest asperity just touches: its status is undecided, and nothing is doubted."""
    table = "[path]\nloads = [0.0, 3e-7, 0.0]\nforces = [0.0, 0.0, 0.0]\n"
    outcome = run(scene_text(WITHIN, more=FRICTION + table))
    assert (outcome.status, outcome.err) == (0, "")


def test_a_steady_state_of_which_nothing_is_proved(run: Any) -> None:
    """Nothing times an infinite error is nothing: a warning of numpy's, and no number, was it."""
    keys = "reference = 1e60\nellipse = {load = 1.0, force_amplitude = 0.1, chords = 6}\n"
    outcome = run(scene_text(f"{HEXAGONAL}within = 0.006", more=f"{FRICTION}[steady]\n{keys}"))
    assert outcome.status == 3
    assert "nan" not in outcome.out


# [gradient]


def stage(table: str) -> str:
    """A scene with friction and this table."""
    return scene_text(WITHIN, "load = 3.60853389e-7", FRICTION + table)


def printed(out: str) -> dict[str, str]:
    """The lines of the gradient, by their first words."""
    lines = out.split("gradient of the ")[1].split("\n\n")[0].splitlines()[1:]
    return {line[:22].strip(): line[22:] for line in lines}


def test_what_is_written_and_printed(run: Any) -> None:
    """Names apart from numbers, what is held, how far heights are known, and what was asked by."""
    text = stage('[gradient]\nof = "loss"\nfraction = 0.5\nby = ["heights", "positions"]\n')
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
    most = summary["largest"]["heights"]
    assert most["slope"] == gradient.heights[most["asperity"]]
    assert abs(most["slope"]) == np.abs(gradient.heights).max()
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
    lines = printed(run(stage('[gradient]\nof = "approach"\nby = ["tip_radii"]\n')).out)
    assert "by height" not in lines
    assert lines["by friction"] == "0"
    assert lines["by tip_radius"].startswith("up to ")


def test_where_there_is_none(run: Any) -> None:
    """All else is computed and written; what is missing is said, and the status says so."""
    keys = 'of = "loss"\nfraction = 1.0\nholding = "approach"'
    said = "maximum: found 1.804266945e-07: gross sliding, expected a force below f P"
    text = stage(f"[gradient]\n{keys}\n[cycle]\nmaximum_fraction = [0.5]\n")
    outcome = run(text, "--out", "out")
    assert outcome.status == 3
    summary = json.loads(Path("out/summary.json").read_text())
    assert said in summary["gradient"]["none_because"]
    assert f"none, {said}" in outcome.out
    assert "warning: no gradient of the" in outcome.err
    assert summary["cycle"][0]["loss"] > 0
    assert Path("out/cycle.csv").exists()
    assert not Path("out/gradient.csv").exists()
    file = cr.read_scene("a.toml")
    (*_, result) = file.compute(file.press())
    for form in (result.plot, result.to_dataframe):
        with pytest.raises(cr.InputError, match="gradient: found none, expected at least one"):
            form()


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
    summary = json.loads(Path("a-results/summary.json").read_text())
    assert summary["normal"]["mismatch"] == pytest.approx(-0.1167, abs=1e-4)
    assert (summary["cycle"][0]["loss_normalised"] is not None) == smooth
    assert summary["cycle"][0]["loss"] > 0
    assert "sphere_radius" not in summary["gradient"]["by"]
    assert command("check", "a-results/proof.json").status == 0


def test_the_slider_page_is_of_spheres(run: Any) -> None:
    text = scene_text(WITHIN, "load = 1e-7", MORE, radius="inf")
    assert run(text, "--html").refuses("slider page: found a flat, expected a sphere")


def layout(keys: str, normal: str = "approach = 5e-5", more: str = "") -> str:
    """A scene with a hexagonal pattern and these keys."""
    tips = "" if "tip_radius = " in keys else "tip_radius = 0.02\n"
    return scene_text(f'pattern = "hexagonal"\n{tips}{keys}', normal, more)


VECTOR = '[shakedown]\nload = 1\nkind = "vector"\nforce_amplitudes = '
LOOPS = "[cycle]\nmaximum_fraction = [0.5]\nloop_"
PASCALS = '[units]\nlength = "m"\npressure = "Pa"\n'
DEGREES = "expected a phase in radians, from -pi to pi; 90 degrees are 1.5708"
ELLIPSE = "ellipse = {load = 1.0, force_amplitude = 0.1, phase = "

MISTAKES = [
    # [asperities]
    (layout("spacing = 1e-61"), "[asperities] spacing: found 1e-61, expected a size from 1e-60"),
    (layout("spacing = 1\nspaceing = 1"), '[asperities] spaceing: unknown key, did you mean'),
    (layout("spacing = 1\ntip_radius = [1, -2]"), "[asperities] tip_radius[1]: found -2, expected"),
    (layout("spacing = 1\nheight_std = 1"), "[asperities] seed: missing, needed with height_std"),
    (layout("spacing = 1\nseed = 1"), "[asperities] seed: not used without height_std or tip_rad"),
    (layout("spacing = 1\ntip_radius_cv = 10\nseed = 1"), "[asperities] tip_radius_cv: found"),
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
    (scene_text(material=TWO_BODIES.replace("70e3", "-70e3")), "[material] base.youngs_modulus:"),
    (layout("spacing = 1\ntip_radius = [1, 2]", "load = 1"),
     "[asperities] within: missing, needed with a list of tip radii under a given load"),
    (scene_text(more=PASCALS), "[material] contact_modulus: found 1 N/m², which is 1 Pa, expected"),
    # [normal], [solver], [units], and which tables there are
    (scene_text(normal=""), "[normal] approach, load: found neither, expected exactly one of the"),
    (scene_text(more='[""]'), '[""]: unknown table, expected a name'),
    (scene_text(more="[frictoin]"), '[frictoin]: unknown table, did you mean "friction"?'),
    (scene_text(more="[gradient]\nof = 'loss'\nfraction = 0.1"),
     "[friction]: missing table, needed with the loss of [gradient]"),
    (scene_text(more="[solver]\nname = 'newtn'"), "[solver] name: found 'newtn', expected one of"),
    # stages
    (stage("[shear]\nfractions = [0.1, -0.1]"), "[shear] fractions[1]: found -0.1, expected a"),
    (stage("[history]\nfractions = [1.1]"), "[history] fractions[0]: found 1.1, expected a"),
    (stage("[cycle]\nmaximum_fraction = [0.1, 0.2]\nminimum_fraction = [0]"),
     "[cycle] minimum_fraction: found 1 values, expected 2, as in maximum_fraction"),
    (stage("[cycle]\nmaximum_fraction = [0.1]\nminimum_fraction = [0.1]"),
     "[cycle] maximum_fraction[0]: found 0.1, expected a number above its minimum, 0.1"),
    (stage("[cycle]\nmaximum_fraction = 0.1\ndisplacement = 1e-6"),
     "[cycle] maximum_fraction, displacement: found both, expected exactly one of the two"),
    (stage("[cycle]\ndisplacement = 1e-6\nminimum_fraction = 0.1"),
     "[cycle] minimum_fraction: not used with displacement"),
    (stage("[cycle]\ndisplacement = []"), "[cycle] displacement: found [], expected a positive"),
    (stage("[cycle]\ndisplacement = 1.0"), "[cycle]: displacement: found 1: gross sliding,"),
    (stage(f"{LOOPS}points = 3"), "[cycle] loop_points: found 3, expected a whole number, at"),
    (stage(f"{LOOPS}asperities = [61]"), "[cycle] loop_asperities: found [61], expected whole"),
    (stage("[path]\nloads = [1e-7]\nforces = [0.0, 0.0]"), "[path] loads, forces: found 1 and 2"),
    (stage("[path]\nloads = [1e-7]\nforces = [1e-7]"), "[path]: forces[0]"),
    (stage("[steady]\nellipse = {load = 1, load_amplitude = -2, force_amplitude = 1}"),
     "[steady] ellipse.load_amplitude: found -2, expected at most the load 1 in size"),
    (stage(f"[steady]\n{ELLIPSE}90}}"), f"[steady] ellipse.phase: found 90, {DEGREES}"),
    (stage(f"[steady]\n{ELLIPSE}0.0}}\nphases = [3.1416, 180.0]"), "[steady] phases[1]: found"),
    (stage("[shakedown]\nload = 1e-8\nforce_amplitudes = [0.0]"),
     "[shakedown]: force_amplitudes: found one point, expected a path that moves"),
    (stage('[shakedown]\nload = 1\nforce_amplitudes = [1]\nkind = "x"'), "[shakedown] kind:"),
    (stage("[shakedown]\nload = 1\nforce_amplitudes = [[1, 0]]"),
     "[shakedown] force_amplitudes[0]: found [1.0, 0.0], expected a finite number, or with kind"),
    (stage("[shakedown]\nload = 1\nforce = [0.2, 0.1]\nforce_amplitudes = [1, -1]"),
     "[shakedown] force: found [0.2, 0.1], expected a finite number, or with kind = \"vector\""),
    (stage(f"{VECTOR}[[1, 0]]\nforce = 0.1"), "[shakedown] force: found 0.1, expected a pair"),
    (stage('[gradient]\nof = "los"'), "[gradient] of: found 'los', expected one of: loss,"),
    (stage('[gradient]\nof = "load"\nfraction = 0.1'), "[gradient] fraction: found 0.1, expected"),
    (stage('[gradient]\nof = "load"\nby = ["height"]'),
     "[gradient] by: found ['height'], expected a list of some of: heights, tip_radii, positions; "
     "those by sphere_radius, contact_modulus, poisson_ratio, friction are always given"),
    # files that are no TOML
    ("", "empty"),
    ("[sphere]\nradius = \n", "not a TOML file: Invalid value (at line 2, column 10)"),
    (b"\xff\xfe[sphere]", "not UTF-8"),
    ("a = " + "[" * 5000, "not a TOML file"),
]  # fmt: skip


def test_bad_scenes(command: Any, tmp_path: Path) -> None:
    for scene, message in MISTAKES:
        outcome = command("run", put(tmp_path, scene, "a.toml"), "--no-figures")
        (line,) = outcome.err.splitlines()
        assert line.startswith(f"convexrough: error: a.toml: {message}")
        assert (outcome.status, outcome.out) == (2, "")
        assert [each.name for each in tmp_path.rglob("*") if each.is_file()] == ["a.toml"]


def refused(folder: Path, text: str) -> list[str]:
    return refusal(cr.read_scene, folder / put(folder, text, "scene.toml"))


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    text = "r = 1\n[sphere]\nradius = -1\n[material]\npoisson_ratio = 0.6\n[normal]\n"
    assert [line.split(":")[0] for line in refused(tmp_path, text)] == [
        "r", "[sphere] radius", "[material] poisson_ratio",
        "[material] contact_modulus, youngs_modulus", "[normal] approach, load", "[asperities]",
    ]  # fmt: skip


def test_a_slip(tmp_path: Path) -> None:
    for wrong, meant, why in (
        ("spacing = 2.5D-3", "spacing = 2.5e-3", "exponent"),
        ("spacing = .0025", "spacing = 0.0025", "both sides"),
        ("spacing: 0.0025", "spacing = 0.0025", "equals sign"),
        ("spacing = 0.0025;", "spacing = 0.0025", "end of the line"),
        ("pattern = hexagonal", 'pattern = "hexagonal"', "straight quotes"),
        ("pattern = “hexagonal”", 'pattern = "hexagonal"', "straight quotes"),
        ("spacing = Inf", "spacing = inf", "lower case"),
        (r'path = "C:\Users\a.csv"', r"path = 'C:\Users\a.csv'", "single quotes"),
        ("path = my summits.csv", 'path = "my summits.csv"', "straight quotes"),
    ):
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
