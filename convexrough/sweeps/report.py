"""What a sweep says: for programs, and in aligned lines for people."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from convexrough.run.columns import aligned
from convexrough.run.results import results_folder, write_figures, write_tables
from convexrough.run.stage import Summary
from convexrough.sweeps.batch import Columns
from convexrough.sweeps.running import Done, duration
from convexrough.sweeps.table import SweepTable
from convexrough.version import __version__

#: Quantiles in print, rows of a table in print, failed scenes that are named, and figures drawn.
AT, MOST_ROWS, MOST_NAMED, MOST_FIGURES = (0.05, 0.5, 0.95), 40, 5, 24


def summarise(table: SweepTable) -> Summary:
    """What is there, and quantiles at each point of the grid."""
    return {
        "schema": 1,
        "version": __version__,
        "sweep": {
            "folder": None if table.folder is None else str(table.folder.path),
            "hash": table.manifest["sweep"],
            "scenes": table.scenes,
            "rows": len(table),
            **table.counts(),
        },
    }


def with_quantiles(summary: Summary, found: Columns) -> Summary:
    """The same with a row for each point of the grid and each quantity."""
    names = list(found)
    rows = zip(*(values.tolist() for values in found.values()), strict=True)
    return summary | {"quantiles": [dict(zip(names, row, strict=True)) for row in rows]}


def with_work(summary: Summary, done: Done) -> Summary:
    """The same with what this call did."""
    found = done.found._asdict()
    work = {"found": found, "computed": done.computed, "seconds": done.seconds}
    return summary | {"sweep": summary["sweep"] | work}


def describe(summary: Summary) -> list[str]:
    """Aligned lines."""
    it = summary["sweep"]
    lines = [("scenes", f"{it['scenes']:,}"), ("rows", f"{it['rows']:,}")]
    lines += [(f"  {word}", f"{it[word]:,}") for word in ("certified", "undecided", "failed")]
    if "computed" in it:
        rate = it["computed"] / it["seconds"]
        found = it["found"]
        if any(found.values()):
            removed = [
                f"{found[kind]:,} {kind} removed"
                for kind in ("damaged", "unfinished")
                if found[kind]
            ]
            lines.append(("found", ", ".join([f"{found['scenes']:,}", *removed])))
        said = f"{it['computed']:,} in {duration(it['seconds'])}, {rate:,.3g} a second"
        lines.append(("computed", said))
    lines.append(("folder", it["folder"]))
    return [f"{name:<12}{text}" for name, text in lines]


def describe_quantiles(found: Columns) -> list[str]:
    """A table of the first rows."""
    heads = [f"{float(name):.0%}" if name[0] in "01" else name for name in found]
    rows = list(zip(*(values.tolist() for values in found.values()), strict=True))
    left = heads.index("quantity") + 1
    cells = [[_cell(value) for value in row] for row in rows[:MOST_ROWS]]
    lines = aligned([heads, *cells], left=left)
    if len(rows) > MOST_ROWS:
        lines.append(f"and {len(rows) - MOST_ROWS:,} rows more: --out DIR writes all of them")
    return lines


def failures(table: SweepTable) -> list[str]:
    """The first scenes that failed, and why."""
    named: list[str] = []
    for block in table.blocks(["scene", "status", "message"]):
        for row in np.flatnonzero(block["status"] == "failed"):
            named.append(f"scene {block['scene'][row]}: {block['message'][row]}")
            if len(named) == MOST_NAMED:
                return named
    return named


def write_summary(folder: Path, table: SweepTable, found: Columns) -> list[Path]:
    """quantiles.csv, and a figure of each measured quantity over each swept one."""
    from convexrough.plots.notebook import Figure  # it loads matplotlib
    from convexrough.plots.style import DOUBLE

    pairs = [(name, key) for key in table.swept for name in table.measured]
    figures = {}
    for name, key in pairs[:MOST_FIGURES]:
        figure = Figure(figsize=(0.65 * DOUBLE, 3.0), layout="constrained")
        table.plot(name, key, figure.subplots())
        figures[f"{name}-over-{key}"] = figure
    with results_folder(folder, force=False) as new:
        return write_tables(new, {"quantiles": found}) + write_figures(new, figures)


def _cell(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
