"""The stages of a run. Each has a module of its own and an entry in `STAGES`."""

from __future__ import annotations

from convexrough.run.stage import Stage
from convexrough.run.stages.cycle import Cycle
from convexrough.run.stages.gradient import Gradient
from convexrough.run.stages.history import History
from convexrough.run.stages.normal import Normal
from convexrough.run.stages.path import Path, Steady
from convexrough.run.stages.shakedown import Shakedown
from convexrough.run.stages.shear import Shear

__all__ = [
    "STAGES",
    "Cycle",
    "Gradient",
    "History",
    "Normal",
    "Path",
    "Shakedown",
    "Shear",
    "Steady",
]

#: Tables of a scene file that compute something, by their names, in the order of results.
STAGES: dict[str, type[Stage]] = {
    each.name: each for each in (Normal, Shear, Cycle, History, Path, Steady, Shakedown, Gradient)
}
