"""Scenes of a batch that are pressed and cycled together.

Each scene is then a row of common arrays. Only numbers in `NORMAL` and `CYCLE` can be measured so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from convexrough.arrays import Array
from convexrough.plausibility import cautions_about
from convexrough.rows import PressedRows, in_rows
from convexrough.run.scene_file import Task
from convexrough.run.stages import CycleStage
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import smooth_reference
from convexrough.sweeps.measures import FAILURES, Column, Measured, Numbers, row_label

#: Arrays with an entry or a row for each scene, by their names in `Contacts` or `Cycles`.
Found = Mapping[str, Array]


def _count(status: str) -> Callable[[Found], Array]:
    return lambda found: (found["status"] == status).sum(axis=1)


#: Numbers of summaries, computed from arrays of `Contacts` and `Cycles` and from "amplitudes" (of
#: force), "moved" (proved displacement amplitudes), "smooth" and "scales" (losses of spheres).
NORMAL: dict[str, Callable[[Found], Array]] = {
    **{name: _count(name) for name in ("contact", "open", "undecided")},
    "approach": lambda found: found["approaches"],
    "approach_error": lambda found: found["approach_errors"],
    "load": lambda found: found["loads"],
    "largest_load": lambda found: found["asperity_loads"].max(axis=1),
    "certificate.load_error": lambda found: found["asperity_load_errors"].max(axis=1),
}
CYCLE: dict[str, Callable[[Found], Array]] = {
    **{name: _count(name) for name in ("sliding", "partial", "undecided")},
    "loss": lambda found: found["losses"],
    "loss_error": lambda found: found["loss_errors"],
    "force_amplitude": lambda found: found["amplitudes"],
    "displacement_amplitude": lambda found: found["displacement_amplitudes"],
    "displacement_error": lambda found: found["displacement_errors"],
    "secant_stiffness": lambda found: found["amplitudes"] / found["moved"],
    "loss_factor": lambda found: found["losses"] / (np.pi * found["amplitudes"] * found["moved"]),
    "loss_normalised": lambda found: found["losses"] / found["scales"],
    "smooth_normalised": lambda found: found["smooth"],
    "loss_over_smooth": lambda found: found["losses"] / found["scales"] / found["smooth"],
}
KNOWN = {f"normal.{name}" for name in NORMAL} | {f"cycle.{name}" for name in CYCLE}


def measured_together(asked: Mapping[int, Task], columns: Sequence[Column]) -> dict[int, Measured]:
    """The measured numbers of the scenes that are proved together, by the index of the scene."""
    if not {column.number for column in columns} <= KNOWN:
        return {}
    groups: dict[tuple[int, bool, int], list[int]] = {}
    for number, each in asked.items():
        cycle = _cycle(each, columns)
        usual = each.solver.name == "newton" and each.influence in (None, "dense")
        if usual and not (cycle and each.scene.friction is None):
            ends = len(cycle.maximum_fraction) if cycle else 0
            groups.setdefault((len(each.scene), each.load is not None, ends), []).append(number)
    found: dict[int, Measured] = {}
    for (_, by_load, _), numbers in groups.items():
        some = [asked[number] for number in numbers]
        controls = np.array([each.load if by_load else each.approach for each in some])
        try:
            for rows in in_rows([each.scene for each in some], controls, by_load):
                mine = [some[k] for k in rows.places.tolist()]
                for k, known in _known(rows, mine, columns).items():
                    found[numbers[rows.places[k]]] = known
        except FAILURES:  # one scene failed, so that `compute` measures each alone
            continue
    return found


def _cycle(asked: Task, columns: Sequence[Column]) -> CycleStage | None:
    stage = asked.stages.get("cycle")
    wanted = any(column.stage == "cycle" for column in columns)
    return stage if wanted and isinstance(stage, CycleStage) else None


def _known(
    rows: PressedRows, asked: Sequence[Task], columns: Sequence[Column]
) -> dict[int, Measured]:
    contacts = rows.contacts()
    good = ~(contacts["status"] == "undecided").any(axis=1)
    normal = {name: number(contacts) for name, number in NORMAL.items()}
    numbers: list[Numbers] = [
        {(f"normal.{name}", ""): float(values[k]) for name, values in normal.items()}
        for k in range(len(asked))
    ]
    stages = [stage for each in asked if (stage := _cycle(each, columns))]
    if stages:
        friction = np.array([each.scene.friction for each in asked], dtype=np.float64)
        limits = friction * contacts["loads"]
        smooth = [
            smooth_reference(each.scene, float(load))
            for each, load in zip(asked, contacts["loads"], strict=True)
        ]
        scales = np.array([np.nan if each is None else each.energy_scale for each in smooth])
        highs = np.array([stage.maximum_fraction for stage in stages]).T
        lows = np.array([stage.lowest for stage in stages]).T
        for high, low in zip(highs, lows, strict=True):
            proved, fields = rows.cycles(high * limits, low * limits, friction)
            good &= proved
            half = (high - low) / 2.0
            moved = np.where(proved, fields["displacement_amplitudes"], np.nan)  # never 0
            fields |= {"amplitudes": half * limits, "scales": scales, "moved": moved}
            fields["smooth"] = np.where(np.isnan(scales), np.nan, mindlin.loss(half))
            cycle = {name: number(fields) for name, number in CYCLE.items()}
            for k, known in enumerate(numbers):
                label = row_label((low[k], high[k]))
                known |= {(f"cycle.{name}", label): float(it[k]) for name, it in cycle.items()}
    return {
        k: Measured(
            numbers[k],
            "",
            "; ".join(cautions_about(asked[k].scene, contacts["asperity_loads"][k])),
        )
        for k in np.flatnonzero(good).tolist()
    }
