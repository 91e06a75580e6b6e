"""`summits` on the command line: what it writes, what it says, and its exit status."""

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import convexrough as cr

SCENE = """
[sphere]
radius = {radius}
[material]
contact_modulus = {modulus}
poisson_ratio = 0.3
[asperities]
pattern = "file"
path = "scan-summits/summits.csv"
geometry = "closest"
[normal]
load = {load}
[units]
length = "{unit}"
"""


@pytest.fixture
def surface(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> cr.surface.Surface:
    """Its heights are in scan.npz, tilted; scene.toml presses it."""
    monkeypatch.chdir(tmp_path)
    surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=256, unit="µm")
    tilt = 0.01 * np.arange(256)
    np.savez("scan.npz", heights=surface.heights + tilt, pixel=1.0, unit="µm")
    Path("scene.toml").write_text(SCENE.format(radius=1e4, modulus=1.0, load=100.0, unit="µm"))
    return surface


def rows(path: str) -> list[dict[str, str]]:
    with open(path, encoding="utf-8", newline="") as file:
        names, *cells = csv.reader(file)
    return [dict(zip([name.partition(" [")[0] for name in names], row, strict=True))
            for row in cells]  # fmt: skip


@pytest.mark.usefixtures("surface")
def test_a_scan_becomes_a_scene(command: Any) -> None:
    outcome = command("summits", "scan.npz", "--no-figures")
    assert outcome.status == 0
    assert outcome.err.startswith("convexrough: hint: use --scene or --radius to press")
    assert outcome.out.endswith("\nwritten to scan-summits: summits.csv, summary.json\n")
    summits = cr.surface.read("scan.npz").summits()
    table = rows("scan-summits/summits.csv")
    assert len(table) == len(summits)
    for name, values in (("x", summits.x), ("y", summits.y), ("height", summits.heights),
                         ("tip_radius", summits.tip_radii), ("deviation", summits.deviations),
                         ("elliptic_load", summits.elliptic_loads),
                         ("eccentricity", summits.eccentricities)):  # fmt: skip
        assert [float(row[name]) for row in table] == values.tolist()
    scene = cr.read_scene("scene.toml").scene
    np.testing.assert_array_equal(scene.asperities.positions, summits.positions)
    np.testing.assert_array_equal(scene.asperities.tip_radii, summits.tip_radii)
    lines = outcome.out.splitlines()
    assert (
        f"summits           {len(summits):,}  (of {summits.origin.maxima:,} maxima" in outcome.out
    )
    assert "removed           plane, slopes 0.01" in outcome.out
    statistics = next(line for line in lines if line.startswith("density")).split()
    found = cr.surface.read("scan.npz").summits(0.0).statistics.density
    assert statistics[:3] == ["density", "[1/µm²]", f"{found:.4g}"]
    assert statistics[4] == f"{cr.surface.read('scan.npz').moments.density:.4g}"


@pytest.mark.usefixtures("surface")
def test_pressed_as_a_scene_says(command: Any) -> None:
    outcome = command("summits", "scan.npz", "--scene", "scene.toml", "--json", "--no-figures")
    assert outcome.status == 0
    found = json.loads(outcome.out)
    file = cr.read_scene("scene.toml")  # of the table that was just written
    contact = cr.press(file.scene, load=file.load)
    chosen = next(row for row in found["provability"] if row["prune"] == 0.05)
    assert chosen["contacts"] == (contact.status == "contact").sum()
    assert chosen["scope"] == contact.certificate.scope
    assert_allclose(chosen["approach"], contact.approach, rtol=1e-9)
    assert_allclose(chosen["crowding"], contact.crowding, rtol=1e-9)
    assert found["crowded"] == []
    first = found["trusted_from"]
    trusted = [row["trusted"] for row in found["provability"] if row["prune"] >= first]
    assert trusted
    assert all(trusted)
    assert rows("scan-summits/provability.csv")[0]["prune"] == "0.0"
    assert json.loads(Path("scan-summits/summary.json").read_text()) == found
    said = command("summits", "scan.npz", "--radius", "1e4", "--load", "100", "--modulus", "1",
                   "--json", "--no-figures", "--force")  # fmt: skip
    assert json.loads(said.out) == found


