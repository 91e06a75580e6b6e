"""`summits` on the command line; how strongly to prune, and the figures of a surface."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_checks import discs, fits, texts
from numpy.testing import assert_allclose
from scene_files import rows, scene_text
from scenes import MATERIAL

import convexrough as cr
from convexrough.plots.surface import surface_figures
from convexrough.surface import Provability, crowded, provability

FOUND = 'pattern = "file"\npath = "scan-summits/summits.csv"\ngeometry = "closest"'


def write_scene(name: str, unit: str, radius: float, modulus: float, load: float = 100.0) -> None:
    material = f"contact_modulus = {modulus}\npoisson_ratio = 0.3"
    units = f'[units]\nlength = "{unit}"' if unit else ""
    Path(name).write_text(scene_text(FOUND, f"load = {load}", units, str(radius), material))


def save(name: str, heights: Any) -> None:
    np.savez(name, heights=heights, pixel=1.0, unit="µm")


@pytest.fixture
def surface(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> cr.surface.Surface:
    """Its heights are in scan.npz, tilted; scene.toml presses it."""
    monkeypatch.chdir(tmp_path)
    surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=256, unit="µm")
    save("scan.npz", surface.heights + 0.01 * np.arange(256))
    write_scene("scene.toml", "µm", radius=1e4, modulus=1.0)
    return surface


@pytest.fixture
def find(command: Any, surface: cr.surface.Surface) -> Any:
    """`convexrough summits` on that map or others, without figures, over earlier results."""
    return lambda line: command("summits", *line.split(), "--no-figures", "--force")


#: Options that press a sphere.
PRESSED = "--radius 1e4 --load 10 --modulus 1"


def numbers(table: str, name: str) -> list[float]:
    """A column of a table that was written, whatever its unit."""
    found = rows(f"scan-summits/{table}.csv")
    (column,) = [each for each in found[0] if each.partition(" [")[0] == name]
    return [float(row[column]) for row in found]


def test_a_scan_becomes_a_scene(find: Any) -> None:
    outcome = find("scan.npz")
    assert outcome.status == 0
    assert outcome.err.startswith("convexrough: hint: use --scene or --radius to press")
    assert outcome.out.endswith("\nwritten to scan-summits: summits.csv, summary.json\n")
    found = cr.surface.read("scan.npz")
    summits = found.summits()
    for name, values in summits.columns().items():
        assert numbers("summits", name) == values.tolist()
    scene = cr.read_scene("scene.toml").scene
    np.testing.assert_array_equal(scene.asperities.positions, summits.positions)
    np.testing.assert_array_equal(scene.asperities.tip_radii, summits.tip_radii)
    assert f"summits           {len(summits):,}  (of {summits.origin.maxima:,} m" in outcome.out
    assert "removed           plane, slopes 0.01" in outcome.out
    density = found.summits(0.0).statistics.density
    said = rf"density +\[1/µm²\] +{density:.4g} +\S+ +{found.moments.density:.4g}"
    assert re.search(said, outcome.out)


def test_pressed_as_a_scene_says(find: Any) -> None:
    outcome = find("scan.npz --scene scene.toml --json")
    assert (outcome.status, "reads" in outcome.err) == (0, False)
    found = json.loads(outcome.out)
    file = cr.read_scene("scene.toml")  # of the table that was just written
    contact = cr.press(file.scene, load=file.load)
    chosen = next(row for row in found["provability"] if row["prune"] == 0.05)
    assert chosen["contacts"] == (contact.status == "contact").sum()
    assert_allclose(chosen["approach"], contact.approach, rtol=1e-9)
    assert found["crowded"] == []
    later = [row for row in found["provability"] if row["prune"] >= found["trusted_from"]]
    assert {row["doubt"] for row in later if row["contacts"] >= 5} == {""}
    assert rows("scan-summits/provability.csv")[0]["prune"] == "0.0"
    assert json.loads(Path("scan-summits/summary.json").read_text()) == found
    assert json.loads(find(f"scan.npz {PRESSED} --load 100 --json").out) == found


def test_a_scene_in_another_unit(find: Any) -> None:
    """A map in µm for a scene in m: the table is in m, and the contact the same."""
    write_scene("metres.toml", "m", radius=0.01, modulus=1e12)

    def pressed(scene: str) -> tuple[Any, Any]:
        found = json.loads(find(f"scan.npz --scene {scene} --json").out)
        return found, np.array(numbers("summits", "tip_radius"))

    (one, radii), (other, smaller) = map(pressed, ("scene.toml", "metres.toml"))
    assert_allclose(smaller, radii / 1e6)
    assert other["surface"]["unit"] == "m"
    for first, second in zip(one["provability"], other["provability"], strict=True):
        assert first["contacts"] == second["contacts"]
        assert_allclose(second["approach"], 1e-6 * first["approach"], rtol=1e-6)
    np.save("nameless.npy", cr.surface.read("scan.npz").heights)
    nameless = find("nameless.npy --pixel 1 --scene metres.toml")
    assert nameless.refuses("expected a map with a unit, as metres.toml is in m: unit=")
    summits = cr.surface.read("scan.npz").summits(0.05)
    with pytest.raises(cr.InputError, match=r'summits in µm, expected .* Surface.to_unit\("m"\)'):
        cr.read_scene("metres.toml", asperities=summits)
    write_scene("unnamed.toml", "", radius=0.01, modulus=1e12)
    said = "expected a unit of length in unnamed.toml"
    assert find("scan.npz --scene unnamed.toml").refuses(said)


def test_not_certified_is_exit_status_three(find: Any) -> None:
    """A ridge with two tops that are almost one."""
    x, y = np.mgrid[-32:33, -32:33]
    tops = -1e-5 * (np.minimum(abs(x), 6) ** 2 - 16.0) ** 2
    save("scan.npz", tops - x**2 / 1e6 - y**2 / 4e3)
    outcome = find("scan.npz --prune 0 --radius 1e4 --approach 3 --detrend none")
    assert outcome.status == 3
    assert Path("scan-summits/summits.csv").exists()
    assert " none " in outcome.out
    assert "not met at a pruning of 0: status not proved; no pruning meets all" in outcome.err


def test_a_long_table_is_written_as_npz(find: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("convexrough.run.results.MOST_CSV_ROWS", 3)
    assert "summits.npz" in find("scan.npz").out
    columns = np.load("scan-summits/summits.npz")
    assert len(columns["height [µm]"]) == len(columns["deviation [µm]"]) > 3


def test_summits_on_filled_pixels_are_counted(find: Any, surface: cr.surface.Surface) -> None:
    heights = np.array(surface.heights)
    row, column = surface.summits().pixels[0]
    heights[row + 1 : row + 3, column] = np.nan
    save("holes.npz", heights)
    said = find(f"holes.npz {PRESSED} --fill").err
    assert re.search("summits fitted to filled pixels.*: 1\n", said)


def test_wrong_input(find: Any) -> None:
    np.save("bare.npy", np.random.default_rng(1).standard_normal((30, 40)))
    np.save("plane.npy", np.add.outer(np.arange(30.0), np.arange(40.0)))
    before = {path.name for path in Path().iterdir()}
    for arguments, message in (
        ("bare.npy --pixel -1", "pixel: found -1.0, expected a positive number"),
        ("bare.npy --pixel one", "--pixel: found 'one', expected a number, or two"),
        ("bare.npy --pixel 1 --fit 99", "found 40 by 30 pixels, expected at"),
        ("bare.npy --pixel 1 --prune 5", "prune: found 5.0, expected a number"),
        ("plane.npy --pixel 1", "heights: found nothing but a plane"),
        ("scan.npz --radius 1", "--radius needs exactly one of --approach and --load"),
        ("scan.npz --load 1", "--approach, --load and --modulus need --radius"),
        ("scan.npz --radius 1 --load 1", "--load needs --modulus"),
        ("scan.npz --scene scene.toml --radius 1", "--scene excludes --radius"),
        ("scan.npz --scene missing.toml", "missing.toml: cannot be read"),
        ("scan.npz --radius -1 --approach 1", "sphere_radius: found -1.0"),
        ("scan.npz --detrend cone", "'cone' is not one of"),
    ):
        outcome = find(arguments)
        assert (outcome.status, outcome.out) == (2, "")
        assert message in " ".join(outcome.err.split())
        assert {path.name for path in Path().iterdir()} == before


def test_the_whole_map_beside_its_asperities(find: Any, surface: cr.surface.Surface) -> None:
    y, x = np.mgrid[:256, :256] - 127.5
    save("ball.npz", surface.heights - (x**2 + y**2) / 4000)
    pressed = f"ball.npz {PRESSED} --whole"
    ran = find(pressed)
    assert "of the variance of the heights: " in ran.err
    assert "--detrend sphere, removes it" in ran.err
    assert "at one approach  asperities  whole map  difference" in ran.out
    said = find(f"{pressed} --detrend sphere").out
    unless = r"with the removed form, unless 10000 contains it already\n"
    assert re.search(rf"pressing radius +10000; 1\d+\.\d+ {unless}", said)
    ran = find(f"{pressed} --detrend sphere --json")
    assert "variance" not in ran.err
    found = json.loads(ran.out)["whole"]
    assert found["load"]["asperities"] == pytest.approx(10.0)
    assert 0.7 < found["load"]["asperities"] / found["load"]["whole"] < 1.0
    assert found["resolution"] < 0.01
    assert "--whole needs --scene or --radius" in find("ball.npz --whole").err


def test_a_map_in_micrometres_called_millimetres(find: Any, surface: cr.surface.Surface) -> None:
    """Its slopes are right; only the base shows the mistake."""
    np.save("map.npy", surface.heights)
    write_scene("mm.toml", "mm", radius=10.0, modulus=1e5, load=1.0)
    for unit, wrong in (("mm", True), ("µm", False)):
        said = find(f"map.npy --scene mm.toml --pixel 1 --unit {unit}").err
        assert ("the map is 256 mm wide, and the sphere 20 mm: check the units" in said) == wrong
        assert ("asperities in contact: 1, fewer than 5" in said) == wrong


def test_where_nothing_touches_nothing_is_to_be_trusted(find: Any) -> None:
    outcome = find("scan.npz --radius 1e4 --approach -100")
    place = "pressed at        approach of the pressing body from height 0: -100 µm\npruning"
    assert place in outcome.out
    assert "no asperity carries a load: check the sign and unit of the approach" in outcome.err
    assert "assumptions       met at no pruning" in outcome.out


def test_heights_far_from_zero(find: Any, surface: cr.surface.Surface) -> None:
    """The contact is that of the shifted map; only the approach is shifted, which is said."""
    found = []
    for offset, warned in ((0, False), (5000, True)):
        save("scan.npz", surface.heights + offset)
        ran = find("scan.npz --scene scene.toml --detrend none")
        assert ("the mean height is 5000 µm: approaches are measured from" in ran.err) == warned
        assert ("removed           nothing; the mean height is 5000 µm" in ran.out) == warned
        approaches = np.array(numbers("provability", "approach"))
        span = f"{approaches.min():.6g} to {approaches.max():.6g} µm\n"
        assert f"load 100, approach of the pressing body from height 0: {span}" in ran.out
        found.append((approaches + offset, numbers("provability", "contacts")))
    assert found[0][1] == found[1][1]
    assert_allclose(found[0][0], found[1][0], rtol=1e-9)


def test_the_body_with_a_removed_paraboloid(find: Any, surface: cr.surface.Surface) -> None:
    """The radii that a scene accepts, along x and y; else the angle by which to turn summits."""
    y, x = np.mgrid[:256, :256] - 127.5
    for curvatures, degrees, radii in (
        ((1 / 3e3, 0.0), 0.0, (2307.7, 1e4)),
        ((1 / 3e3, 1 / 6e3), 30.0, (2307.7, 3750.0)),
        ((1 / 3e3, 1 / 6e3), 120.0, (3750.0, 2307.7)),
        ((1 / 3e3, -1 / 3e3), 0.0, (2307.7, -4285.7)),
        ((-1 / 3e3, -1 / 3e3), 0.0, (-4285.7, -4285.7)),
    ):
        u = (x + 1j * y) * np.exp(-1j * np.radians(degrees))
        form = -(curvatures[0] * u.real**2 + curvatures[1] * u.imag**2) / 2
        save("form.npz", surface.heights / 10 + form)
        ran = find(f"form.npz {PRESSED} --detrend paraboloid")
        found = json.loads(Path("form-summits/summary.json").read_text())["with_form"]
        assert_allclose(found["radii"], radii, rtol=0.02)
        if curvatures[0] != curvatures[1]:
            assert_allclose(found["angle"], 30.0 if degrees else 0.0, atol=1)
        (line,) = re.findall("pressing radius.*", ran.out)
        turn = "turn x and y of the summits by -[23]"
        assert re.search(turn if degrees else r"\] with the removed form", line), line


MAP = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=384, unit="µm")
MAXIMA = MAP.summits(0.0)


def press(asperities: cr.Asperities, load: float = 300.0) -> cr.Contact:
    return cr.press(cr.Scene(1e4, asperities, MATERIAL, geometry="closest"), load=load)


def test_each_level_is_a_press(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", logger="convexrough")
    curve = provability(MAXIMA, press, levels=[0.2, 0.0, 0.05, 0.05])
    assert curve.prune.tolist() == [0.0, 0.05, 0.2]
    assert sum(line.startswith("pruning") for line in caplog.messages) == 3
    for i, prune in enumerate(curve.prune):
        left = MAP.summits(float(prune))
        contact = press(left)
        assert curve.summits[i] == len(left)
        assert curve.heights[i] == prune * MAP.max_height
        assert curve.scope[i] == contact.certificate.scope
        assert_allclose(curve.crowding[i], contact.crowding, rtol=1e-9)
        assert_allclose(curve.model_error[i], contact.model_error, rtol=1e-6)
        assert_allclose(curve.approaches[i], contact.approach, rtol=1e-9)
        _, values = crowded(contact, above=0.1)
        assert_allclose(values[0], contact.crowding, rtol=1e-12)
        if contact.certificate.all_proved:
            assert curve.contacts[i] == (contact.status == "contact").sum()
            assert curve.undecided[i] == 0


def curve_of(**changed: Any) -> Provability:
    """One that is to be trusted, but for what is changed."""
    good = dict(prune=0.1, heights=0.1, summits=9, contacts=5, undecided=0, scope="global",
                crowding=0.999, model_error=0.0499, approaches=1.0, loads=1.0)  # fmt: skip
    size = np.size(changed.get("prune", 0.1))
    return Provability(**{name: np.resize(it, size) for name, it in (good | changed).items()})


def test_what_trust_needs() -> None:
    fine = {}, {"scope": "local"}
    wrong = ({"contacts": 4}, {"scope": "none"}, {"undecided": 1}, {"crowding": 1.001},
             {"model_error": 0.0501}, {"crowding": np.nan})  # fmt: skip
    for change in (*fine, *wrong):
        trusted, curve = change in fine, curve_of(**change)
        assert (curve.trusted.tolist(), curve.trusted_from == 0.1) == ([trusted], trusted)


def test_prunings_that_leave_few_contacts_are_not_advised() -> None:
    """Neither alone, on a crowded map, nor as a reason to doubt weaker prunings."""
    for crowding, first in (([1.2, 1.1, 0.1, 0.0], np.nan), ([1.2, 0.9, 0.1, 0.0], 0.1)):
        curve = curve_of(prune=[0.0, 0.1, 0.3, 0.5], contacts=[30, 20, 4, 1], crowding=crowding)
        assert_allclose(curve.trusted_from, first)
        assert curve.doubts[0] == "discs overlap"
        assert curve.doubts[-1] == "fewer than 5 contacts"
    curve = curve_of(prune=[0.0, 0.1, 0.3, 0.5], contacts=[8, 8, 4, 5], crowding=[0.1] * 4)
    assert curve.trusted_from == 0.0


def said(figure: Any) -> set[str]:
    return {text.get_text() for text in texts(figure)}


@pytest.mark.sample(1)
@pytest.mark.parametrize("load", [1.0, 300.0, 1000.0])
def test_figures_fit(load: float) -> None:
    summits = MAXIMA.pruned(0.02)
    curve = provability(MAXIMA, lambda left: press(left, load))
    contact = press(summits, load)
    figures = surface_figures(MAP, MAXIMA, summits, curve, contact)
    assert set(figures) == {"map", "histograms", "provability"}
    fits(*figures.values())
    touching = int((contact.loads > 0).sum())
    chart = figures["map"].axes[0]
    assert discs(chart, "_contacts") == touching
    (dots,) = chart.lines
    shown, count = len(dots.get_xdata()), f"{len(summits):,}"
    some = count if shown == len(summits) else f"{shown:,} of {count}"
    named = {f"summits ({some})", f"contacts ({touching:,})", "smooth contact"}
    assert named <= said(figures["map"])
    pairs, _ = crowded(contact)
    assert {f"{i}, {j}" for i, j in pairs[:1]} <= said(figures["map"])


def test_a_map_names_the_unit_of_its_numbers() -> None:
    """256 Å are 25.6 nm, of heights and of summits."""
    surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, unit="Å")
    for drawn in (surface.plot(), surface.summits().plot()):
        assert drawn.get_xlabel().endswith("[nm]")
        assert drawn.get_xlim()[1] == pytest.approx(12.8, rel=0.15)
