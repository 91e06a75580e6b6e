"""The measurements, one in each row, and the conclusions from them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from convexrough.bench.scenes import FAMILIES, Family
from convexrough.version import __version__

#: Times count as equal up to this relative difference.
NOISE = 0.1

#: Exponents are fitted to scenes of at least this many asperities, as fixed costs dominate below.
FITTED_FROM = 10_000


@dataclass(frozen=True)
class Row:
    """One task on one scene.

    task    : "solve" (a point of the diagram of time against error: `solver` with the settings that
        `setting` describes), "sweep", or a name in `convexrough.bench.measure.TASKS`
    outcome : "refused" means that the solver does not accept the scene; `message` says why
    seconds : [s] the least of `runs`; for a sweep, the time of one scene
    product : [s] time of a plain product of the same size, from `measure.plain_product`; nan
        without a lattice
    error   : max |P - P_ref| / max P_ref for loads P;  bound : proved bound on this error
    memory  : [bytes] largest increase of the memory of the process; None where unknown
    """

    task: str
    family: Family
    asperities: int
    outcome: Literal["answered", "refused", "failed"] = "answered"
    message: str = ""
    solver: str = "newton"
    setting: str = "default"
    touching: int = 0
    seconds: float = math.nan
    runs: int = 0
    product: float = math.nan
    iterations: int = 0
    error: float = math.nan
    bound: float = math.nan
    memory: int | None = None

    @property
    def default(self) -> bool:
        """True for the default solver with its default settings."""
        return (self.solver, self.setting) == ("newton", "default")

    @property
    def known(self) -> bool:
        """True if the row has an answer with a known error."""
        return self.outcome == "answered" and math.isfinite(self.error)


@dataclass(frozen=True)
class Bench:
    """All that was measured."""

    machine: dict[str, Any]
    quick: bool
    rows: tuple[Row, ...]
    seconds: float

    def panels(self) -> dict[tuple[Family, int], list[Row]]:
        """The rows of all solvers, by family and number of asperities."""
        found: dict[tuple[Family, int], list[Row]] = {}
        for row in self.rows:
            if row.task == "solve":
                found.setdefault((row.family, row.asperities), []).append(row)
        return found

    def presses(self, family: Family, least: int = 0) -> list[Row]:
        """Rows of "press" with an answer, of a family and at least so many asperities."""
        wanted = "press", family, "answered"
        rows = [row for row in self.rows if (row.task, row.family, row.outcome) == wanted]
        return [row for row in rows if row.asperities >= least]

    def exponent(self, family: Family) -> float:
        """The exponent b of the time n^b to press n asperities; nan for fewer than two sizes.

        It is that of the least-squares fit  log time = a + b log n.
        """
        large = self.presses(family, FITTED_FROM)
        if len({row.asperities for row in large}) < 2:
            return math.nan
        sizes, times = np.log([(row.asperities, row.seconds) for row in large]).T
        return float(np.polyfit(sizes, times, 1)[0])

    def summary(self) -> dict[str, Any]:
        """The measurements for JSON; errors are relative to the largest load, times in seconds."""
        return {
            "schema": 2,
            "version": __version__,
            "quick": self.quick,
            "machine": self.machine,
            "seconds": self.seconds,
            "exponents": {family: self.exponent(family) for family in FAMILIES},
            "verdicts": self.verdicts(),
            "rows": [asdict(row) for row in self.rows],
        }

    def verdicts(self) -> list[str]:
        """Sentences: whether the default solver is on the frontier, and how its time grows."""
        lines = []
        for (family, n), rows in self.panels().items():
            beaten = [f"{row.solver}, {row.setting}" for row in better_than_default(rows)]
            said = f"not on the frontier: {'; '.join(beaten)}" if beaten else "on the frontier"
            lines.append(f"{n:,} asperities ({family}): the default solver is {said}.")
        for family in FAMILIES:
            if math.isfinite(b := self.exponent(family)):
                sizes = [row.asperities for row in self.presses(family, FITTED_FROM)]
                lines.append(f"The time of a press grows as n^{b:.2f} from {min(sizes):,} to "
                             f"{max(sizes):,} asperities ({family}).")  # fmt: skip
        return lines


def frontier(rows: Iterable[Row]) -> list[Row]:
    """The Pareto frontier: the points for which no different one is as fast and as accurate."""
    points = [row for row in rows if row.known]

    def dominated(row: Row) -> bool:
        return any(
            other.seconds <= row.seconds
            and other.error <= row.error
            and (other.seconds, other.error) != (row.seconds, row.error)
            for other in points
        )

    return [row for row in points if not dominated(row)]


def better_than_default(rows: Iterable[Row]) -> list[Row]:
    """Points as accurate as the default solver's and faster by more than `NOISE`; or all points.

    All points are better if the default solver has none."""
    points = [row for row in rows if row.known]
    default = next((row for row in points if row.default), None)
    if default is None:
        return points
    limit = default.seconds / (1.0 + NOISE)
    return [row for row in points if row.seconds < limit and row.error <= default.error]
