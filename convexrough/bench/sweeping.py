"""What a scene costs in a sweep, beside one that is pressed and sheared alone.

python -m convexrough.bench.sweeping          # ten thousand scenes by one process and by two
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from convexrough.bench.scenes import REFINEMENTS
from convexrough.contact import press
from convexrough.run.columns import aligned
from convexrough.scene.asperities import Asperities
from convexrough.scene.material import Material
from convexrough.scene.scene import Scene
from convexrough.shearing.cycle import cycle
from convexrough.sweeps.engines import processes
from convexrough.sweeps.running import run
from convexrough.sweeps.sweep_file import plan_of

#: Scenes that are computed one by one to compare with.
ALONE = 50

HEADING = ["asperities", "scenes", "processes", "seconds", "ms each", "ms alone", "efficiency"]
HEADING += ["certified"]


@dataclass(frozen=True)
class SweepRow:
    """One sweep: random heights on one array, a load, a cycle each.

    seconds : from the start of its processes to the last row
    alone   : [s] of a scene made, pressed and cycled one by one in one process
    """

    asperities: int
    scenes: int
    workers: int
    seconds: float
    alone: float
    certified: int


def measure_sweeps(size: int, scenes: int, workers: Sequence[int]) -> list[SweepRow]:
    """The same sweep by so many processes; `size` is a key of `REFINEMENTS`."""
    refinement = REFINEMENTS[size]
    lattice = {"spacing": 0.0025 / refinement, "tip_radius": 0.02 / refinement, "within": 0.0102}
    spread = 1e-6 / refinement
    plan = plan_of(
        {
            "sphere": {"radius": 1.0},
            "material": {"contact_modulus": 1.0, "poisson_ratio": 0.3},
            "asperities": {"pattern": "hexagonal", **lattice, "height_std": spread},
            "normal": {"load": 3.6e-7},
            "friction": {"coefficient": 0.5},
            "cycle": {"maximum": [0.37]},
            "sweep": {"seeds": scenes, "measure": ["contacts", "loss"]},
        },
        Path("bench"),
    )
    began = time.perf_counter()
    for seed in range(ALONE):
        asperities = Asperities.hexagonal(**lattice, height_std=spread, seed=seed)
        contact = press(Scene(1.0, asperities, Material(1.0, 0.3), 0.5), load=3.6e-7)
        cycle(contact, maximum=0.37 * 0.5 * contact.load)
    alone = (time.perf_counter() - began) / ALONE
    rows = []
    for count in workers:
        began = time.perf_counter()
        with processes(count) as engine:
            status = run(plan, engine).table.read(["status"])["status"]
        seconds = time.perf_counter() - began
        certified = int(np.count_nonzero(status == "certified"))
        rows.append(SweepRow(len(asperities), scenes, count, seconds, alone, certified))
    return rows


def table(rows: Sequence[SweepRow]) -> list[list[str]]:
    """Cells; efficiency is the time of one process over that of n, over n."""
    cells = [HEADING]
    for row in rows:
        one = [
            each.seconds
            for each in rows
            if (each.workers, each.asperities, each.scenes) == (1, row.asperities, row.scenes)
        ]
        part = f"{one[0] / row.seconds / row.workers:.2f}" if one else "-"
        each = f"{1e3 * row.seconds / row.scenes:.2f}"
        cells.append(
            [f"{row.asperities:,}", f"{row.scenes:,}", str(row.workers), f"{row.seconds:.1f}", each,
             f"{1e3 * row.alone:.2f}", part, f"{row.certified:,}"]
        )  # fmt: skip
    return cells


if __name__ == "__main__":
    print("\n".join(aligned(table(measure_sweeps(61, 10_000, (1, 2))))))
