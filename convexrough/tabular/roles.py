"""Columns of tables: known names, their quantities and units, and messages on wrong ones."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from convexrough.errors import InputError
from convexrough.tabular.units import NAMELESS, Unit, UnitNames, bare, known_unit


class Column(NamedTuple):
    """A known column: its quantity, "" for text; other names; True if numbers must be positive."""

    kind: str = "length"
    also: tuple[str, ...] = ()
    positive: bool = False


#: The known columns.
COLUMNS = {
    "x": Column(),
    "y": Column(),
    "height": Column(also=("z", "h", "heights", "höhe", "hoehe")),
    "tip_radius": Column(also=("radius",), positive=True),
    "load": Column("force"),
    "force": Column("force"),
    "pressure": Column("pressure"),
    "area": Column("area"),
    "status": Column(""),
    "contact": Column("", also=("touching", "in_contact")),
    "no_contact": Column("", also=("open",)),
    "index": Column(""),
}

#: Names of columns with row numbers.
INDEX = ("index", "asperity", "id", "no", "nr", "#", "i", "number", "node", "label", "row", "")

#: First words, in lower case, of rows that summarise a table and are not part of it.
TOTALS = ("sum", "total", "totals", "grand total", "summe", "gesamt", "somme", "suma",
          "mean", "mittelwert", "average", "median", "std", "max", "min", "maximum",
          "minimum")  # fmt: skip


def is_index(header: str) -> bool:
    """True for the header of a column with row numbers."""
    return bare(header).lower().removesuffix(".") in INDEX


#: Largest number of characters of a line that are shown; similarity above which the name of an
#: unread column may be a misspelling; and relative difference up to which factors are equal.
MOST_SHOWN, LOOKS_LIKE, SAME = 60, 0.75, 1e-9


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How columns of a file are read."""

    #: names in the file, and factors of the numbers, by known name
    columns: Mapping[str, str] = field(default_factory=dict, hash=False)
    scales: Mapping[str, float] = field(default_factory=dict, hash=False)
    units: UnitNames = NAMELESS  # of the scene
    convert: bool = False  # True to convert columns in other units, False to refuse them
    scalable: bool = False  # True if messages may propose the options --scale and --column
    keyed: bool = False  # True if messages may propose the key `columns` of [asperities]
    alike: bool = True  # True to demand one unit of a quantity, even if the scene names none


AS_IT_IS = Reading()


def named_columns(what: str, given: Mapping[str, str], known: Sequence[str]) -> dict[str, str]:
    """The headers in `given`, by known name; an entry has name and header in either order."""
    named = {}
    for one, other in given.items():
        name, column = (one, other) if one in known or other not in known else (other, one)
        if name not in known or not column:
            expected = f"NAME=COLUMN, where NAME is one of {', '.join(known)}"
            raise InputError(what, found=f"{one}={other}", expected=expected)
        named[name] = column
    return named


def places_of(
    wanted: Sequence[str], names: Sequence[str], how: Reading, found: str
) -> tuple[dict[str, int], list[str]]:
    """Places, from 0, of wanted columns by name; and mistakes, in which `found` shows `names`."""
    bared = [bare(name) for name in names]
    lowered = [each.lower() for each in bared]
    spelt = [re.sub(r"[\s-]+", "_", each.strip()) for each in lowered]  # as in `COLUMNS`
    places: dict[str, int] = {}
    mistakes: list[str] = []
    for name in wanted:
        called = how.columns.get(name)
        if called is None:
            alike = [i for i, each in enumerate(spelt) if each in (name, *COLUMNS[name].also)]
        else:  # the header as it is, perhaps without its unit; in lower case; or its number
            number = int(called[:9]) if called.isdecimal() else 0
            alike = [i for i, each in enumerate(names) if called in (each, bared[i])]
            alike = alike or [i for i, each in enumerate(lowered) if each == called.lower()]
            alike = alike or ([number - 1] if 0 < number <= len(names) else [])
            if not alike:
                mistakes.append(f"columns: found {found}, expected a column {called!r}")
        if alike:
            mistakes += [f"columns: found {bared[place]!r} as {it} and {name}, expected one each"
                         for it, place in places.items() if place == alike[0]]  # fmt: skip
            places[name] = alike[0]
        if len(alike) > 1:
            several = [*dict.fromkeys(bared[i] for i in alike)]
            twice = len(several) < len(alike)
            choice = f": --column {name}={several[0]}" * how.scalable
            shown = f"{several[0]!r} twice" if twice else " and ".join(map(repr, several))
            expected = "once" if twice else f"one of them{choice}"
            mistakes.append(f"columns: found {shown}, expected {expected}")
    return places, mistakes