@pytest.mark.usefixtures("surface")
def test_a_scene_in_another_unit(command: Any) -> None:
    """A map in µm for a scene in m: the table is in m, and the contact the same."""
    text = SCENE.format(radius=0.01, modulus=1e12, load=100.0, unit="m")
    Path("metres.toml").write_text(text)
    options = ("--json", "--no-figures", "--force")
    one = json.loads(command("summits", "scan.npz", "--scene", "scene.toml", *options).out)
    small = [float(row["tip_radius"]) for row in rows("scan-summits/summits.csv")]
    other = json.loads(command("summits", "scan.npz", "--scene", "metres.toml", *options).out)
    assert_allclose(
        [float(row["tip_radius"]) for row in rows("scan-summits/summits.csv")],
        np.array(small) / 1e6,
    )
    assert other["surface"]["unit"] == "m"
    for first, second in zip(one["provability"], other["provability"], strict=True):
        assert first["contacts"] == second["contacts"]
        assert_allclose(second["approach"], 1e-6 * first["approach"], rtol=1e-6)
    np.save("nameless.npy", cr.surface.read("scan.npz").heights)
    nameless = command(
        "summits", "nameless.npy", "--pixel", "1", "--scene", "metres.toml", *options
    )
    assert nameless.status == 2
    assert "expected a map with a unit, as metres.toml is in m: unit=" in nameless.err
    summits = cr.surface.read("scan.npz").summits(0.05)
    with pytest.raises(cr.InputError, match=r'in µm, expected m.*surface\.to_unit\("m"\)'):
        cr.read_scene("metres.toml", asperities=summits)
    unnamed = text.replace("[units]", "").replace('length = "m"', "")
    Path("unnamed.toml").write_text(unnamed)
    refused = command("summits", "scan.npz", "--scene", "unnamed.toml", *options)
    assert refused.status == 2
    assert "expected a unit of length in unnamed.toml" in refused.err


