"""Which scenes a sweep has, what a file may say of them, what is in its table, and its forms."""

import itertools
import json
import pickle
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import SMALL, numbers, same, sweeping, swept, tables, toml
from scenes import hexagonal, paper

import convexrough as cr
from convexrough.sweeps.batch import compute
from convexrough.sweeps.grid import Grid, with_values
from convexrough.sweeps.measures import CYCLE, NORMAL, measured
from convexrough.sweeps.plan import plan_of


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> cr.SweepTable:
    """The table of SMALL, in a folder that no test changes."""
    return swept(SMALL, out=tmp_path_factory.mktemp("whole") / "a")


@pytest.fixture
def folder(whole: cr.SweepTable, tmp_path: Path) -> Path:
    """A copy of that folder."""
    shutil.copytree(whole.folder.path, tmp_path / "a")
    return tmp_path / "a"


ALL = tables(
    shear={"fractions": [0.2, 0.5]},
    cycle={"maximum_fraction": [0.37, 0.5], "minimum_fraction": [-0.37, 0.1]},
    history={"fractions": [0.5, -0.2, 0.5]},
    steady={"ellipse": {"load": 3e-7, "load_amplitude": 5e-8, "force_amplitude": 4e-8}},
    sweep={
        "seeds": 2,
        "measure": [
            *("contact", "open", "undecided", "load", "approach", "load_error"),
            *("certificate.convexity_number", "model_error", "crowding", "displacement"),
            *("loss", "loss_normalised", "loss_over_smooth", "loss_factor", "secant_stiffness"),
            *("history.loss", "steady.loss"),
        ],
    },
)


def test_rows_are_those_of_single_scenes() -> None:
    table = swept(ALL)
    rows = table.read()
    assert list(rows) == table.columns
    assert rows["scene"].tolist() == list(range(8))
    assert set(rows["status"]) == {"certified"}
    assert set(rows["message"]) == {""}
    for i in (0, 7):  # the first and the last seed
        rough = hexagonal(height_std=rows["asperities.height_std"][i], seed=int(rows["seed"][i]))
        scene = replace(rough, friction=0.5)
        contact = cr.press(scene, load=rows["normal.load"][i])
        P, proof = 0.5 * contact.load, contact.certificate
        first, second = cr.cycles(contact, P * np.array([0.37, 0.5]), P * np.array([-0.37, 0.1]))
        loads, forces = cr.elliptic_path(**ALL["steady"]["ellipse"], friction=0.5)
        closed = cr.steady(scene, loads=loads, forces=forces)
        expected = {
            "contact": (contact.status == "contact").sum(),
            "open": (contact.status == "open").sum(), "undecided": 0, "load": contact.load,
            "approach": contact.approach, "load_error": proof.load_error,
            "certificate.convexity_number": proof.convexity_number,
            "model_error": contact.model_error, "crowding": contact.crowding,
            "displacement_0.2": cr.shear(contact, force=0.2 * P).displacement,
            "displacement_0.5": cr.shear(contact, force=0.5 * P).displacement,
            "loss_0.37": first.loss, "loss_0.1_0.5": second.loss,
            "loss_normalised_0.37": first.loss_normalised,
            "loss_over_smooth_0.1_0.5": second.loss_normalised / second.smooth_normalised,
            "loss_factor_0.37": first.loss_factor,
            "secant_stiffness_0.1_0.5": second.secant_stiffness,
            "history.loss_2": cr.history(contact, forces=P * np.array([0.5, -0.2, 0.5])).losses[2],
            "steady.loss": closed.loss,
        }  # fmt: skip
        for name, value in expected.items():
            rounding = 1e-12 * value if name == "load_error" else 0.0
            assert rows[name][i] == pytest.approx(value, rel=0.0, abs=rounding), name


TOGETHER = {"maximum_fraction": [0.37, 1.0], "minimum_fraction": [-0.37, 0.1]}


