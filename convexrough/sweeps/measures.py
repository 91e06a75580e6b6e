"""What a sweep can measure of a contact: the columns of its table, and their values."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from convexrough import checks
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.friction.cycle import Cycle, cycles
from convexrough.friction.onset import onset_of_sliding
from convexrough.friction.shear import ShearState, shear

#: Quantiles of the onset of sliding over the loaded asperities.
QUANTILES = (0.0, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True)
class Stages:
    """The shear stages of every scene, as fractions of f P.

    cycle : minimum and maximum of each steady cycle;  shear : on first loading
    """

    cycle: tuple[tuple[float, float], ...] = ()
    shear: tuple[float, ...] = ()

    def named(self, stage: str) -> list[str]:
        """What each column of a stage ends in: the amplitude of a cycle, the fraction of a force.

        A cycle that is not symmetric is named by its minimum and its maximum.
        """
        if stage == "shear":
            return [f"{fraction!r}" for fraction in self.shear]
        return [f"{high!r}" if low == -high else f"{low!r}_{high!r}" for low, high in self.cycle]


class Sheared:
    """A contact, and its shear stages as far as they are asked for."""

    def __init__(self, contact: Contact, stages: Stages) -> None:
        self.contact, self.stages = contact, stages

    @property
    def limit(self) -> float:
        """f P [force]."""
        return checks.friction(self.contact.scene.friction) * self.contact.load

    @cached_property
    def cycles(self) -> list[Cycle]:
        low, high = self.limit * np.array(self.stages.cycle).T
        return cycles(self.contact, high, low)

    @cached_property
    def states(self) -> list[ShearState]:
        return [shear(self.contact, force=part * self.limit) for part in self.stages.shear]

    @property
    def onsets(self) -> Array:
        """(n,) of the loaded asperities, as fractions of f P."""
        loaded = np.flatnonzero(self.contact.loads)
        return onset_of_sliding(self.contact, which=loaded) / (self.limit or 1.0)

    def undecided(self) -> int:
        """How many words are not proved, in all that was asked for."""
        made = [self.contact, *vars(self).get("cycles", ()), *vars(self).get("states", ())]
        return sum(int((each.status == "undecided").sum()) for each in made)


def _counts(it: Sheared) -> Iterator[float]:
    for word in ("contact", "open", "undecided"):
        yield float((it.contact.status == word).sum())


def _certificate(it: Sheared) -> Iterator[float]:
    judged = it.contact.certificate
    yield from (judged.load_error, judged.convexity_number)
    yield from (it.contact.model_error, it.contact.crowding)


def _onset_quantiles(it: Sheared) -> list[float]:
    onsets = it.onsets
    if len(onsets) == 0:
        return [np.nan] * len(QUANTILES)
    return [float(each) for each in np.quantile(onsets, QUANTILES)]


@dataclass(frozen=True)
class Measure:
    """What is measured under one name.

    values : one for each column; suffixes name them;  stage : the table that it needs, or ""
    units  : "force", "length", "work" or "stiffness" of all columns, or of each; "" of a number
    """

    values: Callable[[Sheared], Iterator[float] | Sequence[float]]
    stage: str = ""
    suffixes: tuple[str, ...] = ()
    units: str | tuple[str, ...] = ""

    def columns(self, name: str, stages: Stages) -> list[str]:
        if self.stage in ("cycle", "shear"):
            return [f"{name}_{each}" for each in stages.named(self.stage)]
        return [f"{name}_{each}" for each in self.suffixes] or [name]


def _of_cycles(value: Callable[[Cycle], float], units: str = "") -> Measure:
    return Measure(lambda it: [value(each) for each in it.cycles], "cycle", units=units)


#: By name. Energies, forces and lengths are in the scene's units.
MEASURES = {
    "contacts": Measure(lambda it: [float((it.contact.status == "contact").sum())]),
    "words": Measure(_counts, suffixes=("contact", "open", "undecided")),
    "load": Measure(lambda it: [it.contact.load], units="force"),
    "approach": Measure(lambda it: [it.contact.approach], units="length"),
    "certificate": Measure(
        _certificate,
        suffixes=("load_error", "convexity_number", "model_error", "crowding"),
        units=("force", "", "", ""),
    ),
    "displacement": Measure(
        lambda it: [state.displacement for state in it.states], "shear", units="length"
    ),
    "onset": Measure(_onset_quantiles, "friction", tuple(f"{part:g}" for part in QUANTILES)),
    "loss": _of_cycles(lambda cycle: cycle.loss, "work"),
    "loss_normalised": _of_cycles(lambda cycle: cycle.loss_normalised),
    "loss_over_smooth": _of_cycles(
        lambda cycle: cycle.loss_normalised / (cycle.smooth_normalised or np.nan)
    ),
    "loss_factor": _of_cycles(lambda cycle: cycle.loss_factor),
    "stiffness": _of_cycles(lambda cycle: cycle.secant_stiffness, "stiffness"),
}


def columns(measures: Sequence[str], stages: Stages) -> list[str]:
    """The names of the measured columns, in the order of the measures."""
    return [each for name in measures for each in MEASURES[name].columns(name, stages)]


def said(column: str) -> str:
    """What a measured column is, as a figure says it: "loss at Q/(fP) = 0.37"."""
    own = [name for name in MEASURES if column == name or column.startswith(f"{name}_")]
    name = max(own, key=len, default=column)
    words, suffix = name.replace("_", " "), column.removeprefix(name).strip("_")
    if not own or not suffix:
        return words
    if name == "onset":
        return f"onset of sliding, Q/(fP), quantile {suffix}"
    if MEASURES[name].stage not in ("cycle", "shear"):
        return suffix.replace("_", " ")
    low, _, high = suffix.rpartition("_")
    return f"{words} at Q/(fP) = {high}" if not low else f"{words}, Q/(fP) from {low} to {high}"


def units(measures: Sequence[str], stages: Stages, length: str, force: str) -> dict[str, str]:
    """What each measured column is in, where the names of both units are known."""
    if not (length and force):
        return {}
    names = {"": "", "length": length, "force": force}
    names |= {"work": f"{force} {length}", "stiffness": f"{force}/{length}"}
    found: dict[str, str] = {}
    for name in measures:
        own = MEASURES[name].columns(name, stages)
        kinds = MEASURES[name].units
        each = [kinds] * len(own) if isinstance(kinds, str) else kinds
        found |= {column: names[kind] for column, kind in zip(own, each, strict=True) if kind}
    return found


def measure(contact: Contact, measures: Sequence[str], stages: Stages) -> tuple[list[float], str]:
    """A value for each of `columns`, and what is not proved, "" if all is."""
    it = Sheared(contact, stages)
    values = [float(each) for name in measures for each in MEASURES[name].values(it)]
    if contact.certificate.scope == "none":
        return values, "no certificate"
    unsure = it.undecided()
    return values, f"{unsure} undecided" if unsure else ""
