"""A stage is a table of the scene file. It computes a result; all output is derived from that.

A new stage is a subclass of `Stage` and one of `Result` in a file of `run/stages`, and a line in
`STAGES` there (docs/architecture.md has one of 40 lines).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.contact import Contact
from convexrough.plottable import Plottable
from convexrough.record import Table, rows_of, singular
from convexrough.run.values import FileTable
from convexrough.tabular.columns import aligned
from convexrough.tabular.units import UnitNames

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Columns = dict[str, NDArray[Any]]
Summary = dict[str, Any]

#: Statuses of asperities; as keys, the number of asperities with that status.
STATUSES = ("contact", "open", "stuck", "partial", "sliding", "intermittent", "undecided")

#: Physical dimension of each number, by name; all others have none.
KINDS = {
    "force": ("load", "force", "largest_load", "load_error", "force_amplitude", "level", "front"),
    "length": ("approach", "displacement", "displacement_amplitude", "approach_error",
               "displacement_error", "gap_error"),
    "work": ("loss", "loss_error", "loss_first", "loss_first_error", "duality_gap", "smooth",
             "partial_slip_loss", "sliding_loss"),
    "stiffness": ("secant_stiffness",),
}  # fmt: skip
KIND = {name: kind for kind, names in KINDS.items() for name in names}

#: Rows of long tables that are printed: the last ones.
MOST_PRINTED = 20


class Stage(FileTable):
    """A table of the scene file that asks for a result from a pressed contact, with its checks.

    name    : of the table;  frictional : it needs [friction]
    numbers : keys of its summary that are numbers, which a sweep can measure
    labels  : keys that tell rows apart, where there are several
    """

    name: ClassVar[str]
    frictional: ClassVar[bool] = True
    numbers: ClassVar[tuple[str, ...]] = ()
    labels: ClassVar[tuple[str, ...]] = ()

    def compute(self, contact: Contact) -> Result:
        """Compute the result. Raises InputError, SolverError."""
        raise NotImplementedError

    def fits(self, count: int) -> None:
        """Check that the stage exists for so many asperities. Raises InputError if not."""


def limit(contact: Contact) -> float:
    """f P [force]."""
    return checks.friction(contact.scene.friction) * contact.load


def number(found: Any, name: str) -> Any:
    """How many asperities have this status, or what a result, or its certificate, calls so."""
    if name in STATUSES:
        return (found.status == name).sum(axis=-1)
    return getattr(found if hasattr(found, name) else found.certificate, name)


def numbers_of(found: Any, names: Sequence[str]) -> Summary:
    """Numbers of a result by their names."""
    return {name: plain(number(found, name)) for name in names}


@dataclass(frozen=True, eq=False, repr=False)
class Result(Table, Plottable):
    """What a stage found: the summary, tables, figures and printed lines are all read off `rows`.

    found : results of the package, one for each row, or one with arrays along steps
    """

    printed: ClassVar[Mapping[str, str]] = {}  # keys of rows, and their headings
    title: ClassVar[str] = ""
    digits: ClassVar[int] = 7
    steps: ClassVar[bool] = False  # rows follow each other: the last ones are printed

    stage: Stage
    contact: Contact
    found: tuple[Any, ...]

    @property
    def name(self) -> str:
        """Name of the table in the scene file, of the key in the summary, and of the CSV file."""
        return self.stage.name

    def rows(self) -> list[Summary]:
        """Numbers and words, a row for each of `found`."""
        return [numbers_of(each, self.stage.numbers) for each in self.found]

    @cached_property
    def known(self) -> list[Summary]:
        """`rows()`, computed once."""
        return self.rows()

    def summary(self) -> Any:
        """What summary.json says: a list of rows, or one."""
        return self.known

    def doubts(self) -> Iterator[str]:
        """What keeps this from being certified, a line for each reason."""
        if unsure := sum(row.get("undecided", 0) for row in self.known):
            yield f"not certified: {unsure} statuses in {self.name} undecided"

    @property
    def certified(self) -> bool:
        """All of it is proved."""
        return not any(self.doubts())

    def tables(self) -> dict[str, Columns]:
        """Tables of numbers by the stems of their files."""
        return {self.name: columns_of(self.known)}

    def figures(self, **units: Any) -> Mapping[str, Figure]:
        """Figures by the stems of their files; units are used for labels only."""
        return {}

    def prepare(self, *, figures: bool) -> None:
        """Compute what only tables need, and figures, so that nothing is solved in writing them."""
        _ = self.known

    def lines(self, units: UnitNames) -> list[str]:
        """The printed table, one string per line."""
        cut = self.known[-MOST_PRINTED:] if self.steps else self.known
        many = f"(the last {len(cut)} of {len(self.known)} rows; all are in {self.name}.csv)"
        printed = self.headings()
        said = [titled(self.title or self.name, printed, units)]
        said += [many] if len(cut) < len(self.known) else []
        rows = [[row[key] for key in printed] for row in cut]
        return [*said, *aligned([list(printed.values()), *rows], digits=self.digits)]

    def headings(self) -> Mapping[str, str]:
        """Of the printed columns, by their keys in the rows."""
        return self.printed

    def plot(self, axes: Axes | None = None, **options: Any) -> Axes:
        """The main picture of the last of `found`: axes in, axes out."""
        axes = self.found[-1].plot(axes, **options)
        return axes

    def to_dataframe(self) -> pandas.DataFrame:
        """The first of `tables`."""
        from convexrough.frames import dataframe

        columns = next(iter(self.tables().values()))
        return dataframe({name: (("row",), it) for name, it in columns.items()}, {})


class Steps(Result):
    """Steps that follow each other: one result with arrays along them."""

    steps = True

    def rows(self) -> list[Summary]:
        return rows_of(self.columns_of_steps())

    def columns_of_steps(self) -> Columns:
        """By the names of the stage's numbers."""
        (found,) = self.found
        arrays = {singular(name): name for along in found._along.values() for name in along}
        return {
            name: number(found, name) if name in STATUSES else getattr(found, arrays[name])
            for name in self.stage.numbers
        }

    @cached_property
    def fine(self) -> Any:
        """The same with points between its own, for figures."""
        from convexrough.plots.between import between  # matplotlib: only when it draws

        return between(self.found[0])

    def prepare(self, *, figures: bool) -> None:
        super().prepare(figures=figures)
        if figures:
            _ = self.fine

    def figures(self, **units: Any) -> Mapping[str, Figure]:
        from convexrough.plots import path_figures  # matplotlib: only when it draws

        return path_figures(self.found[0], fine=self.fine, **units)

    def summary(self) -> Summary:
        """A list for each number."""
        return {key: [row[key] for row in self.known] for key in self.known[0]}


