"""The README, the pages and the examples: what they show is run, and links lead somewhere.

A block of Python is executed. A block of TOML whose first line names a file, `# scene.toml`, is
written to it. Of a console block the lines `$ convexrough ...` are run, and must end with status 0
unless the line says `# exit status 3`. A block that is not to be run has its reason in a comment
before it: `<!-- not run: why -->`.
"""

import io
import re
import runpy
import shlex
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest
from matplotlib.text import Text

import convexrough
from convexrough import cli

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(
    r"(?:<!-- not run: (?P<why>\S.*?) -->\n+)?^```(?P<language>.*)\n(?P<text>(?s:.*?))^```$", re.M
)
COMMAND = re.compile(r"^\$ (.*?)(?:\s+# exit status (\d))?$", re.M)
#: Directives of the site, which the site's own build checks.
DIRECTIVES = {"{toctree}", "{eval-rst}"}


def blocks(page: Path) -> list[re.Match[str]]:
    return list(BLOCK.finditer(page.read_text("utf-8")))


def runs(block: re.Match[str]) -> bool:
    return block["why"] is None and block["language"] not in DIRECTIVES


RUN = [page for page in PAGES if any(map(runs, blocks(page)))]


@pytest.mark.usefixtures("no_processes")
@pytest.mark.sample(7)
@pytest.mark.parametrize("page", RUN, ids=lambda page: str(page.relative_to(ROOT)))
def test_blocks_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "page"}
    for block in filter(runs, blocks(page)):
        language, text = block["language"], block["text"]
        if language == "python":
            exec(compile(text, str(page), "exec"), names)
        elif language == "toml":
            name = re.match(r"# (\S+\.toml)\n", text)
            assert name, "a block of TOML begins with the name of its file"
            Path(name[1]).write_text(text, "utf-8")
        else:
            assert language == "console", f"a block of {language or 'no language'} is not run"
            commands = COMMAND.findall(text)
            assert commands
            for command, status in commands:
                program, *arguments = shlex.split(command)
                assert program == "convexrough", f"not run: {command}"
                assert cli.main(arguments) == int(status or 0), command


def test_links_lead_somewhere() -> None:
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#\s]+)\)", page.read_text("utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), (page, target)


def test_every_concept_says_first_what_it_is_for() -> None:
    for page in (ROOT / "docs/theory").glob("*.md"):
        _, opening = page.read_text("utf-8").split("\n\n")[:2]
        assert page.name == "index.md" or opening.startswith("After this page you "), page


def test_every_public_name_is_in_the_reference() -> None:
    pages = "\n".join(page.read_text("utf-8") for page in (ROOT / "docs/reference").glob("*.md"))
    for name in {*convexrough.__all__} - {"__version__"}:  # of a module: it, or names in it
        assert re.search(rf":: convexrough\.{name}[.\n]", pages), name
    for name in convexrough.solvers.__all__:
        assert f":: convexrough.solvers.{name}\n" in pages, name


def test_the_readme_shows_what_the_package_computes(capsys: pytest.CaptureFixture[str]) -> None:
    first = next(each for each in blocks(ROOT / "README.md") if each["language"] == "python")
    exec(compile(first["text"], "README.md", "exec"), {})
    assert re.match(r"\S+ 37\nglobal .*\nTrue .*\n6 ", capsys.readouterr().out)


def test_every_section_that_the_code_cites_is_there() -> None:
    """Formulas cite `docs/theory/page.md, "Section"`; a renamed section is found here."""
    cited = set()
    for path in (ROOT / "convexrough").rglob("*.py"):
        text = re.sub(r"\s+(#:? )?", " ", path.read_text("utf-8"))
        cited |= set(re.findall(r'(docs/theory/[\w-]+\.md),? "([^"]+)"', text))
    assert len(cited) > 15
    for page, section in cited:
        text = (ROOT / page).read_text("utf-8").replace("$", "")
        assert re.search(rf"^(#+ |.*\*\*){re.escape(section)}", text, re.M), (page, section)


def test_every_test_that_the_guarantees_name_is_there() -> None:
    named = set(re.findall(r"`(test_\w+)`", (ROOT / "docs/guarantees.md").read_text("utf-8")))
    tests = "\n".join(path.read_text("utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    assert len(named) > 40
    assert named <= set(re.findall(r"^def (test_\w+)", tests, re.M))


DRAWING = runpy.run_path(str(ROOT / "docs/figures.py"))["drawings"]()
#: Two of them take a minute and ten seconds: only with --full.
DRAWN = dict.fromkeys(DRAWING, 1) | dict.fromkeys(("design.png", "design-fine.png"), 0)


def test_one_command_draws_the_figures_of_the_pages() -> None:
    """All but those that show what the benchmark measured."""
    measured = {"cost.png", "work-precision.png"}
    assert {*DRAWING} | measured == {path.name for path in (ROOT / "docs/figures").iterdir()}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.sample(n)) for name, n in DRAWN.items()]
)
def test_each_figure_is_drawn(name: str, tmp_path: Path) -> None:
    DRAWING[name](tmp_path / name)
    assert (tmp_path / name).stat().st_size > 10_000


