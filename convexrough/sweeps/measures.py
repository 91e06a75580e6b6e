"""The numbers that a sweep can measure.

The name of a number is its name in the summary of a run, such as `cycle.loss`, or the last part of
this name. `loss` means `cycle.loss` if no earlier stage (table of results, such as `shear`) has a
`loss`. A column is named after the number and its row: `loss_0.37` is the loss of the cycle between
+-0.37 f P, where f P is the friction limit; `history.loss_2` is the loss at the third force.

If only numbers in `NORMAL` and `CYCLE` are measured, the contacts and cycles of a batch are
computed together, in common arrays with a row for each scene.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.errors import ConvexroughError, InputError
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.onset import onset_of_sliding
from convexrough.plausibility import cautions_about, cautions_of
from convexrough.record import singular
from convexrough.rows import PressedRows, in_rows
from convexrough.run.scene_file import Task
from convexrough.run.stage import STATUSES, Stage, cautions, limit, unit_of
from convexrough.run.stages import CycleStage
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz, mindlin
from convexrough.sphere.smooth import smooth_reference
from convexrough.tabular.units import UnitNames

Stages = Mapping[str, Stage]

#: Numbers in a summary, by their name and the label of their row.
Numbers = dict[tuple[str, str], float]

#: ONSET has a column for each of these QUANTILES of the shear forces, divided by f P, at which
#: loaded asperities start to slide.
ONSET, QUANTILES = "onset", (0.0, 0.25, 0.5, 0.75, 1.0)

#: What a message on a wrong name of a number is about.
MEASURE = "[sweep] measure"

#: Errors that mean that one scene failed; other scenes are still computed.
FAILURES = (ConvexroughError, ArithmeticError, MemoryError, np.linalg.LinAlgError)


class Column(NamedTuple):
    """The name of a column, with the name and row of its number in a summary."""

    name: str
    number: str
    row: str

    @property
    def stage(self) -> str:
        return self.number.partition(".")[0]


class Measured(NamedTuple):
    """The measured numbers of a scene, why they are not certified, and why the model may fail."""

    numbers: Numbers
    doubts: str
    cautions: str


def measured(contact: Contact, stages: Stages, wanted: Container[str]) -> Measured:
    """The numbers of the stages in `wanted`, and of the stage "normal"."""
    found: Numbers = {}
    doubts: list[str] = []
    chosen = {name: it for name, it in stages.items() if name in wanted or name == "normal"}
    said = [*cautions_of(contact), *cautions(chosen.values(), contact)]
    for name, stage in chosen.items():
        result = stage.compute(contact)
        found |= _numbers(result.summary(), name, "", [*stage.labels])
        doubts += result.doubts()
    if ONSET in wanted:
        which = np.flatnonzero(contact.cached(FrictionLevels).loads)
        onsets = onset_of_sliding(contact, which=which) / (limit(contact) or 1.0)
        at = np.full(len(QUANTILES), np.nan)
        if len(which):  # the least force at which this part slides
            at = np.quantile(onsets, QUANTILES, method="inverted_cdf")
        found |= {(ONSET, f"{q:g}"): float(it) for q, it in zip(QUANTILES, at, strict=True)}
    return Measured(found, "; ".join(doubts), "; ".join(said))


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
    """The label of a row: a force, the maximum of a symmetric cycle, or both ends of a cycle."""
    *first, last = ends
    return "_".join(f"{float(it)!r}" for it in (*(it for it in first if it != -last), last))


def chosen(contact: Contact, stages: Stages, measures: Sequence[str]) -> tuple[Column, ...]:
    """The columns for each name in `measures`. A name stands for the first number that has it.
    Stages are computed until all names are found. Raises InputError for a name of no number."""
    rows: dict[str, dict[str, None]] = {}  # in order, by the name of the number

    def number(name: str) -> str:
        return next((each for each in rows if f".{each}".endswith(f".{name}")), "")

    for stage in (*stages, *({ONSET} & {*measures})):
        if not all(map(number, measures)):
            only = {stage: stages[stage]} if stage in stages else {}
            for each, row in measured(contact, only, {stage}).numbers:
                rows.setdefault(each, {})[row] = None
    columns = []
    for name in measures:
        if not number(name):
            whole = {*rows} if "." in name else {each.rpartition(".")[2] for each in rows}
            names = sorted(whole | {ONSET})
            given = ", ".join(f"[{stage}]" for stage in stages)
            expected = f"a number of the tables {given}: {checks.nearest(name, names)}"
            raise InputError(MEASURE, found=f'"{name}"', expected=expected)
        known = number(name)
        columns += [Column(f"{name}_{row}" if row else name, known, row) for row in rows[known]]
    return tuple(columns)


def unit(name: str, units: UnitNames) -> str:
    """The unit of a number in a summary, or of a key of a file; "" if unknown."""
    return "" if name.startswith("gradient.") else unit_of(name.rpartition(".")[2], units)


#: Numbers of summaries that `_known` computes for many scenes together.
NORMAL = ("contact", "open", "undecided", "approach", "approach_error", "load", "area",
          "largest_load", "certificate.load_error")  # fmt: skip
CYCLE = ("sliding", "partial", "undecided", "loss", "loss_error", "force_amplitude",
         "displacement_amplitude", "displacement_error", "secant_stiffness", "loss_factor",
         "loss_normalised", "smooth_normalised", "loss_over_smooth")  # fmt: skip
KNOWN = {f"normal.{name}" for name in NORMAL} | {f"cycle.{name}" for name in CYCLE}


def measured_together(asked: Mapping[int, Task], columns: Sequence[Column]) -> dict[int, Measured]:
    """The measured numbers of scenes, by the number of the scene; only where all is proved."""
    if not asked or not {column.number for column in columns} <= KNOWN:
        return {}
    wanted = {column.stage for column in columns}
    stages = next(iter(asked.values())).stages  # the same [cycle] for all: see `grid.FIXED`
    cycle = stages.get("cycle") if "cycle" in wanted else None
    assert cycle is None or isinstance(cycle, CycleStage)
    if cycle and cycle.displacement:
        return {}
    groups: dict[tuple[int, bool], list[int]] = {}
    for number, each in asked.items():
        usual = each.solver.name == "newton" and each.influence in (None, "dense")
        if usual and not (cycle and each.scene.friction is None):
            groups.setdefault((len(each.scene), each.load is not None), []).append(number)
    found: dict[int, Measured] = {}
    for (_, by_load), numbers in groups.items():
        scenes = [asked[number].scene for number in numbers]
        controls = [asked[it].load if by_load else asked[it].approach for it in numbers]
        try:
            for rows in in_rows(scenes, np.array(controls), by_load):
                mine = [numbers[place] for place in rows.places.tolist()]
                known = _known(rows, [asked[number].scene for number in mine], cycle)
                found |= {mine[k]: each for k, each in known.items()}
        except FAILURES:  # of one scene; `compute` then measures each scene alone
            continue
    return found


def _known(
    rows: PressedRows, scenes: Sequence[Scene], cycle: CycleStage | None
) -> dict[int, Measured]:
    """The numbers of those rows in which everything is proved, by the number of the row."""
    contacts = rows.contacts()
    modulus = scenes[0].material.contact_modulus  # of all rows of a stack
    tips = np.array([scene.relative_radii for scene in scenes])
    discs = hertz.contact_radius(contacts["asperity_loads"], modulus, tips)
    contacts |= {
        "area": np.pi * (discs**2).sum(axis=1),
        "largest_load": contacts["asperity_loads"].max(axis=1),
        "certificate.load_error": contacts["asperity_load_errors"].max(axis=1),
    }
    good = ~(contacts["status"] == "undecided").any(axis=1)
    values = _in_summary("normal", "", NORMAL, contacts)
    if cycle is not None:
        friction = np.array([scene.friction for scene in scenes], dtype=np.float64)
        limits = friction * contacts["loads"]
        spheres = map(smooth_reference, scenes, contacts["loads"].tolist())
        scales = np.array([(each and each.energy_scale) or np.nan for each in spheres])
        for high, low in zip(cycle.maximum_fraction, cycle.lowest, strict=True):
            proved, cycles = rows.cycles(high * limits, low * limits, friction)
            good &= proved
            amplitude, loss = (high - low) / 2.0 * limits, cycles["losses"]
            moved = np.where(proved, cycles["displacement_amplitudes"], np.nan)  # never 0
            smooth = np.where(np.isnan(scales), np.nan, mindlin.loss((high - low) / 2.0))
            cycles |= {
                "force_amplitude": amplitude,
                "secant_stiffness": amplitude / moved,
                "loss_factor": loss / (np.pi * amplitude * moved),
                "loss_normalised": loss / scales,
                "smooth_normalised": smooth,
                "loss_over_smooth": loss / scales / smooth,
            }
            values |= _in_summary("cycle", row_label((low, high)), CYCLE, cycles)
    found, numbers = {}, np.array([*values.values()], dtype=np.float64).T.tolist()
    for k in np.flatnonzero(good).tolist():
        pressed = contacts["asperity_loads"][k], float(contacts["approaches"][k]), discs[k]
        warned = "; ".join(cautions_about(scenes[k], *pressed))
        found[k] = Measured(dict(zip(values, numbers[k], strict=True)), "", warned)
    return found


def _in_summary(
    stage: str, row: str, names: Sequence[str], found: Mapping[str, Array]
) -> dict[tuple[str, str], Array]:
    """The numbers with these names, from arrays by their names in the singular or the plural."""
    known = {singular(name): values for name, values in found.items()}
    counts = {name: (known["status"] == name).sum(axis=1) for name in names if name in STATUSES}
    return {
        (f"{stage}.{name}", row): each for name, each in (known | counts).items() if name in names
    }
