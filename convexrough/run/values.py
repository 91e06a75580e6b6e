"""Types of the values in a scene file, and messages for all mistakes at once. Only modules that
define tables import this one, because pydantic takes 0.1 s to import."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Self

import pydantic
from pydantic import Discriminator, Field, Tag, ValidationError
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from convexrough import checks
from convexrough.checks import SIZED, is_sized, nearest

#: Keys that a user may have written, each with the key that the message suggests.
MEANT = {"E": "youngs_modulus", "E*": "contact_modulus", "Estar": "contact_modulus"}
MEANT |= {"nu": "poisson_ratio", "R": "radius", "rho": "tip_radius", "f": "coefficient"}
MEANT |= {"mu": "coefficient", "P": "load", "D": "approach"}
MEANT |= {"maximum": "maximum_fraction", "minimum": "minimum_fraction"}  # names in Python

#: A mistake: the key and the message.
Mistake = tuple[str, str]


def expected(
    phrase: str, holds: Callable[[Any], bool] = lambda value: True
) -> pydantic.WrapValidator:
    """A validator that also requires `holds`; messages end with "expected" and the phrase."""

    def check(value: Any, validated: pydantic.ValidatorFunctionWrapHandler) -> Any:
        try:
            if holds(result := validated(value)):
                return result
        except ValidationError as error:
            if error.errors()[0]["type"] == "expected":  # keep an inner message
                raise
        raise PydanticCustomError("expected", "{phrase}", {"phrase": phrase})

    return pydantic.WrapValidator(check)


def one_of(names: Collection[str]) -> pydantic.WrapValidator:
    return expected(f"one of: {', '.join(names)}", names.__contains__)


#: The type of a value in the file, "(list)" or "(number)"; messages omit tags in brackets.
_EITHER = Discriminator(lambda it: "(list)" if isinstance(it, list) else "(number)")
_ONE, _LIST = Tag("(number)"), Tag("(list)")

_SIZED = expected(SIZED, is_sized)

Finite = Annotated[float, expected(*checks.finite), _SIZED]
Positive = Annotated[float, expected(*checks.positive), _SIZED]
NonNegative = Annotated[float, expected(*checks.non_negative), _SIZED]
Ratio = Annotated[float, expected("a number from 0 to 0.5", lambda value: 0 <= value <= 0.5)]
Variation = Annotated[float, expected(*checks.variation)]
Share = Annotated[float, expected("a number from 0 to 1", lambda value: 0 <= value <= 1)]
Fraction = Annotated[float, expected("a number from -1 to 1", lambda value: -1 <= value <= 1)]
Phase = Annotated[float, expected(*checks.phase)]
#: A single number in the file stands for a list of this number.
ALSO_ONE = pydantic.BeforeValidator(lambda it: [it] if isinstance(it, (int, float)) else it)
Shares = Annotated[list[Share], expected("a list of numbers from 0 to 1", bool), ALSO_ONE]
Fractions = Annotated[list[Fraction], expected("a list of numbers from -1 to 1", bool), ALSO_ONE]
Whole = Annotated[
    int, expected("a whole number that is not negative", lambda value: 0 <= value < 2**63)
]
Text = Annotated[str, expected("text in quotes", bool)]
Switch = Annotated[bool, expected("true or false")]
TipRadius = Annotated[Annotated[Positive, _ONE] | Annotated[list[Positive], _LIST], _EITHER]
_Length = Annotated[
    float,
    Field(allow_inf_nan=True),
    expected("a positive number, or inf where it is flat", lambda value: value > 0),
    expected(SIZED, lambda value: value == math.inf or is_sized(value)),
]
_Two = expected("two radii, along x and along y", lambda value: len(value) == 2)
Radius = Annotated[Annotated[_Length, _ONE] | Annotated[list[_Length], _Two, _LIST], _EITHER]
NUMBER_OR_PAIR = 'a finite number, or with kind = "vector" a pair [x, y] of finite numbers'
_Pair = Annotated[list[Finite], expected(NUMBER_OR_PAIR, lambda value: len(value) == 2)]
Force = Annotated[Annotated[Finite, _ONE] | Annotated[_Pair, _LIST], _EITHER]


class FileTable(pydantic.BaseModel):
    """A table of a file. Infinite numbers, texts in place of numbers, unknown keys are mistakes."""

    model_config = pydantic.ConfigDict(
        extra="ignore", strict=True, allow_inf_nan=False, frozen=True
    )

    alternatives: ClassVar[tuple[str, ...]] = ()  # keys of which exactly one is given
    needs: ClassVar[Mapping[str, str]] = {}  # for each key, one required with it
    elsewhere: ClassVar[tuple[str, frozenset[str]]] = ("", frozenset())  # name, keys unused with it

    @pydantic.model_validator(mode="wrap")
    @classmethod
    def _all_mistakes(cls, keys: Any, validated: pydantic.ModelWrapValidatorHandler[Self]) -> Self:
        """The checked table. Raises ValidationError with all mistakes in values and in keys."""

        def told(key: str, said: str) -> InitErrorDetails:
            return _detail("told", said, (key,), keys)

        if not isinstance(keys, dict):
            raise PydanticCustomError("expected", "a table")
        found: list[InitErrorDetails] = []
        try:
            table = validated(keys)
        except ValidationError as error:
            for each in error.errors():
                kind = each["type"] if each["type"] in ("told", "missing") else "expected"
                said = each["msg"].removeprefix("Input should be ")
                said = "a table" if each["type"] == "model_type" else said
                found.append(_detail(kind, said, each["loc"], each["input"]))
        found += [told(*each) for each in cls.mistakes_between(keys)]
        if found := found or [told(*each) for each in table.mistakes_within()]:
            raise ValidationError.from_exception_data(cls.__name__, found)
        return table

    @classmethod
    def mistakes_between(cls, keys: Mapping[str, Any]) -> Iterator[Mistake]:
        """Mistakes in the set of given keys: unknown, missing or excluded keys."""
        stage, others = cls.elsewhere
        for key in keys:
            if key in cls.model_fields:
                continue
            meant = f'did you mean "{MEANT[key]}"?' if MEANT.get(key) in cls.model_fields else ""
            unknown = f"unknown key, {meant or nearest(key, cls.model_fields)}"
            yield key, f"not used with {stage}" if key in others else unknown
        if cls.alternatives:
            given = [key for key in cls.alternatives if key in keys]
            if len(given) != 1:
                found = "both" if given else "neither"
                either = ", ".join(cls.alternatives)
                yield either, f"found {found}, expected exactly one of the two"
        for key, needed in cls.needs.items():
            if key in keys and needed not in keys:
                yield needed, f"missing, needed with {key}"

    def mistakes_within(self) -> Iterator[Mistake]:
        """Mistakes between values, each of which is valid alone."""
        yield from ()


def _detail(kind: str, said: Any, place: tuple[str | int, ...], found: Any) -> InitErrorDetails:
    """A mistake in the form that pydantic needs to raise several mistakes at once."""
    error = PydanticCustomError(kind, "{said}", {"said": said})
    return InitErrorDetails(type=error, loc=place, input=found)


def phrased(error: ErrorDetails) -> str:
    """The message of a mistake: where it is, what was found, and what is expected."""
    table, *inner = (each for each in error["loc"] if not str(each).startswith("("))
    place = "".join(f"[{each}]" if isinstance(each, int) else f".{each}" for each in inner)
    where = f"[{table}] {place.removeprefix('.')}".rstrip()
    if error["type"] == "missing":
        return f"{where}: missing"
    if error["type"] == "told":
        return f"{where}: {error['msg']}"
    found = error["input"]
    said = str(found).lower() if isinstance(found, bool) else checks.shown(found)  # as in TOML
    return f"{where}: found {said}, expected {error['msg']}"
