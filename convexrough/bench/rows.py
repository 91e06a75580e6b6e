"""The measurements, one in each row; the conclusions, and the page that shows them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from convexrough.bench.scenes import FAMILIES, Family
from convexrough.errors import FileError, file_errors
from convexrough.tabular.columns import aligned, markdown
from convexrough.version import __version__

#: Markers of the block of a page that `page_text` replaces.
BEGIN, END = "<!-- bench: begin -->", "<!-- bench: end -->"

#: Tasks that have no plain column of seconds in the table of sizes.
NOT_OTHER = ("solve", "press", "from nothing", "sweep")

#: Times count as equal up to this relative difference.
NOISE = 0.1

#: Exponents are fitted to scenes of at least this many asperities; in smaller ones, costs that do
#: not depend on size dominate.
FITTED_FROM = 10_000


@dataclass(frozen=True)
class Row:
    """One task on one scene.

    task    : "solve" (a press by `solver` with the settings that `setting` describes; each row
        gives a point in a diagram of `seconds` against `error`), "sweep", or a name in
        `convexrough.bench.measure.TASKS`
    outcome : "refused" means that the solver does not accept the scene; `message` says why
    seconds : [s] the least of `runs`; for a sweep, the time of one scene
    product : [s] from `measure.plain_product`
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
    def scene(self) -> tuple[Family, int]:
        """The family and the number of asperities."""
        return self.family, self.asperities

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
                found.setdefault(row.scene, []).append(row)
        return found

    def presses(self, family: Family, least: int = 0) -> list[Row]:
        """Rows of answered presses of a family, with at least `least` asperities."""
        wanted = "press", family, "answered"
        rows = [row for row in self.rows if (row.task, row.family, row.outcome) == wanted]
        return [row for row in rows if row.asperities >= least]

    def exponent(self, family: Family) -> float:
        """The exponent b of the time n^b to press n >= `FITTED_FROM` asperities, by least squares
        of logarithms; nan for fewer than two sizes."""
        large = [(row.asperities, row.seconds) for row in self.presses(family, FITTED_FROM)]
        if len({size for size, _ in large}) < 2:
            return math.nan
        sizes, times = np.log(large).T
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
            if beaten := [f"{row.solver}, {row.setting}" for row in better_than_default(rows)]:
                said = f"not on the frontier: {'; '.join(beaten)}"
            elif any(row.known for row in rows):
                said = "on the frontier"
            else:
                said = "not compared, because no reference loads are proved accurate enough"
            lines.append(f"{n:,} asperities ({family}): the default solver is {said}.")
        for family in FAMILIES:
            if math.isfinite(b := self.exponent(family)):
                sizes = [row.asperities for row in self.presses(family, FITTED_FROM)]
                lines.append(f"The time of a press grows as n^{b:.2f} from {min(sizes):,} to "
                             f"{max(sizes):,} asperities ({family}).")  # fmt: skip
        return lines


def frontier(rows: Iterable[Row]) -> list[Row]:
    """The Pareto frontier: points such that no other is at least as fast and as accurate."""
    points = [row for row in rows if row.known]
    found = {(row.seconds, row.error) for row in points}
    as_good = [[s <= row.seconds and e <= row.error for s, e in found] for row in points]
    return [row for row, others in zip(points, as_good, strict=True) if sum(others) == 1]


def better_than_default(rows: Iterable[Row]) -> list[Row]:
    """Points as accurate as the default's, and faster by more than `NOISE`; all if it has none."""
    points = [row for row in rows if row.known]
    default = next((row for row in points if row.default), None)
    if default is None:
        return points
    limit = default.seconds / (1.0 + NOISE)
    return [row for row in points if row.seconds < limit and row.error <= default.error]


def describe(bench: Bench) -> list[str]:
    """The measurements as aligned lines for the terminal."""
    lines = [machine_line(bench)]
    for (family, n), rows in bench.panels().items():
        table, best = [["solver", "setting", "error", "seconds", "iterations", ""]], frontier(rows)
        for row in rows:
            error = f"{row.error:.1e}" if row.known else row.outcome
            mark = "frontier" if row in best else ""
            table.append([row.solver, row.setting, error, _seconds(row), f"{row.iterations}", mark])
        lines += ["", f"{n:,} asperities ({family})", *aligned(table, left=2)]
    return [*lines, "", *aligned(size_table(bench), left=1), "", *_messages(bench)]


