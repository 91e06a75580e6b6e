"""The tables [shear], [cycle] and [history] of scene files: shear forces at constant load."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from convexrough import plots
from convexrough.contact import Contact
from convexrough.errors import blamed_on
from convexrough.friction.cycle import Loop, loops
from convexrough.friction.fretting import Fretting, fretting, fretting_columns
from convexrough.friction.onset import indices
from convexrough.friction.path import history
from convexrough.friction.shear import shear
from convexrough.friction.steady import cycles
from convexrough.run.stage import Columns, Labels, Result, Stage, Steps, Summary, limit
from convexrough.run.values import ALSO_ONE, Fractions, Mistake, Positive, Shares, Whole, expected
from convexrough.scene.rings import one_of_each_ring

#: Largest number of asperities whose loops are computed, unless the scene file names them.
MOST_LOOPS = 12

#: Most and fewest points of a loop by default. Between these, the number of touching asperities
#: times points is at most the first number of AFFORDABLE on a lattice, and the second elsewhere.
MOST_POINTS, LEAST_POINTS, AFFORDABLE = 400, 32, (600_000, 150_000)

Points = Annotated[int, expected("a whole number, at least 4", lambda value: value >= 4)]

Chosen = Annotated[
    Literal["all"] | list[Whole], expected('"all" or a list of indices of asperities, from 0')
]


class ShearStage(Stage):
    """Shear forces on first loading, as fractions of the friction limit f P, from 0 to 1."""

    name = "shear"
    numbers = (*("force", "displacement", "displacement_error", "sliding", "partial", "undecided"),
               "scope")  # fmt: skip

    fractions: Shares

    @property
    def labels(self) -> Labels:
        return {"fraction": self.fractions}

    def compute(self, contact: Contact) -> ShearResult:
        f_p = limit(contact)
        states = tuple(shear(contact, force=part * f_p) for part in self.fractions)
        return ShearResult(self, contact, states)


class ShearResult(Result):
    stage: ShearStage
    printed = ("fraction", "force", "displacement", "sliding", "partial", "undecided")

    def proved_forces(self) -> Iterator[float]:
        return (abs(state.force) for state in self.found)

    def tables(self) -> dict[str, Columns]:
        """The tables, with a row for each fraction and asperity."""
        names = ("forces", "stick_radii", "slips", "displacements", "status")
        each = [self.at_asperities(state.columns(*names)) for state in self.found]
        return {"shear": self.stacked(each)}

    def figures(self) -> Mapping[str, Any]:
        return plots.shear_figures(self.found)


class CycleStage(Stage):
    """The largest and smallest shear forces of steady cycles, as fractions of f P.

    minimum_fraction : default: minus the largest force
    displacement : displacement amplitudes of symmetric cycles, in place of forces
    loop_points : approximate number of points of a loop; the default is smaller for many
        asperities, and where order fails
    loop_asperities : indices of asperities whose loops are computed, or "all"; default: one
        asperity at each of at most 12 distances from the axis
    """

    name = "cycle"
    numbers = ("force_amplitude", "displacement_amplitude", "displacement_error",
               "secant_stiffness", "loss_factor", "loss", "loss_error", "loss_normalised",
               "smooth_normalised", "balance_defect", "sliding", "partial",
               "undecided")  # fmt: skip

    alternatives = ("maximum_fraction", "displacement")

    maximum_fraction: Fractions = Field(default=[])
    minimum_fraction: Fractions | None = None
    displacement: Annotated[
        list[Positive], expected("a positive number, or a list of these", bool), ALSO_ONE
    ] = Field(default=[])
    loop_points: Points | None = None
    loop_asperities: Chosen | None = None

    @property
    def lowest(self) -> list[float]:
        """The minimum of each cycle, as a fraction of the friction limit."""
        given = self.minimum_fraction
        return [-value for value in self.maximum_fraction] if given is None else given

    @property
    def labels(self) -> Labels:
        if self.displacement:
            return {"prescribed_displacement": self.displacement}
        return {"maximum_fraction": self.maximum_fraction, "minimum_fraction": self.lowest}

    def mistakes_within(self) -> Iterator[Mistake]:
        if self.displacement:
            if self.minimum_fraction is not None:
                yield "minimum_fraction", "not used with displacement"
            return
        if (n := len(self.lowest)) != len(self.maximum_fraction):
            expected = f"expected {len(self.maximum_fraction)}, as in maximum_fraction"
            yield "minimum_fraction", f"found {n} values, {expected}"
            return
        for i, (low, high) in enumerate(zip(self.lowest, self.maximum_fraction, strict=True)):
            if not low < high:
                expected = f"expected a number above its minimum, {low + 0.0:g}"
                yield f"maximum_fraction[{i}]", f"found {high}, {expected}"

    def compute(self, contact: Contact) -> CycleResult:
        if isinstance(asked := self.loop_asperities, list):
            indices("[cycle] loop_asperities", asked, len(contact.scene))
        if self.displacement:
            with blamed_on("[cycle]"):
                found = cycles(contact, displacement=self.displacement)
        else:
            ranges = np.array([self.maximum_fraction, self.lowest])
            found = cycles(contact, *limit(contact) * ranges)
        return CycleResult(self, contact, tuple(found))


class CycleResult(Result):
    stage: CycleStage
    digits = 6
    printed = ("maximum_fraction", "minimum_fraction", "force_amplitude", "displacement_amplitude",
               "loss", "loss_factor", "loss_over_smooth", "sliding")  # fmt: skip

    def rows(self) -> list[Summary]:
        rows = super().rows()
        for row, cycle in zip(rows, self.found, strict=True):
            smooth = cycle.smooth_normalised or math.nan
            row["loss_over_smooth"] = cycle.loss_normalised / smooth
            row["partial_slip_loss"] = float(cycle.partial_slip_losses.sum())
            row["sliding_loss"] = float(cycle.sliding_losses.sum())
        return rows

    def proved_forces(self) -> Iterator[float]:
        return ((cycle.maximum - cycle.minimum) / 2 for cycle in self.found)

    @cached_property
    def loops(self) -> list[Loop]:
        """For each cycle, the loops of the whole contact and of some asperities."""
        stage, contact = self.stage, self.contact
        touching = max(1, int((contact.loads > 0).sum()))
        most = AFFORDABLE[contact.scene.lattice is None]
        affordable = int(np.clip(most // touching, LEAST_POINTS, MOST_POINTS))
        if any(each.order == "fails" for each in self.found):  # a general step for each point
            affordable = LEAST_POINTS
        chosen = stage.loop_asperities
        if chosen is None:
            distances = contact.scene.asperities.distances
            chosen = one_of_each_ring(distances, contact.loads, MOST_LOOPS)
        points = stage.loop_points or affordable
        return loops(self.found, points, None if chosen == "all" else chosen)

    @cached_property
    def worn(self) -> list[Fretting]:
        """Slip, losses and tractions of each asperity in each cycle."""
        return [fretting(each) for each in self.found]

    def tables(self) -> dict[str, Columns]:
        """The tables of cycles, of loops (in total and by asperity) and of fretting by asperity."""
        worn = self.stacked([fretting_columns([each]) for each in self.worn])
        del worn["maximum"], worn["minimum"]  # fractions replace forces, as in the other tables
        curves = self.stacked([
            {
                "curve": np.repeat(["total", *it.asperities.astype(str)], len(it.forces)),
                "force": np.concatenate([it.forces, *it.asperity_forces.T]),
                "displacement": np.concatenate([it.displacements, *it.asperity_displacements.T]),
            }
            for it in self.loops
        ])  # fmt: skip
        return {**super().tables(), "loop": curves, "fretting": worn}

    def figures(self) -> Mapping[str, Any]:
        widest = max(self.worn, key=lambda each: each.maximum - each.minimum)
        figures = plots.cycle_figures(self.found, loops=self.loops)
        return {**figures, **plots.fretting_figures(widest)}


class HistoryStage(Stage):
    """A sequence of shear forces that starts at 0, as fractions of the friction limit f P."""

    name = "history"
    numbers = ("force", "displacement", "loss", "loss_error")

    fractions: Fractions

    @property
    def labels(self) -> Labels:
        return {"fraction": self.fractions}

    def compute(self, contact: Contact) -> HistoryResult:
        past = history(contact, forces=limit(contact) * np.array(self.fractions))
        return HistoryResult(self, contact, (past,))


class HistoryResult(Steps):
    stage: HistoryStage
    printed = ("fraction", "displacement", "loss")