class Single(Result):
    """One result of which numbers are told."""

    def summary(self) -> Summary:
        return self.known[0]


def plain(value: Any) -> Any:
    """A number of numpy as one of Python, an array as a list."""
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def columns_of(rows: Sequence[Summary]) -> Columns:
    return {key: np.array([row[key] for row in rows]) for key in rows[0]} if rows else {}


def repeated(labels: Columns, tables: Sequence[Columns]) -> Columns:
    """Tables one below the other, each with its labels in every row."""
    count = len(next(iter(tables[0].values())))
    left = {name: np.repeat(values, count) for name, values in labels.items()}
    return left | {name: np.concatenate([each[name] for each in tables]) for name in tables[0]}


def unit_of(name: str, units: UnitNames) -> str:
    """What a number of this name is in; "" where that is not named, or it is plain."""
    length, force = units.length, units.force
    both = length and force
    return {
        "length": length,
        "force": force,
        "work": f"{force} {length}" if both else "",
        "stiffness": f"{force}/{length}" if both else "",
    }.get(KIND.get(name, ""), "")


def titled(title: str, printed: Mapping[str, str], units: UnitNames) -> str:
    """A heading, with the units of quantities where the scene names them."""
    named = [f"{it} {unit}" for key, it in printed.items() if (unit := unit_of(key, units))]
    return f"{title}  ({', '.join(named)})" if named else title
