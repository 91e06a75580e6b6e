"""[shear]: the states after monotonic shear to several forces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from convexrough.contact import Contact
from convexrough.friction.shear import shear
from convexrough.run.stage import Columns, Result, Stage, Summary, limit, repeated
from convexrough.run.values import Shares


class ShearStage(Stage):
    """Shear forces after loading from rest, as fractions of the friction limit f P, from 0 to 1."""

    name = "shear"
    numbers = (*("force", "displacement", "displacement_error", "sliding", "partial", "undecided"),)
    labels = ("fraction",)

    fractions: Shares

    def compute(self, contact: Contact) -> ShearResult:
        f_p = limit(contact)
        states = (shear(contact, force=part * f_p) for part in self.fractions)
        return ShearResult(self, contact, tuple(states))


@dataclass(frozen=True, eq=False, repr=False)
class ShearResult(Result):
    """The result of [shear]: a friction state for each fraction."""

    stage: ShearStage
    printed: ClassVar[Mapping[str, str]] = {
        "fraction": "Q/(fP)",
        "force": "force",
        "displacement": "displacement",
        "sliding": "sliding",
        "partial": "partial",
        "undecided": "undecided",
    }

    def rows(self) -> list[Summary]:
        return [
            {"fraction": part, **row, "scope": state.certificate.scope}
            for part, row, state in zip(
                self.stage.fractions, super().rows(), self.found, strict=True
            )
        ]

    def proved_forces(self) -> Iterator[float]:
        return (abs(state.force) for state in self.found)

    def tables(self) -> dict[str, Columns]:
        """The tables, with a row for each fraction and asperity."""
        x, y = self.contact.scene.asperities.positions.T
        names = ("forces", "stick_radii", "slips", "displacements", "status")
        each = [{"x": x, "y": y, **state.columns(*names)} for state in self.found]
        return {"shear": repeated({"fraction": np.array(self.stage.fractions)}, each)}

    def figures(self) -> Mapping[str, Any]:
        from convexrough.plots import shear_figures  # matplotlib: only when it draws

        return shear_figures(self.found)
