"""The README and the pages: their Python runs, their links lead somewhere."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_python_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks of a page run one after the other, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in re.findall(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.M | re.S):
        exec(compile(block, str(page), "exec"), names)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)\)", page.read_text("utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_the_readme_shows_what_the_package_computes(capsys: pytest.CaptureFixture[str]) -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    block = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)[0]
    exec(compile(block, "README.md", "exec"), {})
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
