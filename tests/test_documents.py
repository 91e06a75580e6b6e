"""The README and the pages: what they show is run in an empty folder, and links lead somewhere.

A block of Python is executed. A block of TOML whose first line names a file, `# scene.toml`, is
written to it. Of a console block the lines `$ convexrough ...` are run, and must end with status 0
unless the line says `# exit status 3`. A block that is not to be run has its reason in a comment
before it: `<!-- not run: why -->`.
"""

import re
import runpy
import shlex
from pathlib import Path

import pytest

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


@pytest.mark.usefixtures("no_processes")
@pytest.mark.sample(7)
@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if any(map(runs, blocks(page)))],
    ids=lambda page: str(page.relative_to(ROOT)),
)
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
    """The first sentence of a page says what its reader will be able to do, or know."""
    for page in (ROOT / "docs/theory").glob("*.md"):
        _, opening = page.read_text("utf-8").split("\n\n")[:2]
        assert page.name == "index.md" or opening.startswith("After this page you "), page


def test_every_public_name_is_in_the_reference() -> None:
    pages = "\n".join(page.read_text("utf-8") for page in (ROOT / "docs/reference").glob("*.md"))
    for name in convexrough.__all__:  # of a module: it, or names in it
        if name != "__version__":
            assert re.search(rf":: convexrough\.{name}[.\n]", pages), name
    for name in convexrough.solvers.__all__:
        assert f":: convexrough.solvers.{name}\n" in pages, name


def test_the_readme_shows_what_the_package_computes(capsys: pytest.CaptureFixture[str]) -> None:
    first = next(each for each in blocks(ROOT / "README.md") if each["language"] == "python")
    exec(compile(first["text"], "README.md", "exec"), {})
    printed = capsys.readouterr().out.split("\n")
    assert printed[0].split()[1] == "37"
    assert printed[1].startswith("global")
    assert printed[2].startswith("True")
    assert printed[3].startswith("6 ")


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


LONG = {"design.png", "design-fine.png"}
DRAWING = runpy.run_path(str(ROOT / "docs/figures.py"))["drawings"]()


def test_one_command_draws_the_figures_of_the_pages() -> None:
    """All but those that show what the benchmark measured."""
    measured = {"cost.png", "work-precision.png"}
    assert {*DRAWING} | measured == {path.name for path in (ROOT / "docs/figures").iterdir()}


@pytest.mark.parametrize("name", sorted(DRAWING.keys() - LONG))
@pytest.mark.sample(1)
def test_each_figure_is_drawn(name: str, tmp_path: Path) -> None:
    DRAWING[name](tmp_path / name)
    assert (tmp_path / name).stat().st_size > 10_000


@pytest.mark.sample(0)  # a minute and ten seconds: only with --full
@pytest.mark.parametrize("name", sorted(LONG))
def test_long_figures_are_drawn(name: str, tmp_path: Path) -> None:
    test_each_figure_is_drawn(name, tmp_path)