def test_not_certified_is_exit_status_three(
    command: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ridge with two tops that are almost one."""
    monkeypatch.chdir(tmp_path)
    x, y = np.mgrid[-32:33, -32:33]
    tops = -1e-5 * (np.minimum(abs(x), 6) ** 2 - 16.0) ** 2
    np.savez("scan.npz", heights=tops - x**2 / 1e6 - y**2 / 4e3, pixel=1.0, unit="µm")
    outcome = command("summits", "scan.npz", "--prune", "0", "--radius", "1e4", "--approach", "3",
                      "--detrend", "none", "--no-figures")  # fmt: skip
    assert outcome.status == 3
    assert Path("scan-summits/summits.csv").exists()
    assert " none " in outcome.out
    assert "cannot be trusted" in outcome.err


@pytest.mark.usefixtures("surface")
def test_files_of_others_are_kept(command: Any) -> None:
    """Only the files of an earlier run are replaced; a folder with an input is refused."""
    Path("mine").mkdir()
    for name in ("map.pdf", "provability.csv", "scan.npz"):
        Path("mine", name).write_text("mine")
    options = ("--out", "mine", "--formats", "png,pdf")
    outcome = command("summits", "scan.npz", *options)
    assert outcome.status == 2
    assert "mine: not empty; --force replaces its results; or name another folder" in outcome.err
    assert sorted(path.name for path in Path().iterdir()) == ["mine", "scan.npz", "scene.toml"]
    assert command("summits", "scan.npz", "--out", "mine", "--no-figures", "--force").status == 0
    assert Path("mine/map.pdf").read_text() == Path("mine/scan.npz").read_text() == "mine"
    assert command("summits", "scan.npz", *options, "--force").status == 0
    assert command("summits", "scan.npz", "--out", "mine", "--no-figures", "--force").status == 0
    assert {path.name for path in Path("mine").iterdir()} == {
        *("files.json", "provability.csv", "scan.npz", "summary.json", "summits.csv")
    }
    refused = command("summits", "scan.npz", "--out", ".", "--force")
    assert refused.status == 2
    assert "holds scan.npz, an input; name another folder" in refused.err


@pytest.mark.usefixtures("surface")
def test_a_long_table_is_written_as_npz(command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("convexrough.run.results.MOST_CSV_ROWS", 3)
    assert "summits.npz" in command("summits", "scan.npz", "--no-figures").out
    assert len(np.load("scan-summits/summits.npz")["height [µm]"]) > 3


@pytest.mark.usefixtures("surface")
def test_a_scene_that_reads_another_table_is_named(command: Any) -> None:
    options = ("--scene", "scene.toml", "--no-figures")
    assert "reads" not in command("summits", "scan.npz", *options).err
    said = command("summits", "scan.npz", *options, "--out", "other").err
    table = Path("other", "summits.csv")
    assert f"scene.toml reads scan-summits/summits.csv, which is not {table}" in said


def test_summits_on_filled_pixels_are_counted(command: Any, surface: cr.surface.Surface) -> None:
    heights = np.array(surface.heights)
    row, column = surface.summits().pixels[0]
    heights[row + 1 : row + 3, column] = np.nan
    np.savez("holes.npz", heights=heights, pixel=1.0, unit="µm")
    pressed = ("--radius", "1e4", "--load", "10", "--modulus", "1", "--no-figures")
    said = command("summits", "holes.npz", *pressed, "--fill").err
    assert re.search(
        r"1 summits are fitted to filled pixels.*: 1 of them touch, with \d+\.\d%", said
    )


@pytest.mark.sample(8)
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("missing.npy",), "missing.npy: cannot be read: No such file"),
        (("bare.npy",), "bare.npy: pixel: found none, expected its size, which the file does not"),
        (("bare.npy", "--pixel", "one"), "--pixel: found 'one', expected a number, or two"),
        (("bare.npy", "--pixel", "-1"), "pixel: found -1.0, expected a positive number"),
        (("bare.npy", "--pixel", "1", "--fit", "99"), "found 40 by 30 pixels, expected at"),
        (("bare.npy", "--pixel", "1", "--fit", "4"), "fit: found 4, expected an odd number"),
        (("bare.npy", "--pixel", "1", "--prune", "5"), "prune: found 5.0, expected a number"),
        (("plane.npy", "--pixel", "1", "--out", "no/a"), "heights: found nothing but a plane"),
        (("holes.npy", "--pixel", "1"), "found 3 holes (nan) in 1,200 pixels"),
        (("plane.npy", "--pixel", "1"), "heights: found nothing but a plane"),
        (("scan.npz", "--radius", "1"), "--radius needs exactly one of --approach and --load"),
        (("scan.npz", "--load", "1"), "--radius needs exactly one of"),
        (("scan.npz", "--radius", "1", "--load", "1"), "--load and --modulus go together"),
        (("scan.npz", "--scene", "scene.toml", "--radius", "1"), "--scene says how to press"),
        (("scan.npz", "--scene", "missing.toml"), "missing.toml: cannot be read"),
        (("scan.npz", "--radius", "-1", "--approach", "1"), "sphere_radius: found -1.0"),
        (("scan.npz", "--detrend", "cone"), "'cone' is not one of"),
    ],
)
@pytest.mark.usefixtures("surface")
def test_wrong_input(command: Any, arguments: tuple[str, ...], message: str) -> None:
    rough = np.random.default_rng(1).standard_normal((30, 40))
    np.save("bare.npy", rough)
    np.save("plane.npy", np.add.outer(np.arange(30.0), np.arange(40.0)))
    rough[3, 4:7] = np.nan
    np.save("holes.npy", rough)
    before = {path.name for path in Path().iterdir()}
    outcome = command("summits", *arguments)
    assert outcome.status == 2
    assert outcome.out == ""
    assert message in " ".join(outcome.err.split())
    assert "Traceback" not in outcome.err
    assert {path.name for path in Path().iterdir()} == before


def test_the_whole_map_beside_its_asperities(command: Any, surface: cr.surface.Surface) -> None:
    y, x = np.mgrid[:256, :256] - 127.5
    np.savez("ball.npz", heights=surface.heights - (x**2 + y**2) / 4000, pixel=1.0, unit="µm")
    pressed = ("--radius", "1e4", "--load", "10", "--modulus", "1", "--no-figures")
    ran = command("summits", "ball.npz", *pressed, "--whole")
    assert "of the variance of the heights: " in ran.err
    assert "--detrend sphere, removes it" in ran.err
    assert "the same approach  asperities  whole map  difference" in ran.out
    mended = ("--detrend", "sphere", "--force", "--whole")
    said = command("summits", "ball.npz", *pressed, *mended).out
    assert re.search(
        r"pressing radius +10000; the removed form, 1\d+\.\d+, is not in it: toge", said
    )
    mended = (*mended, "--json")
    ran = command("summits", "ball.npz", *pressed, *mended)
    assert "variance" not in ran.err
    found = json.loads(ran.out)["whole"]
    assert found["load"]["asperities"] == pytest.approx(10.0)
    assert 0.7 < found["load"]["asperities"] / found["load"]["whole"] < 1.0
    assert found["resolution"] < 0.01
    assert "--whole needs --scene or --radius" in command("summits", "ball.npz", "--whole").err


def test_a_tilt_that_leaves_no_summit_is_named(command: Any, surface: cr.surface.Surface) -> None:
    tilted = surface.heights + np.arange(256)
    np.savez("tilt.npz", heights=tilted, pixel=1.0, unit="µm")
    refused = command("summits", "tilt.npz", "--detrend", "none")
    assert refused.status == 2
    assert "; a plane, slopes " in refused.err
    assert "--detrend plane, removes it" in refused.err
    for form in ("plane", "sphere"):
        found = command("summits", "tilt.npz", "--detrend", form, "--no-figures", "--force")
        assert (found.status, "variance" in found.err) == (0, False)


def test_a_map_in_micrometres_called_millimetres(command: Any, surface: cr.surface.Surface) -> None:
    """Its slopes are right; only the base shows the mistake."""
    np.save("map.npy", surface.heights)
    Path("mm.toml").write_text(SCENE.format(radius=10.0, modulus=1e5, load=1.0, unit="mm"))
    for unit, wrong in (("mm", True), ("µm", False)):
        options = ("--pixel", "1", "--unit", unit, "--no-figures", "--force")
        said = command("summits", "map.npy", "--scene", "mm.toml", *options).err
        assert ("the map is 256 mm wide, and the sphere 20 mm: check the units" in said) == wrong
        assert ("asperities in contact: 1, fewer than 5" in said) == wrong


@pytest.mark.usefixtures("surface")
def test_where_nothing_touches_nothing_is_to_be_trusted(command: Any) -> None:
    asked = ("summits", "scan.npz", "--radius", "1e4", "--approach", "-100", "--no-figures")
    outcome = command(*asked)
    assert "warning: at a pruning of 0.05 nothing touches, so the model is not" in outcome.err
    assert "advised pruning   none, because nothing touches" in outcome.out
