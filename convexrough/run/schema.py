"""The tables of a scene file: what each key may hold, and every mistake in words.

Only this module knows pydantic, which takes 0.1 s to import: `read_scene` imports it when a file is
read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Tag,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from convexrough.checks import SIZED, is_sized, nearest
from convexrough.influence import KINDS
from convexrough.run.sensitivity import BY, NUMBERS
from convexrough.solvers import SOLVERS


def _expected(phrase: str, holds: Callable[[Any], bool] = lambda value: True) -> WrapValidator:
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


_SIZED = _expected(SIZED, is_sized)

Finite = Annotated[float, _expected("a finite number"), _SIZED]
Positive = Annotated[float, _expected("a positive number", lambda value: value > 0), _SIZED]
NonNegative = Annotated[
    float, _expected("a number that is not negative", lambda value: value >= 0), _SIZED
]
Ratio = Annotated[float, _expected("a number from 0 to 0.5", lambda value: 0 <= value <= 0.5)]
Share = Annotated[float, _expected("a number from 0 to 1", lambda value: 0 <= value <= 1)]
Fraction = Annotated[float, _expected("a number from -1 to 1", lambda value: -1 <= value <= 1)]
Shares = Annotated[list[Share], _expected("a list of numbers from 0 to 1", bool)]
Fractions = Annotated[list[Fraction], _expected("a list of numbers from -1 to 1", bool)]
TipRadius = Annotated[
    Annotated[Positive, Tag("number")] | Annotated[list[Positive], Tag("list")],
    Discriminator(lambda value: "list" if isinstance(value, list) else "number"),
]
Seed = Annotated[int, _expected("a whole number that is not negative", lambda value: value >= 0)]
Points = Annotated[int, _expected("a whole number, at least 4", lambda value: value >= 4)]
Chosen = Annotated[
    Literal["all"] | list[Seed], _expected('"all" or a list of indices of asperities, from 0')
]
Text = Annotated[str, _expected("text in quotes", bool)]
Pattern = Annotated[Literal["hexagonal", "square"], _expected('"hexagonal", "square" or "file"')]
Geometry = Annotated[Literal["summit", "closest"], _expected('"summit" or "closest"')]
InfluenceName = Annotated[str, _expected(f"one of: {', '.join(KINDS)}", KINDS.__contains__)]
SolverName = Annotated[str, _expected(f"one of: {', '.join(SOLVERS)}", SOLVERS.__contains__)]


ShakedownKind = Annotated[
    Literal["exact", "elastic", "vector"], _expected('"exact", "elastic" or "vector"')
]
Pair = Annotated[
    list[Finite], _expected("a pair [x, y] of finite numbers", lambda value: len(value) == 2)
]
Force = Annotated[
    Annotated[Finite, Tag("number")] | Annotated[Pair, Tag("list")],
    Discriminator(lambda value: "list" if isinstance(value, list) else "number"),
]


Number = Annotated[str, _expected(f"one of: {', '.join(NUMBERS)}", NUMBERS.__contains__)]
By = Annotated[
    list[str], _expected(f"a list of some of: {', '.join(BY)}", lambda it: set(it) <= {*BY})
]
Control = Annotated[Literal["load", "approach"], _expected('"load" or "approach"')]


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


class Sphere(Table):
    radius: Positive


class Material(Table):
    alternatives = ("contact_modulus", "youngs_modulus")
    contact_modulus: Positive | None = None
    youngs_modulus: Positive | None = None
    poisson_ratio: Ratio
    hardness: Positive | None = None


class Lattice(Table):
    needs: ClassVar = {"height_std": "seed", "tip_radius_cv": "seed"}
    pattern: Pattern
    spacing: Positive
    tip_radius: TipRadius
    within: NonNegative | None = None
    height_std: NonNegative = 0.0
    tip_radius_cv: NonNegative = 0.0
    seed: Seed | None = None
    geometry: Geometry = "summit"


class Summits(Table):
    pattern: Literal["file"]
    path: Text
    tip_radius: TipRadius | None = None
    geometry: Geometry = "summit"


class Normal(Table):
    alternatives = ("approach", "load")
    approach: Finite | None = None
    load: Positive | None = None


class Friction(Table):
    coefficient: Positive


class Shear(Table):
    fractions: Shares


class Cycle(Table):
    maximum: Fractions
    minimum: Fractions | None = None
    loop_points: Points | None = None
    loop_asperities: Chosen | None = None

    @property
    def lowest(self) -> list[float]:
        """The minimum of each cycle: the negative of its maximum unless given."""
        return [-value for value in self.maximum] if self.minimum is None else self.minimum

    def mistakes_within(self) -> Iterator[str]:
        if (n := len(self.lowest)) != len(self.maximum):
            yield f"minimum: found {n} values, expected {len(self.maximum)}, as in maximum"
            return
        for i, (low, high) in enumerate(zip(self.lowest, self.maximum, strict=True)):
            if not low < high:
                yield f"maximum[{i}]: found {high}, expected a number above its minimum, {low}"


class History(Table):
    fractions: Fractions


class Ellipse(Table):
    load: Positive
    load_amplitude: Finite = 0.0
    force: Finite = 0.0
    force_amplitude: Finite
    phase: Finite = 0.0
    chords: Annotated[int, _expected("a whole number, at least 6", lambda value: value >= 6)] = 96


class Path(Table):
    loads: list[NonNegative] | None = None
    forces: list[Finite] | None = None
    ellipse: Ellipse | None = None
    reference: Positive = 1.0

    def mistakes_within(self) -> Iterator[str]:
        points = (self.loads, self.forces)
        if self.ellipse is not None:
            if points != (None, None):
                yield "ellipse: found beside loads or forces, expected one of the two ways"
        elif None in points:
            yield "loads, forces: missing, both are needed where there is no ellipse"
        elif len(points[0] or ()) != len(points[1] or ()) or not points[0]:
            found = f"{len(points[0] or ())} and {len(points[1] or ())} values"
            yield f"loads, forces: found {found}, expected as many of both, at least one"


class Steady(Path):
    needs: ClassVar = {"phases": "ellipse", "factors": "phases"}
    phases: Annotated[list[Finite], _expected("a list of finite numbers", bool)] | None = None
    factors: Annotated[list[Positive], _expected("a list of positive numbers", bool)] = [1.0]


class Shakedown(Table):
    loads: Positive
    forces: Force = 0.0
    load_amplitudes: list[Finite] | None = None
    force_amplitudes: list[Force]
    kind: ShakedownKind = "exact"
    reference: Positive = 1.0

    def mistakes_within(self) -> Iterator[str]:
        if self.load_amplitudes and len(self.load_amplitudes) != len(self.force_amplitudes):
            found = len(self.load_amplitudes)
            yield f"load_amplitudes: found {found} values, expected {len(self.force_amplitudes)}"
        pairs = self.kind == "vector"
        expected = 'a pair [x, y] with kind = "vector"' if pairs else "a number with this kind"
        if isinstance(self.forces, list) != pairs and self.forces != 0.0:
            yield f"forces: found {self.forces}, expected {expected}"
        for i, force in enumerate(self.force_amplitudes):
            if isinstance(force, list) != pairs:
                yield f"force_amplitudes[{i}]: found {force}, expected {expected}"


class Gradient(Table):
    of: Number
    fraction: Share | None = None
    by: By = list(BY)  # pydantic makes a copy of it
    holding: Control | None = None

    def mistakes_within(self) -> Iterator[str]:
        sheared = self.of in ("loss", "displacement")
        if sheared and self.fraction is None:
            yield f"fraction: missing, needed with the {self.of}"
        if not sheared and self.fraction is not None:
            yield f"fraction: found {self.fraction}, expected none with the {self.of}"


class Solver(Table):
    name: SolverName = "newton"
    influence: InfluenceName | None = None


class Units(Table):
    length: Text = ""
    force: Text = ""


@dataclass(frozen=True)
class Document:
    """The tables of one file, each right by itself and beside the others."""

    sphere: Sphere
    material: Material
    asperities: Lattice | Summits
    normal: Normal
    friction: Friction | None = None
    shear: Shear | None = None
    cycle: Cycle | None = None
    history: History | None = None
    path: Path | None = None
    steady: Steady | None = None
    shakedown: Shakedown | None = None
    gradient: Gradient | None = None
    solver: Solver = field(default_factory=Solver)
    units: Units = field(default_factory=Units)


_TABLES: dict[str, tuple[type[Table], ...]] = {
    "sphere": (Sphere,),
    "material": (Material,),
    "asperities": (Lattice, Summits),
    "normal": (Normal,),
    "friction": (Friction,),
    "shear": (Shear,),
    "cycle": (Cycle,),
    "history": (History,),
    "path": (Path,),
    "steady": (Steady,),
    "shakedown": (Shakedown,),
    "gradient": (Gradient,),
    "solver": (Solver,),
    "units": (Units,),
}
_REQUIRED = ("sphere", "material", "asperities", "normal")
_FRICTIONAL = ("shear", "cycle", "history", "path", "steady", "shakedown")


def validate(contents: dict[str, Any]) -> tuple[Document | None, list[str]]:
    """The tables of a parsed file, or None and everything that is wrong, one line each."""
    tables: dict[str, Any] = {}
    mistakes = []
    for name, keys in contents.items():
        if name == "sweep":
            mistakes.append("[sweep]: many scenes, which `convexrough sweep` computes")
        elif name not in _TABLES:
            what = f"[{name}]: unknown table" if isinstance(keys, dict) else f"{name}: in no table"
            mistakes.append(f"{what}, {nearest(name, _TABLES)}")
        elif not isinstance(keys, dict):
            mistakes.append(f"[{name}]: found {_shown(keys)}, expected a table")
        else:
            table, found = validate_table(name, keys, _TABLES[name])
            tables[name] = table
            mistakes += [f"[{name}] {mistake}" for mistake in found]
    for name in _REQUIRED:
        if name not in contents:
            keys = ", ".join(key for key in _TABLES[name][0].model_fields)
            mistakes.append(f"[{name}]: missing table, its keys are: {keys}")
    if "friction" not in contents and (given := [name for name in _FRICTIONAL if name in contents]):
        mistakes.append(f"[friction]: missing table, needed with [{given[0]}]")
    mistakes += _unbounded(tables)
    asked = tables.get("gradient")
    if "friction" not in contents and asked is not None and asked.fraction is not None:
        mistakes.append(f"[friction]: missing table, needed with the {asked.of} of [gradient]")
    return (None if mistakes else Document(**tables)), mistakes


def validate_table(
    name: str, keys: dict[str, Any], models: tuple[type[Table], ...]
) -> tuple[Table | None, list[str]]:
    """One table, or None and what is wrong in it; the last of the models is that of files."""
    model = models[-1] if keys.get("pattern") == "file" else models[0]
    mistakes = list(model.mistakes_between(keys))
    try:
        table = model.model_validate(keys)
    except ValidationError as error:
        return None, [_phrase(models, model, each) for each in error.errors()] + mistakes
    return table, mistakes + list(table.mistakes_within())


def _phrase(models: tuple[type[Table], ...], model: type[Table], error: ErrorDetails) -> str:
    """One mistake: the key, or element of its list, what was found, what is expected."""
    key, *inner = error["loc"]
    place = str(key) + "".join(f"[{i}]" for i in inner if isinstance(i, int))
    if error["type"] == "extra_forbidden":
        if any(key in other.model_fields for other in models):
            return f"{place}: not used with this pattern"
        return f"{place}: unknown key, {nearest(place, model.model_fields)}"
    if error["type"] == "missing":
        return f"{place}: missing"
    return f"{place}: found {_shown(error['input'])}, expected {error['msg']}"


def _unbounded(tables: dict[str, Any]) -> Iterator[str]:
    """A list of tip radii says how many asperities there are; a load alone does not."""
    lattice, normal = tables.get("asperities"), tables.get("normal")
    if not isinstance(lattice, Lattice) or normal is None or normal.load is None:
        return
    if isinstance(lattice.tip_radius, list) and lattice.within is None:
        yield "[asperities] within: missing, needed with a list of tip radii under a given load"


def _shown(value: object) -> str:
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
