"""Checks of arguments, which raise InputError with the value found and what is expected."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sized
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough.arrays import Array, even, evenly
from convexrough.errors import InputError

#: Smallest and largest absolute value of a number in a scene's units. Within these limits products
#: of a few numbers do not underflow or overflow.
SMALLEST, LARGEST = 1e-60, 1e60

#: The text after "expected" in a message on a number outside these limits.
SIZED = f"a size from {SMALLEST:g} to {LARGEST:g}; choose other units"


class Kind(NamedTuple):
    """A check of a number; an instance is called with a name and a value."""

    expected: str  # description of valid numbers, for error messages
    holds: Callable[[float], bool]  # True for a valid number; called with finite numbers only

    def __call__(self, what: str, value: float | None) -> float:
        """The value of `what` as a float; raises InputError unless it is valid and `is_sized`."""
        number = _number(what, value, self.expected)
        if not (math.isfinite(number) and self.holds(number)):
            raise InputError(what, found=number, expected=self.expected)
        if not is_sized(number):
            raise InputError(what, found=number, expected=SIZED)
        return number


finite = Kind("a finite number", math.isfinite)
positive = Kind("a positive number", lambda number: number > 0)
non_negative = Kind("a number that is not negative", lambda number: number >= 0)
variation = Kind(
    "a standard deviation over the mean, from 0 to 1: not in per cent",
    lambda number: 0 <= number <= 1,
)
#: The limit is a little above pi, because users may give pi rounded up.
phase = Kind(
    "a phase in radians, from -pi to pi; 90 degrees are 1.5708", lambda number: abs(number) < 3.15
)


def is_sized(number: float) -> bool:
    """True for 0, and for numbers with an absolute value from `SMALLEST` to `LARGEST`."""
    return number == 0 or SMALLEST <= abs(number) <= LARGEST


def between(what: str, value: float | None, low: float, high: float) -> float:
    number = _number(what, value, f"a number from {low} to {high}")
    if not low <= number <= high:
        raise InputError(what, found=number, expected=f"a number from {low} to {high}")
    return number


def whole(what: str, value: int, least: int = 1) -> int:
    """The value as an int; raises InputError unless it is a whole number, at least `least`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(what, found=repr(value), expected=f"a whole number, at least {least}")
    return int(value)


def numbers(what: str, values: ArrayLike, expected: str = "numbers") -> Array:
    """A float64 copy, of any shape, that stores one number if `arrays.even` made the original;
    raises InputError unless all values are real numbers."""
    if isinstance(values, np.ma.MaskedArray) and values.mask.any():
        found = f"{values.mask.sum()} masked values"
        raise InputError(what, found=found, expected=f"{expected} without gaps")
    try:
        given = np.asarray(values)
        if given.dtype.kind not in "biufO":
            raise TypeError("no real numbers")
        return evenly(lambda some: np.array(some, dtype=np.float64), given)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(what, found=shown(values), expected=expected) from error


def array(
    what: str,
    values: ArrayLike,
    *,
    length: int | None = None,
    sign: str = "",
    smallest: float = 0.0,
    one: str = "asperity",
) -> Array:
    """A read-only copy of a vector; raises InputError for values that are not valid or finite.

    length : required number of values; a single number stands for this many equal values
    sign : required sign: "" (any), "positive" or "not negative"
    smallest : smallest allowed absolute value of values other than 0
    one  : noun for messages such as "one per asperity"

    A pandas object whose index `is_permuted` is refused.
    """
    in_order(what, values)
    vector = numbers(what, values)
    if vector.ndim == 0 and length is not None:
        vector = even(float(vector), length)
    if vector.ndim != 1 or (length is not None and vector.size != length):
        count = "a list of numbers" if length is None else f"{length} values, one per {one}"
        raise InputError(what, found=f"shape {np.shape(values)}", expected=count)
    each = vector[:1] if vector.strides == (0,) else vector
    good = np.abs(each) <= LARGEST  # False for nan
    if sign == "positive":
        good &= each > 0
    elif sign == "not negative":
        good &= each >= 0
    if not good.all():
        first = int(np.argmin(good))
        kind = {"": "a finite number", "positive": "a positive, finite number"}
        huge = f", at most {LARGEST:g}" if LARGEST < abs(vector[first]) < np.inf else ""
        expected = kind.get(sign, "a finite number that is not negative") + huge
        raise InputError(f"{what}[{first}]", found=vector[first], expected=expected)
    if not (good := (each == 0) | (np.abs(each) >= smallest)).all():
        first = int(np.argmin(good))
        raise InputError(f"{what}[{first}]", found=vector[first], expected=SIZED)
    vector.flags.writeable = False
    return vector


def same_index(**given: Any) -> None:
    """Raise InputError if pandas objects have different indices."""
    frames = {name: each for name, each in given.items() if hasattr(each, "iloc")}
    for name, each in frames.items():
        first, other = next(iter(frames.items()))
        if not each.index.equals(other.index):
            expected = f"that of {first}: the same rows in the same order"
            raise InputError(name, found="another index", expected=expected)


