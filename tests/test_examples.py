"""Every example runs, and what it computes agrees with its reference."""

import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest
from matplotlib.text import Text

FOLDER = Path(__file__).parent.parent / "examples"
#: Relative tolerances: of the paper's rounded numbers, of quadrature, extrapolation and minima.
TOLERANCES = {
    "papers_example": 1e-3, "losing_contact": 1e-5, "continuum_limit": 1e-5,
    "limits_of_shakedown": 1e-7, "normal_and_shear_together": 5e-5, "roughness_statistics": 1e-3,
    "design_a_damper": 1e-3, "scatter_of_heights": 0.1,
}  # fmt: skip

#: All `compare()` at their end; but lessons assert what they say on the way.
SCRIPTS = {path.stem: path for path in sorted(FOLDER.glob("*.py"))}
LESSONS = {path.stem: path for path in sorted(FOLDER.glob("course/[01]*.py"))}


@pytest.fixture(autouse=True)
def shown(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """Run as a script is; numbers of the figures that it shows."""
    figures: list[int] = []
    plt.switch_backend("agg")
    monkeypatch.setattr(plt, "show", lambda: figures.extend(plt.get_fignums()))
    monkeypatch.syspath_prepend(FOLDER)  # as for a script: one example may begin with another
    with plt.rc_context():
        yield figures
    plt.close("all")


def load(path: Path) -> dict[str, Any]:
    """The names of a script that is run, but not as the main one."""
    return runpy.run_path(str(path), run_name=path.stem)


@pytest.mark.sample(1)
@pytest.mark.parametrize("script", sorted({*SCRIPTS} - {"boundary_elements", "measured_surface"}))
def test_example(script: str) -> None:
    pairs = load(SCRIPTS[script])["compare"]()
    assert pairs
    for name, computed, reference in pairs:
        tolerance = TOLERANCES.get(script, 1e-9)
        assert computed == pytest.approx(reference, rel=tolerance, abs=1e-12), name


@pytest.mark.sample(1)
@pytest.mark.parametrize("script", LESSONS)
def test_lesson(script: str, shown: list[int]) -> None:
    """Every claim holds, and a class that runs the script sees its picture in large letters."""
    lesson = load(LESSONS[script])
    assert LESSONS[script].read_text("utf-8").count("\nassert ") > 5
    assert shown == plt.get_fignums() == [1]
    assert plt.rcParams["font.size"] >= 14
    assert min(text.get_fontsize() for text in plt.figure(1).findobj(Text) if text.get_text()) > 10
    assert "compare" not in lesson


def test_boundary_elements() -> None:
    """The asperity model against a boundary-element solution of the same shapes."""
    pairs = {name: (a, b) for name, a, b in load(FOLDER / "boundary_elements.py")["compare"](384)}
    errors = {name: a / b - 1 for name, (a, b) in pairs.items()}
    assert pairs["order of convergence"][0] == pytest.approx(2.0, abs=0.25)
    assert abs(errors["closest, total load"]) < 2.5e-4
    assert abs(errors["summit, total load"]) < 4e-3
    for ring in "FEDCBA":
        assert abs(errors[f"closest, load in ring {ring}"]) < 4e-3
    assert -0.08 < errors["summit, load in ring A"] < -0.07


def test_measured_surface() -> None:
    """What the picture of asperities costs on a map, as the example and the page on theory say."""
    pairs = {name: (a, b) for name, a, b in load(FOLDER / "measured_surface.py")["compare"]()}
    errors = {name: a / b - 1 for name, (a, b) in pairs.items()}
    for force, total in (("3", -0.076), ("10", -0.106), ("30", -0.100)):
        assert errors[f"load {force}, load"] == pytest.approx(total, abs=0.005)
        assert -0.35 < errors[f"load {force}, area"] < -0.25
        assert -0.16 < errors[f"load {force}, heaviest"] < -0.06
        assert abs(errors[f"load {force}, contacts"]) < 0.06
