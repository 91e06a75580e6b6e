"""The stages of a run. Each has an entry in `STAGES`."""

from __future__ import annotations

from convexrough.run.stage import Stage
from convexrough.run.stages.constant_load import CycleStage as CycleStage
from convexrough.run.stages.constant_load import HistoryStage
from convexrough.run.stages.constant_load import ShearStage as ShearStage
from convexrough.run.stages.gradient import GradientStage
from convexrough.run.stages.normal import NormalStage as NormalStage
from convexrough.run.stages.path import PathStage, ShakedownStage, SteadyStage

#: Stages by the names of their tables in a scene file, in the order of results.
STAGES: dict[str, type[Stage]] = {each.name: each for each in (
    NormalStage, ShearStage, CycleStage, HistoryStage, PathStage, SteadyStage, ShakedownStage,
    GradientStage)}  # fmt: skip