@pytest.mark.parametrize("cycle", [TOGETHER, {"displacement": [1e-6, 2e-6]}])
def test_rows_together_are_those_of_scenes_one_by_one(cycle: dict[str, list[float]]) -> None:
    """Where only numbers of contacts and cycles are asked for, scenes are computed together."""
    contents = {k: v for k, v in ALL.items() if k not in ("shear", "history", "steady")}
    contents["cycle"] = cycle
    asked = [f"normal.{each}" for each in NORMAL] + [f"cycle.{each}" for each in CYCLE]

    def measured(*more: str) -> dict[str, Any]:
        sweep = ALL["sweep"] | {"measure": [*asked, *more]}
        return swept(contents | {"sweep": sweep}).read()

    together, alone = measured(), measured("crowding")
    assert ("cycle.loss_1e-06" in alone) == ("displacement" in cycle)
    assert set(alone) - set(together) == {"crowding"}
    for name, values in together.items():
        if values.dtype.kind == "U":
            assert values.tolist() == alone[name].tolist()
        elif "error" in name:
            assert (values <= 1e3 * alone[name] + 1e-25).all(), name
        else:
            np.testing.assert_allclose(values, alone[name], rtol=1e-12, atol=1e-30, err_msg=name)


def test_scenes_made_in_python() -> None:
    """A number that is asked for twice, or swept, has one column."""
    scenes = [replace(paper(), sphere_radius=R, friction=0.5) for R in (0.9, 1.0, 1.1)]
    loads, asked = [1e-7, 2e-7, 3e-7], ("approach", "loss", "load", "normal.load", "load")
    table = swept(scenes, load=loads, cycle=[0.3], measure=(name for name in asked))
    assert table.columns[:5] == ["scene", "normal.load", "seed", "status", "message"]
    assert table.columns[5:] == ["approach", "loss_0.3", "load"]
    assert numbers(table, "normal.load", "seed") == [loads, [-1, -1, -1]]
    contacts = [cr.press(scene, load=load) for scene, load in zip(scenes, loads, strict=True)]
    losses = [cr.cycle(each, maximum=0.3 * 0.5 * each.load).loss for each in contacts]
    approaches = [each.approach for each in contacts]
    assert numbers(table, "approach", "loss_0.3") == [approaches, losses]


def test_scenes_of_a_made_lattice_are_the_same_in_other_processes() -> None:
    """The layout goes with them, and no bit depends on earlier scenes with the same points."""
    scene = hexagonal(0.0012, 0.01, height_std=1e-6, seed=1)
    cr.press(scene, load=3e-6)
    contact = cr.press(scene, load=1e-7)
    again = cr.press(pickle.loads(pickle.dumps(scene)), load=1e-7)
    assert len(scene) > 200
    assert contact.influence == again.influence
    assert again.scene.lattice.basis.tolist() == scene.lattice.basis.tolist()
    assert again.certificate.load_errors.tolist() == contact.certificate.load_errors.tolist()


def test_a_file_that_changes_during_a_sweep(tmp_path: Path) -> None:
    """No table has rows of two surfaces."""
    (tmp_path / "a.csv").write_text("x,y,tip_radius\n0,0,1\n1,0,1\n")
    contents = sweeping(over={"normal.load": [1e-7, 2e-7]})
    contents["asperities"] = {"pattern": "file", "path": "a.csv"}
    (tmp_path / "a.toml").write_text(toml(contents))
    plan = plan_of(tmp_path / "a.toml")
    (tmp_path / "a.csv").write_text("x,y,tip_radius\n0,0,1\n1,0,2\n")
    with pytest.raises(cr.FileError, match=r"a\.csv: changed since the sweep began"):
        compute(plan.batch(range(2)))


def failing(over: dict[str, Any]) -> dict[str, Any]:
    """Radii of 61 asperities, for scenes of 61 and of 19."""
    found = sweeping(over=over | {"asperities.within": [0.0102, 0.0052]})
    found["asperities"]["tip_radius"] = [0.02] * 61
    return found


