"""The measurements as aligned lines, as files, and on a page of the documentation."""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path

from convexrough.atomic import write_text
from convexrough.bench.measure import TASKS
from convexrough.bench.rows import Bench, Row, frontier
from convexrough.errors import FileError, file_errors
from convexrough.run.results import write_figures, write_json, write_tables
from convexrough.tabular.columns import aligned, markdown
from convexrough.version import __version__

BEGIN, END = "<!-- bench: begin -->", "<!-- bench: end -->"

#: Tasks with a column of seconds, in addition to "press".
OTHERS = [task for task in TASKS if task not in ("press", "from nothing")]


def describe(bench: Bench) -> list[str]:
    """The measurements as aligned lines for the terminal."""
    lines = [machine_line(bench)]
    for (family, n), rows in bench.panels().items():
        table = [["solver", "setting", "error", "seconds", "iterations", ""]]
        best = frontier(rows)
        for row in rows:
            error = f"{row.error:.1e}" if row.known else row.outcome
            mark = "frontier" if row in best else ""
            cells = [row.solver, row.setting, error, _seconds(row), str(row.iterations), mark]
            table.append(cells)
        lines += ["", f"{n:,} asperities ({family})", *aligned(table, left=2)]
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
    for row in bench.rows:
        if row.task == "press" and row.outcome == "answered":
            scene = (row.family, row.asperities)
            found = {it.task: it for it in bench.rows if (it.family, it.asperities) == scene}
            cells = [row.family, f"{row.asperities:,}", f"{row.touching:,}"]
            for one in (row, found["from nothing"]):
                counted = one.seconds / one.product  # nan without a lattice
                cells += [_seconds(one), f"{counted:.0f}" if math.isfinite(counted) else "-"]
            memory = "-" if row.memory is None else f"{row.memory / 1e6:.0f}"
            others = [_seconds(found.get(task)) for task in OTHERS]
            table.append([*cells, *others, memory, f"{row.bound:.0e}"])
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


def write_bench(folder: Path, bench: Bench, *, figures: bool, page: Path | None) -> list[Path]:
    """Write bench.json, rows.csv, the figures and, if given, the page; return the paths.

    Raises FileError; files already written remain.
    """
    table = {each.name: [getattr(row, each.name) for row in bench.rows] for each in fields(Row)}
    written = [write_json(folder / "bench.json", bench.summary())]
    written += write_tables(folder, {"rows": table})
    if not figures and page is None:
        return written
    from convexrough.bench.figures import bench_figures  # matplotlib: only when it draws

    drawn = bench_figures(bench)
    if figures:
        written += write_figures(folder, drawn)
    if page is not None:
        before, after = split_page(page)
        with file_errors(beside := page.parent / "figures", "be made"):
            beside.mkdir(exist_ok=True)
        written += write_figures(beside, drawn)
        block = [before + BEGIN, "", *page_block(bench), "", END + after]
        written.append(write_text(page, "\n".join(block)))
    return written


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
    return f"{row.seconds:.2g}" if row.seconds < 100 else f"{row.seconds:.0f}"
