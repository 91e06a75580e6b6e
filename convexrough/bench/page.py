"""The measurements as aligned lines, as files, and on a page of the documentation."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from convexrough.atomic import replacing, write_text
from convexrough.bench.measure import TASKS
from convexrough.bench.rows import Bench, Row, frontier
from convexrough.errors import FileError, file_errors
from convexrough.run.results import Writer
from convexrough.tabular.columns import aligned, markdown
from convexrough.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BEGIN, END = "<!-- bench: begin -->", "<!-- bench: end -->"

#: Tasks with a column of seconds, in addition to "press".
OTHERS = [task for task in TASKS if task not in ("press", "from nothing")]


def describe(bench: Bench) -> list[str]:
    """The measurements as aligned lines for the terminal."""
    lines = [machine_line(bench)]
    for (family, n), rows in bench.panels().items():
        lines += ["", f"{n:,} asperities ({family})", *aligned(_work_table(rows), left=2)]
    return [*lines, "", *aligned(size_table(bench), left=1), "", *_messages(bench)]


def page_block(bench: Bench) -> list[str]:
    """Lines of Markdown: the machine, a figure, a table of sizes, and the conclusions."""
    return [
        machine_line(bench),
        "",
        "![Time against error, every solver, at each size](figures/work-precision.png)",
        "",
        *markdown(size_table(bench), left=1),
        "",
        *(f"- {line}" for line in _messages(bench)),
    ]


def machine_line(bench: Bench) -> str:
    """A line about the machine and its load."""
    on = bench.machine
    versions = ", ".join(f"{name} {number}" for name, number in on["versions"].items())
    load = on["load_average"] or 0.0
    busy = "; other work was running, so times are high" if load > 0.3 else ""
    return (
        f"{'Quick' if bench.quick else 'Full'} run of {bench.seconds / 60:.1f} min, {on['date']}, "
        f"on {on['cores']} cores ({on['processor']}, {on['memory'] / 2**30:.0f} GiB, "
        f"{on['system']}): convexrough {__version__}, Python {on['python']}, {versions}. Threads "
        f"of linear algebra: {on['linear_algebra_threads']}. Load average: {load:.1f}"
        f"{busy}."
    )


def size_table(bench: Bench) -> list[list[str]]:
    """A heading, and a row for each scene: the times [s] of tasks; a press also in products."""
    on = f"in products on {bench.machine['cores']} cores"
    heading = ["scene", "asperities", "touching", "press", on, "from nothing", on, *OTHERS]
    table = [[*heading, "MB", "proved error"]]
    found = {(row.task, row.family, row.asperities): row for row in bench.rows}
    for row in bench.rows:
        if row.task == "press" and row.outcome == "answered":
            cells = [row.family, f"{row.asperities:,}", f"{row.touching:,}"]
            for task in ("press", "from nothing"):
                one = found[task, row.family, row.asperities]
                counted = f"{one.products:.0f}" if math.isfinite(one.products) else "-"
                cells += [_seconds(one), counted]
            cells += [_seconds(found.get((task, row.family, row.asperities))) for task in OTHERS]
            memory = "-" if row.memory is None else f"{row.memory / 1e6:.0f}"
            table.append([*cells, memory, f"{row.bound:.0e}"])
    return table


def _messages(bench: Bench) -> list[str]:
    lines = bench.verdicts()
    for row in bench.rows:
        if row.task == "sweep":
            lines.append(f"A scene of about {row.asperities:,} with a cycle in a sweep "
                         f"({row.message}): {1e3 * row.seconds:.2f} ms.")  # fmt: skip
        elif row.task != "solve" and row.outcome != "answered":
            place = f"{row.task}, {row.asperities:,} asperities ({row.family})"
            lines.append(f"{place}: {row.outcome}, {row.message}")
    return lines


def write_bench(new: Writer, bench: Bench, *, figures: bool, page: Path | None) -> None:
    """Write bench.json, rows.csv, the figures and, if given, the page.

    Raises FileError; files already written remain.
    """
    new.summary("bench.json", bench.summary())
    rows = [asdict(row) for row in bench.rows]
    new.tables({"rows": {name: [row[name] for row in rows] for name in rows[0]}})
    if figures:
        new.figures(_drawn(bench))
    if page is not None:
        new.files += _renew(page, bench)


def _drawn(bench: Bench) -> dict[str, Figure]:
    from convexrough.bench.figures import bench_figures  # matplotlib: only when it draws

    return bench_figures(bench)


def _renew(page: Path, bench: Bench) -> list[Path]:
    before, after = split_page(page)
    folder, written = page.parent / "figures", []
    with file_errors(folder, "be made"):
        folder.mkdir(exist_ok=True)
    for stem, figure in _drawn(bench).items():
        with replacing(path := folder / f"{stem}.png") as temporary:
            figure.savefig(temporary, format="png", dpi=200)
        written.append(path)
    block = [before + BEGIN, "", *page_block(bench), "", END + after]
    return [*written, write_text(page, "\n".join(block))]


def split_page(page: Path) -> tuple[str, str]:
    """The text before and after the block of a page. Raises FileError unless it has one block."""
    with file_errors(page, "be read"):
        text = page.read_text(encoding="utf-8")
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end or BEGIN in after or END in after or END in before:
        raise FileError(f"{page}: expected one line {BEGIN} and below it one line {END}")
    return before, after


def _work_table(rows: list[Row]) -> list[list[str]]:
    best = frontier(rows)
    table = [["solver", "setting", "error", "seconds", "iterations", ""]]
    for row in rows:
        error = f"{row.error:.1e}" if row.known else row.outcome
        mark = "frontier" if row in best else ""
        table.append([row.solver, row.setting, error, _seconds(row), str(row.iterations), mark])
    return table


def _seconds(row: Row | None) -> str:
    if row is None or row.outcome != "answered":
        return "-"
    if row.seconds < 1e-3:
        return f"{1e6 * row.seconds:.0f}e-6"
    return f"{row.seconds:.2g}" if row.seconds < 100 else f"{row.seconds:.0f}"
