"""The stage of docs/architecture.md: one file and one registration give all that a stage has."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from scene_files import FRICTION, rows, scene_text

import convexrough as cr
from convexrough.run.stages import STAGES

PAGE = Path(__file__).parents[2] / "docs" / "architecture.md"
MORE = FRICTION + "[onset]\n"


@pytest.fixture(autouse=True)
def added(monkeypatch: pytest.MonkeyPatch) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    assert block.count("\n") <= 45
    monkeypatch.setitem(STAGES, "onset", STAGES["shear"])  # taken out again at the end
    exec(compile(block, str(PAGE), "exec"), {"__name__": "onset"})


def test_it_is_computed_written_and_printed(run: Any) -> None:
    ran = run(scene_text(more=MORE))
    assert (ran.status, ran.err) == (0, "")
    said = json.loads(Path("a-results/summary.json").read_text())["onset"]
    assert re.search(rf"^onset of sliding\nquantile +Q/\(fP\)\n +0 +{said[0]['onset']:.7g}$",
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


def test_its_mistakes_are_told(run: Any) -> None:
    for more, said in (
        (MORE + "quantils = [1]", '[onset] quantils: unknown key, did you mean "quantiles"?'),
        (MORE + "quantiles = [2.0]", "[onset] quantiles[0]: found 2.0, expected a number from 0"),
        (MORE.replace("onset", "onst"), '[onst]: unknown table, did you mean "onset"?'),
        ("[onset]", "[friction]: missing table, needed with [onset]"),
    ):
        assert run(scene_text(more=more)).refuses(said)
