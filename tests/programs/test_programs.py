"""Scenes as programs: files are read by libraries that share nothing with their writer."""

import json
from pathlib import Path
from typing import Any

import highspy
import numpy as np
import pytest
import scs
from scenes import PAPER_APPROACH, complementary_energy, hexagonal
from scipy import sparse

import convexrough as cr
from convexrough.programs import program

#: The source paper's, its inner 19 asperities.
SCENE = hexagonal(within=0.0051)
CONTACT = cr.press(SCENE, approach=PAPER_APPROACH)
CONTROLS = {"approach": PAPER_APPROACH, "load": CONTACT.load}
FEW = 8  # bristles: the method of HiGHS is one of active sets, and takes its time with more


def energy(control: str) -> float:
    """Phi, from its definition: docs/theory/convexity.md, (1)."""
    depth = PAPER_APPROACH if control == "approach" else 0.0
    return complementary_energy(CONTACT) - depth * CONTACT.loads.sum()


def matrix(data: Any, name: str, shape: tuple[int, int]) -> Any:
    parts = [data[f"{name}_{part}"] for part in ("data", "indices", "indptr")]
    return sparse.csc_array(tuple(parts), shape=shape)


def by_scs(path: Path) -> tuple[Any, Any, float]:
    data = np.load(path)
    n, m = len(data["q"]), len(data["b"])
    given = {"P": matrix(data, "P", (n, n)), "A": matrix(data, "A", (m, n))}
    assert abs(given["P"] - given["P"].T).max() == 0  # SCS itself reads the upper triangle only
    given |= {"b": data["b"], "c": data["q"]}
    equal = int(data["equalities"])
    cones = {"z": equal, "q": [3] * ((m - equal) // 3)}
    found = scs.SCS(given, cones, verbose=False, eps_abs=1e-9, eps_rel=1e-9).solve()
    return found["x"], found["y"], found["info"]["pobj"]


def by_highs(path: Path) -> tuple[Any, Any, float]:
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    assert highs.readModel(str(path)) == highspy.HighsStatus.kOk
    highs.run()
    solution = highs.getSolution()
    return solution.col_value, solution.row_dual, highs.getObjectiveValue()


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize(
    ("form", "ending"), [("cones", "npz"), ("dual", "npz"), ("bristles", "mps")]
)
def test_files_are_solved_by_others(form: Any, ending: str, control: str, tmp_path: Path) -> None:
    """Other forms and endings are those of the gallery, which its tests read."""
    made = program(SCENE, form, **{control: CONTROLS[control]}, bristles=FEW)
    made.save(tmp_path / f"scene.{ending}")
    read = by_highs if ending == "mps" else by_scs
    x, z, objective = read(tmp_path / f"scene.{ending}")
    loads = made.loads(z if form == "dual" else x)
    near, exact = 1e-4 + made.load_error_estimate, energy(control)
    assert np.abs(loads - CONTACT.loads).max() < near * CONTACT.loads.max()
    if form == "bristles":  # another energy than that of the contact: its own
        assert objective == pytest.approx(made.objective, rel=1e-6)
    else:
        assert made.energy(made.objective) == pytest.approx(exact, rel=1e-12)
    assert made.energy(objective) == pytest.approx(exact, rel=1e-6 + made.load_error_estimate)


def test_a_program_that_is_not_convex_is_not_made() -> None:
    above = cr.gallery.case("convexity-end-above")
    with pytest.raises(cr.solvers.TooDenseError):
        cr.program(above.scene, **above.control)


def test_the_command(command: Any, tmp_path: Path) -> None:
    command("new", "scene.toml")
    ran = command("export", "scene.toml", "--bristles", "4")
    assert (ran.status, ran.err) == (0, "")
    folder = tmp_path / "scene-programs"
    index = json.loads((folder / "index.json").read_text())
    written = {path.name for path in folder.iterdir()}
    assert written == {*index["programs"], "index.json", "files.json"}
    assert len(index["programs"]) == 8
    assert command("export", "scene.toml").refuses("not empty")
    one = command("export", "scene.toml", "--format", "mps", "--out", "one", "--json")
    assert list(json.loads(one.out)["programs"]) == ["scene.bristles.mps"]
    assert command("export", "scene.toml", "--format", "mpz").refuses("mpz")
