"""What a sweep can measure: every number of the summary of a run, by its name or the end of it.

`cycle.loss` is the loss of each cycle; so is `loss`, as no stage before has one. Columns are named
by the measure and the row of the summary: `loss_0.37` is that of the cycle between +-0.37 f P,
`history.loss_2` that of the third force of a history.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, cast

import numpy as np

from convexrough import checks
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.cycle import Loop, cycles
from convexrough.friction.onset import onset_of_sliding
from convexrough.run.stages import Cycled, Stages, compute
from convexrough.run.summary import Summary, proved, summarise

#: What the summary of a run holds, and the onset of sliding.
STAGES = (
    *("normal", "shear", "cycle", "history", "path", "steady", "phase_losses", "shakedown"),
    *("gradient", "onset"),
)

#: Quantiles of the onset of sliding over the loaded asperities.
QUANTILES = (0.0, 0.25, 0.5, 0.75, 1.0)


class Column(NamedTuple):
    """A column of a table, the number of a summary in it, and the row of that."""

    name: str
    number: str
    row: str

    @property
    def stage(self) -> str:
        return self.number.partition(".")[0]


def numbers(summary: Summary) -> dict[tuple[str, str], float]:
    """Every number of a summary, by its name and row."""
    stages = {name: stage for name, stage in summary.items() if isinstance(stage, (dict, list))}
    return {(".".join(path), row): value for path, row, value in _numbers(stages)}


def _numbers(
    value: Any, path: tuple[str, ...] = (), row: str = ""
) -> Iterator[tuple[tuple[str, ...], str, float]]:
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _numbers(each, (*path, key), row)
    elif isinstance(value, list):
        for i, each in enumerate(value):
            yield from _numbers(each, path, _row(each, f"{row}_{i}" if row else f"{i}"))
    elif isinstance(value, (int, float)):
        yield path, row, float(value)


def _row(value: Any, place: str) -> str:
    """What is said of a row: the force of a shear, the amplitude of a cycle; or its place."""
    known = value if isinstance(value, dict) else {}
    if "maximum" in known:
        low, high = known["minimum"], known["maximum"]
        return f"{high!r}" if low == -high else f"{low!r}_{high!r}"
    for key in ("fraction", "quantile"):
        if key in known:
            return f"{known[key]!r}"
    return place


def chosen(contact: Contact, stages: Stages, measures: Sequence[str]) -> tuple[Column, ...]:
    """The columns of each measure: the first number of that name. Raises InputError.

    No stage is computed beyond the one in which the last of them is found.
    """
    rows: dict[str, list[str]] = {}
    for stage in STAGES:
        if all(any(_ends(number, name) for number in rows) for name in measures):
            break
        if stage != "onset" or any(_ends("onset.onset", name) for name in measures):
            for number, row in numbers(measured(contact, stages, {stage})):
                if row not in rows.setdefault(number, []):
                    rows[number].append(row)
    columns = []
    for name in measures:
        number = next((each for each in rows if _ends(each, name)), "")
        if not number:
            names = sorted({each.rpartition(".")[2] for each in rows} | {"onset"})
            expected = f"a number of the stages of this file: {checks.nearest(name, names)}"
            raise InputError("[sweep] measure", found=f'"{name}"', expected=expected)
        columns += [Column(f"{name}_{row}" if row else name, number, row) for row in rows[number]]
    return tuple(columns)


def _ends(number: str, name: str) -> bool:
    return f".{number}".endswith(f".{name}")


def measured(contact: Contact, stages: Stages, wanted: Container[str]) -> Summary:
    """The summary of some stages, and of the contact itself."""
    stages = _only(stages, wanted)
    found = compute(contact, replace(stages, cycle=None))
    if stages.cycle:
        limit = checks.friction(contact.scene.friction) * contact.load
        steady = cycles(contact, *(limit * np.array(each) for each in stages.cycle))
        pairs = zip(*stages.cycle, steady, strict=True)  # no loop is measured
        found = replace(found, cycles=tuple(Cycled(*each, cast(Loop, None)) for each in pairs))
    summary = summarise(found)
    for row in summary.get("cycle", ()):
        row["loss_over_smooth"] = row["loss_normalised"] / (row["smooth_normalised"] or np.nan)
    return summary | ({"onset": _onsets(contact)} if "onset" in wanted else {})


def _only(stages: Stages, wanted: Container[str]) -> Stages:
    alone = {name: None for name in ("shear", "cycle", "history", "gradient") if name not in wanted}
    kept = {
        name: value
        for name, value in stages.varying._asdict().items()
        if {"phases": "phase_losses"}.get(name, name) in wanted
    }
    return replace(stages, **cast(Any, alone), varying=type(stages.varying)(**kept))


def _onsets(contact: Contact) -> list[Summary]:
    """Quantiles over the loaded asperities of the force, over f P, at which they start to slide."""
    which = np.flatnonzero(contact.loads)
    limit = checks.friction(contact.scene.friction) * contact.load
    onsets = onset_of_sliding(contact, which=which) / (limit or 1.0)
    found = np.quantile(onsets, QUANTILES) if len(onsets) else np.full(len(QUANTILES), np.nan)
    return [{"quantile": q, "onset": float(it)} for q, it in zip(QUANTILES, found, strict=True)]


def unproved(summary: Summary) -> str:
    """What is not proved of a summary, "" if all is."""
    if proved(summary):
        return ""
    if summary["normal"]["certificate"]["scope"] == "none":
        return "no certificate"
    words = [n for (name, _), n in numbers(summary).items() if name.endswith(".undecided")]
    return f"{sum(words):.0f} undecided" if sum(words) else "not proved"


#: What numbers are, by the end of their name, and a file's keys.
KINDS = {
    "force": ("load", "largest_load", "load_error", "force", "force_amplitude", "loads"),
    "length": (
        *("approach", "approach_error", "gap_error", "displacement", "displacement_error"),
        *("displacement_amplitude", "radius", "spacing", "tip_radius", "within", "height_std"),
    ),
    "work": ("loss", "loss_error", "loss_first", "duality_gap"),
    "stiffness": ("secant_stiffness",),
}


def unit(number: str, length: str, force: str) -> str:
    """What a number of a summary, or a key of a file, is in; "" where that has no name."""
    names = {"length": length, "force": force, "work": f"{force} {length}"}
    names["stiffness"] = f"{force}/{length}"
    kinds = [kind for kind, ends in KINDS.items() if number.rpartition(".")[2] in ends]
    known = length and force and not number.startswith("gradient.")
    return names[kinds[0]] if kinds and known else ""
