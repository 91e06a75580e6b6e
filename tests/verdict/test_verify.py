"""`verify` on the command line: what it says, in which order, and its exit status."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_checks import fits, texts
from scene_files import FRICTION, WITHIN, lines, put, rows, scene_text

import convexrough as cr
from convexrough.friction.verdict import verify_shear

MORE = '[units]\nlength = "mm"\nforce = "N"\n' + FRICTION


@pytest.fixture
def contact(tmp_path: Path) -> cr.Contact:
    """The paper's, whose scene is a.toml by its approach, and b.toml by its load."""
    (tmp_path / "a.toml").write_text(scene_text(WITHIN, more=MORE))
    contact = cr.press(cr.read_scene(tmp_path / "a.toml").scene, approach=5e-5)
    (tmp_path / "b.toml").write_text(scene_text(WITHIN, f"load = {contact.load!r}", MORE))
    return contact


def claim(contact: cr.Contact, changes: dict[int, float] | None = None, factor: float = 1.0) -> str:
    """The loads, written in a shuffled order, with some changed."""
    loads = factor * contact.loads
    for i, load in (changes or {}).items():
        loads[i] = load
    order = np.random.default_rng(1).permutation(len(loads))
    x, y = contact.scene.asperities.positions[order].T
    return put(Path(), {"x": x, "load": loads[order], "y": y})


@pytest.mark.parametrize("scene", ["a.toml", "b.toml"])
def test_what_is_right(command: Any, contact: cr.Contact, scene: str) -> None:
    outcome = command("verify", scene, claim(contact), "--within", "1e-10")
    assert (outcome.status, outcome.err) == (0, "")
    said = [line for line in outcome.out.splitlines() if line]
    assert re.search(r" proved; loads correct to within \S+e-1\d of the largest load$", said[3])
    assert said[4:6] == ["wrong statuses    none", "undecided         none"]
    assert re.search(r"error +at most \S+e-1\d of the largest load \(1e-10 allowed\)", said[6])
    assert said[7].endswith("(as prescribed)" if scene == "b.toml" else "(none prescribed)")


def test_a_bound_is_not_rounded_up_above_the_limit(command: Any, contact: cr.Contact) -> None:
    outcome = command("verify", "a.toml", claim(contact, factor=1.01), "--within", "0.0100001")
    assert outcome.status == 0
    assert "correct to within 1.00001 % of the largest load of the solution\n" in outcome.out
    assert " 1.00001 % of the largest load of the solution (1.00001 % allowed)\n" in outcome.out


def test_errors_relative_to_zero(command: Any, contact: cr.Contact) -> None:
    Path("c.toml").write_text(scene_text(WITHIN, "approach = -5e-5", MORE))
    largest = float(contact.loads.max())
    for scene, factor, floor, which, result in (
        ("a.toml", 0.0, "0", "given load", "wrong"),
        ("c.toml", 1.0, "0", "load of the solution", "wrong"),
        ("c.toml", 1.0, "1", "load of the solution", r"proved; errors of up to \S+ N while the"),
    ):
        asked = ("verify", scene, claim(contact, factor=factor), "--floor", floor)
        outcome = command(*asked)
        assert re.search(f"^result            contact set {result}", outcome.out, re.M)
        said = rf"(\S+) N while the largest {which} is 0 \(1 % allowed; exceeded by 37 loads"
        (shown,) = re.findall(f"^load error        at most {said}", outcome.out, re.M)
        verdict = json.loads(command(*asked, "--json").out)["verdict"]
        assert verdict["error"] is None
        assert largest <= verdict["load_error"] <= float(shown) <= 1.01 * largest


def test_a_wrong_set(command: Any, contact: cr.Contact) -> None:
    outcome = command("verify", "a.toml", claim(contact, {36: 0.0, 50: 1e-9}))
    assert outcome.status == 3
    assert "warning: not certified: wrong statuses (2)" in outcome.err
    x, y = contact.scene.asperities.positions[36]
    row = f"index.*\n *36 +{x:.6g} +{y:.6g} +0 +{contact.loads[36]:.6g} +"
    parts = ("result +contact set wrong", "wrong statuses +2",
             "claimed open, proved to touch: 1", rf"{row}(\S+) +contact",
             "claimed to touch, proved open: 1", "index.*\n *50 .* open", "undecided +none",
             "load error", "total load", "suspects", "index.*\n *36 .*\n *50 ",
             "certificate of the given loads")  # fmt: skip
    found = re.search(r"(?s:.*?)\n *".join(parts), outcome.out)
    assert found
    assert contact.loads[36] <= float(found[1]) <= 1.01 * contact.loads[36]


