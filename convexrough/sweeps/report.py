"""The output of the command `sweep`: printed lines, JSON, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from convexrough.record import rows_of
from convexrough.run.results import Writer, headed
from convexrough.run.stage import Summary
from convexrough.sweeps.batch import Columns
from convexrough.sweeps.folder import MANIFEST
from convexrough.sweeps.table import SweepTable, open_sweep
from convexrough.tabular.columns import aligned, labelled

#: The printed quantiles; the largest numbers of printed rows and of printed failures.
AT, MOST_ROWS, MOST_NAMED = (0.05, 0.5, 0.95), 40, 5


def summarise(table: SweepTable, **did: Any) -> Summary:
    """What `--json` prints: the state of the table, and `did`, the second result of `run`."""
    folder = str(table.folder.path) if table.folder else None
    said = {"folder": folder, "hash": table.manifest["sweep"], "scenes": table.scenes}
    said |= {"rows": len(table), **table.counts(), "not_measured": table.manifest["not_measured"]}
    return headed(sweep=said | did)


def describe(summary: Summary) -> list[str]:
    """The printed report of a sweep, from its summary."""
    it = summary["sweep"]
    names = ("scenes", "rows", "  certified", "  undecided", "  failed")
    lines = [(name, f"{it[name.strip()]:,}") for name in names]
    if "computed" in it:
        rate = it["computed"] / it["seconds"]
        said = f"{it['computed']:,} scenes in {it['seconds']:,.0f} s, {rate:,.3g} per second"
        lines.append(("computed", f"{said}; {it['found']}"))
    if left_out := it["not_measured"]:
        lines.append(("left out", f"{', '.join(map('[{}]'.format, left_out))}: nothing measured"))
    lines.append(("folder", it["folder"]))
    return labelled(lines, 12)


def incomplete(summary: Summary) -> list[str]:
    """A line that tells how many scenes have no row yet; none if the sweep is complete."""
    scenes = summary["sweep"]["scenes"]
    missing = scenes - summary["sweep"]["rows"]
    return [f"incomplete: {missing:,} of {scenes:,} scenes are missing"] if missing else []


def describe_quantiles(found: Columns) -> list[str]:
    """The printed table of quantiles: its first `MOST_ROWS` rows."""
    heads = [f"{float(name):.0%}" if name[0] in "01" else name for name in found]
    rows = [list(row.values()) for row in rows_of(found)]
    lines = aligned([heads, *rows[:MOST_ROWS]], left=heads.index("quantity") + 1)
    if len(rows) > MOST_ROWS:
        lines.append(f"and {len(rows) - MOST_ROWS:,} more rows: --out DIR writes all of them")
    return lines


def cautions(table: SweepTable) -> Iterator[str]:
    """Warnings: the messages of the first `MOST_NAMED` scenes that failed, and the first messages
    of undecided and of certified scenes."""
    yield from islice(_messages(table, "failed"), MOST_NAMED)
    for status, what in (("undecided", ""), ("certified", " with warnings")):
        said = _messages(table, status)
        if first := next(said, ""):
            count = 1 + sum(1 for _ in said)
            yield f"{status} scenes{what}: {count:,} of {len(table):,}; the first is {first}"


def _messages(table: SweepTable, status: str) -> Iterator[str]:
    """The messages of the scenes with this status."""
    for block in table.blocks(["scene", "status", "message"]):
        for row in np.flatnonzero((block["status"] == status) & (block["message"] != "")):
            yield f"scene {block['scene'][row]}: {block['message'][row]}"


def write_summary(new: Writer, table: SweepTable, found: Columns) -> None:
    """Write quantiles.csv, and a figure of each measured number against each swept key."""
    new.tables({"quantiles": found})
    for key in table.swept:
        for name in table.measured:
            figure: Any = table.plot(name, key).figure
            new.figures({f"{name}-over-{key}": figure})


def progress_kept(folder: Path) -> str:
    """A message: how many rows of an interrupted sweep are kept, and how to continue."""
    if not (folder / MANIFEST).exists():
        return "nothing was computed yet"
    table = open_sweep(folder)
    more = "; the same command with --resume computes the rest" if len(table) else ""
    return f"{len(table):,} of {table.scenes:,} scenes are kept in {folder}{more}"
