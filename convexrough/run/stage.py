"""Base classes of stages and of their results; docs/architecture.md has an example of 40 lines.

A stage is a table of the scene file. Its class checks the keys, and computes from a pressed contact
the result, from which summary, tables, figures and printed lines are derived.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from convexrough import checks, plots
from convexrough.contact import Contact, press
from convexrough.errors import ConvexroughError
from convexrough.plausibility import cautions_of
from convexrough.record import Record, frame_of, rows_of, singular
from convexrough.run.values import FileTable
from convexrough.tabular.columns import aligned
from convexrough.tabular.units import UnitNames

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Columns = dict[str, NDArray[Any]]
Summary = dict[str, Any]
Labels = Mapping[str, Sequence[float]]

#: Statuses of asperities; as a name in a row of a result, the number of asperities that have it.
STATUSES = ("contact", "open", "stuck", "partial", "sliding", "intermittent", "undecided")

#: Names of numbers in results and of keys of scene files, by physical dimension; other numbers are
#: dimensionless.
KINDS = {
    "force": ("load", "force", "largest_load", "load_error", "force_amplitude", "level", "front"),
    "length": ("approach", "displacement", "displacement_amplitude", "approach_error",
               "displacement_error", "prescribed_displacement", "gap_error", "radius", "spacing",
               "tip_radius", "within", "height_std", "x", "y", "height", "contact_radius", "gap"),
    "work": ("loss", "loss_error", "loss_first", "loss_first_error", "duality_gap", "smooth",
             "partial_slip_loss", "sliding_loss"),
    "stiffness": ("secant_stiffness",),
    "area": ("area",),
}  # fmt: skip
KIND = {name: kind for kind, names in KINDS.items() for name in names}


def cautions(stages: Iterable[Stage], contact: Contact) -> Iterator[str]:
    """Warnings about the contact at the largest load of a stage, if that exceeds `contact.load`."""
    highest = max(stages, key=lambda stage: stage.highest_load, default=None)
    if highest is not None and highest.highest_load > contact.load:
        with suppress(ConvexroughError):  # `compute` raises it
            top = press(contact.scene, load=highest.highest_load, influence=contact.influence)
            for each in cautions_of(top):
                yield f"under the largest load of [{highest.name}]: {each}"


class Stage(FileTable):
    """A table of the scene file with checked keys, which requests a result of a pressed contact."""

    name: ClassVar[str]  # of the table
    numbers: ClassVar[tuple[str, ...]] = ()  # names of the numbers in a row of its result

    @property
    def labels(self) -> Labels:
        """The numbers that identify the rows of the result, by name, if there are several rows."""
        return {}

    @property
    def highest_load(self) -> float:
        """[force] the largest load in the table; 0 if the stage uses the load of [normal]."""
        return 0.0

    @classmethod
    def sheared_by(cls, keys: Any) -> str:
        """What needs [friction] if the stage has these keys, for messages; "" if nothing does."""
        return f"[{cls.name}]"

    def compute(self, contact: Contact) -> Result:
        """The result of this stage for a pressed contact. Raises InputError and SolverError."""
        raise NotImplementedError


def limit(contact: Contact) -> float:
    """[force] the friction limit, the coefficient of friction times the total load."""
    return checks.friction(contact.scene.friction) * contact.load


def number(found: Any, name: str) -> Any:
    """The attribute `name` of `found` or of its certificate; for a status, its count."""
    if name in STATUSES:
        return (found.status == name).sum(axis=-1)
    return getattr(found if hasattr(found, name) else found.certificate, name)


def numbers(found: Any, names: Iterable[str]) -> Summary:
    """For each of these names the result of `number`, as a Python number or text."""
    values = ((name, number(found, name)) for name in names)
    return {name: it.item() if isinstance(it, np.generic) else it for name, it in values}


@dataclass(frozen=True, eq=False, repr=False)
class Result(Record):
    """The result of a stage. Summary, tables and printed lines are derived from its `rows`."""

    printed: ClassVar[tuple[str, ...]] = ()  # the columns that rows may have; default: all
    digits: ClassVar[int] = 7  # of printed numbers
    most: ClassVar[int | None] = None  # largest number of printed rows, which are the last ones

    stage: Stage
    contact: Contact
    #: Objects such as ShearState, one for each row, or one object with arrays along steps.
    found: tuple[Any, ...]

    @property
    def name(self) -> str:
        """Name of the table in the scene file, of the key in summary.json, and of the CSV file."""
        return self.stage.name

    def rows(self) -> list[Summary]:
        """Rows of numbers and texts by key, one for each object in `found`; one without labels."""
        labels, names = self.stage.labels, self.stage.numbers
        return [
            {name: values[k] for name, values in labels.items()} | numbers(each, names)
            for k, each in enumerate(self.found if labels else self.found[:1])
        ]

    @cached_property
    def known(self) -> list[Summary]:
        """`rows()`, computed once."""
        return self.rows()

    def summary(self) -> Any:
        """The entry of summary.json: a list of rows, or the only row if rows have no labels."""
        return self.known if self.stage.labels else self.known[0]

    def doubts(self) -> Iterator[str]:
        """The reasons why this result is not certified."""
        loaded = (row for row in self.known if row.get("load") != 0)  # at 0 one just touches
        if unsure := sum(row.get("undecided", 0) for row in loaded):
            many = "status" if unsure == 1 else "statuses"
            yield f"not certified: {unsure} {many} in {self.name} undecided"
        if not {*self.orders} <= {"proved", "proved for one step"}:
            needs = f"which the proof of [{self.name}] needs"
            yield f"not proved: that indentations increase with the load, {needs}"
        elif "proved for one step" in self.orders and "loss" in self.stage.numbers:
            why = 'because order is "proved for one step" only'
            yield f"not proved: the losses of [{self.name}], {why}"

    def cautions(self) -> Iterator[str]:
        """Warnings about limits of the model."""
        yield from ()

    def proved_forces(self) -> Iterator[float]:
        """[force] the shear forces at which `run --proof` proves the friction state."""
        yield from ()

    @property
    def orders(self) -> Counter[str]:
        """The numbers of objects in `found` with each `order` (docs/theory/states.md)."""
        return Counter(each.order for each in self.found if getattr(each, "order", None))

    @property
    def certified(self) -> bool:
        """True if everything in this result is proved."""
        return not any(self.doubts())

    def tables(self) -> dict[str, Columns]:
        """The tables to write: for each file name without its ending, the columns by name."""
        rows = self.known
        return {self.name: {key: np.array([row[key] for row in rows]) for key in rows[0]}}

    def at_asperities(self, columns: Columns) -> Columns:
        """A table with a row for each asperity: its position x and y, and these columns."""
        return dict(zip("xy", self.contact.scene.asperities.positions.T, strict=True)) | columns

    def stacked(self, tables: Sequence[Columns]) -> Columns:
        """The tables of all rows one below the other, with the labels of the rows in front."""
        counts = [len(next(iter(each.values()))) for each in tables]
        left = {name: np.repeat(it, counts) for name, it in self.stage.labels.items()}
        return left | {name: np.concatenate([each[name] for each in tables]) for name in tables[0]}

    def figures(self) -> Mapping[str, Figure]:
        """The figures to write, by the file name without its ending."""
        return {}

    def lines(self) -> list[str]:
        """The printed lines: a table and, where it matters, what is proved about order."""
        said = self.printed_table(self.name, self.known, self.printed)
        proved = "".join(self.orders)
        if len(self.orders) > 1:
            proved = ", ".join(f"{each} (rows: {n})" for each, n in sorted(self.orders.items()))
        return [*said, *([f"indentations increase with the load: {proved}"] if proved else [])]

    def printed_table(self, name: str, rows: list[Summary], printed: Iterable[str]) -> list[str]:
        """The lines of the last rows of a table, with its name and units."""
        keys = [key for key in printed or rows[0] if key in rows[0]]
        units = [(key, unit_of(key, self.contact.scene.units)) for key in keys]
        named = ", ".join(f"{key} {unit}" for key, unit in units if unit)
        cut = rows[-(self.most or len(rows)) :]
        said = [f"{name}  ({named})" if named else name]
        if len(cut) < len(rows):
            said.append(f"(the last {len(cut)} of {len(rows)} rows; all are in the table {name})")
        cells = [[row[key] for key in keys] for row in cut]
        return [*said, *aligned([keys, *cells], digits=self.digits)]

    def plot(self, axes: Axes | None = None, **options: Any) -> Axes:
        """Draw the main figure of the last object in `found`, and return the axes. Raises
        InputError if there is none, as where no gradient exists."""
        checks.some(self.name, self.found)
        return cast("Axes", self.found[-1].plot(axes, **options))

    def to_dataframe(self) -> pandas.DataFrame:
        """The first table as a pandas DataFrame. Raises InputError if there is none."""
        checks.some(self.name, self.found)
        return frame_of(next(iter(self.tables().values())))


class Steps(Result):
    """The result of a stage with consecutive steps, as one object with arrays along the steps."""

    most = 20

    def rows(self) -> list[Summary]:
        (found,) = self.found
        plural = {singular(name): name for names in found._along.values() for name in names}
        return rows_of({
            **{name: np.array(values) for name, values in self.stage.labels.items()},
            **{name: number(found, plural.get(name, name)) for name in self.stage.numbers},
        })  # fmt: skip

    def figures(self) -> Mapping[str, Figure]:
        return plots.path_figures(self.found[0])

    def summary(self) -> Summary:
        """Each number of the stage as a list with an entry for each step."""
        lists = {key: [row[key] for row in self.known] for key in self.known[0]}
        return lists | {"order": self.found[0].order}


def unit_of(name: str, units: UnitNames) -> str:
    """The unit of the number with this name; "" if it has none or the scene names no units."""
    return units.name(KIND.get(name, ""))
