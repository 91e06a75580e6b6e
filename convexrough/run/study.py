"""The tables of a scene file as one model, with the type of each key and messages for mistakes.
`read_scene` imports this module only when it reads a file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import product
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import Discriminator, Field, Tag, ValidationError, create_model

from convexrough.checks import nearest
from convexrough.errors import InputError
from convexrough.influence import KINDS, Kind
from convexrough.run import values
from convexrough.run.stage import Stage
from convexrough.run.stages import STAGES, NormalStage
from convexrough.run.values import FileTable, Mistake, NonNegative, Positive, Ratio, Text, expected
from convexrough.scene.material import Material
from convexrough.solvers import SOLVERS
from convexrough.tabular.units import UnitNames, force_of, known_unit, parsed

#: [Pa] smallest and largest accepted modulus: below moduli of gels, above that of diamond.
SOFTEST, HARDEST = 1e3, 1e13
MODULI = ("contact_modulus", "youngs_modulus", "hardness")

Geometry = Annotated[Literal["summit", "closest"], expected('"summit" or "closest"')]
Pattern = Annotated[Literal["hexagonal", "square"], expected('"hexagonal", "square" or "file"')]


class SphereTable(FileTable):
    radius: values.Radius


class BodyTable(FileTable):
    youngs_modulus: Positive
    poisson_ratio: Ratio
    hardness: Positive | None = None

    def made(self) -> Material:
        return Material.from_youngs(self.youngs_modulus, self.poisson_ratio, self.hardness)


class MaterialTable(BodyTable):
    alternatives = ("contact_modulus", "youngs_modulus")
    contact_modulus: Positive | None = None
    youngs_modulus: Positive | None = None  # type: ignore[assignment]

    def made(self) -> Material:
        if self.contact_modulus is None:
            return super().made()
        return Material(self.contact_modulus, self.poisson_ratio, self.hardness)


class BodiesTable(FileTable):
    elsewhere = ("two bodies", frozenset(MaterialTable.model_fields))
    sphere: BodyTable
    base: BodyTable

    def made(self) -> Material:
        return Material.pair(self.sphere.made(), self.base.made())


#: Keys of random heights and tip radii, which need a seed; and keys of asperities in a pattern that
#: a table of asperities from a file does not have.
RANDOM = ("height_std", "tip_radius_cv")
LATTICE = frozenset(("spacing", "within", *RANDOM, "seed"))


class SummitsTable(FileTable):
    elsewhere = ('pattern "file": positions and heights are in the file; delete this key', LATTICE)
    pattern: Literal["file"]
    path: Text
    tip_radius: values.TipRadius | None = None
    columns: dict[str, Text] = Field(default_factory=dict)
    geometry: Geometry = "closest"


class LatticeTable(FileTable):
    needs: ClassVar[Mapping[str, str]] = dict.fromkeys(RANDOM, "seed")
    elsewhere = ("this pattern", frozenset(SummitsTable.model_fields))
    pattern: Pattern
    spacing: Positive
    tip_radius: values.TipRadius
    within: NonNegative | None = None
    height_std: NonNegative = 0.0
    tip_radius_cv: values.Variation = 0.0
    seed: values.Whole | None = None
    geometry: Geometry = "closest"

    @classmethod
    def mistakes_between(cls, keys: Mapping[str, Any]) -> Iterator[Mistake]:
        yield from super().mistakes_between(keys)
        if "seed" in keys and keys.keys().isdisjoint(RANDOM):
            yield "seed", f"not used without {' or '.join(RANDOM)}"


class FrictionTable(FileTable):
    coefficient: Positive


class SolverTable(FileTable):
    name: Annotated[str, values.one_of(SOLVERS)] = "newton"
    influence: Annotated[Kind, values.one_of(KINDS)] | None = None


class UnitsTable(FileTable):
    length: Text = ""
    force: Text = ""
    pressure: Text = ""
    convert: values.Switch = False

    @property
    def names(self) -> UnitNames:
        """The units of length and force. By default, force is pressure times length squared."""
        pressure, length = parsed(self.pressure), parsed(self.length)
        made = force_of(pressure, length) if pressure and length else ""
        return UnitNames(self.length.strip(), self.force.strip() or made)

    def mistakes_within(self) -> Iterator[Mistake]:
        for kind in ("length", "force", "pressure"):
            try:
                known_unit(kind, getattr(self, kind), kind)
            except InputError as error:
                expects = f"{error.expected}; without [units] no unit is checked"
                yield kind, f"found {error.found}, expected {expects}"
                return
        pressure, length, force = map(parsed, (self.pressure, self.length, self.force))
        if pressure and not length:
            yield "length", "missing, needed with pressure"
        elif pressure and length and not (made := force_of(pressure, length)):
            expects = "a unit that gives a named unit of force"
            yield "pressure", f"found {self.pressure}, expected {expects}"
        elif pressure and length and force and force.size != (pressure * length**2).size:
            makes = f"the force of {self.pressure} and {self.length}"
            yield "force", f"found {self.force}, expected {made}, {makes}"


def _is_bodies(table: Any) -> str:
    both = isinstance(table, dict) and not table.keys().isdisjoint(BodiesTable.model_fields)
    return "(bodies)" if both else "(one)"


def _is_file(table: Any) -> str:
    return "(file)" if isinstance(table, dict) and table.get("pattern") == "file" else "(lattice)"


#: Tables that every scene file must have.
REQUIRED: dict[str, type[FileTable]] = {
    "sphere": SphereTable,
    "material": MaterialTable,
    "asperities": LatticeTable,
    "normal": NormalStage,
}


class Study(FileTable):
    """All tables of a scene file but those of further stages, which `_model` adds."""

    sphere: SphereTable
    material: Annotated[
        Annotated[MaterialTable, Tag("(one)")] | Annotated[BodiesTable, Tag("(bodies)")],
        Discriminator(_is_bodies),
    ]
    asperities: Annotated[
        Annotated[LatticeTable, Tag("(lattice)")] | Annotated[SummitsTable, Tag("(file)")],
        Discriminator(_is_file),
    ]
    normal: NormalStage
    friction: FrictionTable | None = None
    solver: SolverTable = SolverTable()
    units: UnitsTable = UnitsTable()

    @property
    def stages(self) -> dict[str, Stage]:
        """The stages that the file requests, by name, in the order of results."""
        return {name: it for name in STAGES if (it := getattr(self, name)) is not None}

    @classmethod
    def mistakes_between(cls, keys: Mapping[str, Any]) -> Iterator[Mistake]:
        """Mistakes: unknown tables, missing tables, and keys that need a key of another table."""
        for name, keys_within in keys.items():
            if name == "sweep":
                yield name, "[sweep]: only `convexrough sweep` computes many scenes"
            elif name not in cls.model_fields:
                a_table = isinstance(keys_within, dict)
                what = f"[{name}]: unknown table" if a_table else f"{name}: not in a table"
                yield name, f"{what}, {nearest(name, cls.model_fields)}"
        if "friction" not in keys:
            further = [name for name in STAGES if name in keys and name != NormalStage.name]
            found = (STAGES[name].sheared_by(keys[name]) for name in further)
            if sheared_by := next(filter(None, found), ""):
                yield "friction", f"missing table, needed with {sheared_by}"
        yield from _unbounded(*(keys.get(name) for name in ("asperities", "normal", "sphere")))

    def mistakes_within(self) -> Iterator[Mistake]:
        """A mistake for each modulus that no solid has, if the file names units."""
        material, unit = self.material, self.units.names.unit("pressure")
        if unit is None:
            return
        tables: dict[str, Any] = {"material": material}
        if isinstance(material, BodiesTable):
            tables = {f"material.{name}": table for name, table in material}
        for (name, table), key in product(tables.items(), MODULI):
            value = getattr(table, key, None)
            if value and not SOFTEST <= (pascals := value * float(unit.size)) <= HARDEST:
                found = f"found {value:g} {unit.name}, which is {pascals:.3g} Pa"
                solid = f"expected {SOFTEST:g} to {HARDEST:g} Pa, as solids have"
                said = f"[{name}] {key}: {found}, {solid}; without [units] no unit is checked"
                yield "material", said


def _unbounded(lattice: Any, normal: Any, sphere: Any) -> Iterator[Mistake]:
    """A mistake if a lattice lacks `within` and nothing else limits the number of asperities."""
    if not isinstance(lattice, dict) or lattice.get("pattern") == "file" or "within" in lattice:
        return
    missing = "[asperities] within: missing, needed with"
    radius = sphere.get("radius") if isinstance(sphere, dict) else None
    if math.inf in (radius if isinstance(radius, list) else [radius]):
        yield "asperities", f"{missing} a flat or a cylinder (infinite)"
    elif not isinstance(normal, dict) or "load" not in normal:
        return
    elif isinstance(lattice.get("tip_radius"), list):
        yield "asperities", f"{missing} a list of tip radii under a given load"


@lru_cache(4)
def _model(stages: tuple[type[Stage], ...]) -> type[Study]:
    fields: dict[str, Any]
    fields = {each.name: (each | None, None) for each in stages if each is not NormalStage}
    return create_model("Study", __base__=Study, **fields)


def validate(contents: Mapping[str, Any]) -> tuple[Study | None, list[str]]:
    """The checked tables of a parsed file, or None; and the mistakes, in the order of the file."""
    if "" in contents:
        return None, ['[""]: unknown table, expected a name']
    model = _model(tuple(STAGES.values()))
    try:
        return model.model_validate(dict(contents)), []
    except ValidationError as error:
        places = {name: place for place, name in enumerate(contents)}
        errors = error.errors()
        errors.sort(key=lambda each: places.get(str(each["loc"][0]), len(places)))
        return None, [_said(each) for each in errors]


T = TypeVar("T", bound=FileTable)


def validate_table(name: str, keys: Any, model: type[T]) -> tuple[T | None, list[str]]:
    """The checked table, or None if it has mistakes; and a message for each mistake in it."""
    try:
        return model.model_validate(keys), []
    except ValidationError as error:
        return None, [
            values.phrased({**each, "loc": (name, *each["loc"])}) for each in error.errors()
        ]


def _said(error: Any) -> str:
    table, *inner = error["loc"]
    if error["type"] == "missing" and not inner:
        keys = ", ".join(REQUIRED[str(table)].model_fields)
        return f"[{table}]: missing table, its keys are: {keys}"
    if error["type"] == "told" and not inner:
        own = error["msg"]
        return own if table in own.split(":")[0] else f"[{table}]: {own}"
    return values.phrased(error)