@pytest.mark.usefixtures("no_processes")
def test_a_scene_that_fails_has_a_row_that_says_why(command: Any, tmp_path: Path) -> None:
    """And the command says which failed, as its status does."""
    table = swept(failing({"normal.load": [1e-7, 1e-30, 3e-7]}))
    status, message, contact = numbers(table, "status", "message", "contact")
    assert status == ["certified", "failed"] * 3
    assert "tip_radius: found shape (61,), expected 19 values" in message[1]
    assert np.isnan(contact[1::2]).all()
    assert not np.isnan(contact[::2]).any()
    (tmp_path / "a.toml").write_text(toml(failing({})))
    status, _, err = command("sweep", "a.toml", "--workers", "1")
    assert status == 4
    assert err.startswith("convexrough: warning: scene 1: a.toml: [asperities] tip_radius")


ELLIPSE = {"load": 3e-7, "load_amplitude": 5e-8, "force_amplitude": 4e-8, "chords": 6}
HELD = {"gradient.holding": ["load", "approach"]}
GROSS = "no gradient of the loss exists for this scene: maximum: found 1.5e-07: gross sliding"


def test_a_missing_number_is_nan() -> None:
    for measure, values, fraction, said in (
        ("closest_change", {"asperities.geometry": ["summit", "closest"]}, 0.5, ""),
        ("gradient.by.sphere_radius", {"sphere.radius": [1.0, [1.0, 2.0]]}, 0.5, ""),
        ("gradient.by.load", HELD, 0.5, ""),
        ("gradient.by.friction", HELD, 1.0, GROSS),
        ("phase_losses.loss", {"steady.phases": [[0.0, 1.0], [0.5]]}, 0.5, ""),
    ):
        contents = sweeping(measure=["contact", measure], over=values)
        contents["gradient"] = {"of": "loss", "fraction": fraction}
        table = swept(contents | {"steady": {"ellipse": ELLIPSE}})
        status, message, last = numbers(table, "status", "message", table.measured[-1])
        assert status == ["certified", "undecided" if said else "certified"]
        assert said in message[1]
        assert np.isnan(last).tolist() == [False, True], measure
        assert not np.isnan(table.read(["contact"])["contact"]).any()
        assert not said or table.quantiles([measure])["0.05"][0] == -np.inf


def test_numbers_that_the_first_scene_lacks() -> None:
    """A scene with more rows fails; numbers of no common scene are refused."""
    phases = sweeping(measure=["phase_losses.loss"], over={"steady.phases": [[0.5], [0.0, 1.0]]})
    status, message = numbers(swept(phases | {"steady": {"ellipse": ELLIPSE}}), "status", "message")
    assert status == ["certified", "failed"]
    assert message[1].startswith("steady.phase_losses.loss: found row 1, without a column")
    held = sweeping(measure=["by.load", "by.approach"], over=HELD)
    with pytest.raises(cr.InputError, match=r"measure: found .by\.load., expected a number"):
        swept(held | {"gradient": {"of": "loss", "fraction": 0.5}})


def test_what_is_refused(whole: cr.SweepTable) -> None:
    for call, said in (
        (lambda: whole.quantiles(at=[1.5]), r"at\[0\]: found 1.5, expected a number from 0"),
        (lambda: whole.quantiles(at="a"), "at: found 'a', expected a list of quantiles"),
        (lambda: whole.read("load"), "columns: found 'load', expected a list of names"),
        (lambda: swept([paper()], load=1e-7, cycle=[(0.5, 0.1)], measure=["loss"]), "cycle: "),
        (lambda: swept(SMALL, resume=True), "out: found none, expected the folder of"),
        (lambda: swept(SMALL, out="b", resume=True, overwrite=True), "overwrite: found both"),
        (lambda: swept(SMALL, part=(1.5, 2)), "part: found 1.5, expected a whole number"),
        (lambda: swept([paper()], load=1e-7, measure=[1]), r"measure: found \[1\], expected"),
        (lambda: cr.open_sweep("x" * 300), "cannot be read: File name too long"),
    ):
        with pytest.raises((cr.InputError, cr.FileError), match=said):
            call()


