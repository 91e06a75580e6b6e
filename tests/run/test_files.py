"""Scene files, CSV in and out, results on disk."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import HEXAGONAL, scene_text

import convexrough as cr
from convexrough.atomic import replacing, to_json
from convexrough.run import results
from convexrough.run.results import MANIFEST, results_folder, write_results
from convexrough.run.scene_file import read_scene
from convexrough.run.stages import NormalStage
from convexrough.tabular.table import read_table
from convexrough.verdict.claims import Manner, read_loads

COLUMNS = ("x", "y", "height", "tip_radius", "load", "contact_radius", "gap", "status",
           "load_error")  # fmt: skip


def read(tmp_path: Path, *parts: str, **tables: str) -> Any:
    path = tmp_path / "scene.toml"
    path.write_text(scene_text(*parts, **tables), encoding="utf-8")
    return read_scene(path)


def mistakes(tmp_path: Path, *parts: str, **tables: str) -> list[str]:
    with pytest.raises(cr.InputError) as caught:
        read(tmp_path, *parts, **tables)
    return [
        line.removeprefix(f"{tmp_path / 'scene.toml'}: ") for line in str(caught.value).split("\n")
    ]


def small_scene() -> cr.Scene:
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025, tip_radius=0.02, within=0.006, height_std=1e-6, tip_radius_cv=0.1, seed=2
    )
    return cr.Scene(1.0, asperities, cr.Material(1.0, 0.3), geometry="summit")


@pytest.fixture(scope="module")
def contact() -> cr.Contact:
    return cr.press(small_scene(), approach=2e-5)


# Scene files


@pytest.mark.sample(6)
@pytest.mark.parametrize(
    ("asperities", "expected"),
    [
        ("spacing = -0.1", "spacing: found -0.1, expected a positive number"),
        ("spacing = nan", "spacing: found nan, expected a positive number"),
        ("spacing = true", "spacing: found true, expected a positive number"),
        ("spacing = 1e-61", "spacing: found 1e-61, expected a size from 1e-60 to 1e+60"),
        ("spacing = 1\nspaceing = 1", 'spaceing: unknown key, did you mean "spacing"?'),
        ("spacing = 1\nzzz = 1", "zzz: unknown key, valid: pattern, spacing, tip_radius"),
        ("spacing = 1\ntip_radius = [1, -2]", "tip_radius[1]: found -2, expected a positive"),
        ("spacing = 1\nheight_std = 1", "seed: missing, needed with height_std"),
        (
            "spacing = 1\ntip_radius_cv = 10\nseed = 1",
            "tip_radius_cv: found 10, expected a standard deviation over the mean",
        ),
        ("spacing = 1\nseed = 1.5", "seed: found 1.5, expected a whole number"),
        ("spacing = 1\nwithin = -1", "within: found -1, expected a number that is not negative"),
        ("spacing = 1\ngeometry = 3", 'geometry: found 3, expected "summit" or "closest"'),
        ('spacing = 1\npath = "a.csv"', "path: not used with this pattern"),
        ("", "spacing: missing"),
    ],
)
def test_a_wrong_key(tmp_path: Path, asperities: str, expected: str) -> None:
    text = 'pattern = "hexagonal"\n' + asperities
    if "tip_radius = " not in text:
        text += "\ntip_radius = 0.02"
    (line,) = mistakes(tmp_path, text)
    assert line.startswith(f"[asperities] {expected}")


PRESSED = "approach = 1e-5"
FRICTION = "[friction]\ncoefficient = 1\n"


@pytest.mark.sample(6)
@pytest.mark.parametrize(
    ("normal", "more", "expected"),
    [
        ("", "", "[normal] approach, load: found neither, expected exactly one of the two"),
        ("approach = 1\nload = 1", "", "[normal] approach, load: found both, expected exactly"),
        ("load = 0", "", "[normal] load: found 0, expected a positive number"),
        ("approach = nan", "", "[normal] approach: found nan, expected a finite number"),
        (PRESSED, "[frictoin]", '[frictoin]: unknown table, did you mean "friction"?'),
        (PRESSED, "[sweep]", "[sweep]: many scenes, which `convexrough sweep` computes"),
        (PRESSED, "[shear]\nfractions = [0.1]", "[friction]: missing table, needed with [shear]"),
        (PRESSED, FRICTION + "[shear]\nfractions = [0.1, -0.1]",
         "[shear] fractions[1]: found -0.1, expected a number from 0 to 1"),
        (PRESSED, FRICTION + "[shear]\nfractions = []",
         "[shear] fractions: found [], expected a list of numbers from 0 to 1"),
        (PRESSED, FRICTION + "[history]\nfractions = [1.1]",
         "[history] fractions[0]: found 1.1, expected a number from -1 to 1"),
        (PRESSED, FRICTION + "[cycle]\nmaximum_fraction = [0.1, 0.2]\nminimum_fraction = [0]",
         "[cycle] minimum_fraction: found 1 values, expected 2, as in maximum_fraction"),
        (PRESSED, FRICTION + "[cycle]\nmaximum_fraction = [0.1]\nminimum_fraction = [0.1]",
         "[cycle] maximum_fraction[0]: found 0.1, expected a number above its minimum, 0.1"),
        (PRESSED, "[solver]\nname = 'newtn'", "[solver] name: found 'newtn', expected one of"),
        (PRESSED, "[units]\nlength = 1", "[units] length: found 1, expected text in quotes"),
    ],
)  # fmt: skip
def test_a_wrong_table(tmp_path: Path, normal: str, more: str, expected: str) -> None:
    (line,) = mistakes(tmp_path, normal=normal, more=more)
    assert line.startswith(expected)


def test_a_phase_in_degrees(tmp_path: Path) -> None:
    more = "[friction]\ncoefficient = 1\n[steady]\nphases = [3.1416, 180.0]\n"
    more += "ellipse = {load = 1.0, force_amplitude = 0.1, phase = 90}"
    expected = "expected a phase in radians, from -pi to pi; 90 degrees are 1.5708"
    assert sorted(mistakes(tmp_path, normal="approach = 1e-5", more=more)) == [
        f"[steady] ellipse.phase: found 90, {expected}",
        f"[steady] phases[1]: found 180.0, {expected}",
    ]


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("r = 1\n[sphere]\nradius = -1\n[material]\npoisson_ratio = 0.6\n[normal]\n")
    with pytest.raises(cr.InputError) as caught:
        read_scene(path)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{path}: ") for line in lines)
    places = [line.removeprefix(f"{path}: ").split(":")[0] for line in lines]
    assert places == [
        "r",
        "[sphere] radius",
        "[material] poisson_ratio",
        "[material] contact_modulus, youngs_modulus",
        "[normal] approach, load",
        "[asperities]",
    ]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "empty"),
        (b"# nothing\n", "empty"),
        (b"[sphere]\nradius = \n", "line 2, column 10"),
        (b"[sphere\n", "line 1"),
        (b"\xff\xfe[sphere]", "not UTF-8"),
        (b"a = " + b"[" * 5000, "not a TOML file"),
        (b"a = " + b"9" * 5000, "not a TOML file"),
    ],
)
def test_no_toml(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    with pytest.raises(cr.FileError, match=expected):
        read_scene(path)


# What `within` is when the file does not say


@pytest.mark.sample(2)
@pytest.mark.parametrize("geometry", ["summit", "closest"])
@pytest.mark.parametrize("pattern", ["hexagonal", "square"])
@pytest.mark.parametrize("normal", ["approach = 2e-5", "load = 2e-7", "load = 1e-9"])
@pytest.mark.parametrize("rough", ["", "height_std = 4e-6\ntip_radius_cv = 0.3\nseed = 5"])
def test_the_default_within_loses_no_asperity(
    tmp_path: Path, geometry: str, pattern: str, normal: str, rough: str
) -> None:
    text = HEXAGONAL.replace("hexagonal", pattern).replace("summit", geometry) + f"{rough}\n"
    file = read(tmp_path, text, normal)
    generous = read(tmp_path, text + "within = 0.05", normal)
    n = len(file.scene)
    assert n < len(generous.scene) / 4
    same = cr.press(file.scene, approach=file.approach, load=file.load)
    far = cr.press(generous.scene, approach=file.approach, load=file.load)
    assert same.certificate.holds
    assert far.certificate.holds
    assert np.allclose(far.loads[:n], same.loads, rtol=1e-12, atol=0)
    assert not far.loads[n:].any()


# Results


def written(folder: Path, contact: cr.Contact, *, figures: bool = False) -> list[str]:
    found = [NormalStage(approach=contact.approach).compute(contact)]
    paths = write_results(folder, found, figures=figures)
    assert all(path.stat().st_size > 0 for path in paths)
    assert {path.name for path in paths} == {path.name for path in folder.iterdir()}
    return [path.name for path in paths]


def test_results_read_back_the_same(tmp_path: Path, contact: cr.Contact) -> None:
    assert written(tmp_path, contact) == ["summary.json", "asperities.csv"]
    path = tmp_path / "asperities.csv"
    assert path.read_text().splitlines()[0] == ",".join(COLUMNS)
    wanted = ("x", "y", "height", "tip_radius", "load")
    columns = read_table(path, required=wanted).columns
    asperities = contact.scene.asperities
    assert np.array_equal(np.column_stack((columns["x"], columns["y"])), asperities.positions)
    assert np.array_equal(columns["height"], asperities.heights)
    assert np.array_equal(columns["tip_radius"], asperities.tip_radii)
    assert np.array_equal(read_loads(path, contact.scene, Manner()).values, contact.loads)
    normal = json.loads((tmp_path / "summary.json").read_text())["normal"]
    assert normal["contact"] == int((contact.status == "contact").sum())
    assert normal["certificate"]["load_error"] == contact.certificate.load_error


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "result.csv"
    path.write_text("old")

    def write(error: Exception | None) -> None:
        with replacing(path) as temporary:
            temporary.write_text("new")
            if error:
                raise error

    with pytest.raises(RuntimeError):
        write(RuntimeError())
    with pytest.raises(cr.FileError, match=r"result\.csv: cannot be written: No space left"):
        write(OSError(28, "No space left on device"))
    assert path.read_text() == "old"
    assert [each.name for each in tmp_path.iterdir()] == ["result.csv"]
    write(None)
    assert path.read_text() == "new"
    assert [each.name for each in tmp_path.iterdir()] == ["result.csv"]


def test_a_folder_comes_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"

    def write(error: BaseException | None, text: str, *, force: bool = False) -> None:
        with results_folder(folder, force=force) as new:
            (new / "one.csv").write_text(text)
            assert not folder.exists() or (folder / "one.csv").read_text() == "1"
            if error is not None:
                raise error

    with pytest.raises(cr.FileError, match="b: cannot hold results: No space"):
        write(OSError(28, "No space left on device"), "half")
    assert not list((tmp_path / "a").iterdir())
    write(None, "1")
    assert json.loads((folder / MANIFEST).read_text())["files"] == ["one.csv"]
    with pytest.raises(KeyboardInterrupt):
        write(KeyboardInterrupt(), "2", force=True)
    assert sorted(each.name for each in folder.iterdir()) == [MANIFEST, "one.csv"]
    assert (folder / "one.csv").read_text() == "1"


def test_json_has_no_infinities() -> None:
    summary: Any = {"a": {"b": [1.0, float("inf")]}, "c": float("nan"), "d": -float("inf")}
    assert json.loads(to_json(summary)) == {"a": {"b": [1.0, None]}, "c": None, "d": None}


def test_many_asperities_go_to_npz(
    tmp_path: Path, contact: cr.Contact, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results, "MOST_CSV_ROWS", len(contact.loads) - 1)
    assert written(tmp_path, contact) == ["summary.json", "asperities.npz"]
    path = tmp_path / "asperities.npz"
    with np.load(path) as arrays:
        assert tuple(arrays) == COLUMNS
        assert arrays["status"].tolist() == contact.status.tolist()
    assert np.array_equal(read_loads(path, contact.scene, Manner()).values, contact.loads)


def test_one_fraction_is_a_list_of_one(tmp_path: Path) -> None:
    more = "[friction]\ncoefficient = 0.5\n[cycle]\nmaximum_fraction = 0.5\n"
    assert read(tmp_path, more=more).stages["cycle"].maximum_fraction == [0.5]