def is_permuted(index: NDArray[Any]) -> bool:
    """True if an index has the numbers 0, 1, ... or 1, 2, ... in another order."""
    if index.dtype.kind not in "iuf" or len(index) < 2:
        return False
    ordered = np.sort(index)
    counts = ordered[0] in (0, 1) and (np.diff(ordered) == 1).all()
    return bool(counts and (ordered != index).any())


def in_order(what: str, values: Any) -> None:
    """Raise InputError for a pandas object with an index that `is_permuted`."""
    if hasattr(values, "iloc") and is_permuted(np.asarray(values.index)):
        expected = "increasing order: use .sort_index(), or .to_numpy() if rows are in order"
        raise InputError(what, found="an index in another order", expected=expected)


def some(what: str, values: Sized) -> None:
    """Raise InputError for an empty list."""
    if len(values) == 0:
        raise InputError(what, found="none", expected="at least one")


def friction(coefficient: float | None) -> float:
    """The coefficient of friction f; raises InputError if the scene has none."""
    if coefficient is None:
        expected = "a coefficient of friction, as shear needs one"
        raise InputError("friction", found="none", expected=expected)
    return coefficient


def bearable(what: str, forces: ArrayLike, limit: float | Array) -> Array:
    """The shear forces Q as an array; raises InputError unless |Q| is at most the limit f P."""
    given = numbers(what, forces)
    limits = np.broadcast_to(limit, given.shape)
    good = np.abs(given) <= limits * (1 + 1e-15)  # False for nan
    if not good.all():
        place = np.unravel_index(int(np.argmin(good)), given.shape)
        name = f"{what}[{', '.join(map(str, place))}]" if place else what
        worst, limit = float(given[place]), float(limits[place])
        found = f"{worst!r}"
        if math.isfinite(worst) and limit > 0:
            times = abs(worst) / limit
            found += f" ({times:.4g} f P" if times > 1.001 else f" ((1 + {times - 1:.1g}) f P"
            found += ": gross sliding)"
        raise InputError(name, found=found, expected=f"at most f P = {limit!r} in size")
    return given


def instance(what: str, value: object, kind: type) -> None:
    """Raise InputError unless the value is an object of this class."""
    if not isinstance(value, kind):
        found = f"type {type(value).__name__}"
        if isinstance(value, type):
            found = f"the class {value.__name__}"
        name = kind.__name__  # "Asperities" has no article
        article = "" if name.endswith("s") else "an " if name[0] in "AEIOU" else "a "
        raise InputError(what, found=found, expected=article + name)


def shown(value: object) -> str:
    """A value for one line of an error message: its text, shortened, or its type."""
    if isinstance(value, np.ndarray) and value.ndim:
        return f"an array of {value.dtype.name}"
    text = repr(value)
    if "\n" in text:
        return f"type {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


def path(what: str, value: object, expected: str) -> Path:
    """A path. Raises InputError for a value of another kind."""
    if not isinstance(value, (str, os.PathLike)):
        raise InputError(what, found=shown(value), expected=expected)
    return Path(value)


def sequence(what: str, values: object, expected: str) -> None:
    """Raise InputError for text, and for values that are not iterable."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise InputError(what, found=shown(values), expected=expected)


def exactly_one(first: str, a: Any, second: str, b: Any) -> tuple[str, Any]:
    """The name and the value of the one that is not None; raises InputError for none or both."""
    if (a is None) == (b is None):
        found = "neither" if a is None else "both"
        raise InputError(f"{first}, {second}", found=found, expected="exactly one of the two")
    return (first, a) if b is None else (second, b)


def fits_in_memory(
    what: str, count: float, bytes_each: float, power: int = 1, noun: str = "asperities"
) -> None:
    """Raise InputError if bytes_each * count^power exceeds the memory available."""
    count = float(count)
    needed = bytes_each * count**power
    if needed < 2**26:
        return
    import psutil  # imported only when an array may be large

    available = psutil.virtual_memory().available
    if needed > available:
        most = int((available / bytes_each) ** (1.0 / power))
        raise InputError(
            what,
            found=f"{count:.3g} {noun} ({needed / 2**30:.3g} GiB)",
            expected=f"at most {most:,} for the {available / 2**30:.3g} GiB of memory available",
        )


def nearest(name: str, valid: Iterable[str]) -> str:
    """A suggestion for an unknown name: the most similar valid name, or all if none is similar."""
    import difflib  # only when something is misspelt

    names = {each.lower(): each for each in valid}
    if near := difflib.get_close_matches(name.lower(), names, n=1):
        return f'did you mean "{names[near[0]]}"?'
    return f"valid: {', '.join(names.values())}"


def _number(what: str, value: float | None, expected: str) -> float:
    refused = bool, np.bool_, str, bytes, np.complexfloating  # which float() accepts
    if value is None or isinstance(value, refused):
        raise InputError(what, found=repr(value), expected=expected)
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(what, found=shown(value), expected=expected) from error
