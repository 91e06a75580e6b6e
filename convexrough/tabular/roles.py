"""Columns of tables: known names, their quantities and units, and messages on wrong ones."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

from convexrough.errors import InputError
from convexrough.tabular.arrays import FACTORS, TIMES
from convexrough.tabular.units import NAMELESS, Unit, UnitNames, bare, in_text, known_unit, parsed


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
INDEX = ("index", "id", "no", "nr", "#", "i", "number", "node", "label", "node label", "asperity",
         "row", "")  # fmt: skip

#: First words, in lower case, of rows that summarise a table and are not part of it.
TOTALS = ("sum", "total", "totals", "grand total", "summe", "gesamt", "somme", "suma",
          "mean", "average", "max", "min", "maximum", "minimum")  # fmt: skip


def is_index(header: str) -> bool:
    """True for the header of a column with row numbers."""
    return bare(header).lower().removesuffix(".") in INDEX


def totals(cells: Sequence[str]) -> str:
    """The first word of a row that summarises a table; "" for other rows."""
    name = next(filter(None, cells), "")
    return name if name.rstrip(" :=").lower() in TOTALS else ""


#: Words for heights that are no lengths, or that grow downwards.
CHANGED = re.compile(
    r"\b(volts?|mV|waves|fringes|inverted|depths|downwards|multiplied|divided)\b", re.I
)

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
    shared: Sequence[str] = ()  # columns also in another file, to which --scale would apply, too
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
        else:  # the header as it is, without its unit, in lower case
            ways = ((names, called), (bared, called), (lowered, called.lower()))
            ranks = ([i for i, each in enumerate(known) if each == it] for known, it in ways)
            alike = next(filter(None, ranks), [])
            if not alike and called.isdecimal() and 1 <= int(called[:9]) <= len(names):
                alike = [int(called) - 1]
            if not alike:
                mistakes.append(f"columns: found {found}, expected a column {called!r}")
        if alike:
            mistakes += [f"columns: found {bared[place]!r} as {it} and {name}, expected one each"
                         for it, place in places.items() if place == alike[0]]  # fmt: skip
            places[name] = alike[0]
        if len(alike) > 1:
            choice = f": --column {name}={bared[alike[0]]}" if how.scalable else ""
            several = [*dict.fromkeys(bared[i] for i in alike)]
            found_them, expected = " and ".join(map(repr, several)), f"one of them{choice}"
            if called is not None or len(several) < len(alike):
                found_them, expected = f"{called or several[0]!r} twice", "once"
            mistakes.append(f"columns: found {found_them}, expected {expected}")
    return places, mistakes


def columns_key(named: Mapping[str, str], missing: Iterable[str], unread: Iterable[str]) -> str:
    """The key `columns` of a scene file: the headers in `named` by known name; and for each other
    name in `missing` an unread column with the initial of its last word or a synonym, or NAME."""
    chosen = dict(named)
    for name in (each for each in missing if each not in named):
        left = [it for it in unread if it not in chosen.values() and "diam" not in it.lower()]
        initials = tuple(each.split("_")[-1][0] for each in (name, *COLUMNS[name].also))
        alike = [each for each in left if each.lower().startswith(initials)]
        chosen[name] = (alike or ["NAME"])[0]
    pairs = (f"{key} = {json.dumps(each, ensure_ascii=False)}" for key, each in chosen.items())
    return f"columns = {{{', '.join(pairs)}}} in [asperities]"


def lookalikes(unread: Sequence[str], missing: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Each name of a missing column, with that of an unread one that is similar."""
    from difflib import SequenceMatcher  # only when a column is missing

    for name, each in product(unread, missing):
        alike = SequenceMatcher(None, name.lower(), each).ratio()
        if LOOKS_LIKE < alike < 1:  # 1: assigned otherwise by `Reading.columns`
            yield each, name


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
        way = f"--scale {name}=" if how.scalable and name not in how.shared else ""
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


def units_in(said: Iterable[tuple[str, str]], names: Sequence[str], how: Reading) -> Iterator[str]:
    """A mistake for each text, said at a place in the file, that states a factor, or names another
    unit than the scene's for one of the columns `names`, whose headers state none."""
    kinds = {COLUMNS[name].kind for name in names}
    for place, text in said:
        if states_factor(text) and not how.scales:
            way = ", or --scale" * how.scalable
            yield f"{place}: found {shortened(text)!r}, expected no factor of the numbers{way}"
        for name in in_text(text):
            found = parsed(name)
            kind = found.kind if found else "length"
            scene = how.units.unit(kind)
            if kind in kinds and not (found and scene and found.size == scene.size):
                expected = f"units in the header, as NAME [{name}], or no such {place.split()[0]}"
                yield f"{place}: found {shortened(text)!r}, expected {expected}"
                break


def states_factor(text: str) -> bool:
    """True for a text that states a factor other than 1, or an offset other than 0."""
    numbers = r"[+-]?[.,]?\d[\d.,]*(?:e[+-]?\d+)?|\b(?:two|ten|hundred|thousand|million)\b"
    found = re.findall(numbers, text, re.I)
    changes = not all(re.fullmatch(r"\+?(1(\.0*)?|0)", number) for number in found)
    text = re.sub(r"\b(x|y|bias|scan)[\s_-]*offsets?\b", "", text, flags=re.I)  # not of heights
    return changes and bool(FACTORS.search(text) or TIMES.search(text))


def shortened(text: str) -> str:
    """The text without control characters, cut after `MOST_SHOWN` characters."""
    text = "".join(each if each.isprintable() else " " for each in text[: MOST_SHOWN + 1])
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}..."