def test_json_and_files(command: Any, contact: cr.Contact, tmp_path: Path) -> None:
    loads = claim(contact, {36: 0.0})
    asked = ("verify", "b.toml", loads, "--out", "found")
    outcome = command(*asked, "--json", "--within", "1e-6")
    assert outcome.status == 3
    found, folder = json.loads(outcome.out), tmp_path / "found"
    verdict = found["verdict"]
    expected = {"holds": False, "wrongly_open": [36], "wrongly_loaded": [], "undecided": [],
                "total_prescribed": contact.load, "within": 1e-6}  # fmt: skip
    assert {key: verdict[key] for key in expected} == expected
    assert verdict["suspects"][0] == 36
    assert verdict["total_given"] == pytest.approx(contact.load - contact.loads[36], rel=1e-12)
    assert [row["index"] for row in found["asperities"]] == list(range(61))
    row = found["asperities"][36]
    assert (row["claimed"], row["status"], row["suspect"]) == ("open", "contact", 1)
    assert row["load_error"] >= row["solution"] > 0
    written = {path.name for path in folder.iterdir()}
    assert written == {"files.json", "verdict.csv", "verdict.json", "verdict.png"}
    assert found == json.loads((folder / "verdict.json").read_text())
    written = rows(folder / "verdict.csv")[36]
    assert (written["claimed"], written["suspect"]) == ("open", "1")
    said = "found: not empty; --force replaces its results; or name another folder"
    assert command(*asked).refuses(said)


@pytest.mark.parametrize("scene", ["a.toml", "b.toml"])
def test_loads_in_another_unit(command: Any, contact: cr.Contact, scene: str) -> None:
    outcome = command("verify", scene, claim(contact, factor=1e3))
    assert outcome.status == 3
    assert " % of the largest load of the solution (1 % allowed" in outcome.out
    assert "of the largest given load)\n" in outcome.out
    hint = "hint: the loads are 10^3 times what they should be: another unit of force (as mN for N)"
    assert hint + (", or of the modulus?" if scene == "a.toml" else "?") in outcome.err
    elsewhere = command("verify", scene, claim(contact, factor=1.0989))  # E* without 1 - nu^2
    assert "hint: the loads are 1.099 times those of the solution\n" in elsewhere.err
    turned = dict(enumerate(np.roll(contact.loads, 5).tolist()))
    elsewhere = command("verify", scene, claim(contact, turned))
    assert "hint: the loads are those of the solution, in another order" in elsewhere.err
    assert hint in command("verify", scene, claim(contact, factor=1e3), "--within", "1").err
    passed = command("verify", scene, claim(contact, factor=0.7), "--within", "1")
    assert (passed.status, "loads are 0.7 times those of the sol" in passed.err) == (0, True)
    heading = "\ncertificate of the given loads; gaps and energy after scaling them to the prescrib"
    assert (heading in passed.out) == (scene == "b.toml")
    if scene == "b.toml":
        assert ": ratio 1000\n" in outcome.out
        assert "the total load is not the prescribed one" in outcome.err


@pytest.mark.parametrize("tiny", ["e-20", "e-143"])
def test_noise(command: Any, contact: cr.Contact, tiny: str) -> None:
    noisy = {int(i): float(f"1.5{tiny}") for i in np.flatnonzero(contact.loads == 0)}
    outcome = command("verify", "a.toml", claim(contact, noisy))
    assert outcome.status == 3
    assert f"24 of the given loads, on asperities proved open, are at most 1.5{tiny}" in outcome.err
    assert f"--floor 2{tiny} counts them as 0" in outcome.err
    assert "and 14 more: --json and --out list all" in outcome.out
    floored = command("verify", "a.toml", claim(contact, noisy), "--floor", f"2{tiny}")
    assert (floored.status, floored.err) == (0, "")
    assert "hint: --floor 1 counts" in command("verify", "a.toml", "loads.csv", "--floor", "1").err
    below = ("verify", "a.toml", claim(contact, {40: float(f"-1{tiny}")}))
    assert command(*below).refuses(f"not negative; --floor 1{tiny} counts noise as 0: ")
    assert command(*below, "--floor", f"1{tiny}").status == 0


def test_statuses_that_contradict_the_loads_are_refused(command: Any, contact: cr.Contact) -> None:
    """A file with statuses makes two claims about each asperity."""
    texts = np.array(contact.status)
    flags = np.where(texts == "open", "0", "1")
    for said, column, asperity, word in (
        (texts, "status", 0, "open"),
        (texts, "status", 60, "contact"),
        (flags, "Contact", 0, "0"),
        (flags, "touching", 60, "1"),
        (np.where(flags == "1", "True", "False"), "in_contact", 0, "False"),
        (np.where(flags == "1", "0", "1"), "open", 0, "1"),
        (np.where(texts == "open", "open", "closed"), "contact", 0, "open"),
    ):
        wrong = said.copy()
        wrong[asperity] = word
        for statuses, status in ((said, 0), (wrong, 2)):
            Path("loads.csv").write_text(lines({"load": contact.loads, column: statuses}))
            outcome = command("verify", "a.toml", "loads.csv")
            assert outcome.status == status
            place = f"row {2 + asperity}, column {column.lower()}"
            assert (f'{place}: found "{word.lower()}", expected "' in outcome.err) == bool(status)


