"""What a load path costs: seven segments on which everything happens that the rules know."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from convexrough import checks
from convexrough.bench.measure import Outcome, outcome_of, timed
from convexrough.bench.scenes import APPROACH, Family
from convexrough.contact import press
from convexrough.errors import InputError, SolverError
from convexrough.memory import MemoryRise
from convexrough.paths.path import LoadPath, load_path
from convexrough.scene.scene import Scene

#: (P, T) over the load at the paper's approach: pressing, shear, unloading and turning round.
CORNERS = np.array(
    [(0.6, 0), (0.6, 0.3), (1, 0.3), (1, -0.15), (0.7, -0.15), (0.7, 0.2), (0.5, 0.1)]
)


@dataclass(frozen=True)
class PathRow:
    """first, again : [s] of the first and the next call, with every bound and word
    presses : how many normal problems;  undecided : how many words are not proved
    error   : proved bound on the last displacement, over the largest
    """

    family: str
    asperities: int
    outcome: Outcome
    message: str = ""
    touching: int = 0
    segments: int = len(CORNERS)
    presses: int = 0
    first: float = np.nan
    again: float = np.nan
    order: str = ""
    undecided: int = 0
    error: float = np.nan
    memory: int | None = None


def measure_path(family: Family, each: Scene) -> PathRow:
    """Follow the path twice."""
    blank = PathRow(family, len(each), "answered")
    contact = press(each, approach=APPROACH)
    P, T = contact.load * CORNERS.T

    def follow() -> LoadPath:
        return load_path(each, loads=P, forces=checks.friction(each.friction) * T)

    memory = MemoryRise()
    try:
        path, first = timed(follow)
        risen = memory.risen()
        _, again = timed(follow)
    except (InputError, SolverError) as error:
        return replace(blank, outcome=outcome_of(error), message=str(error))
    return replace(
        blank,
        touching=int(np.count_nonzero(contact.loads)),
        presses=path.presses,
        first=first,
        again=again,
        order=path.order,
        undecided=int((path.status == "undecided").sum()),
        error=float(path.displacement_errors[-1] / np.abs(path.displacements).max()),
        memory=risen,
    )