def columns_key(named: Mapping[str, str], missing: Iterable[str]) -> str:
    """The key `columns` of a scene file: the headers in `named` by known name, or NAME."""
    chosen = dict.fromkeys(missing, "NAME") | dict(named)
    pairs = (f"{key} = {json.dumps(each, ensure_ascii=False)}" for key, each in chosen.items())
    return f"columns = {{{', '.join(pairs)}}} in [asperities]"


def lookalikes(unread: Sequence[str], missing: Sequence[str]) -> dict[str, str]:
    """By name of a missing column, an unread one with a similar name."""
    from difflib import get_close_matches  # only when a column is missing

    left = [each for each in unread if each.lower() not in missing]  # else named by `Reading`
    alike = [(get_close_matches(each.lower(), missing, 1, LOOKS_LIKE), each) for each in left]
    return {near[0]: each for near, each in alike if near}


def factors_of(
    names: Sequence[str], units: Mapping[str, str], how: Reading
) -> tuple[dict[str, float], list[str]]:
    """The factors of the columns, by name; and mistakes in their units."""
    factors, mistakes = {name: how.scales[name] for name in names if name in how.scales}, []
    first: dict[str, tuple[str, Unit]] = {}  # of each quantity, the first column with a unit
    for name in (name for name in names if name in units):
        kind, said, place = COLUMNS[name].kind, units[name], f"column {name}"
        scene, given = how.units.unit(kind), how.scales.get(name)
        if given is not None and scene is None:
            continue
        way = f"--scale {name}=" if how.scalable else ""
        try:
            found = known_unit(place, said, kind)
        except InputError as error:
            if given is None and (scene or "a unit of" in str(error.found)):
                taken = f", or {way}1 to take the numbers as they are" if way else ""
                mistakes.append(f"{error}{taken}")
            continue  # text in brackets need not be a unit
        assert found is not None
        other, wanted = first.setdefault(kind, (name, found))
        if scene is None:
            if how.alike and found.size != wanted.size:
                mistakes.append(f"{place}: found {said}, expected {units[other]}, as {other}")
            continue
        factor = found.into(scene)
        equal = f"1 {said} is {factor:.15g} {scene.name}"
        if given is not None:
            if abs(abs(given) / factor - 1) > SAME:
                mistakes.append(f"{place}: found a factor {given:g}, expected {factor:.15g}, as "
                                f"{equal}")  # fmt: skip
        elif factor != 1 and how.convert:
            factors[name] = factor
        elif factor != 1:
            advice = f"{way}{factor:.15g} or " if way else ""
            mistakes.append(f"{place}: found {said}, expected {scene.name}, the scene's unit; "
                            f"{equal}: {advice}convert = true in [units] of the scene")  # fmt: skip
    for name in names:
        there = first.get(COLUMNS[name].kind)
        if there and there[0] in factors and name not in units and name not in how.scales:
            mistakes.append(f"column {name}: found no unit, expected one, as {there[0]} has")
    return factors, mistakes


def shortened(text: str) -> str:
    """The text without control characters, cut after `MOST_SHOWN` characters."""
    text = "".join(each if each.isprintable() else " " for each in text[: MOST_SHOWN + 1])
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}..."