def test_shear_forces(command: Any, contact: cr.Contact) -> None:
    force = 0.25 * contact.load
    state = cr.shear(contact, force=force)
    asked = ("verify", "a.toml", claim(contact), "--shear-force", repr(force), "--shear")

    def judged(forces: Any, *options: str, **more: Any) -> Any:
        return command(*asked, put(Path(), {"force": forces} | more, "forces.csv"), *options)

    outcome = judged(state.forces)
    assert (outcome.status, outcome.err) == (0, "")
    assert "shear forces      statuses proved; shear forces correct to within " in outcome.out
    opened, slid = np.array(state.status), np.array(state.status)
    opened[0], slid[60] = "open", "sliding"
    for column, values, expected in (
        ("status", opened, 'found "open" at asperity 0, which is'),
        ("status", slid, 'found "sliding" at asperity 60, which is'),
        ("state", state.status, "found statuses, expected them in a column called st"),
        ("slip", np.zeros(61, int), "found flags, expected"),
    ):
        assert judged(state.forces, **{column: values}).refuses(f"column {column}: {expected}")
    partial = np.where(np.array(state.status) == "sliding", "partial", state.status)
    for more in ({}, {"status": partial}):
        hint = "1 % below f P_i: these asperities count as claimed to stick, unless a column status"
        assert hint in judged(0.998 * state.forces, **more).err
    for factor, said in ((-1, "have the opposite sign to"), (-1e3, "total and are 10^3"),
                         (1e-6, "are 10^-6 times what they should be: another unit of force (as"),
                         (1.25, "are 1.25 times those of the solution")):  # fmt: skip
        outcome = judged(factor * state.forces)
        assert outcome.status == 3
        assert "hint: the shear forces " in outcome.err
        assert said in outcome.err
    spoiled = np.where(np.arange(61) == 4, 0.5 * contact.loads, state.forces)
    outcome = judged(spoiled, "--json")
    assert outcome.status == 3
    found = json.loads(outcome.out)
    sheared, row = found["shear_verdict"], found["asperities"][4]
    assert found["verdict"]["holds"]
    assert (sheared["wrongly_sliding"], sheared["suspects"]) == ([4], [4])
    assert (row["shear_claimed"], row["shear_status"]) == ("sliding", "partial")
    assert row["force_error"] >= spoiled[4] - state.forces[4]
    assert "the total force is not the prescribed one" in outcome.err

    other = cr.shear(contact, force=1.1 * state.force)
    right = np.abs(other.forces - state.forces) <= 1e-12 * state.forces.max()
    assert right[contact.loads > 0].any()
    suspects = json.loads(judged(other.forces, "--json").out)["shear_verdict"]["suspects"]
    assert suspects
    assert not right[suspects].any()


def test_wrong_use(command: Any, contact: cr.Contact) -> None:
    loads = claim(contact)
    for wrong, expected in (
        (("--shear", loads), "--shear and --shear-force go together"),
        (("--shear-force", "1"), "--shear and --shear-force go together"),
        (("--within", "0"), "--within: found 0.0, expected a positive number"),
        (("--within", "5"), "; 5 % is 0.05"),
        (("--tolerance", "-1"), "--tolerance: found -1.0"),
        (("--tolerance", "1"), "--tolerance: found 1.0, expected at most 0.00125, half the small"),
        (("--sign", "-1"), "no load is positive, expected positive compression: without --sign -1"),
        (("--floor", "-1"), "--floor: found -1.0"),
        (("--column", "x=x", "coord"), "hint: quote names that contain spaces"),
        (("--shear", loads, "--shear-force", "1", "--column", "force=load"), "force: found 1.0 ("),
    ):
        assert command("verify", "a.toml", loads, *wrong).refuses(expected)


def test_the_figure(contact: cr.Contact) -> None:
    loads = contact.loads.copy()
    loads[36], loads[50] = 0.0, loads.max()
    verdict = cr.verify(contact.scene, loads, approach=5e-5)
    force = 0.25 * contact.load
    forces = cr.shear(contact, force=force).forces.copy()
    forces[4] = 0.5 * contact.loads[4]
    sheared = verify_shear(contact, forces, force=force)
    for figures in (cr.plots.verdict_figures(verdict), cr.plots.verdict_figures(verdict, sheared)):
        said = {text.get_text() for text in texts(figures["verdict"])}
        assert {"36", "50", "claimed open, proved to touch (1)"} < said
        fits(figures["verdict"])
    assert {"4", "claimed to slide, proved not to (1)", "sliding", "partial slip"} < said
