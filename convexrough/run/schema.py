"""The tables of a scene file: what each key may hold, and every mistake in words.

`read_scene` imports this when a file is read, and not before.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, ValidationError
from pydantic_core import ErrorDetails

from convexrough.checks import nearest
from convexrough.errors import InputError
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
    Radius,
    Ratio,
    Seed,
    Share,
    Shares,
    SolverName,
    Switch,
    Table,
    Text,
    TipRadius,
)
from convexrough.tabular.units import UnitNames, force_of, known_unit, parsed


class Sphere(Table):
    radius: Radius


class Material(Table):
    alternatives = ("contact_modulus", "youngs_modulus")
    contact_modulus: Positive | None = None
    youngs_modulus: Positive | None = None
    poisson_ratio: Ratio
    hardness: Positive | None = None


class Body(Table):
    youngs_modulus: Positive
    poisson_ratio: Ratio
    hardness: Positive | None = None


class Bodies(Table):
    """[material] of two bodies that differ."""

    sphere: Body
    base: Body


class Lattice(Table):
    needs: ClassVar = {"height_std": "seed", "tip_radius_cv": "seed"}
    pattern: Pattern
    spacing: Positive
    tip_radius: TipRadius
    within: NonNegative | None = None
    height_std: NonNegative = 0.0
    tip_radius_cv: NonNegative = 0.0
    seed: Seed | None = None
    geometry: Geometry = "closest"


class Summits(Table):
    pattern: Literal["file"]
    path: Text
    tip_radius: TipRadius | None = None
    columns: dict[str, Text] = Field(default_factory=dict)
    geometry: Geometry = "closest"


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
    pressure: Text = ""
    convert: Switch = False

    @property
    def names(self) -> UnitNames:
        """The force is that of the pressure on a square, where only these are named."""
        pressure, length = (parsed(name) if name else None for name in (self.pressure, self.length))
        made = force_of(pressure, length) if pressure and length else ""
        return UnitNames(self.length.strip(), self.force.strip() or made)

    def mistakes_within(self) -> Iterator[str]:
        for kind in ("length", "force", "pressure"):
            try:
                known_unit(kind, getattr(self, kind), kind)
            except InputError as error:
                yield f"{error}; without [units] no unit is looked at"
                return
        pressure, length, force = map(parsed, (self.pressure, self.length, self.force))
        if pressure and not length:
            yield "length: missing, needed with pressure"
        elif pressure and length and not (made := force_of(pressure, length)):
            yield f"pressure: found {self.pressure}, expected one that makes a force with a name"
        elif pressure and length and force and force.size != (pressure * length**2).size:
            makes = f"as {self.pressure} and {self.length} make"
            yield f"force: found {self.force}, expected {made}, {makes}"


@dataclass(frozen=True)
class Document:
    """The tables of one file, each right by itself and beside the others."""

    sphere: Sphere
    material: Material | Bodies
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
    "material": (Material, Bodies),
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
#: Letters of the formulas, and the keys that they stand for.
MEANT = {"E": "youngs_modulus", "E*": "contact_modulus", "Estar": "contact_modulus"}
MEANT |= {"nu": "poisson_ratio", "R": "radius", "rho": "tip_radius", "f": "coefficient"}
MEANT |= {"mu": "coefficient", "P": "load", "D": "approach"}

#: [Pa] moduli of solids: from gels to diamond, with room.
SOFTEST, HARDEST = 1e3, 1e13

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
    mistakes += _implausible(tables)
    asked = tables.get("gradient")
    if "friction" not in contents and asked is not None and asked.sheared:
        mistakes.append(f"[friction]: missing table, needed with the {asked.of} of [gradient]")
    return (None if mistakes else Document(**tables)), mistakes


def validate_table(
    name: str, keys: dict[str, Any], models: tuple[type[Table], ...]
) -> tuple[Table | None, list[str]]:
    """One table, or None and what is wrong in it.

    The last of the models is that of files, or of two bodies.
    """
    other = keys.get("pattern") == "file" or not keys.keys().isdisjoint(Bodies.model_fields)
    model = models[-1] if other else models[0]
    mistakes = list(model.mistakes_between(keys))
    try:
        table = model.model_validate(keys)
    except ValidationError as error:
        return None, [_phrase(models, model, each) for each in error.errors()] + mistakes
    return table, mistakes + list(table.mistakes_within())


def _phrase(models: tuple[type[Table], ...], model: type[Table], error: ErrorDetails) -> str:
    """One mistake: the key, or element of its list, what was found, what is expected."""
    key, *inner = error["loc"]
    if model is Bodies and inner:
        return f"{key}.{_phrase((Body,), Body, {**error, 'loc': tuple(inner)})}"
    place = str(key) + "".join(f"[{i}]" for i in inner if isinstance(i, int))
    if error["type"] == "extra_forbidden":
        if any(key in other.model_fields for other in models if other is not model):
            return f"{place}: not used with {'two bodies' if model is Bodies else 'this pattern'}"
        meant = f'did you mean "{MEANT[place]}"?' if MEANT.get(place) in model.model_fields else ""
        return f"{place}: unknown key, {meant or nearest(place, model.model_fields)}"
    if error["type"] == "missing":
        return f"{place}: missing"
    expected = "a table" if error["type"] == "model_type" else error["msg"]
    return f"{place}: found {_shown(error['input'])}, expected {expected}"


def _unbounded(tables: dict[str, Any]) -> Iterator[str]:
    """A list of tip radii, or a base that bends away, says how many asperities there are."""
    lattice, normal, sphere = (tables.get(name) for name in ("asperities", "normal", "sphere"))
    if not isinstance(lattice, Lattice) or lattice.within is not None:
        return
    if sphere is not None and math.inf in np.atleast_1d(sphere.radius):
        yield "[asperities] within: missing, needed with a flat base or a cylinder, without an end"
    elif isinstance(lattice.tip_radius, list) and normal is not None and normal.load is not None:
        yield "[asperities] within: missing, needed with a list of tip radii under a given load"


def _implausible(tables: dict[str, Any]) -> Iterator[str]:
    """A modulus that no solid has, where units are named."""
    material, units = tables.get("material"), tables.get("units")
    if not isinstance(material, Material) or units is None:
        return
    unit = units.names.unit("pressure")
    name = "youngs_modulus" if material.contact_modulus is None else "contact_modulus"
    value = getattr(material, name)
    if unit is None or value is None:
        return
    if not SOFTEST <= (pascals := value * float(unit.size)) <= HARDEST:
        yield (
            f"[material] {name}: found {value:g} {unit.name}, which is {pascals:.3g} Pa, expected "
            f"{SOFTEST:g} to {HARDEST:g} Pa, as solids have; without [units] no unit is looked at"
        )


def _shown(value: object) -> str:
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
