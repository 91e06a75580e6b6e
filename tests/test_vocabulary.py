"""Turns of phrase that readers had to read twice."""

import io
import re
import tokenize
from pathlib import Path

ROOT = Path(__file__).parent.parent

#: A banned turn, and what to write.
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

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MODULES = sorted((ROOT / "convexrough").rglob("*.py"))
EXAMPLES = sorted((ROOT / "examples").rglob("*.py"))


def prose_of_a_page(path: Path) -> str:
    """Without code: fenced and indented blocks, and what stands in backquotes."""
    text = re.sub(r"^```.*?^```$", "", path.read_text("utf-8"), flags=re.M | re.S)
    return re.sub(r"`[^`]*`", "", re.sub(r"^    .*$", "", text, flags=re.M))


def prose_of_a_module(path: Path) -> str:
    """Docstrings, messages, help texts and comments."""
    names = {"STRING", "FSTRING_MIDDLE", "COMMENT"}
    tokens = tokenize.generate_tokens(io.StringIO(path.read_text("utf-8")).readline)
    return "\n".join(t.string for t in tokens if tokenize.tok_name[t.type] in names)


def found_in(text: str) -> list[str]:
    text = re.sub(r"\s+(#:? )?", " ", text)
    return [
        f"...{text[max(found.start() - 40, 0) : found.end() + 20]}...: write {advice}"
        for turn, advice in BANNED.items()
        for found in re.finditer(turn, text, re.I)
    ]


def test_no_banned_turn() -> None:
    prose = {page: prose_of_a_page(page) for page in PAGES}
    prose |= {module: prose_of_a_module(module) for module in [*MODULES, *EXAMPLES]}
    found = [
        f"{path.relative_to(ROOT)}: {each}" for path in prose for each in found_in(prose[path])
    ]
    assert not found, "\n".join(found)
