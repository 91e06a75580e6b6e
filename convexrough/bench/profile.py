"""How often each solver is right on the hard cases, and how fast: a performance profile."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.comparison import compare, every_solver
from convexrough.gallery.cases import case, names
from convexrough.plots.notebook import new_axes
from convexrough.plots.style import SINGLE, TICK, label
from convexrough.progress import LOGGER
from convexrough.solvers import Newton, Solver

#: `Profile.rows` reports the parts of cases solved within these multiples of the least time.
FACTORS = (1, 2, 5, 10, 100)


@dataclass(frozen=True, eq=False)
class Profile:
    """Times of k solvers on m hard cases, after Dolan and More (Math. Program. 91 (2002) 201).

    solvers : names;  cases : names
    seconds : (k, m) [s] time of each right answer; infinite where a solver gave none
    outcomes : (k, m) "right", "wrong", "refused" or "failed"
    sets : (k, m) True where exactly the asperities that touch have a load
    """

    solvers: list[str]
    cases: Sequence[str]
    seconds: Array
    outcomes: NDArray[np.str_]
    sets: NDArray[np.bool_]

    @property
    def ratios(self) -> Array:
        """(k, m) `seconds`, divided by the time of the fastest right answer to the case."""
        least = self.seconds.min(axis=0)
        return self.seconds / np.where(np.isfinite(least), least, 1.0)

    def part(self, factor: float) -> Array:
        """(k,) part of the cases answered correctly within this factor of the least time."""
        return np.asarray((self.ratios <= factor).mean(axis=1))

    def rows(self) -> list[dict[str, str | int | float]]:
        """For each solver the numbers of outcomes and of right `sets`, and `part` for `FACTORS`."""
        rows = list[dict[str, str | int | float]]()
        for i, solver in enumerate(self.solvers):
            outcomes = self.outcomes[i].tolist()
            counts = {it: outcomes.count(it) for it in ("right", "wrong", "refused", "failed")}
            parts = {f"within {factor}x": float(self.part(factor)[i]) for factor in FACTORS}
            right = int(self.sets[i].sum())
            rows.append({"solver": solver, **counts, "contact set right": right, **parts})
        return rows

    def plot(self, axes: Axes | None = None) -> Axes:
        """Plot the part of cases answered correctly against time / least time; return the axes."""
        axes = new_axes((SINGLE, 3.8)) if axes is None else axes
        finite = self.ratios[np.isfinite(self.ratios)]
        factors = np.unique(np.append(finite, 2.0 * finite.max(initial=1.0)))
        parts = np.array([self.part(factor) for factor in factors])
        axes.step(factors, parts, where="post", label=self.solvers)
        axes.set(xscale="log", ylim=(0.0, 1.02))
        axes.legend(fontsize=TICK - 2, ncols=2, frameon=False,
                    loc="upper center", bbox_to_anchor=(0.5, -0.2))  # fmt: skip
        label(axes, "time / time of the fastest solver", "part of the cases answered correctly")
        return axes


def profile_of(
    solvers: Sequence[Solver] | None = None,
    *,
    cases: Sequence[str] = (),
    within: float = 1e-3,
) -> Profile:
    """Times and outcomes of solvers on the hard cases, run once each.

    solvers : solver objects; default: every solver of `compare`. Newton's method is always first
    cases   : names of cases or families; default: all
    within  : largest error of a right answer, divided by the largest load
    """
    solvers = [Newton(), *(s for s in solvers or every_solver() if s != Newton())]
    wanted, said = names(*cases), [each.name for each in solvers]
    seconds = np.full((len(solvers), len(wanted)), np.inf)
    outcomes = np.full(seconds.shape, "", dtype="U8")
    sets = np.zeros(seconds.shape, dtype=bool)
    for column, name in enumerate(wanted):
        LOGGER.info(name)
        hard = case(name)
        for row, entry in enumerate(compare(hard.scene, **hard.control, solvers=solvers).entries):
            outcomes[row, column] = entry.outcome
            if entry.contact is not None:
                said[row] = max(said[row], entry.solver, key=len)  # with "+ refinement" if any is
                checked = hard.check(entry.contact.loads, within=within)
                sets[row, column] = not (len(checked.wrongly_open) or len(checked.wrongly_loaded))
                outcomes[row, column] = "right" if checked.error <= within else "wrong"
                if checked.error <= within:
                    seconds[row, column] = entry.contact.seconds
    return Profile(said, wanted, seconds, outcomes, sets)
