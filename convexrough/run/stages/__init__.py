"""The stages of a run. Each has a module of its own and an entry in `STAGES`."""

from __future__ import annotations

from convexrough.run.stage import Stage
from convexrough.run.stages.constant_load import CycleStage, HistoryStage, ShearStage
from convexrough.run.stages.gradient import GradientStage
from convexrough.run.stages.normal import NormalStage
from convexrough.run.stages.path import PathStage, SteadyStage
from convexrough.run.stages.shakedown import ShakedownStage

__all__ = [
    "STAGES",
    "CycleStage",
    "GradientStage",
    "HistoryStage",
    "NormalStage",
    "PathStage",
    "ShakedownStage",
    "ShearStage",
    "SteadyStage",
]

#: Stages by the names of their tables in a scene file, in the order of results.
STAGES: dict[str, type[Stage]] = {
    each.name: each
    for each in (
        NormalStage,
        ShearStage,
        CycleStage,
        HistoryStage,
        PathStage,
        SteadyStage,
        ShakedownStage,
        GradientStage,
    )
}