@pytest.mark.usefixtures("no_processes")
def test_what_is_not_proved_is_said_counted_and_marked(command: Any, tmp_path: Path) -> None:
    graze = sweeping(over={"normal.approach": [0.0, 5e-5]})
    graze["normal"] = {}
    table = swept(graze)
    said = "not certified: undecided asperities: 1; "
    said += "no asperity carries a load: check the sign and unit of the approach"
    assert numbers(table, "status", "message") == [["undecided", "certified"], [said, ""]]
    assert table.quantiles()["undecided"].tolist() == [1, 0]
    axes = table.plot()
    white = [line.get_xydata().tolist() for line in axes.lines if line.get_mfc() == "white"]
    assert [points for points in white if points] == [[[0.0, 0.0]]]
    assert axes.get_legend().get_texts()[-1].get_text() == "with undecided scenes"
    (tmp_path / "a.toml").write_text(toml(graze))
    for asked in (("a.toml", "--workers", "1"), ("--summary", "a-sweep")):
        status, _, err = command("sweep", *asked)
        assert status == 3
        first = f"undecided scenes: 1 of 2; the first is scene 0: {said}"
        assert err.startswith(f"convexrough: warning: {first}")


def test_a_figure_has_a_logarithmic_axis_for_decades_and_says_what_a_band_pools() -> None:
    over = {"sphere.radius": [0.9, 1.0], "normal.load": [1e-10, 2e-7, 3e-7]}
    over |= {"friction.coefficient": [0.4, 0.5]}
    table = swept(sweeping(over=over, measure=["load", "contact"]))
    load, contact = (table.plot(name, "sphere.radius") for name in ("load", "contact"))
    assert (load.get_yscale(), contact.get_yscale()) == ("log", "linear")
    assert table.plot("load", "normal.load").get_xscale() == "log"
    assert "all load, coefficient: 6 combinations" in contact.get_legend().get_texts()[0].get_text()


def test_a_figure_of_names_joins_nothing() -> None:
    contents = sweeping(over={"asperities.geometry": ["summit", "closest"]}, seeds=3)
    contents["asperities"]["height_std"] = 1e-6
    axes = swept(contents).plot()
    assert [each.get_text() for each in axes.get_xticklabels()] == ["summit", "closest"]
    assert {each.get_linestyle() for each in axes.lines} == {"None"}
    assert [len(each.get_segments()) for each in axes.collections] == [2, 2]  # type: ignore[attr-defined]


def test_data_frames(whole: cr.SweepTable, folder: Path) -> None:
    frame = cr.open_sweep(folder).to_dataframe()
    assert list(frame.columns) == whole.columns
    assert frame.index.name == "row"
    assert frame["loss_0.37"].tolist() == numbers(whole, "loss_0.37")[0]
    lazy = whole.to_dask(["normal.load", "loss_0.37"])
    assert lazy.npartitions > 1
    means = lazy.groupby("normal.load")["loss_0.37"].mean().compute(scheduler="synchronous")
    expected = frame.groupby("normal.load")["loss_0.37"].mean()
    assert means.to_dict() == pytest.approx(expected.to_dict(), rel=1e-15, abs=0)
    with pytest.raises(cr.InputError, match="column: found 'los', expected a column of the table"):
        whole.read(["los"])
    parquet = pytest.importorskip("pyarrow.dataset").dataset(folder / "parts")
    rows = parquet.to_table(columns=["scene", "load"])
    assert sorted(rows["scene"].to_pylist()) == list(range(16))


def test_a_part_of_a_sweep(whole: cr.SweepTable, tmp_path: Path) -> None:
    for k in (2, 3, 1):
        table = swept(SMALL, out=tmp_path / "a", part=(k, 3))
        assert table.complete == (k == 1)
    assert same(table, whole)
    second = swept(SMALL, part=(2, 3))
    assert numbers(second, "scene") == [list(range(5, 10))]
    other = tables(sweep={"seeds": 5})
    for contents, full in ((SMALL, [True] * 3), (other, [False, False, True])):
        for k in (1, 2, 3):  # a part replaces another sweep, but only its own share of the same
            table = swept(contents, out=tmp_path / "a", part=(k, 3), overwrite=True)
            assert table.complete == full[k - 1]
    assert same(table, swept(other))


