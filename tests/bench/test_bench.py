"""The benchmark: its reference, what it concludes, what it writes. No time is tested."""

import csv
import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import multiprecision
import numpy as np
import pytest
from drawn import words
from flint import arb, ctx
from matplotlib.text import Text

import convexrough as cr
from convexrough.bench import measure, page, paths, reference, suite, summary
from convexrough.bench.figures import bench_figures
from convexrough.bench.frontier import better_than_default, exponent, mark_frontier
from convexrough.bench.gradients import measure_gradient
from convexrough.bench.measure import Attempt, CostRow, Row, Tally, counted
from convexrough.bench.plan import Plan, attempts, full_plan, quick_plan
from convexrough.bench.scenes import APPROACH, REFINEMENTS, scene
from convexrough.bench.suite import Bench, Panel
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import BristleQP, Conic, Newton

ROOT = Path(__file__).parent.parent.parent
TINY = replace(
    quick_plan(),
    work=(("lattice", 61),),
    cost=(("lattice", 61), ("scattered", 61)),
    shear=(("lattice", 61),),
    cycles=(("lattice", 61),),
    paths=(("lattice", 61), ("rough", 61)),
    gradients=(("lattice", 61),),
    amplitudes=2,
    patience=0.0,
    sweeps=((61, 20, (1,)),),
)
LONG = np.finfo(np.longdouble).eps < 1e-18
extended = pytest.mark.skipif(not LONG, reason="no extended precision on this platform")


@cache
def tiny() -> Bench:
    return suite.run(TINY)


# The reference.


def solved(family: Any, refinement: float) -> tuple[NormalProblem, reference.Reference]:
    problem = NormalProblem.assemble(scene(family, refinement), approach=APPROACH)
    return problem, reference.refine(problem, Newton().solve(problem).loads)


def test_no_reference_where_long_double_is_no_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("convexrough.bench.reference.Long", np.float64)
    each = scene("lattice", 1.0)
    problem = NormalProblem.assemble(each, approach=APPROACH)
    with pytest.raises(cr.InputError, match="numbers longer than float64"):
        reference.refine(problem, Newton().solve(problem).loads)


@extended
@pytest.mark.parametrize("few", [0, reference.FEW], ids=["transforms", "pairs"])
@pytest.mark.parametrize("family", ["lattice", "rough"])
def test_reference_against_50_digits(
    family: Any, few: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reference, "FEW", few)
    problem, found = solved(family, 1.0)
    asperities = problem.scene.asperities
    exact = multiprecision.solve(
        asperities.positions,
        asperities.tip_radii,
        asperities.heights,
        sphere_radius=1.0,
        contact_modulus=1.0,
        approach=APPROACH,
    )
    loads = found.loads * problem.units.force  # a power of two
    high = loads.astype(np.float64)
    low = (loads - high).astype(np.float64)
    with ctx.workdps(60):
        off = [
            abs(float(arb(float(h)) + arb(float(e)) - exact.loads[i]))
            for i, h, e in zip(problem.candidates, high, low, strict=True)
        ]
    assert found.touching == sum(1 for load in exact.loads if load > 0)
    assert 0 < max(off) < 2e-18 * float(loads.max())
    assert found.correction < 1e-17
    assert found.residual < 1e-18


