"""Results on disk: complete files and folders, where they are from; proofs; warnings.

And how outside programs read them: names of files, columns, and keys.
"""

import hashlib
import json
import re
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scene_files import EVERYTHING, FRICTION, HEXAGONAL, WITHIN, lines, put, scene_text
from scenes import MATERIAL, hexagonal

import convexrough as cr
from convexrough import plots
from convexrough.atomic import replacing
from convexrough.run.results import MANIFEST, Writer, results_folder
from convexrough.solvers import Solution


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
    assert {each.name: each.read_text() for each in tmp_path.iterdir()} == {"result.csv": "old"}
    write(None)
    assert {each.name: each.read_text() for each in tmp_path.iterdir()} == {"result.csv": "new"}


def test_a_folder_comes_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"

    def write(error: BaseException | None, text: str, *, force: bool = False) -> None:
        with results_folder(folder, force=force) as new:
            new.text("one.csv", text)
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


def test_an_output_folder_in_use(command: Any, tmp_path: Path) -> None:
    """It is refused; --force leaves nothing of the run before, and what a user added."""
    (tmp_path / "a.toml").write_text(scene_text(more=FRICTION + "[history]\nfractions = [0.5]"))
    (tmp_path / "b.toml").write_text(scene_text(normal="approach = 2e-5"))
    folder = tmp_path / "out"
    assert command("run", "a.toml", "--out", "out", "--no-figures").status == 0
    (folder / "notes.txt").write_text("mine")
    before = {path: path.read_bytes() for path in folder.iterdir()}
    second = ("run", "b.toml", "--out", "out", "--no-figures")
    assert command(*second).refuses("out: not empty; --force replaces")
    assert {path: path.read_bytes() for path in folder.iterdir()} == before
    loads = folder / "link.csv"
    loads.symlink_to(tmp_path / "asperities.csv")
    (folder / "asperities.csv").replace(tmp_path / "asperities.csv")
    for name, *inputs, out, said in (
        ("run", "a.toml", ".", "holds a.toml, an input; name another folder"),
        ("export", "a.toml", ".", "holds a.toml, an input"),
        ("verify", "a.toml", "out/link.csv", "out", "out: holds link.csv, an input"),
    ):
        assert command(name, *inputs, "--out", out, "--force").refuses(said)
    loads.unlink()
    assert (folder / "history.csv").exists()
    ran = command(*second, "--force")
    expected = {"summary.json", "asperities.csv", "scene.toml", "files.json", "notes.txt"}
    assert (ran.status, {path.name for path in folder.iterdir()}) == (0, expected)
    assert (folder / "notes.txt").read_text() == "mine"