#: A turn of phrase that readers had to read twice, and what to write.
BANNED = {
    r"(?<!those )(?<!anyone )(?<!someone )\bwho\b": '"which" or "that" for things',
    r"\b(some|no)body\b": "name the thing, or the reader",
    r"\b(the|its) like\b|\bthe kin\b": "name the things",
    r"\b(is|are|be|was|were|been|far) off\b": '"wrong", "error" or a number',
    r"\b(every|each|all|no|its|the|of|their|these|friction) words?\b(?! \")": '"status"',
    r"\b(holds?|held|hold \w+) against\b": '"compare with" or "check against"',
    r"\bknows? no\b|\bknow nothing\b": "say what does not depend on what",
    r"\bmended\b|\bspoiled\b|\bguilty\b": '"fixed", "corrupted", "wrong"',
    r"\bis no \w+ness\b|\bwhat is no\b": "say what it is",
}

SOURCES = sorted([*(ROOT / "convexrough").rglob("*.py"), *(ROOT / "examples").rglob("*.py")])


def prose(path: Path) -> str:
    """Of a page: all but code. Of a module: docstrings, messages, help texts and comments."""
    text = path.read_text("utf-8")
    if path.suffix == ".md":
        text = re.sub(r"^```(?s:.*?)^```$|^    .*$|`[^`]*`", "", text, flags=re.M)
    else:
        names = {"STRING", "FSTRING_MIDDLE", "COMMENT"}
        tokens = tokenize.generate_tokens(io.StringIO(text).readline)
        text = "\n".join(t.string for t in tokens if tokenize.tok_name[t.type] in names)
    return re.sub(r"\s+(#:? )?", " ", text)


def test_no_banned_turn() -> None:
    found = []
    for path in [*PAGES, *SOURCES]:
        text = prose(path)
        for turn, advice in BANNED.items():
            for at in re.finditer(turn, text, re.I):
                shown = text[max(at.start() - 40, 0) : at.end() + 20]
                found.append(f"{path.relative_to(ROOT)}: ...{shown}...: write {advice}")
    assert not found, "\n".join(found)


FOLDER = ROOT / "examples"
#: Relative tolerances: of the paper's rounded numbers, of quadrature, extrapolation and minima.
TOLERANCES = {
    "papers_example": 1e-3, "losing_contact": 1e-5, "continuum_limit": 1e-5,
    "limits_of_shakedown": 1e-7, "normal_and_shear_together": 5e-5, "roughness_statistics": 1e-3,
    "design_a_damper": 1e-3, "scatter_of_heights": 0.1,
}  # fmt: skip

#: All `compare()` at their end; but lessons assert what they say on the way.
SCRIPTS = {path.stem for path in FOLDER.glob("*.py")}
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


def compared(script: str, *options: int) -> Any:
    """Names, values and references of a script that is run, but not as the main one."""
    return runpy.run_path(str(FOLDER / f"{script}.py"), run_name=script)["compare"](*options)


@pytest.mark.sample(1)
@pytest.mark.parametrize("script", sorted(SCRIPTS - {"boundary_elements", "measured_surface"}))
def test_example(script: str) -> None:
    pairs = compared(script)
    assert pairs
    for name, computed, reference in pairs:
        tolerance = TOLERANCES.get(script, 1e-9)
        assert computed == pytest.approx(reference, rel=tolerance, abs=1e-12), name


@pytest.mark.sample(1)
@pytest.mark.parametrize("script", LESSONS)
def test_lesson(script: str, shown: list[int]) -> None:
    """Every claim holds, and a class that runs the script sees its picture in large letters."""
    assert "compare" not in runpy.run_path(str(LESSONS[script]), run_name=script)
    assert LESSONS[script].read_text("utf-8").count("\nassert ") > 5
    assert shown == plt.get_fignums() == [1]
    assert plt.rcParams["font.size"] >= 14
    assert min(text.get_fontsize() for text in plt.figure(1).findobj(Text) if text.get_text()) > 10


def test_boundary_elements() -> None:
    """The asperity model against a boundary-element solution of the same shapes."""
    errors = {name: a / b - 1 for name, a, b in compared("boundary_elements", 384)}
    assert abs(errors["order of convergence"]) < 0.125  # of 2
    assert abs(errors["closest, total load"]) < 2.5e-4
    assert abs(errors["summit, total load"]) < 4e-3
    for ring in "FEDCBA":
        assert abs(errors[f"closest, load in ring {ring}"]) < 4e-3
    assert -0.08 < errors["summit, load in ring A"] < -0.07


def test_measured_surface() -> None:
    """What the picture of asperities costs on a map, as the example and the page on theory say."""
    errors = {name: a / b - 1 for name, a, b in compared("measured_surface")}
    for force, total in (("3", -0.076), ("10", -0.106), ("30", -0.100)):
        assert errors[f"load {force}, load"] == pytest.approx(total, abs=0.005)
        assert -0.35 < errors[f"load {force}, area"] < -0.25
        assert -0.16 < errors[f"load {force}, heaviest"] < -0.06
        assert abs(errors[f"load {force}, contacts"]) < 0.06
