"""How a docstring becomes a page of the reference: as it is written, with nothing marked up.

Docstrings here are plain text: bars, stars and underscores are mathematics, names and their
meanings stand in aligned lines, and formulas of their own are indented. So

- a line "name : meaning" and the indented lines after it become an item of a list; two that share
  a line are set apart by a semicolon and two spaces;
- indented paragraphs stay as they are, in fixed width, and so do examples, which begin with >>>;
- everything else is a paragraph, in which only `backquotes` mean anything: code.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

ITEM = re.compile(r"(\S.*?) +: (.*)")


def literal_docstring(
    app: Any, what: str, name: str, subject: Any, options: Any, lines: list[str]
) -> None:
    """For Sphinx's event `autodoc-process-docstring`: rewrites the lines in place."""
    lines[:] = restructured(lines)


def restructured(lines: list[str]) -> list[str]:
    """The lines of a docstring as reStructuredText that says just that."""
    return [line for paragraph in _paragraphs(lines) for line in [*_shown(paragraph), ""]]


def _paragraphs(lines: list[str]) -> Iterator[list[str]]:
    paragraph: list[str] = []
    for line in [*lines, ""]:
        if line.strip():
            paragraph.append(line.rstrip())
        elif paragraph:
            yield paragraph
            paragraph = []


def _shown(paragraph: list[str]) -> list[str]:
    if paragraph[0].startswith(" "):
        return ["::", "", *(f"    {line}" for line in paragraph)]
    if paragraph[0].startswith(">>> "):
        return paragraph
    if any(ITEM.match(line) for line in paragraph):
        return list(_list(paragraph))
    return [_plain(line) for line in paragraph]


def _list(paragraph: list[str]) -> Iterator[str]:
    """Names and meanings; prose before and after the items stays prose."""
    in_list = False
    for line in paragraph:
        if line.startswith(" ") and in_list:
            yield "   " + _plain(line.strip())
            continue
        parts = [ITEM.match(part) for part in line.split(";  ")]
        if all(parts):
            if not in_list:
                yield ""
            for part in parts:
                assert part is not None
                yield f":{_plain(part[1]).replace(':', chr(92) + ':')}: {_plain(part[2])}"
        else:
            if in_list:
                yield ""
            yield _plain(line.strip())
        in_list = all(parts)


def _plain(text: str) -> str:
    """Escaped, but for `code`."""
    pieces = re.split(r"`([^`]+)`", text)
    plain = [re.sub(r"([\\*|_`])", r"\\\1", piece) for piece in pieces[::2]]
    code = [f"\\ ``{piece}``\\ " for piece in pieces[1::2]]
    return "".join(a + b for a, b in zip(plain, [*code, ""], strict=True))
