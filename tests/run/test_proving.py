"""`run --proof`, `verify --proof`, `check`: files, output, exit status."""

import json
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import FRICTION, HEXAGONAL, lines, put, scene_text

import convexrough as cr


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
    wrong = command(*asked, "--force")
    assert wrong.status == 3
    said = "warning: proof.json is not written: no exact proof is found from the given loads, which"
    assert said in wrong.err
    assert not (tmp_path / "proof.json").exists()  # an earlier proof does not stand beside it
    (tmp_path / "b.toml").write_text(scene_text(f"{HEXAGONAL}within = 0.0102", "load = 3.6e-7"))
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
