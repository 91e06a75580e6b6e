"""The tables of a scene file: what each key may hold, and every mistake in words.

`read_scene` imports this when a file is read, and not before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from pydantic import Field, ValidationError
from pydantic_core import ErrorDetails

from convexrough.checks import nearest
from convexrough.run.path_schema import Path, Shakedown, Steady
from convexrough.run.sensitivity import BY
from convexrough.run.values import (
    By,
    Chosen,
    Control,
    Finite,
    Fractions,
    Geometry,
    InfluenceName,
    NonNegative,
    Number,
    Pattern,
    Points,
    Positive,
    Ratio,
    Seed,
    Share,
    Shares,
    SolverName,
    Table,
    Text,
    TipRadius,
)


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


class Gradient(Table):
    of: Number
    fraction: Share | None = None
    by: By = Field(list(BY))
    holding: Control | None = None

    @property
    def sheared(self) -> bool:
        """Whether it is asked of a shear force."""
        return self.of in ("loss", "displacement")

    def mistakes_within(self) -> Iterator[str]:
        if self.sheared and self.fraction is None:
            yield f"fraction: missing, needed with the {self.of}"
        if not self.sheared and self.fraction is not None:
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
    if "friction" not in contents and asked is not None and asked.sheared:
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
