"""The numbers that a sweep can measure: names in the summary of a run, or their last parts.

`cycle.loss` is the loss of each cycle. `loss` means the same if no earlier stage has a `loss`. A
column is named after the number and its row: `loss_0.37` is the loss of the cycle between
+-0.37 f P, where f P is the friction limit; `history.loss_2` is that at a history's third force.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from convexrough import checks
from convexrough.contact import Contact
from convexrough.errors import ConvexroughError, InputError
from convexrough.friction.onset import onset_of_sliding
from convexrough.plausibility import cautions_of
from convexrough.run.stage import Stage, limit, unit_of
from convexrough.tabular.units import UnitNames

Stages = Mapping[str, Stage]

#: Numbers in a summary, by their name and the label of their row.
Numbers = dict[tuple[str, str], float]

#: ONSET: these quantiles of the shear forces at which loaded asperities start to slide, over f P.
ONSET, QUANTILES = "onset", (0.0, 0.25, 0.5, 0.75, 1.0)

#: Errors that mean that one scene failed; the others are still computed.
FAILURES = (ConvexroughError, ArithmeticError, MemoryError, np.linalg.LinAlgError)

#: Keys of a scene file that are lengths.
LENGTHS = ("radius", "spacing", "tip_radius", "within", "height_std")


class Column(NamedTuple):
    """The name of a column, with the name and row of its number in a summary."""

    name: str
    number: str
    row: str

    @property
    def stage(self) -> str:
        return self.number.partition(".")[0]


class Measured(NamedTuple):
    """The numbers of a scene; why they are not certified, and why the model may fail, or ""."""

    numbers: Numbers
    doubts: str
    cautions: str


def measured(contact: Contact, stages: Stages, wanted: Container[str]) -> Measured:
    """The numbers of the wanted stages, and of the stage "normal"."""
    found: Numbers = {}
    doubts: list[str] = []
    cautions = [*cautions_of(contact)]
    for name, stage in stages.items():
        if name in wanted or name == "normal":
            cautions += stage.cautions(contact)
            result = stage.compute(contact)
            found |= dict(_numbers(result.summary(), name, "", stage.labels))
            doubts += result.doubts()
    if ONSET in wanted:
        which = np.flatnonzero(contact.loads)
        onsets = onset_of_sliding(contact, which=which) / (limit(contact) or 1.0)
        at = np.quantile(onsets, QUANTILES) if len(which) else np.full(len(QUANTILES), np.nan)
        found |= {(ONSET, f"{q:g}"): float(it) for q, it in zip(QUANTILES, at, strict=True)}
    return Measured(found, "; ".join(doubts), "; ".join(cautions))


def _numbers(
    value: Any, name: str, row: str, labels: Sequence[str]
) -> Iterator[tuple[tuple[str, str], float]]:
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _numbers(each, f"{name}.{key}", row, labels)
    elif isinstance(value, list):
        for i, each in enumerate(value):
            many = isinstance(each, dict) and labels
            own = row_label([each[label] for label in reversed(labels)]) if many else str(i)
            yield from _numbers(each, name, f"{row}_{own}" if row else own, labels)
    elif isinstance(value, (int, float)):
        yield (name, row), float(value)


def row_label(ends: Sequence[float]) -> str:
    """The label of a row: a force, or both ends of a cycle, or the maximum of a symmetric cycle."""
    *first, last = ends
    return "_".join(f"{float(it)!r}" for it in (*(it for it in first if it != -last), last))


def chosen(contact: Contact, stages: Stages, measures: Sequence[str]) -> tuple[Column, ...]:
    """The columns for each name in `measures`, which stands for the first number of that name.

    Raises InputError if no number has the name. Stages after the last needed one are not computed.
    """
    rows: dict[str, list[str]] = {}

    def number(name: str) -> str:
        return next((each for each in rows if f".{each}".endswith(f".{name}")), "")

    for stage in (*stages, *((ONSET,) if ONSET in measures else ())):
        if not all(map(number, measures)):
            new = measured(
                contact, {stage: stages[stage]} if stage in stages else {}, {stage}
            ).numbers
            for each, row in new:
                rows.setdefault(each, []).append(row)
    columns = []
    for name in measures:
        if not number(name):
            names = sorted({each.rpartition(".")[2] for each in rows} | {ONSET})
            given = ", ".join(f"[{stage}]" for stage in stages)
            expected = f"a number of the tables {given}: {checks.nearest(name, names)}"
            raise InputError("[sweep] measure", found=f'"{name}"', expected=expected)
        known = number(name)
        columns += [Column(f"{name}_{row}" if row else name, known, row) for row in rows[known]]
    return tuple(columns)


def unit(name: str, units: UnitNames) -> str:
    """The unit of a number of a summary or of a key of a file; "" if unknown."""
    end = name.rpartition(".")[2]
    if name.startswith("gradient."):
        return ""
    return units.length if end in LENGTHS else unit_of(end, units)
