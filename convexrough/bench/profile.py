"""How often each solver is right on the hard cases, and how fast: a performance profile."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from convexrough.comparison import compare, every_solver
from convexrough.gallery.cases import case, names
from convexrough.progress import LOGGER
from convexrough.solvers import Newton, Solver

#: Rows report the parts of cases solved within these multiples of the least time.
FACTORS = (1, 2, 5, 10, 100)

#: Largest error of a right answer, divided by the largest load.
WITHIN = 1e-3


def profile_of(
    solvers: Sequence[Solver] | None = None, *, cases: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """A row for each solver, run once on each hard case (Dolan and More, Math. Program. 91, 201).

    solvers : solver objects; default: every solver of `compare`. Newton's method is always first
    cases   : names of cases or families; default: all

    A row contains the numbers of cases with each outcome ("right", "wrong", "refused", "failed"),
    and of those in which exactly the asperities that touch have a load. Further entries are the
    parts of the cases answered correctly within multiples of the least time of a right answer, and
    `outcomes` by case.
    """
    solvers = [Newton(), *(s for s in solvers or every_solver() if s != Newton())]
    cases, said = names(*cases), [each.name for each in solvers]
    seconds = np.full((len(solvers), len(cases)), np.inf)
    outcomes = np.full(seconds.shape, "", dtype="U8")
    sets = np.zeros(seconds.shape, dtype=bool)
    for column, name in enumerate(cases):
        LOGGER.info(name)
        hard = case(name)
        for row, entry in enumerate(compare(hard.scene, **hard.control, solvers=solvers).entries):
            outcomes[row, column] = entry.outcome
            if entry.contact is not None:
                said[row] = max(said[row], entry.solver, key=len)  # with "+ refinement" if any is
                checked = hard.check(entry.contact.loads, within=WITHIN)
                sets[row, column] = not (len(checked.wrongly_open) or len(checked.wrongly_loaded))
                outcomes[row, column] = "right" if checked.error <= WITHIN else "wrong"
                if checked.error <= WITHIN:
                    seconds[row, column] = entry.contact.seconds
    least = seconds.min(axis=0)
    ratios = seconds / np.where(np.isfinite(least), least, 1.0)
    rows = []
    for solver, own, right, ratio in zip(said, outcomes.tolist(), sets, ratios, strict=True):
        counts = {it: own.count(it) for it in ("right", "wrong", "refused", "failed")}
        parts = {f"within {factor}x": float((ratio <= factor).mean()) for factor in FACTORS}
        known = {"solver": solver, **counts, "contact set right": int(right.sum()), **parts}
        rows.append(known | {"outcomes": dict(zip(cases, own, strict=True))})
    return rows