def test_a_folder_of_another_sweep_is_refused(folder: Path) -> None:
    before = sorted(path.name for path in (folder / "parts").iterdir())
    another = "holds another sweep, 16 scenes of sweep by version.*this is 20 scenes of sweep"
    with pytest.raises(cr.FileError, match=another):
        swept(tables(sweep={"seeds": 5}), out=folder, resume=True)
    with pytest.raises(cr.FileError, match="holds 16 of these 16 scenes already; resume=True"):
        swept(SMALL, out=folder)
    assert sorted(path.name for path in (folder / "parts").iterdir()) == before
    other, part = tables(sweep={"seeds": 1}), next((folder / "parts").iterdir())
    notes, kept = folder / "notes.txt", part.with_name(f"{part.name}.bak")
    for mine in (notes, kept):
        mine.write_text("mine")
    assert same(swept(other, out=folder, overwrite=True), swept(other))
    assert notes.read_text() == kept.read_text() == "mine"


def test_nothing_of_a_folder_that_is_no_sweep_is_removed(folder: Path) -> None:
    """Nor parts without a manifest, by a sweep that is not told to overwrite."""
    manifest, before = folder / "manifest.json", {*(folder / "parts").iterdir()}
    manifest.write_text("{}")
    with pytest.raises(cr.FileError, match="cannot be read: not a sweep"):
        swept(SMALL, out=folder, overwrite=True)
    assert manifest.read_text() == "{}"
    manifest.unlink()
    assert swept(tables(sweep={"seeds": 1}), out=folder).complete
    assert before < {*(folder / "parts").iterdir()}


