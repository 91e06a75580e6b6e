"""What was measured, for people: aligned lines, and a page of the documentation."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from convexrough.bench import sweeping
from convexrough.bench.gradients import GradientRow
from convexrough.bench.machine import busy
from convexrough.bench.measure import CostRow, Row
from convexrough.bench.paths import PathRow
from convexrough.bench.suite import Bench, Panel, ShearRow
from convexrough.bench.summary import condensed, verdicts
from convexrough.errors import FileError
from convexrough.run.columns import aligned, markdown
from convexrough.version import __version__

BEGIN, END = "<!-- bench: begin -->", "<!-- bench: end -->"

WORK_HEADING = ["solver", "setting", "error", "seconds", "assembling", "certifying", "A P"]
WORK_HEADING += ["single", "iterations", "MB", ""]
COST_HEADING = ["scene", "asperities", "touching", "seconds", "from nothing", "in products"]
COST_HEADING += [
    "assembling",
    "solving",
    "certifying",
    "A P",
    "single",
    "MB",
    "B each",
    "proved error",
]
PATH_HEADING = ["scene", "asperities", "touching", "presses", "first call, s", "next, s"]
PATH_HEADING += ["presses per segment", "undecided", "proved error", "MB", "order"]
GRADIENT_HEADING = ["scene", "asperities", "touching", "press", "cycle", "gradient"]
GRADIENT_HEADING += ["A P", "single"]
SHEAR_HEADING = ["what", "asperities", "touching", "states", "seconds", "s per state", "MB"]


def describe(bench: Bench) -> list[str]:
    """Aligned lines for people."""
    lines = [f"{name:<16}{text}" for name, text in _machine_lines(bench)]
    for title, table, left, messages in (*_panels(bench), *_costs(bench)):
        lines += ["", title, *aligned(table, left=left), *messages]
    return [*lines, "", *verdicts(bench)]


def page_block(bench: Bench, figures: str) -> list[str]:
    """Lines of Markdown; `figures` is where the figures are, from the page."""
    lines = [*(f"- {line}" for line in verdicts(bench)), ""]
    lines += [
        f"![Time against error, every solver, at each size]({figures}/work-precision.png)",
        "",
    ]
    lines += [f"![Time of a press against the number of asperities]({figures}/cost.png)", ""]
    lines += ["### The machine", ""]
    lines += markdown([["", ""], *([name, text] for name, text in _machine_lines(bench))], left=2)
    for title, table, left, messages in (*_costs(bench), *_panels(bench)):
        heading = f"### {title[0].upper()}{title[1:]}"
        lines += ["", heading, "", *markdown(table, left=left), *messages]
    return lines


class Section(NamedTuple):
    """A table with what is above and below it; so many of its columns are aligned to the left."""

    title: str
    table: list[list[str]]
    left: int
    messages: list[str]


def _panels(bench: Bench) -> Iterator[Section]:
    for panel in bench.panels:
        yield Section(_title(panel), _work_table(panel), 2, _messages(panel.rows))


def _costs(bench: Bench) -> Iterator[Section]:
    yield Section("cost of a press", _cost_table(bench.cost), 1, _messages(bench.cost))
    if bench.shear:
        yield Section("cost of shear", _shear_table(bench.shear), 1, _messages(bench.shear))
    if bench.paths:
        title = "cost of a load path of seven segments, with every bound and word"
        yield Section(title, _path_table(bench.paths), 1, _messages(bench.paths))
    if bench.sweeps:
        yield Section("cost of a sweep", sweeping.table(bench.sweeps), 0, [])
    if bench.gradients:
        messages = _messages(bench.gradients)
        yield Section("cost of a gradient", _gradient_table(bench.gradients), 1, messages)


def renewed_page(page: Path, bench: Bench, figures: str) -> str:
    """The text of a page with the block between the markers written anew; the rest as it was.

    Raises FileError where the page has no such block.
    """
    before, after = split_page(page)
    return "\n".join([before + BEGIN, "", *page_block(bench, figures), "", END + after])


def split_page(page: Path) -> tuple[str, str]:
    """What is before and after the block of a page; FileError where there is not one block."""
    try:
        text = page.read_text(encoding="utf-8")
    except OSError as error:
        raise FileError(f"{page}: cannot be read: {error.strerror or error}") from error
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end or BEGIN in after or END in after or END in before:
        raise FileError(f"{page}: expected one line {BEGIN} and below it one line {END}")
    return before, after


def _title(panel: Panel) -> str:
    title = f"{panel.asperities:,} asperities, {panel.family}"
    if (reference := panel.reference) is None:
        return f"{title}; {panel.without}"
    return (
        f"{title}; {reference.touching:,} touch; reference good to {reference.correction:.0e} "
        f"({reference.how}, residual {reference.residual:.0e})"
    )


def _work_table(panel: Panel) -> list[list[str]]:
    table = [WORK_HEADING]
    for row in condensed(panel.rows):
        guess = f"({row.expected:.0e})" if math.isfinite(row.expected) else "-"
        cells = [row.outcome, guess, *["-"] * 6, ""]
        if row.outcome == "answered":
            cells = [f"{row.error:.1e}" if math.isfinite(row.error) else "unknown"]
            cells += [_seconds(row.seconds), _seconds(row.assembling), _seconds(row.certifying)]
            cells += [
                str(row.products),
                str(row.single),
                str(row.iterations),
                _megabytes(row.memory),
            ]
            cells.append("frontier" if row.frontier else "")
        solver = f"{row.solver} (default)" if row.default else row.solver
        table.append([solver, row.setting, *cells])
    return table


def _cost_table(rows: Sequence[CostRow]) -> list[list[str]]:
    table = [COST_HEADING]
    for row in rows:
        cells = [f"{row.asperities:,}", row.outcome, *["-"] * 11]
        if row.outcome == "answered":
            each = "-" if row.memory is None else f"{row.memory / row.asperities:,.0f}"
            proved = f"{row.load_error:.1e}" if row.certified else f"not proved ({row.scope})"
            counted = row.first / row.product
            cells = [f"{row.asperities:,}", f"{row.touching:,}", _seconds(row.seconds)]
            cells += [_seconds(row.first), f"{counted:.0f}" if math.isfinite(counted) else "-"]
            cells += [_seconds(row.assembling), _seconds(row.solving), _seconds(row.certifying)]
            cells += [str(row.products), str(row.single), _megabytes(row.memory), each, proved]
        table.append([row.family, *cells])
    return table


def _shear_table(rows: Sequence[ShearRow]) -> list[list[str]]:
    table = [SHEAR_HEADING]
    for row in rows:
        cells = [f"{row.asperities:,}", f"{row.touching:,}", str(row.states)]
        if row.outcome == "answered":
            cells += [_seconds(row.seconds), _seconds(row.seconds / row.states)]
            cells.append(_megabytes(row.memory))
        else:
            cells += [row.outcome, "-", "-"]
        table.append([row.what, *cells])
    return table


def _path_table(rows: Sequence[PathRow]) -> list[list[str]]:
    table = [PATH_HEADING]
    for row in rows:
        cells = [f"{row.asperities:,}", row.outcome, *["-"] * 8]
        if row.outcome == "answered":
            cells = [f"{row.asperities:,}", f"{row.touching:,}", str(row.presses)]
            cells += [_seconds(row.first), _seconds(row.again)]
            cells += [f"{row.presses / row.segments:.1f}", str(row.undecided)]
            cells += [f"{row.error:.0e}", _megabytes(row.memory), row.order]
        table.append([row.family, *cells])
    return table


def _gradient_table(rows: Sequence[GradientRow]) -> list[list[str]]:
    table = [GRADIENT_HEADING]
    for row in rows:
        cells = [f"{row.asperities:,}", row.outcome, *["-"] * 5]
        if row.outcome == "answered":
            times = (row.pressing, row.cycling, row.differentiating)
            cells = [f"{row.asperities:,}", f"{row.touching:,}", *map(_seconds, times)]
            cells += [str(row.products), str(row.single)]
        table.append([row.family, *cells])
    return table


def _messages(
    rows: Sequence[Row]
    | Sequence[CostRow]
    | Sequence[ShearRow]
    | Sequence[PathRow]
    | Sequence[GradientRow],
) -> list[str]:
    """Why some did not answer, below their table."""
    found: dict[str, list[str]] = {}
    for row in rows:
        if row.outcome != "answered":
            name = row.solver if isinstance(row, Row) else f"{row.asperities:,} asperities"
            named = found.setdefault(f"{row.outcome}: {row.message}", [])
            named += [name] if name not in named else []
    lines = [f"- {'; '.join(names)} {why}" for why, names in found.items()]
    return ["", *lines] if lines else []


def _machine_lines(bench: Bench) -> list[tuple[str, str]]:
    machine = bench.machine
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items())
    limits = machine["linear_algebra_threads"]
    threads = limits if isinstance(limits, str) else _listed(limits)
    load = machine["load_average"]
    shared = "; other work was running, so times are high" if busy(machine) else ""
    return [
        ("processor", f"{machine['processor']}, {machine['cores']} cores, {machine['system']}"),
        ("memory", f"{machine['memory'] / 2**30:.0f} GiB"),
        ("threads", f"linear algebra ({machine['linear_algebra']}): {threads}"),
        ("", f"transforms: {machine['transform_threads']}"),
        ("versions", f"convexrough {__version__}, Python {machine['python']}, {versions}"),
        ("date", f"{machine['date']}, {'quick' if bench.quick else 'full'} run of "
                 f"{bench.seconds / 60:.1f} min"),
        ("load average", "unknown" if load is None else f"{load:.2f} at the start{shared}"),
    ]  # fmt: skip


def _listed(limits: Mapping[str, str]) -> str:
    return ", ".join(f"{name}={value}" for name, value in limits.items())


def _seconds(value: float) -> str:
    if value < 1e-3:
        return f"{1e6 * value:.0f}e-6"
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"


def _megabytes(memory: int | None) -> str:
    return "-" if memory is None else f"{memory / 1e6:.1f}"