@extended
def test_transforms_see_that_points_are_off_the_lattice_by_rounding(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, pairs = solved("lattice", 5.0)
    assert pairs.how == "sum over pairs"
    monkeypatch.setattr(reference, "FEW", 0)
    _, transforms = solved("lattice", 5.0)
    assert transforms.how == "transforms"
    apart = np.abs(pairs.loads - transforms.loads).max() / pairs.loads.max()
    assert apart < 1e-16 < Newton().solve(problem).residual * 1e3


def test_reference_improves_on_sloppy_loads() -> None:
    problem, good = solved("lattice", 1.0)
    loads = Newton().solve(problem).loads
    again = reference.refine(problem, loads * 1.001)
    assert good.error(again.loads.astype(np.float64)) < 1e-15
    assert good.error(loads) < 1e-14
    assert good.error(loads * 1.001) == pytest.approx(1e-3, rel=1e-6)


def test_reference_refuses_what_it_cannot_do() -> None:
    problem = NormalProblem.assemble(scene("lattice", 1.0), load=1e-7)
    with pytest.raises(cr.InputError, match="approach control"):
        reference.refine(problem, np.zeros(len(problem)))
    assert not reference.measurable(scene("scattered", 27.0))
    assert reference.measurable(scene("lattice", 27.0))


# What is measured.


@pytest.mark.parametrize("kind", ["dense", "lattice"])
def test_counting_changes_no_answer(kind: Any) -> None:
    problem = NormalProblem.assemble(scene("lattice", 2.0), approach=APPROACH, influence=kind)
    tally = Tally()
    operator = counted(problem.influence, tally)
    solution = Newton().solve(replace(problem, influence=operator))
    np.testing.assert_array_equal(solution.loads, Newton().solve(problem).loads)
    assert tally.double > solution.iterations
    assert (tally.single > 0) == (kind == "lattice")
    part = operator.among(np.arange(7))
    before = tally.double
    part.apply(np.ones(7))
    part.among(np.arange(3)).apply(np.ones(3))
    assert tally.double == before + 2


def test_rows_of_those_that_do_not_answer() -> None:
    small = scene("lattice", 1.0)
    failing = Attempt("newton", "one step", Newton(max_iterations=1))
    row = measure.measure(small, failing, None, patience=0.0)
    assert (row.outcome, row.message[:8]) == ("failed", "residual")
    dense = cr.Scene(1.0, cr.Asperities.hexagonal(spacing=0.0025, tip_radius=5.0, within=0.01),
                     cr.Material(1.0, 0.3))  # fmt: skip
    row = measure.measure(dense, Attempt("conic", "", Conic()), None, patience=0.0)
    assert (row.outcome, row.message[:26]) == ("refused", "asperities too dense for a")
    off = Attempt("newton, lattice", "", Newton(), "lattice")
    row = measure.measure(scene("scattered", 1.0), off, None, patience=0.0)
    assert row.outcome == "refused"


@pytest.mark.parametrize("plan", [full_plan(), quick_plan()], ids=["full", "quick"])
def test_plans(plan: Plan) -> None:
    found = attempts(plan)
    assert sum(attempt.default for attempt in found) == 1
    assert len({(each.solver, each.setting) for each in found}) == len(found)
    assert {type(each.settings).__name__ for each in found} == {
        *("Newton", "Conic", "ConicCVXPY", "BristleQP"),
    }
    assert len({size for family, size in plan.cost if family == "lattice" and size > 1e4}) >= 3
    assert {size for _, size in (*plan.work, *plan.cost)} <= set(REFINEMENTS)


@pytest.mark.parametrize("size", [61, 700, 1_500, 8_400])
def test_sizes_are_what_they_say(size: int) -> None:
    assert len(scene("lattice", REFINEMENTS[size])) == pytest.approx(size, rel=0.05)


# What it says of them.


def row(name: str, seconds: float, error: float, **more: Any) -> Row:
    default = name == "newton"
    return Row(name, "", default, "answered", error=error, assembling=0.0, solving=seconds, **more)


def test_frontier() -> None:
    rows = [
        row("fast", 1.0, 1e-3),
        row("middle", 2.0, 1e-6),
        row("worse", 2.5, 1e-5),
        row("same", 2.0, 1e-6),
        row("newton", 3.0, 1e-15),
        row("slow", 4.0, 1e-15),
        row("unknown", 0.1, np.nan),
        Row("refused", "", False, "refused"),
    ]
    marked = mark_frontier(rows)
    assert [each.solver for each in marked if each.frontier] == ["fast", "middle", "same", "newton"]
    assert better_than_default(rows) == ()


def test_who_is_better_than_the_default() -> None:
    default = row("newton", 1.0, 1e-12)
    others = [
        row("within noise", 0.95, 1e-12),
        row("less accurate", 0.5, 1.1e-12),
        row("slower", 1.2, 1e-15),
        row("better", 0.85, 1e-12),
    ]
    assert [each.solver for each in better_than_default([default, *others])] == ["better"]
    missing = [Row("newton", "", True, "failed"), *others]
    assert len(better_than_default(missing)) == len(others)


def test_exponent() -> None:
    sizes = np.array([1e4, 3e4, 1e5, 1e6])
    assert exponent(sizes, 7e-6 * sizes**1.13) == pytest.approx(1.13)
    noisy = 7e-6 * sizes**1.13 * np.array([1.01, 0.99, 0.99, 1.01])
    assert exponent(sizes, noisy) == pytest.approx(1.13, abs=0.01)
    assert np.isnan(exponent([1e4], [1.0]))


def invented(*rows: Row, reference: Any = None) -> Bench:
    """Measurements that were never made."""
    found = reference or solved("lattice", 1.0)[1]
    cost = tuple(
        CostRow("lattice", n, "answered", seconds=1e-6 * n**1.1, memory=500 * n, certified=True,
                scope="local", load_error=1e-9, assembling=0.1, solving=0.1, certifying=0.1)
        for n in (5_000, 10_000, 100_000, 1_000_000)
    )  # fmt: skip
    panel = Panel("lattice", 61, found, "", mark_frontier(rows))
    return replace(tiny(), panels=(panel,), cost=cost, shear=(), paths=())


def test_verdicts() -> None:
    bench = invented(row("newton", 1.0, 1e-15), row("conic", 0.1, 1e-6))
    first, second = summary.verdicts(bench)
    assert first.endswith("in 1 of 1 scenes.")
    assert second.startswith("The time of a press grows as n^1.10 from 10,000 to 1,000,000 ")
    bench = invented(row("newton", 1.0, 1e-15), row("conic", 0.1, 1e-16))
    lines = summary.verdicts(bench)
    assert lines[0].endswith("in 0 of 1 scenes.")
    assert lines[1] == "NOT on the frontier with 61 asperities (lattice): conic, "
    panel = summary.summarise(bench)["work_precision"][0]
    assert panel["default_on_frontier"] is False
    assert panel["better_than_default"] == [["conic", ""]]


def test_settings_that_make_no_difference_are_one_line() -> None:
    rows = [
        replace(row("newton", seconds, 1e-15, iterations=5), setting=f"tolerance 1e-{power}")
        for seconds, power in ((3.0, 2), (1.0, 6), (2.0, 12))
    ]
    rows += [replace(row("conic", 1.0, error), setting=str(error)) for error in (1e-3, 1e-6)]
    rows += [Row("bristles", str(m), False, "left out", expected=m) for m in (16, 64)]
    first, *conic, last = summary.condensed(rows)
    assert (first.setting, first.seconds, first.default) == ("tolerance 1e-2 to 1e-12", 1.0, True)
    assert [each.setting for each in conic] == ["0.001", "1e-06"]
    assert (last.setting, last.expected) == ("every setting", 16)


# What it writes.


@pytest.fixture
def command(command: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The command line, which finds a run that was made before."""
    made = tiny()
    monkeypatch.setattr(suite, "run", lambda plan, announce: made)
    return command


def test_command(command: Any, tmp_path: Path) -> None:
    ran = command("bench", "--quick")
    assert (ran.status, ran.err) == (0, "")
    assert "newton (default)" in ran.out
    assert "The default solver is on the work-precision frontier in " in ran.out
    names = {path.name for path in (tmp_path / "bench-results").iterdir()}
    assert names == {
        *("files.json", "bench.json", "work-precision.csv", "cost.csv", "shear.csv", "paths.csv"),
        *("sweeps.csv", "gradient.csv"),
        *("work-precision.png", "work-precision.svg", "cost.png", "cost.svg"),
    }
    with (tmp_path / "bench-results" / "work-precision.csv").open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == len(tiny().panels[0].rows)
    again = command("bench", "--quick")
    assert again.status == 2
    assert "bench-results: not empty" in again.err
    assert command("bench", "--quick", "--force", "--no-figures").status == 0


def test_json(command: Any, tmp_path: Path) -> None:
    ran = command("bench", "--quick", "--json", "--out", "a", "--no-figures")
    assert (ran.status, ran.err) == (0, "")
    summary = json.loads(ran.out)
    assert summary == json.loads((tmp_path / "a" / "bench.json").read_text())
    assert (summary["schema"], summary["version"]) == (1, cr.__version__)
    assert {"machine", "seconds", "work_precision", "cost", "exponents", "shear"} <= set(summary)
    assert {"processor", "cores", "memory", "versions", "linear_algebra_threads", "date"} <= set(
        summary["machine"]
    )
    (panel,) = summary["work_precision"]
    assert panel["asperities"] == 61
    assert panel["reference"]["touching"] == 37
    default = [each for each in panel["rows"] if each["default"]]
    assert len(default) == 1
    assert 0 < default[0]["error"] < 1e-14
    assert default[0]["solving"] > 0
    assert default[0]["products"] > 0
    assert default[0]["certified"] is True
    answered = [each for each in panel["rows"] if each["outcome"] == "answered"]
    assert {each["solver"] for each in answered} >= {
        *("newton", "newton, lattice", "conic", "conic + Newton step", "conic in CVXPY"),
        *("conic in CVXPY + Newton step", "bristles", "bristles + Newton step"),
    }
    assert all(each["message"] for each in panel["rows"] if each["outcome"] != "answered")
    assert summary["cost"][0]["seconds"] > 0
    assert {each["what"] for each in summary["shear"]} == {"state", "loss curve"}
    paper, rough = summary["paths"]
    assert (paper["touching"], paper["presses"], paper["undecided"]) == (37, 9, 0)
    assert paper["order"] == rough["order"] == "proved at the levels used"
    assert 0 < paper["error"] < 1e-11
    (swept,) = summary["sweeps"]
    assert (swept["asperities"], swept["scenes"], swept["certified"]) == (61, 20, 20)
    assert 0 < swept["alone"] < swept["seconds"]


def test_a_path_takes_at_most_three_presses_for_each_segment() -> None:
    for each in tiny().paths:
        assert each.outcome == "answered"
        assert each.presses <= 3 * each.segments
        assert each.first > 0
        assert each.again > 0


def test_a_path_that_is_not_followed_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise cr.SolverError("no", solver="test")

    monkeypatch.setattr(paths, "load_path", refuse)
    found = paths.measure_path("lattice", scene("lattice", 1.0))
    assert (found.outcome, found.touching) == ("failed", 0)
    assert "no" in found.message
    assert "failed" in "".join(page.describe(replace(tiny(), paths=(found,))))


PAGE = f"# Title\n\nBefore.\n\n{page.BEGIN}\nold\n{page.END}\n\nAfter.\n"


def test_a_page_is_renewed_between_its_markers(command: Any, tmp_path: Path) -> None:
    path = tmp_path / "docs" / "page.md"
    path.parent.mkdir()
    path.write_text(PAGE)
    assert command("bench", "--quick", "--page", "docs/page.md", "--no-figures").status == 0
    text = path.read_text()
    before, after = page.split_page(path)
    assert (before, after) == ("# Title\n\nBefore.\n\n", "\n\nAfter.\n")
    assert "old" not in text
    assert "| newton (default) " in text
    for name in ("work-precision", "cost"):
        assert f"(figures/{name}.png)" in text
        assert (tmp_path / "docs" / "figures" / f"{name}.png").exists()
    assert command("bench", "--quick", "--page", "docs/page.md", "--force").status == 0
    assert path.read_text() == text


@pytest.mark.parametrize(
    "text",
    ["nothing", PAGE.replace(page.END, ""), PAGE.replace(page.BEGIN, ""), PAGE + PAGE],
    ids=["no block", "no end", "no beginning", "two blocks"],
)
def test_a_page_without_one_block_is_refused_first(command: Any, tmp_path: Path, text: str) -> None:
    (tmp_path / "page.md").write_text(text)
    ran = command("bench", "--quick", "--page", "page.md")
    assert ran.status == 2
    assert "page.md: expected one line <!-- bench: begin -->" in ran.err
    assert (tmp_path / "page.md").read_text() == text
    assert not (tmp_path / "bench-results").exists()
    assert command("bench", "--page", "none.md").status == 2


def test_the_page_of_the_documentation() -> None:
    path = ROOT / "docs" / "performance.md"
    before, _ = page.split_page(path)
    assert "convexrough bench --page docs/performance.md" in before
    block = path.read_text("utf-8").split(page.BEGIN)[1].split(page.END)[0]
    assert "| newton (default) " in block
    tables = [line for line in block.splitlines() if line.startswith("|")]
    assert all(line.endswith("|") for line in tables)
    for name in ("work-precision", "cost"):
        assert f"(figures/{name}.png)" in block


def test_figures() -> None:
    figures = bench_figures(tiny())
    assert set(figures) == {"work-precision", "cost"}
    for figure in figures.values():
        figure.draw_without_rendering()
        shown = [axes.xaxis.label for axes in figure.axes]
        shown += [text for legend in figure.legends for text in legend.get_texts()]
        for text in filter(Text.get_text, shown):
            box = text.get_window_extent()
            assert figure.bbox.padded(1).contains(box.x0, box.y0), text
            assert figure.bbox.padded(1).contains(box.x1, box.y1), text
    work = figures["work-precision"]
    below = next(each for each in work.findobj(Text) if each.get_text().startswith("largest"))
    assert not below.get_window_extent().overlaps(work.legends[0].get_window_extent())
    many = replace(tiny(), panels=tiny().panels * 5)
    labels = {text.get_text() for text in words(bench_figures(many)["work-precision"])}
    assert {"newton (default)", "conic", "bristles", "frontier", "seconds"} <= labels


def test_a_figure_of_the_default_solver_alone() -> None:
    figure = bench_figures(invented(row("newton", 1.0, 1e-13)))["work-precision"]
    assert any(text.get_text().startswith("others: ") for text in words(figure))


def test_progress_is_told() -> None:
    told: list[str] = []
    plan = replace(TINY, cost=(), shear=(), cycles=(), paths=())
    short = [Attempt("newton", "", Newton()), Attempt("bristles", "", BristleQP(4))]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("convexrough.bench.suite.attempts", lambda plan: short)
        found = suite.run(plan, told.append)
    assert "lattice, 61 asperities: newton, " in told
    assert [each.solver for each in found.panels[0].rows] == ["newton", "bristles"]


def test_what_a_gradient_costs() -> None:
    each = scene("lattice", REFINEMENTS[700])
    row = measure_gradient("lattice", each)
    assert row.outcome == "answered"
    assert 0 < row.touching < row.asperities
    assert min(row.pressing, row.cycling, row.differentiating) > 0
    assert (row.products > 2, row.single > 2) == (True, True)
    assert row.products + row.single < 100
    smooth = replace(each, friction=None)
    refused = measure_gradient("lattice", smooth)
    assert (refused.outcome, "friction" in refused.message) == ("refused", True)