def test_a_manifest_removes_nothing_outside_its_folder(run: Any, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("precious")
    (tmp_path / "out").mkdir()
    for files in (["../mine.txt"], [str(tmp_path / "mine.txt")]):
        (tmp_path / "out/files.json").write_text(json.dumps({"files": files}))
        assert run(scene_text(), "--out", "out", "--force").status == 0
    for damaged in ('{"files": 1}', "[]", '{"files": ["a'):
        (tmp_path / "out/files.json").write_text(damaged)
        assert run(scene_text(), "--out", "out", "--force").refuses("files.json: damaged")
    assert (tmp_path / "mine.txt").read_text() == "precious"


def test_a_folder_says_where_its_results_are_from(run: Any) -> None:
    rough = HEXAGONAL + "height_std = 1e-6\nseed = 7"
    assert run("# µm\n" + scene_text(rough)).status == 0
    said = json.loads(Path("a-results/files.json").read_text())
    assert Path("a-results/scene.toml").read_bytes() == Path("a.toml").read_bytes()
    assert said["files"] == ["asperities.csv", "scene.toml", "summary.json"]
    digest = hashlib.sha256(Path("a.toml").read_bytes()).hexdigest()
    assert said["inputs"] == {"a.toml": digest}
    assert (said["seed"], said["version"]) == (7, cr.__version__)
    assert said["versions"]["numpy"] == np.__version__


def keys(value: Any) -> Any:
    """The keys of objects; of a list those of its first element; of a number or a word nothing."""
    if isinstance(value, dict):
        return {key: keys(each) for key, each in value.items()}
    return [keys(value[0])] if isinstance(value, list) and value else None


def test_names_columns_and_keys(command: Any, tmp_path: Path, monkeypatch: Any) -> None:
    """All is solved before the first file is written."""
    (tmp_path / "a.toml").write_text(scene_text(WITHIN, more=EVERYTHING))
    monkeypatch.setattr(plots, "save", lambda figure, path, *_: path.touch())
    with monkeypatch.context() as patch:
        first = Writer.summary

        def after(*given: Any) -> None:
            for solves in ("normal.problem.NormalProblem.assemble", "normal.levels.Levels.at",
                           "friction.levels.FrictionLevels.rows"):  # fmt: skip
                patch.setattr(f"convexrough.{solves}", None)  # not to be called
            first(*given)

        patch.setattr(Writer, "summary", after)
        ran = command("run", "a.toml", "--out", "out", "--html")
    assert (ran.status, ran.err) == (0, "")
    found: dict[str, Any] = {"files": sorted(path.name for path in Path("out").iterdir())}
    for path in Path("out").glob("*.csv"):
        found[path.name] = path.read_text().partition("\n")[0].split(",")
    for name in ("summary.json", "files.json"):
        found[name] = keys(json.loads(Path("out", name).read_text()))
    loads = "out/asperities.csv"
    claim = ("--shear", "forces.csv", "--shear-force", "0", "--out", "verdict", "--json")
    (tmp_path / "forces.csv").write_text("force\n" + "0\n" * 61)
    found["verify"] = keys(json.loads(command("verify", "a.toml", loads, *claim).out))
    found["compare"] = keys(json.loads(command("compare", "a.toml", "--json").out))
    (tmp_path / "found.json").write_text(json.dumps(found, indent=1))
    assert found == json.loads((Path(__file__).parents[1] / "golden/folder.json").read_text())


# Plausibility: a warning with its numbers, never an error.


def test_contact_beyond_the_sphere(run: Any, command: Any) -> None:
    ordinary = run(scene_text(HEXAGONAL.replace("summit", "closest")))
    assert (ordinary.err, 'with "closest"' in ordinary.out) == ("", False)
    blunt = HEXAGONAL.replace("0.0025", "0.4").replace("0.02", "0.01")
    outcome = run(scene_text(blunt, "approach = 0.9"), "--force")
    model = "above 0.2 the paraboloid of the model"
    assert f"1.09 of the sphere's radius from the axis; {model}" in outcome.err
    assert f"of the tip radius; {model}" in outcome.err
    claimed = command("verify", "a.toml", "a-results/asperities.csv")  # the same loads: also told
    assert f"of the tip radius; {model}" in claimed.err


def test_an_array_that_ends_inside_the_contact_is_told() -> None:
    """By contact at the rim, as with a radius in the wrong unit, or where all asperities touch."""
    within = (0.0102, 0.0045, 0.004, 0.002)
    wide, few, seven, one = (hexagonal(within=each).asperities for each in within)
    rim = "contact reaches the rim of the array, which is at 0."
    sites = 1e-3 * np.stack(np.meshgrid(*2 * [np.arange(-7, 8)]), axis=-1).reshape(-1, 2)
    square, corner = cr.Asperities(sites, 0.02), cr.Asperities(wide.positions + 0.0102, 0.02)
    zero = SimpleNamespace(name="zero", solve=lambda problem, _: Solution(
        np.zeros(len(problem)), problem.approach, 1, np.inf))  # fmt: skip
    for array, base, control, told in (
        *((wide, wrong, {"approach": 5e-5}, rim) for wrong in (1e3, (1.0, 2e3))),
        (wide, (1.0, 2.0), {"approach": 2e-5}, ""),
        (seven, 1e3, {"approach": 5e-5}, rim),
        (one, 1e3, {"approach": 5e-5}, "surface; check the units of modulus, radii, spacing, heig"),
        (wide, 1.0, {"approach": 9e-5}, "100% of the asperities at the rim of the array touch; as"),
        (wide, 1.0, {"approach": 5e-5}, ""),
        (wide, (np.inf, 1.0), {"approach": 5e-5}, "the ends of the array along the axis of the"),
        (wide, np.inf, {"approach": 1e-6}, ""),
        (wide, 1.0, {"approach": -1e-6}, "no asperity carries a load: check the sign and unit"),
        (wide, 1.0, {"approach": 1e-6, "solver": zero}, "carries a load: check the loads"),
        (few, 1.0, {"approach": 1e-5}, ""),
        (few, 1.0, {"approach": 1.5e-5}, "100% of the asperities at the rim"),
        (few, 1.0, {"approach": 1.1e-5}, ""),  # all touch, and all of the pattern that could
        (square, 1.0, {"approach": 7e-5}, "75% of the asperities at the rim"),
        (corner, 1.0, {"load": 3.6e-7}, "axis of the sphere, at x = 0 and y = 0"),
        (corner, (1.0, np.inf), {"load": 3.6e-7}, "axis of the sphere, at x = 0 and y = 0"),
        (corner, np.inf, {"load": 3.6e-7}, ""),
    ):
        contact = cr.press(cr.Scene(base, array, MATERIAL), **control)
        assert bool(contact.warnings) == bool(told)
        assert told in " ".join(contact.warnings)


def test_run_proves_and_check_accepts(command: Any, tmp_path: Path) -> None:
    assert command("new", "first.toml").status == 0
    ran = command("run", "first.toml", "--proof", "--no-figures")
    assert (ran.status, ran.err) == (0, "")
    assert "proved: under the approach 5e-05 there is a solution, the only one" in ran.out
    path = tmp_path / "first-results" / "proof.json"
    document = json.loads(path.read_text())
    assert len(document["sheared"]) == 3  # forces and amplitudes are the same
    loads = [[Fraction(float.fromhex(x)) for x in pair] for pair in document["claims"]["loads"]]
    known = max(high - low for low, high in loads) / max(high for _, high in loads)
    (printed,) = re.findall("loads known to (.*) of the largest", ran.out)
    assert known <= Fraction(printed) <= 2 * known
    said = re.findall("a cycle loses (.*) to (.*)$", ran.out, re.M)
    for claim, printed in zip(document["claims"]["shear"], said, strict=True):
        claimed = [float.fromhex(end) for end in claim["loss"]]
        assert Fraction(printed[0]) <= claimed[0] <= claimed[1] <= Fraction(printed[1])
        assert claimed == [pytest.approx(float(end), rel=1e-9) for end in printed]
        assert max(map(len, printed)) <= len("1.234567890e-11")
    checked = command("check", str(path))
    assert (checked.status, checked.err) == (0, "")
    assert checked.out in ran.out

    document["claims"]["shear"][2]["status"][0] = "sliding"
    path.write_text(json.dumps(document))
    checked = command("check", str(path))
    assert (checked.status, checked.out) == (1, "")
    assert checked.err.startswith("refused: claims shear [2] status [0]: claimed 'sliding'")
    path.write_text("{")
    assert command("check", str(path)).status == 2
    assert command("check", "none.json").status == 2


def test_verify_proves_loads_and_overwrites_nothing(command: Any, tmp_path: Path) -> None:
    """Also of inaccurate loads, if they hold."""
    assert command("new", "first.toml").status == 0
    asked = ("verify", "first.toml", "loads.csv", "--proof")
    loads = cr.read_scene("first.toml").press().loads
    off = loads * (1 + 0.009 * (-1.0) ** np.arange(len(loads)))
    (tmp_path / "loads.csv").write_text(lines({"load": off}))
    proved = command(*asked)
    about = "written  proof.json, a proof about the loads of the solution, not about the given ones"
    assert (proved.status, about in proved.out) == (0, True)
    assert command("check", "proof.json").status == 0
    assert command(*asked).refuses("proof.json: exists already")
    (tmp_path / "loads.csv").write_text("load\n" + "1e-3\n" * 61)
    said = "warning: proof.json is not written: the given loads are not accepted"
    wrong = command(*asked, "--force")
    assert (wrong.status, said in wrong.err) == (3, True)
    assert not (tmp_path / "proof.json").exists()  # an earlier proof does not stand beside it
    (tmp_path / "b.toml").write_text(scene_text(WITHIN, "load = 3.6e-7"))
    (tmp_path / "loads.csv").write_text("load\n" + "0\n" * 61)
    wrong = command("verify", "b.toml", "loads.csv", "--proof")
    assert (wrong.status, said in wrong.err) == (3, True)


def test_a_state_without_a_proof_does_not_cost_the_others(run: Any, tmp_path: Path) -> None:
    """A small asperity is shaded by two large ones near it, so that order fails farther down."""
    places = {"x": [0.00104, 0.00122, 0.00108], "y": [0.00137, -0.00115, 0.00116]}
    tips = {"height": [-4.6e-9, 7e-10, -3.4e-9], "tip_radius": [0.00109, 0.0186, 0.0149]}
    put(tmp_path, places | tips, "a.csv")
    shear = FRICTION + "[shear]\nfractions = [0.05, 0.6]\n"
    file = 'pattern = "file"\npath = "a.csv"\ngeometry = "summit"\n'
    ran = run(scene_text(file, "approach = 2.2e-5", shear, radius="2.0"), "--proof")
    assert ran.err.count("warning: proof.json leaves out the shear force") == 1
    assert len(json.loads(Path("a-results/proof.json").read_text())["sheared"]) == 1


def test_without_a_proof_the_status_says_so(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise cr.ProofError("nothing is proved")

    monkeypatch.setattr("convexrough.run.results.prove_results", refuse)
    ran = run(scene_text(), "--proof")
    said = "convexrough: warning: proof.json is not written: nothing is proved\n"
    assert (ran.status, ran.err) == (3, said)


def test_a_scene_too_large_to_prove_is_refused(run: Any) -> None:
    ran = run(scene_text(f"{HEXAGONAL}within = 0.08"), "--proof")
    assert ran.refuses("a.toml: asperities of a scene to prove")
    assert not Path("a-results").exists()
