"""Corrections of common TOML mistakes: a decimal comma, a unit, missing quotes."""

from __future__ import annotations

import re
import tomllib
from contextlib import suppress

#: Largest number of mistakes of one file, and of characters of a line, that are shown.
MOST_SLIPS, MOST_SHOWN = 10, 60

_KEY = "[A-Za-z0-9_.-]+"
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"

_OPENING, _CLOSING = "[\u201c\u201d\u201e\u2018\u2019\u00ab]", "\u201c\u201d\u2018\u2019\u00bb"

#: By what is expected instead of a mistake: its correction, and the pattern of what follows the key
_SLIPS = {
    "a decimal point instead of a comma": (
        "{whole}.{part}", r"=\s*(?P<whole>[+-]?\d+),(?P<part>\d+(?:[eE][+-]?\d+)?)"),
    "an exponent with e": (
        "{number}e{power}", rf"=\s*(?P<number>{_NUMBER})[dD](?P<power>[+-]?\d+)"),
    "a number without unit; units are only named, in [units]": (  # 5e+-5 has no unit
        "{number}", rf"=\s*(?P<number>{_NUMBER})\s*(?![exEX]\W*\d)[^\W\d_][^\s#=]*"),
    "digits on both sides of the point": (
        "{number}", r"=\s*(?P<number>[+-]?(?:\d+\.|\.\d+)(?:[eE][+-]?\d+)?)"),
    "text with a backslash in single quotes": ("'{text}'", r'=\s*"(?P<text>[^"\']*\\[^"\']*)"'),
    "lower case": ("{word}", r"=\s*(?P<word>(?i:[+-]?inf|true|false))"),
    "text in straight quotes, or a number": (
        '"{text}"',
        rf"=\s*{_OPENING}?(?P<text>[^\W\d][^\"'=#\[\]{{}}{_CLOSING}]*?)[{_CLOSING}]?"),
    "an equals sign instead of a colon": ("{value}", r":\s*(?P<value>[^\s#].*?)"),
    "nothing at the end of the line": (
        "{value}", rf"=\s*(?P<value>{_NUMBER}|\"[^\"]*\"|\[[^\]]*\])\s*[;,]"),
}  # fmt: skip


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
    for why, (meant, pattern) in _SLIPS.items():
        if found := re.fullmatch(rf"\s*(?P<key>{_KEY})\s*{pattern}\s*(?:#.*)?", line):
            parts = {name: part.strip() for name, part in found.groupdict().items()}
            if "number" in parts:
                parts["number"] = _number(parts["number"])
            if "word" in parts:
                parts["word"] = parts["word"].lower()
            mended = f"{parts['key']} = {meant.format(**parts)}"
            with suppress(ValueError, RecursionError):
                tomllib.loads(mended)
                return mended, why
    return None


def _number(text: str) -> str:
    """The number as TOML requires it, with digits on both sides of the point."""
    text = re.sub(r"(?<!\d)\.(?=\d)", "0.", text)
    return re.sub(r"(?<=\d)\.(?!\d)", ".0", text)
