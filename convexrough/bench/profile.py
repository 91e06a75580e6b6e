"""How often each solver is right on the hard cases, and how fast: a performance profile."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from convexrough.arrays import Array, frozen
from convexrough.compare import compare, every_solver
from convexrough.frames import Variables
from convexrough.gallery.cases import case, names
from convexrough.plots.notebook import Figure
from convexrough.plots.style import SINGLE, TICK, label
from convexrough.progress import LOGGER
from convexrough.record import Table
from convexrough.solvers import Newton, Solver

#: `Profile.rows` reports the parts of cases solved within these multiples of the least time.
FACTORS = (1, 2, 5, 10, 100)


@dataclass(frozen=True, eq=False, repr=False)
class Profile(Table):
    """Times of k solvers on m hard cases, after Dolan and More (Math. Program. 91 (2002) 201).

    solvers : (k,) names;  cases : (m,) names
    seconds : (k, m) [s] time of each right answer; infinite where a solver gave none
    outcomes : (k, m) "right", "wrong", "refused" or "failed"
    sets : (k, m) True where exactly the asperities that touch have a load
    """

    solvers: tuple[str, ...]
    cases: tuple[str, ...]
    seconds: Array
    outcomes: tuple[tuple[str, ...], ...]
    sets: NDArray[np.bool_]

    @property
    def ratios(self) -> Array:
        """(k, m) `seconds`, divided by the time of the fastest right answer to the case."""
        least = self.seconds.min(axis=0)
        none = np.full_like(self.seconds, np.inf)
        ratios: Array = np.divide(self.seconds, least, where=np.isfinite(least), out=none)
        return ratios

    def part(self, factor: float) -> Array:
        """(k,) part of the cases answered correctly within this factor of the least time."""
        part: Array = (self.ratios <= factor).mean(axis=1)
        return part

    def rows(self) -> list[dict[str, str | int | float]]:
        """For each solver the numbers of outcomes and right sets, and its `part` for `FACTORS`."""
        parts = np.array([self.part(factor) for factor in FACTORS]).T
        return [
            {"solver": solver}
            | {outcome: said.count(outcome) for outcome in ("right", "wrong", "refused", "failed")}
            | {"contact set right": int(sets.sum())}
            | {f"within {factor}x": float(p) for factor, p in zip(FACTORS, row, strict=True)}
            for solver, said, sets, row in zip(
                self.solvers, self.outcomes, self.sets, parts, strict=True
            )
        ]

    def plot(self, axes: Axes | None = None) -> Axes:
        """Plot the part of the cases answered right against time / least time; return the axes."""
        if axes is None:
            axes = Figure(figsize=(SINGLE, 3.8), layout="constrained").subplots()
        finite = self.ratios[np.isfinite(self.ratios)]
        factors = np.unique(np.append(finite, 2.0 * finite.max(initial=1.0)))
        parts = np.array([self.part(factor) for factor in factors])
        axes.step(factors, parts, where="post", label=self.solvers)
        axes.set(xscale="log", ylim=(0.0, 1.02))
        axes.legend(fontsize=TICK - 2, ncols=2, frameon=False,
                    loc="upper center", bbox_to_anchor=(0.5, -0.2))  # fmt: skip
        label(axes, "time over that of the fastest", "part of the cases")
        return axes

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "cases", f"{len(self.cases):,}"
        for row in self.rows():
            known = f"{row['right']} right, {row['within 2x']:.0%} within 2x of the fastest"
            yield str(row["solver"]), known

    def _variables(self) -> Variables:
        both = ("solver", "case")
        return {
            "solver": (("solver",), np.array(self.solvers)),
            "case": (("case",), np.array(self.cases)),
            "seconds": (both, self.seconds),
            "outcome": (both, np.array(self.outcomes)),
            "set_right": (both, self.sets),
        }


def profile_of(
    solvers: Sequence[Solver] | None = None,
    *,
    cases: Sequence[str] = (),
    within: float = 1e-3,
) -> Profile:
    """Times and outcomes of solvers on the hard cases, run once each.

    solvers : solver objects; default: every solver of `compare`. Newton's method is always first
    cases   : names of cases or families; default: all
    within  : largest error of correct loads, over the largest load
    """
    others = [Newton(), *(s for s in solvers or every_solver() if s != Newton())]
    wanted = names(*cases)
    seconds = np.full((len(others), len(wanted)), np.inf)
    outcomes = [[""] * len(wanted) for _ in others]
    sets = np.zeros(seconds.shape, dtype=bool)
    for column, name in enumerate(wanted):
        LOGGER.info(name)
        hard = case(name)
        entries = compare(hard.scene, **hard.control, solvers=others).entries
        for row, entry in enumerate(entries):
            outcomes[row][column] = entry.outcome
            if (found := entry.contact) is not None:
                checked = hard.check(found.loads, within=within)
                near = checked.error <= within
                sets[row, column] = len(checked.wrongly_open) + len(checked.wrongly_loaded) == 0
                outcomes[row][column] = "right" if near else "wrong"
                seconds[row, column] = found.seconds if near else np.inf
    return Profile(
        solvers=tuple(each.name for each in others),
        cases=wanted,
        seconds=frozen(seconds),
        outcomes=tuple(map(tuple, outcomes)),
        sets=frozen(sets),
    )
