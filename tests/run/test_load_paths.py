"""Scene files: how wide arrays are, bodies, bases, load paths and gradients."""

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
    rows,
    scene_text,
)

import convexrough as cr
from convexrough.friction import general_step
from convexrough.progress import logged

#: Stages that rest on an order that is proved.
RESTING = ("cycle", "history", "path", "steady", "shakedown")
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
        results = file.compute(contact)
    assert [f"[{name}]" for name in file.stages] == [it for it in said if it.startswith("[")]
    assert all(result.certified for result in results)
    results = [result for result in results if result.name in RESTING]
    assert len(results) == len(RESTING)
    for result in results:
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

    def run(within: str, low: str = "3e-8", high: str = "1.2e-6", radius: str = "1.0") -> Any:
        path = FRICTION + f"[path]\nloads = [{high}, {high}]\nforces = [0.0, 1e-8]\n"
        scene = read(HEXAGONAL + within, f"load = {low}", path, radius)
        contact = scene.press()
        return contact, scene.compute(contact)[1].found[0], list(scene.cautions(contact))

    (pressed, grown, said), (_, whole, _) = run(""), run("within = 0.03")
    assert (len(pressed.scene), (pressed.loads > 0).sum()) == (121, 13)
    assert not said
    assert grown.losses[-1] == pytest.approx(whole.losses[-1], rel=1e-12)
    *_, narrow = run("within = 0.0067")
    under = "under the largest load of [path]: "
    assert [each for each in narrow if under + "contact reaches the rim" in each]
    long = "within = 0.0102\nheight_std = 2e-6\nseed = 3"
    for low, ended in (("1e-9", True), ("4e-8", False)):  # at 4e-8 [normal] has warned of it
        *_, said = run(long, low, "5e-8", "[inf, 1.0]")
        assert any(each.startswith(under + "contact reaches the ends") for each in said) == ended


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


STEADY = FRICTION + "[steady]\nreference = 1e60\n"
STEADY += "ellipse = {load = 1.0, force_amplitude = 0.1, chords = 6}\n"


def test_a_steady_state_of_which_nothing_is_proved(run: Any) -> None:
    """Nothing times an infinite error is nothing: a warning of numpy's, and no number, was it."""
    outcome = run(scene_text(f"{HEXAGONAL}within = 0.006", more=STEADY))
    assert outcome.status == 3
    assert "nan" not in outcome.out


# [gradient]


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
