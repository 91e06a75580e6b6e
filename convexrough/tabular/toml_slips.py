"""Corrections of common TOML mistakes: a decimal comma, a unit, missing quotes."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from typing import NamedTuple

#: Largest number of mistakes of one file that are explained.
MOST_SLIPS = 10

#: Largest number of characters of a line that are shown.
MOST_SHOWN = 60

_KEY = r"(?P<key>\s*[A-Za-z0-9_.-]+\s*)"
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"


class _Slip(NamedTuple):
    """A kind of wrong line, the correction, and the reason."""

    pattern: re.Pattern[str]
    meant: Callable[[re.Match[str]], str]
    why: str


def _slip(pattern: str, meant: Callable[[re.Match[str]], str], why: str) -> _Slip:
    return _Slip(re.compile(pattern + r"\s*(?:#.*)?"), meant, why)


def _number(text: str) -> str:
    """The number as TOML, with digits on both sides of the point."""
    text = re.sub(r"(?<!\d)\.(?=\d)", "0.", text)
    return re.sub(r"(?<=\d)\.(?!\d)", ".0", text)


_SLIPS = [
    _slip(
        rf"{_KEY}=\s*(?P<whole>[+-]?\d+),(?P<part>\d+(?:[eE][+-]?\d+)?)",
        lambda found: f"{found['key'].strip()} = {found['whole']}.{found['part']}",
        "a decimal point, no comma",
    ),
    _slip(
        rf"{_KEY}=\s*(?P<number>{_NUMBER})[dD](?P<power>[+-]?\d+)",
        lambda found: f"{found['key'].strip()} = {_number(found['number'])}e{found['power']}",
        "an exponent with e",
    ),
    _slip(
        rf"{_KEY}=\s*(?P<number>{_NUMBER})\s*(?P<unit>[^\d\s#.,;\]\[\"'=_-][^\s#=]*)",
        lambda found: f"{found['key'].strip()} = {_number(found['number'])}",
        "a number without unit; units are only named, in [units]",
    ),
    _slip(
        rf"{_KEY}=\s*(?P<number>[+-]?(?:\d+\.|\.\d+)(?:[eE][+-]?\d+)?)",
        lambda found: f"{found['key'].strip()} = {_number(found['number'])}",
        "digits on both sides of the point",
    ),
    _slip(
        rf"{_KEY}=\s*[\u201c\u201d\u201e\u2018\u2019\u00ab]?"
        r"(?P<text>[^\W\d][^\"'=#\[\]{}\u201c\u201d\u2018\u2019\u00bb]*?)"
        r"[\u201c\u201d\u2018\u2019\u00bb]?",
        lambda found: f'{found["key"].strip()} = "{found["text"].strip()}"',
        "text in straight quotes",
    ),
    _slip(
        rf"{_KEY}:\s*(?P<value>[^\s#].*?)",
        lambda found: f"{found['key'].strip()} = {found['value']}",
        "an equals sign, no colon",
    ),
    _slip(
        rf"{_KEY}=\s*(?P<value>{_NUMBER}|\"[^\"]*\"|\[[^\]]*\])\s*[;,]",
        lambda found: f"{found['key'].strip()} = {found['value']}",
        "nothing at the end of the line",
    ),
]


def explained(path: object, text: str, error: Exception) -> str:
    """A line for each mistake: place, text and correction, if it is known."""
    lines = text.split("\n")
    found: list[str] = []
    while len(found) < MOST_SLIPS:
        place = re.search(r"at line (\d+)", str(error))
        number = int(place[1]) if place else 0
        line = lines[number - 1].strip("\r") if 0 < number <= len(lines) else ""
        shown = line.strip() if len(line) <= MOST_SHOWN else f"{line[:MOST_SHOWN].strip()}..."
        meant = _corrected(line) if len(line) < 200 else None
        if meant is None:
            what = f"{path}: not a TOML file: {error}"
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
    """The correction of a line and the reason; None if it is not known."""
    for pattern, meant, why in _SLIPS:
        if found := pattern.fullmatch(line):
            try:
                tomllib.loads(mended := meant(found))
            except (ValueError, RecursionError):
                continue
            return mended, why
    return None
