"""The folder of results as outside programs read it: names of files, columns, and keys."""

import csv
import json
from pathlib import Path
from typing import Any

from scene_files import EVERYTHING, WITHIN, scene_text

from convexrough import plots
from convexrough.run.results import Writer

GOLDEN = Path(__file__).parents[1] / "golden" / "folder.json"


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
    found: dict[str, Any] = {"files": sorted(path.name for path in (tmp_path / "out").iterdir())}
    for path in sorted((tmp_path / "out").glob("*.csv")):
        with path.open() as file:
            found[path.name] = next(csv.reader(file))
    for name in ("summary.json", "files.json"):
        found[name] = keys(json.loads((tmp_path / "out" / name).read_text()))
    loads = "out/asperities.csv"
    claim = ("--shear", "forces.csv", "--shear-force", "0", "--out", "verdict", "--json")
    (tmp_path / "forces.csv").write_text("force\n" + "0\n" * 61)
    found["verify"] = keys(json.loads(command("verify", "a.toml", loads, *claim).out))
    found["compare"] = keys(json.loads(command("compare", "a.toml", "--json").out))
    (tmp_path / "found.json").write_text(json.dumps(found, indent=1))
    assert found == json.loads(GOLDEN.read_text())
