"""Names of units of length, and what becomes of two of them in one map."""

from __future__ import annotations

from convexrough.checks import nearest
from convexrough.errors import InputError

#: Metres in each unit, by every name it goes by; the first name of a size is the one shown.
METRES = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "µm": 1e-6,  # the micro sign of keyboards
    "nm": 1e-9,
    "Å": 1e-10,
    "pm": 1e-12,
    "μm": 1e-6,  # the Greek letter
    "um": 1e-6,
    "micron": 1e-6,
    "microns": 1e-6,
    "A": 1e-10,
    "Angstrom": 1e-10,
    "in": 0.0254,
}


def known_unit(what: str, name: str) -> str:
    """The unit by the name under which it is shown; "" for none said."""
    name = name.strip()
    if not name:
        return ""
    if name not in METRES:
        expected = f"a unit of length; {nearest(name, METRES)}"
        raise InputError(what, found=repr(name), expected=expected)
    return next(each for each, metres in METRES.items() if metres == METRES[name])


def one_unit(what: str, given: str | None, found: str) -> str:
    """The unit that the caller gives or the file names, "" for neither; never two."""
    said, there = known_unit(what, given or ""), known_unit(what, found)
    if said and there and said != there:
        expected = f"{there}, as the file says, or none given"
        raise InputError(what, found=said, expected=expected)
    return said or there


def factor(unit: str, into: str) -> float:
    """What a number of one unit is multiplied by to be of another."""
    if unit == into:
        return 1.0
    # Of whole powers of ten the quotient is rounded once.
    return METRES[unit] / METRES[into]