def page_text(page: Path, bench: Bench) -> str:
    """The text of a page with the results in its block, as Markdown. Raises as `split_page`."""
    before, after = split_page(page)
    lines = [
        f"{before}{BEGIN}\n\n{machine_line(bench)}",
        "![Time against error, every solver, at each size](figures/work-precision.png)",
        "![Time of a certified press against the number of asperities](figures/cost.png)",
        "\n".join(markdown(size_table(bench), left=1)),
        "\n".join(f"- {line}" for line in _messages(bench)),
        f"{END}{after}",
    ]
    return "\n\n".join(lines)


def machine_line(bench: Bench) -> str:
    """A line about the machine and its load."""
    on = bench.machine
    versions = ", ".join(f"{name} {number}" for name, number in on["versions"].items())
    load = on["load_average"]
    known = "unknown" if load is None else f"{load:.1f}"
    busy = "; other work was running, so times are high" if (load or 0.0) > 0.3 else ""
    return (
        f"{'Quick' if bench.quick else 'Full'} run of {bench.seconds / 60:.1f} min, {on['date']}, "
        f"on {on['cores']} cores ({on['processor']}, {on['memory'] / 2**30:.0f} GiB, "
        f"{on['system']}): convexrough {__version__}, Python {on['python']}, {versions}. Threads "
        f"of linear algebra: {on['linear_algebra_threads']}. Load average: {known}{busy}."
    )


def size_table(bench: Bench) -> list[list[str]]:
    """A heading, and a row for each scene: times [s] of tasks, and of presses also in products."""
    on = f"in products on {bench.machine['cores']} cores"
    other = [it for it in dict.fromkeys(row.task for row in bench.rows) if it not in NOT_OTHER]
    heading = ["scene", "asperities", "touching", "press", on, "from nothing", on, *other]
    table = [[*heading, "MB", "proved error"]]
    for row in bench.rows:
        if row.task == "press" and row.outcome == "answered":
            found = {it.task: it for it in bench.rows if it.scene == row.scene}
            cells = [row.family, f"{row.asperities:,}", f"{row.touching:,}"]
            for one in (row, found["from nothing"]):
                counted = one.seconds / one.product  # nan without a lattice
                cells += [_seconds(one), f"{counted:.0f}" if math.isfinite(counted) else "-"]
            cells += [_seconds(found.get(task)) for task in other]
            memory = "-" if row.memory is None else f"{row.memory / 1e6:.0f}"
            table.append([*cells, memory, f"{row.bound:.0e}"])
    return table


def _messages(bench: Bench) -> list[str]:
    lines = bench.verdicts()
    for row in bench.rows:
        if row.task == "sweep":
            lines.append(f"Time per scene of about {row.asperities:,} asperities, with a cycle, in "
                         f"a sweep ({row.message}): {1e3 * row.seconds:.2f} ms.")  # fmt: skip
        elif row.task != "solve" and row.outcome != "answered":
            place = f"{row.task}, {row.asperities:,} asperities ({row.family})"
            lines.append(f"{place}: {row.outcome}, {row.message}")
    return lines


def split_page(page: Path) -> tuple[str, str]:
    """The text before and after the block of a page. Raises FileError unless it has one block."""
    with file_errors(page, "be read"):
        text = page.read_text(encoding="utf-8")
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end or BEGIN in after or END in after or END in before:
        raise FileError(f"{page}: expected one line {BEGIN} and below it one line {END}")
    return before, after


def _seconds(row: Row | None) -> str:
    if row is None or row.outcome != "answered":
        return "-"
    if row.seconds < 1e-3:
        return f"{1e6 * row.seconds:.0f}e-6"
    return f"{row.seconds:.{'2g' if row.seconds < 100 else '0f'}}"
