"""Units by name, with dimensions and exact sizes in SI units."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import NamedTuple

from convexrough.checks import nearest
from convexrough.errors import InputError


class Unit(NamedTuple):
    """A unit: its size in SI units, its powers of length and force, and its name in messages."""

    size: Fraction
    length: int
    force: int
    name: str = ""

    @property
    def kind(self) -> str:
        """The quantity that the unit measures, such as "length"; "" if it is not in `KINDS`."""
        return KINDS.get((self.length, self.force), "")

    def __mul__(self, other: Unit) -> Unit:  # type: ignore[override]
        return Unit(self.size * other.size, self.length + other.length, self.force + other.force)

    def __pow__(self, power: int) -> Unit:
        return Unit(self.size**power, power * self.length, power * self.force)

    def into(self, other: Unit) -> float:
        """The size of this unit in the other unit, such as 0.001 from µm into mm, rounded once."""
        return float(self.size / other.size)


KINDS = {(1, 0): "length", (2, 0): "area", (0, 1): "force", (-2, 1): "pressure"}

_PREFIXES = {"G": 9, "M": 6, "k": 3, "": 0, "c": -2, "m": -3, "µ": -6, "n": -9, "p": -12}
PSI = Fraction("4.4482216152605") / Fraction("0.0254") ** 2  # lbf / in^2
_ONE = Unit(Fraction(1), 0, 0)

#: Units by name: those with prefixes, then the others.
UNITS = {
    f"{prefix}{symbol}": Unit(Fraction(10) ** power, *powers, f"{prefix}{symbol}")
    for symbol, powers in (("m", (1, 0)), ("N", (0, 1)), ("Pa", (-2, 1)))
    for prefix, power in _PREFIXES.items()
} | {
    name: Unit(Fraction(size), *powers, name)
    for name, size, powers in (
        *(("Å", "1e-10", (1, 0)), ("in", "0.0254", (1, 0)), ("mil", "2.54e-5", (1, 0))),
        ("dyn", "1e-5", (0, 1)),
        *(("kgf", "9.80665", (0, 1)), ("lbf", "4.4482216152605", (0, 1))),
        *(("bar", "1e5", (-2, 1)), ("psi", PSI, (-2, 1))),
    )
}

#: Other names of units, words in lower case. In addition, a leading u is read as µ.
_ALSO = {"A": "Å", "angstrom": "Å", "micron": "µm", "microns": "µm", "kp": "kgf", "inch": "in",
         "inches": "in", "mils": "mil", "thou": "mil"}  # fmt: skip
_LONG = {"pico": "p", "nano": "n", "micro": "µ", "mikro": "µ", "milli": "m", "centi": "c",
         "zenti": "c", "": ""}  # fmt: skip
_ALSO |= {f"{long}met{end}": f"{short}m" for long, short in _LONG.items()
          for end in ("er", "re", "ers", "res", "ern")}  # fmt: skip
_FACTOR = re.compile(r"(.*?)(?:\^|\*\*)?([+-]?\d)?")
_POWERS = str.maketrans("⁻¹²³μ−", "-123µ-")

#: The name of a column with its unit, which has at most LONGEST_NAME characters.
LONGEST_NAME = 400
_WITH_UNIT = re.compile(
    r"(?P<name>.*?)(?:\s*[\[(](?P<unit>[^\])]*)[\])]|\s+/\s*(?P<per>\S+)|/(?P<tight>\S+))"
)
_LOOSE = re.compile(r"(.*?[^\W_])(?:[\s_]+in[\s_]+|[\s_.]+)([^\s_./]{2,})")

#: Units that after a name and a space, a point or "_" are not read as units.
AMBIGUOUS = ("in", "bar", "pm")


def parsed(name: str) -> Unit | None:
    """The unit with a name such as µm, N/mm² or kPa; None if unknown."""
    if len(name) > 40:
        return None
    upper, *under = name.strip().translate(_POWERS).split("/")
    found = _ONE
    for part, sign in [(upper, 1), *((each, -1) for each in under)]:
        for factor in re.split(r"\s+|·|\*(?!\*)", part.replace("**", "^").strip()):
            symbol, power = _FACTOR.fullmatch(factor).groups()  # type: ignore[union-attr]
            symbol = _ALSO.get(symbol) or _ALSO.get(symbol.lower(), symbol)
            symbol = re.sub("^u", "µ", symbol)  # no symbol begins with u
            if symbol not in UNITS:
                return None
            found *= UNITS[symbol] ** (sign * int(power or 1))
            shown = symbol
    return found._replace(name=shown if name.strip().isalpha() else name.strip())


def bare(name: str) -> str:
    """The name of a column without its unit."""
    return _apart(name)[0]


def unit(name: str) -> str:
    """The unit in the name of a column, as in "x [µm]", "x / m" or "x_mm"; "" if there is none."""
    return _apart(name)[1]


def in_unit(name: str, unit: str) -> str:
    """The name of a column with its unit, if it has one."""
    return f"{name} [{unit}]" if unit else name


def _apart(name: str) -> tuple[str, str]:
    found = _WITH_UNIT.fullmatch(name) if len(name) <= LONGEST_NAME else None
    if not found or (found["tight"] and not parsed(found["tight"])):  # as for p/p0
        loose = _LOOSE.fullmatch(name) if len(name) <= LONGEST_NAME else None
        if loose and loose[2] not in AMBIGUOUS and parsed(loose[2]):
            return loose[1], loose[2]
        return name, ""
    return found["name"], (found["unit"] or found["per"] or found["tight"] or "").strip()


def known_unit(what: str, name: str, kind: str = "length") -> Unit | None:
    """The unit `name`; None for "". Raises InputError about `what` if it is no unit of `kind`."""
    if not isinstance(name, str):
        raise InputError(what, found=repr(name), expected='a name, as "mm"')
    if not name.strip():
        return None
    expected, unit = f"a unit of {kind}", parsed(name)
    if unit is None:
        near = nearest(name, [each for each, unit in UNITS.items() if unit.kind == kind])
        raise InputError(what, found=repr(name), expected=f"{expected}; {near}")
    if unit.kind != kind:
        measures = f", a unit of {unit.kind}" if unit.kind else ""
        raise InputError(what, found=f"{name}{measures}", expected=expected)
    return unit


def one_unit(what: str, given: str | None, found: str) -> Unit | None:
    """The unit of length that the caller or the file names. Raises InputError if they differ."""
    said, there = known_unit(what, given or ""), known_unit(what, found)
    if said and there and said.size != there.size:
        expected = f"{there.name}, as the file says, or none given"
        raise InputError(what, found=said.name, expected=expected)
    return said or there


class UnitNames(NamedTuple):
    """Names of a scene's units of length and force; "" for units that are not named."""

    length: str = ""
    force: str = ""

    @classmethod
    def of(cls, names: object) -> UnitNames:
        """The `UnitNames` of a pair of names. Raises InputError for anything else."""
        if not isinstance(names, tuple) or len(names) != 2:
            raise InputError("units", found=repr(names), expected='two names, as ("mm", "N")')
        for kind, name in zip(cls._fields, names, strict=True):
            known_unit(f"units, {kind}", name, kind)
        return cls(*(name.strip() for name in names))

    def __str__(self) -> str:
        return ", ".join(filter(None, self))

    def unit(self, kind: str) -> Unit | None:
        """The scene's unit of "length", "force", "area" or "pressure"; None if it is not named."""
        return parsed(self.name(kind))

    def name(self, kind: str) -> str:
        """The name of the unit of "length", "force", "area", "pressure", "work" or "stiffness"; ""
        for other kinds, and unless the scene names the units of which it consists."""
        length, force = self
        known = {"length": length, "force": force, "area": length and f"{length}²"}
        if length and force:
            known["pressure"] = f"{force}/{length}²"
            known |= {"work": f"{force} {length}", "stiffness": f"{force}/{length}"}
        return known.get(kind, "")


NAMELESS = UnitNames()


def force_of(pressure: Unit, length: Unit) -> str:
    """The name of the unit pressure * length^2, such as mN for GPa and µm; "" if none is known."""
    made = pressure * length**2
    return next((name for name, unit in UNITS.items() if unit[:3] == made[:3]), "")