def test_resuming_computes_what_is_missing_or_damaged_only(
    whole: cr.SweepTable, folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    gone, broken, *kept = sorted((folder / "parts").iterdir())
    gone.unlink()
    broken.write_bytes(broken.read_bytes()[:-1] + b"x")
    with pytest.raises(cr.FileError, match="; remove this file"):
        cr.open_sweep(folder).read()
    broken.unlink()
    (folder / "parts" / f".{gone.name}.123.unfinished").write_bytes(b"half")
    (folder / "parts/notes.txt").write_text("mine")
    times = {part: part.stat().st_mtime_ns for part in kept}
    with caplog.at_level("INFO", "convexrough"):
        again = swept(SMALL, out=folder, resume=True)
    said = [news for news in caplog.messages if "scenes" in news]
    assert said[0] == "found 14 scenes of an earlier run"
    assert said[-1].startswith("2 of 2 scenes, ")
    assert {path: path.stat().st_mtime_ns for path in times} == times
    assert not list((folder / "parts").glob(".*"))
    assert (folder / "parts/notes.txt").read_text() == "mine"
    assert same(again, whole)


@pytest.mark.usefixtures("no_processes")
def test_the_command(command: Any, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(toml(SMALL))
    status, out, err = command("sweep", "a.toml", "--workers", "1")
    assert (status, err) == (0, "")
    assert "scenes      16\nrows        16\n  certified 16\n" in out
    resumed = command("sweep", "a.toml", "--workers", "1", "--resume", "--json")
    assert '"computed": 0' in resumed.out
    status, out, err = command("sweep", "--summary", "a-sweep", "--out", "b")
    assert (status, sum("loss_0.37" in line for line in out.splitlines())) == (0, 4 + 1)
    written = {path.name for path in (tmp_path / "b").iterdir()}
    assert {"quantiles.csv", "loss_0.37-over-normal.load.png"} <= written
    parts = sorted((tmp_path / "a-sweep/parts").iterdir())
    parts[0].unlink()
    parts[3].unlink()
    incomplete = command("sweep", "--summary", "a-sweep", "--out", "c")
    assert len(list((tmp_path / "c").glob("*.png"))) == len(written) - 2
    assert incomplete.err == "convexrough: warning: incomplete: 2 of 16 scenes are missing\n"
    assert json.loads((tmp_path / "c/files.json").read_text())["rows"] == 14
    assert cr.open_sweep("a-sweep").plot().get_title("left") == "2 scenes are missing"


def test_onset_is_the_least_force_at_which_the_fraction_slides() -> None:
    asperities = cr.Asperities([[0, 0], [1, 0], [0, 1], [-1, -1]], 0.1, [0.0, 2e-4, 3e-4, 5e-4])
    scene = cr.Scene(np.inf, asperities, cr.Material(1.0, 0.3), friction=0.5)
    contact = cr.press(scene, approach=1e-3)
    onsets = np.sort(cr.onset_of_sliding(contact)[contact.loads > 0]) / (0.5 * contact.load)
    found = measured(contact, {}, ["onset"]).numbers
    for quarters in range(1, 5):
        least = onsets[-(-quarters * len(onsets) // 4) - 1]
        np.testing.assert_allclose(found["onset", f"{quarters / 4:g}"], least, rtol=1e-12)


def identity(contents: dict[str, Any], folder: Path = Path()) -> Any:
    return plan_of(contents, folder / "sweep.toml").manifest["sweep"]


def mistakes(contents: dict[str, Any]) -> str:
    with pytest.raises(cr.InputError) as caught:
        identity(contents)
    return str(caught.value)


def points(**keys: Any) -> list[tuple[Any, ...]]:
    """The values and the seed of each scene."""
    grid = Grid(measure=["load"], **keys)
    return [(*values.values(), seed) for values, seed in map(grid.point, range(grid.count))]


def test_rows_are_in_the_order_of_lists_then_grid_then_seeds() -> None:
    together = {"sphere.radius": [1.0, 2.0], "material.poisson_ratio": [0.1, 0.2]}
    over = {"normal.load": [1, 2, 3], "asperities.height_std": [0.0, 1.0]}
    expected = itertools.product([(1.0, 0.1), (2.0, 0.2)], (1, 2, 3), (0.0, 1.0), (7, 5))
    found = points(together=together, over=over, seeds=[7, 5])
    assert found == [(*both, *others) for both, *others in expected]


def test_draws_belong_to_the_seed_alone() -> None:
    def samples(**draw: Any) -> list[float]:
        found = points(over={"normal.load": [1, 2]}, draw=draw, seeds=5)
        return [friction for *_, friction, _ in found]

    friction = {"friction.coefficient": {"uniform": [0.2, 0.6]}}
    alone = samples(**friction)
    assert alone[:5] == alone[5:]
    assert len(set(alone)) == 5
    assert all(0.2 <= value <= 0.6 for value in alone)
    assert samples(**{"sphere.radius": {"normal": [1.0, 0.1]}}, **friction) == alone


def test_whatever_numbers_depend_on_is_in_the_hash(tmp_path: Path) -> None:
    """Also the contents of a file of asperities."""
    over = {"normal.load": [1e-7, 3e-7], "asperities.height_std": [0.0, 1e-6]}
    found = [
        identity(SMALL),
        identity(tables(sphere={"radius": 1.1})),
        identity(sweeping(seeds=2, draw={"sphere.radius": {"uniform": [1, 2]}})),  # no heights
        identity(tables(cycle={"maximum_fraction": [0.38]})),
        *(identity(tables(sweep={"seeds": seeds})) for seeds in (5, [0, 1, 2, 4])),
        *(identity(tables(sweep=table)) for table in ({"measure": ["load"]}, {"over": over})),
    ]
    contents = sweeping(over={"normal.load": [1e-7]})
    contents["asperities"] = {"pattern": "file", "path": "a.csv"}
    for x in (0.0, 1e-4):
        (tmp_path / "a.csv").write_text(f"x,y,tip_radius\n{x},0.0,0.02\n")
        found.append(identity(contents, tmp_path))
    assert len({*found}) == len(found)


def test_a_key_of_a_table_within_a_table() -> None:
    own = {"material": {"sphere": {"youngs_modulus": 1.0, "poisson_ratio": 0.3}, "base": {}}}
    for modulus in (2.0, 3.0):
        there = with_values(own, {"material.sphere.youngs_modulus": modulus}, None)["material"]
        assert there == {"sphere": {"youngs_modulus": modulus, "poisson_ratio": 0.3}, "base": {}}
    assert own["material"]["sphere"]["youngs_modulus"] == 1.0


def test_values_of_together_are_checked_together() -> None:
    """Also where each of them is wrong beside the others of the first scene."""

    def paths(last: list[float]) -> dict[str, Any]:
        both = {"path.loads": [[3e-7], [3e-7] * 3], "path.forces": [[0.0], last]}
        found = sweeping(together=both, measure=["path.loss"])
        return found | {"path": {"loads": [1e-7], "forces": [0.0]}}

    assert plan_of(paths([0.0] * 3)).source.count == 2
    places = "[sweep] together.path.loads[1], together.path.forces[1]"
    assert f"{places}: [path] loads, forces: found 3 and 2 values" in mistakes(paths([0.0] * 2))
    places = "sweep.toml: [sweep] together.path.forces[1]"
    assert mistakes(paths([np.nan])).startswith(f"{places}: [path] forces[0]: found nan")


WRONG = [
    ({k: v for k, v in SMALL.items() if k != "sweep"}, "[sweep]: missing table"),
    (tables(sweep={"sede": 3}), '[sweep] sede: unknown key, did you mean "seeds"?'),
    (sweeping(over={"normal.load": [1e-7, -1.0]}), "[sweep] over.normal.load[1]: [normal] load:"),
    (sweeping(over={"sweep.seeds": [1, 2]}), "over.sweep.seeds: expected a key of a"),
    (sweeping(over={"normal.load": [1e-7, 1e-7]}), "values, none of them twice"),
    (sweeping(over={"material.sphere.poisson_ratio": [0.2]}, together={"material.sphere": [1]}),
     "over.material.sphere.poisson_ratio: swept twice, also in [sweep.together] material.sphere"),
    (sweeping(seeds=3, over={"asperities.seed": [1], "asperities.height_std": [1e-7]}),
     "swept twice, also by seeds"),
    (sweeping(over={"cycle.maximum_fraction": [[0.1]]}), "columns are named after [cycle]"),
    (sweeping(together={"normal.load": [1e-7, 2e-7], "sphere.radius": [1.0]}),
     "together: found [1, 2] values, expected as many for every key"),
    (sweeping(seeds=3), "seeds: nothing is random"),
    (sweeping(seeds=3, over={"asperities.heigth_std": [1e-7]}),
     '[sweep] over.asperities.heigth_std[0]: [asperities] heigth_std: unknown key, did you mean'),
    (sweeping(seeds=1, draw={"sphere.radius": {"uniform": [2, 1]}}),
     "uniform = [low, high] with low < high"),
    (tables(sweep={"measure": ["los"]}), 'measure: found "los", expected a number of the tables '
     '[normal], [cycle]: did you mean "loss"?'),
    ({**tables(cycle=None, path={"loads": [1e-7], "forces": [1e-9]}),
      "sweep": {"measure": ["path.losss"], "over": {"friction.coefficient": [0.5, 1e-3]}}},
     'measure: found "path.losss", expected a number of the tables [normal], [path]: did you mean '
     '"path.loss"?'),
    ({**tables(cycle=None, friction=None), "sweep": {"measure": ["onset"]}},
     "friction: found none, expected a coefficient"),
]  # fmt: skip


def test_mistakes() -> None:
    for contents, said in WRONG:
        message = mistakes(contents)
        assert said in message
        assert all(line.startswith("sweep.toml: ") for line in message.splitlines())


def test_all_mistakes_are_told_at_once() -> None:
    wrong = sweeping(seeds=0, over={"load": [1.0], "normal.load": []})
    wrong["sphere"]["radius"] = -1
    wrong["asperities"]["height_std"] = 1e-7  # so that something is random
    said = mistakes(wrong).splitlines()
    assert [line.split(": ")[1] for line in said] == [
        "[sweep] seeds", "[sweep] over.normal.load", "[sweep] over.load", "[sphere] radius",
    ]  # fmt: skip
