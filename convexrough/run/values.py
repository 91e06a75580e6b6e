"""What a value in a table of a scene file may be, and what is said of one that may not.

Only this module and `schema` know pydantic, which takes 0.1 s to import.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)
from pydantic_core import PydanticCustomError

from convexrough.checks import SIZED, is_sized
from convexrough.influence import KINDS
from convexrough.run.sensitivity import BY, NUMBERS
from convexrough.solvers import SOLVERS


def expected(phrase: str, holds: Callable[[Any], bool] = lambda value: True) -> WrapValidator:
    """What a message says after "expected", of a wrong type or where `holds` is false."""

    def check(value: Any, validated: ValidatorFunctionWrapHandler) -> Any:
        try:
            if holds(result := validated(value)):
                return result
        except ValidationError as error:
            if error.errors()[0]["type"] == "expected":  # said already, inside
                raise
        raise PydanticCustomError("expected", "{phrase}", {"phrase": phrase})

    return WrapValidator(check)


_SIZED = expected(SIZED, is_sized)

Finite = Annotated[float, expected("a finite number"), _SIZED]
Positive = Annotated[float, expected("a positive number", lambda value: value > 0), _SIZED]
NonNegative = Annotated[
    float, expected("a number that is not negative", lambda value: value >= 0), _SIZED
]
Ratio = Annotated[float, expected("a number from 0 to 0.5", lambda value: 0 <= value <= 0.5)]
Share = Annotated[float, expected("a number from 0 to 1", lambda value: 0 <= value <= 1)]
Fraction = Annotated[float, expected("a number from -1 to 1", lambda value: -1 <= value <= 1)]
Shares = Annotated[list[Share], expected("a list of numbers from 0 to 1", bool)]
Fractions = Annotated[list[Fraction], expected("a list of numbers from -1 to 1", bool)]
TipRadius = Annotated[
    Annotated[Positive, Tag("number")] | Annotated[list[Positive], Tag("list")],
    Discriminator(lambda value: "list" if isinstance(value, list) else "number"),
]
_Length = Annotated[
    float,
    Field(allow_inf_nan=True),
    expected("a positive number, or inf where it is flat", lambda value: value > 0),
    expected(SIZED, lambda value: value == math.inf or is_sized(value)),
]
_TwoLengths = Annotated[
    list[_Length], expected("two radii, along x and along y", lambda value: len(value) == 2)
]
Radius = Annotated[
    Annotated[_Length, Tag("number")] | Annotated[_TwoLengths, Tag("list")],
    Discriminator(lambda value: "list" if isinstance(value, list) else "number"),
]
Seed = Annotated[int, expected("a whole number that is not negative", lambda value: value >= 0)]
Points = Annotated[int, expected("a whole number, at least 4", lambda value: value >= 4)]
Chosen = Annotated[
    Literal["all"] | list[Seed], expected('"all" or a list of indices of asperities, from 0')
]
Text = Annotated[str, expected("text in quotes", bool)]
Switch = Annotated[bool, expected("true or false")]
Pattern = Annotated[Literal["hexagonal", "square"], expected('"hexagonal", "square" or "file"')]
Geometry = Annotated[Literal["summit", "closest"], expected('"summit" or "closest"')]
InfluenceName = Annotated[str, expected(f"one of: {', '.join(KINDS)}", KINDS.__contains__)]
SolverName = Annotated[str, expected(f"one of: {', '.join(SOLVERS)}", SOLVERS.__contains__)]
ShakedownKind = Annotated[
    Literal["exact", "elastic", "vector"], expected('"exact", "elastic" or "vector"')
]
Pair = Annotated[
    list[Finite], expected("a pair [x, y] of finite numbers", lambda value: len(value) == 2)
]
Force = Annotated[
    Annotated[Finite, Tag("number")] | Annotated[Pair, Tag("list")],
    Discriminator(lambda value: "list" if isinstance(value, list) else "number"),
]
Number = Annotated[str, expected(f"one of: {', '.join(NUMBERS)}", NUMBERS.__contains__)]
By = Annotated[
    list[str],
    expected(f"a list of some of: {', '.join(BY)}", lambda it: bool(it) and {*it} <= {*BY}),
]
Control = Annotated[Literal["load", "approach"], expected('"load" or "approach"')]


class Table(BaseModel):
    """A table: numbers are finite, no text or truth value stands for one, no other keys."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    alternatives: ClassVar[tuple[str, str] | None] = None  # keys of which exactly one is given
    needs: ClassVar[dict[str, str]] = {}  # the key on the left is only used with that on the right

    @classmethod
    def mistakes_between(cls, keys: dict[str, Any]) -> Iterator[str]:
        """Mistakes in which keys are given together, whatever their values."""
        if cls.alternatives:
            given = [key for key in cls.alternatives if key in keys]
            if len(given) != 1:
                found = "both" if given else "neither"
                both = ", ".join(cls.alternatives)
                yield f"{both}: found {found}, expected exactly one of the two"
        for key, needed in cls.needs.items():
            if key in keys and needed not in keys:
                yield f"{needed}: missing, needed with {key}"

    def mistakes_within(self) -> Iterator[str]:
        """Mistakes that only show between values each right by itself."""
        yield from ()
