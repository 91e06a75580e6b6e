"""[history]: a sequence of shear forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from convexrough.contact import Contact
from convexrough.friction.path import history
from convexrough.run.stage import Columns, Stage, Steps, limit
from convexrough.run.values import Fractions


class HistoryStage(Stage):
    """A sequence of shear forces that starts at 0, as fractions of the friction limit f P."""

    name = "history"
    numbers = ("force", "displacement", "loss", "loss_error")

    fractions: Fractions

    def compute(self, contact: Contact) -> HistoryResult:
        past = history(contact, forces=limit(contact) * np.array(self.fractions))
        return HistoryResult(self, contact, (past,))


@dataclass(frozen=True, eq=False, repr=False)
class HistoryResult(Steps):
    """The result of [history]: the state after each force."""

    stage: HistoryStage
    printed: ClassVar[Mapping[str, str]] = {
        "fraction": "Q/(fP)",
        "displacement": "displacement",
        "loss": "loss",
    }

    def columns_of_steps(self) -> Columns:
        return {"fraction": np.array(self.stage.fractions), **super().columns_of_steps()}
