"""Corrections of common TOML mistakes: a decimal comma, a unit, missing quotes."""

from __future__ import annotations

import re
import tomllib

#: Largest number of mistakes of one file that are explained.
MOST_SLIPS = 10

#: Largest number of characters of a line that are shown.
MOST_SHOWN = 60

_KEY = "[A-Za-z0-9_.-]+"
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"

#: For each mistake: the pattern of what follows the key, its correction, and what was expected.
_SLIPS = [
    (
        r"=\s*(?P<whole>[+-]?\d+),(?P<part>\d+(?:[eE][+-]?\d+)?)",
        "{whole}.{part}",
        "a decimal point instead of a comma",
    ),
    (
        rf"=\s*(?P<number>{_NUMBER})[dD](?P<power>[+-]?\d+)",
        "{number}e{power}",
        "an exponent with e",
    ),
    (
        rf"=\s*(?P<number>{_NUMBER})\s*(?![exEX]\W*\d)[^\W\d_][^\s#=]*",  # 5e+-5 has no unit
        "{number}",
        "a number without unit; units are only named, in [units]",
    ),
    (
        r"=\s*(?P<number>[+-]?(?:\d+\.|\.\d+)(?:[eE][+-]?\d+)?)",
        "{number}",
        "digits on both sides of the point",
    ),
    (r"=\s*(?P<word>(?i:[+-]?inf|true|false))", "{word}", "lower case"),
    (
        r"=\s*[\u201c\u201d\u201e\u2018\u2019\u00ab]?"
        r"(?P<text>[^\W\d][^\"'=#\[\]{}\u201c\u201d\u2018\u2019\u00bb]*?)"
        r"[\u201c\u201d\u2018\u2019\u00bb]?",
        '"{text}"',
        "text in straight quotes, or a number",
    ),
    (r":\s*(?P<value>[^\s#].*?)", "{value}", "an equals sign instead of a colon"),
    (
        rf"=\s*(?P<value>{_NUMBER}|\"[^\"]*\"|\[[^\]]*\])\s*[;,]",
        "{value}",
        "nothing at the end of the line",
    ),
]


def explained(path: object, text: str, error: Exception) -> str:
    """A message with a line for each TOML mistake of a file: place, text and correction."""
    lines = text.split("\n")
    found: list[str] = []
    while len(found) < MOST_SLIPS:
        place = re.search(r"at line (\d+)", str(error))
        number = int(place[1]) if place else 0
        line = lines[number - 1].strip("\r") if 0 < number <= len(lines) else ""
        shown = line.strip() if len(line) <= MOST_SHOWN else f"{line[:MOST_SHOWN].strip()}..."
        meant = _corrected(line) if len(line) < 200 else None
        if meant is None:
            said = str(error).replace("Cannot overwrite a value", "key given twice")
            what = f"{path}: not a TOML file: {said}"
            found.append(f"{what}: {shown}" if shown else what)
            break
        fixed, why = meant
        found.append(f"{path}: line {number}: found {shown}, expected {fixed}: {why}")
        lines[number - 1] = fixed
        try:
            tomllib.loads("\n".join(lines))
        except (ValueError, RecursionError) as following:
            error = following
        else:
            break
    return "\n".join(found)


def _corrected(line: str) -> tuple[str, str] | None:
    """The corrected line and the reason; None if no correction is known."""
    for pattern, meant, why in _SLIPS:
        if found := re.fullmatch(rf"\s*(?P<key>{_KEY})\s*{pattern}\s*(?:#.*)?", line):
            parts = {name: part.strip() for name, part in found.groupdict().items()}
            if "number" in parts:
                parts["number"] = _number(parts["number"])
            if "word" in parts:
                parts["word"] = parts["word"].lower()
            mended = f"{parts['key']} = {meant.format(**parts)}"
            try:
                tomllib.loads(mended)
            except (ValueError, RecursionError):
                continue
            return mended, why
    return None


def _number(text: str) -> str:
    """The number as TOML requires it, with digits on both sides of the point."""
    text = re.sub(r"(?<!\d)\.(?=\d)", "0.", text)
    return re.sub(r"(?<=\d)\.(?!\d)", ".0", text)
