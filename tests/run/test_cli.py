"""The command line as its users meet it: output, files, exit status; and a stage of one's own.

The stage of docs/architecture.md: one file and one registration give all that a stage has.
"""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import EVERYTHING, FRICTION, WITHIN, rows, scene_text

import convexrough as cr
from convexrough.cli.common import progress
from convexrough.run.stages import STAGES


def test_new_overwrites_nothing(command: Any, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("precious")
    assert command("new", "mine.toml").refuses("mine.toml: exists already; name another")
    assert (tmp_path / "mine.toml").read_text() == "precious"
    assert command("new", "no/such/folder.toml").status == 2


def test_paper(command: Any, tmp_path: Path) -> None:
    outcome = command("paper", "--json", "--no-figures", "--html")
    assert outcome.status == 0
    paper = json.loads(outcome.out)["paper"]
    assert paper["contacts"] == {"paper": 37, "computed": 37}
    assert all(ring["computed"] == ring["paper"] for ring in paper["rings"].values())
    assert paper["rings"]["F"]["load"] == pytest.approx(1.935817e-8, rel=1e-6)
    folder = tmp_path / "paper-results"
    assert {path.stem for path in folder.glob("fig*.csv")} == {
        *("fig3_pressure", "fig4_rings", "fig5_centre", "fig5_traction", "fig6_section"),
        *("fig7_asperities", "fig8_loops", "fig9_energy"),
    }
    assert (folder / "summary.json").exists()
    assert (folder / "slider.html").stat().st_size < 1_000_000
    assert paper["sliding_at_half"] == {"paper": 6, "computed": 6}
    assert paper["sliding_ring_at_half"]["computed"] == "A"
    assert paper["first_slide"]["computed"] == pytest.approx(0.352, abs=5e-4)
    assert paper["crossover"]["paper"] == 0.37
    assert paper["crossover"]["computed"] == pytest.approx(0.388, abs=5e-4)
    for row in rows(folder / "fig9_energy.csv"):
        beyond = float(row["fraction"]) > paper["crossover"]["computed"]
        assert (float(row["loss"]) > float(row["smooth_loss"])) == beyond


def test_the_folder_is_refused_before_computing(command: Any, monkeypatch: Any) -> None:
    command("new", "a.toml")
    Path("file").touch()
    monkeypatch.setattr("convexrough.contact.solve", None)  # not to be called
    said = "file: cannot hold results: File exists\n"
    assert command("run", "a.toml", "--out", "file").refuses(said)
    assert command("run", "a.toml", "--out", "file/sub").status == 2


def test_standard_error_may_be_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", None)
    with progress("pressing"):
        print("what a solver prints")


def test_nothing_touches(command: Any, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(scene_text(normal="approach = -1e-6"))
    outcome = command("run", "a.toml", "--json")
    assert outcome.status == 0
    normal = json.loads(outcome.out)["normal"]
    assert (normal["contact"], normal["open"], normal["load"]) == (0, 1, 0.0)
    verified = command("verify", "a.toml", "a-results/asperities.csv", "--json")
    assert (verified.status, json.loads(verified.out)["verdict"]["error"]) == (0, 0.0)


def test_without_a_certificate(run: Any, command: Any) -> None:
    """Two summits so close that nothing is proved, and everything says so."""
    Path("summits.csv").write_text("x,y\n-5e-5,0\n5e-5,0\n")
    summits = 'pattern = "file"\npath = "summits.csv"\ntip_radius = 0.02'
    outcome = run(scene_text(summits, "load = 6.6e-8"), "--json")
    assert outcome.status == 3
    normal = json.loads(outcome.out)["normal"]
    proof = normal["certificate"]
    assert proof["scope"] == "none"
    assert [normal[each] for each in ("contact", "open", "undecided", "loaded")] == [0, 0, 2, 2]
    assert proof["load_error"] is None
    assert "warning: not certified" in outcome.err
    assert "warning: contact discs overlap" in outcome.err
    verified = command("verify", "a.toml", "a-results/asperities.csv")
    assert verified.status == 3
    assert "none: nothing is proved" in verified.out
    assert "warning: not certified" in verified.err


def test_a_run_says_what_the_package_says(run: Any) -> None:
    """As one object of JSON, which is the summary; in every table; and as text."""
    text, folder = scene_text(WITHIN, more=EVERYTHING), Path("deep/er")
    outcome = run(text, "--json", "--out", "deep/er")
    assert (outcome.status, outcome.err) == (0, "")
    summary = json.loads(outcome.out)
    assert summary == json.loads((folder / "summary.json").read_text())
    assert (summary["schema"], summary["version"]) == (2, cr.__version__)
    normal, proof = summary["normal"], summary["normal"]["certificate"]
    counts = [normal[key] for key in ("asperities", "candidates", "contact", "open", "undecided")]
    assert counts == [61, 61, 37, 24, 0]
    assert normal["load"] == pytest.approx(3.60853389e-7, rel=1e-8)
    assert (normal["approach"], normal["solver"]) == (5e-5, "newton")

    file = cr.read_scene("a.toml")
    contact = file.press()
    assert contact.certificate.convexity_number == pytest.approx(0.504, abs=5e-4)
    assert contact.model_error == pytest.approx(0.002, abs=5e-4)
    for name in ("scope", "convexity_number", "load_error", "gap_error"):
        assert proof[name] == getattr(contact.certificate, name)
    limit = 0.5 * contact.load
    counts = [[row[key] for key in ("sliding", "partial", "undecided")] for row in summary["shear"]]
    assert counts == [[0, 37, 0], [6, 31, 0], [6, 31, 0]]
    half = cr.shear(contact, force=0.5 * limit)
    last = [row for row in rows(folder / "shear.csv") if float(row["fraction"]) == 0.5]
    found = [(float(row["force"]), float(row["slip"]), row["status"]) for row in last]
    assert found == [*zip(half.forces, half.slips, half.status, strict=True)]
    assert summary["shear"][2]["displacement"] == half.displacement

    cycles = rows(folder / "cycle.csv")
    partial = cr.cycle(contact, maximum=0.5 * limit, minimum=0.1 * limit)
    assert [float(row["minimum_fraction"]) for row in cycles] == [-0.37, 0.1]
    assert float(cycles[1]["loss"]) == summary["cycle"][1]["loss"]
    assert float(cycles[1]["loss"]) == pytest.approx(partial.loss, rel=1e-13)
    loop = rows(folder / "loop.csv")
    assert {row["curve"] for row in loop} == {"total", *map(str, (0, 1, 7, 13, 19, 31))}
    for curve, loss in (("total", partial.loss), ("7", partial.asperity_losses[7])):
        own = [row for row in loop if (row["curve"], row["maximum_fraction"]) == (curve, "0.5")]
        force, moved = ([float(row[key]) for row in own] for key in ("force", "displacement"))
        assert np.trapezoid(force, moved) == pytest.approx(loss, rel=1e-3)

    more = f"{FRICTION}[cycle]\ndisplacement = 9e-6\n"
    prescribed = run(scene_text(WITHIN, more=more), "--out", "moved")
    assert (prescribed.status, prescribed.err) == (0, "")
    (row,), moved = rows("moved/cycle.csv"), cr.cycle(contact, displacement=9e-6)
    assert (float(row["prescribed_displacement"]), float(row["loss"])) == (9e-6, moved.loss)
    assert {each["prescribed_displacement"] for each in rows("moved/loop.csv")} == {"9e-06"}

    past = cr.history(contact, forces=np.array(file.stages["history"].fractions) * limit)
    assert summary["history"]["loss"] == past.losses.tolist()

    assert summary["path"]["displacement"][3] == pytest.approx(-1.4399972915528e-06, rel=1e-11)
    assert summary["path"]["sliding"] == [0, 12, 0, 6]
    assert summary["steady"]["undecided"] == 0
    assert summary["shakedown"]["factor"] == pytest.approx(0.351719571750, rel=1e-10)
    assert [float(row["loss"]) for row in rows(folder / "path.csv")] == summary["path"]["loss"]
    statuses = [row["status"] for row in rows(folder / "path_asperities.csv")]
    assert (len(statuses), statuses.count("sliding")) == (4 * 61, 18)
    assert [len(rows(folder / f"{name}.csv")) for name in ("steady", "shakedown")] == [61, 61]

    printed = run(text).out
    assert re.search(r"^ *0\.5 .* 6 +31 +0$", printed, re.M)
    assert "indentations increase with the load: proved" in printed
    assert printed.count("those of 12 chords; the loss along the ellipse differs: use") == 1


@pytest.mark.usefixtures("no_processes")
def test_a_file_with_a_sweep_is_swept(run: Any, command: Any) -> None:
    sweep = '[sweep]\nmeasure = ["load"]\nover = {"normal.approach" = [3e-5, 5e-5]}'
    ran = run(scene_text(more=sweep), "--json")
    assert (ran.status, json.loads(ran.out)["sweep"]["certified"]) == (0, 2)
    found = cr.open_sweep("a-sweep").read()["load"]
    Path("one.toml").write_text(scene_text())
    assert found[1] == cr.read_scene("one.toml").press().load
    assert command("run", "a.toml", "--html").refuses("of one scene, not of a sweep")
    assert "[sweep]: only `convexrough sweep`" in command("compare", "a.toml").err


def test_usage_errors(command: Any) -> None:
    both = "gallery few --profile --export new"
    for line in ("run", "run a.toml --outt x", "walk", "verify a.toml", "run a b", both):
        outcome = command(*line.split())
        assert (outcome.status, outcome.out) == (2, ""), line
        assert "Usage: convexrough" in outcome.err


def test_what_new_comments_out_is_valid_too(command: Any, tmp_path: Path) -> None:
    command("new", "new.toml")
    text = (tmp_path / "new.toml").read_text()
    tables = text[text.index("# [units]") :]
    active = "\n".join(line.removeprefix("# ") for line in tables.splitlines())
    rough = re.sub(r"^# (height_std|tip_radius_cv|seed|within|hardness)", r"\1", text, flags=re.M)
    (tmp_path / "all.toml").write_text(rough.replace(tables, active))
    outcome = command("run", "all.toml", "--no-figures")
    assert outcome.status == 0
    assert "approach          5e-05 mm\n" in outcome.out


PAGE = Path(__file__).parents[2] / "docs" / "architecture.md"
MORE = FRICTION + "[onset]\n"


@pytest.fixture
def added(monkeypatch: pytest.MonkeyPatch) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    assert block.count("\n") <= 45
    monkeypatch.setitem(STAGES, "onset", STAGES["shear"])  # taken out again at the end
    exec(compile(block, str(PAGE), "exec"), {"__name__": "onset"})


@pytest.mark.usefixtures("added")
def test_a_stage_is_computed_written_and_printed(run: Any) -> None:
    ran = run(scene_text(more=MORE))
    assert (ran.status, ran.err) == (0, "")
    said = json.loads(Path("a-results/summary.json").read_text())["onset"]
    assert re.search(rf"^onset\nquantile +onset\n +0 +{said[0]['onset']:.7g}$",
                     ran.out, re.M)  # fmt: skip
    file = cr.read_scene("a.toml")
    contact = file.press()
    onsets = cr.onset_of_sliding(contact) / (0.5 * contact.load)
    written = [float(row["onset"]) for row in rows("a-results/onset.csv")]
    assert written == pytest.approx(onsets, nan_ok=True)
    assert said[0] == {"quantile": 0.0, "onset": min(written)}
    (*_, result) = file.compute(contact)
    assert result.certified
    assert "newton; 37 contact" in result._repr_html_()
    assert list(result.to_dataframe()["onset"]) == pytest.approx(onsets, nan_ok=True)


@pytest.mark.usefixtures("added")
def test_mistakes_of_a_stage_are_told(run: Any) -> None:
    said = "[onset] quantiles[0]: found 2.0, expected a number from 0"
    assert run(scene_text(more=MORE + "quantiles = [2.0]")).refuses(said)
    said = "[friction]: missing table, needed with [onset]"
    assert run(scene_text(more="[onset]")).refuses(said)
