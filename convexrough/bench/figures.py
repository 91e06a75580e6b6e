"""Figures of speed: time against error, and cost against size."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from convexrough.bench.measure import Row
from convexrough.bench.suite import Bench, Panel
from convexrough.bench.summary import condensed
from convexrough.plots.style import DOUBLE, FAINT, LABEL, ROUGH, SINGLE, TICK, UNSURE, label

#: Marker, line, face and colour of each solver: no two alike in grey.
LOOKS: dict[str, dict[str, Any]] = {
    "newton": dict(marker="o", color=ROUGH, ms=7, mew=1.2, zorder=5),
    "newton, dense": dict(marker="o", color="0.35", mfc="white", ms=6, zorder=4),
    "newton, lattice": dict(marker="X", color="0.35", ms=6, zorder=4),
    "newton, scattered": dict(marker="P", color="0.35", ms=6, zorder=4),
    "conic": dict(marker="s", color=UNSURE, mfc="white", ls="--"),
    "conic + Newton step": dict(marker="s", color=UNSURE, ls="none"),
    "conic in CVXPY": dict(marker="D", color="0.55", mfc="white", ls="--"),
    "conic in CVXPY + Newton step": dict(marker="D", color="0.55", ls="none"),
    "bristles": dict(marker="^", color="#4f8a4f", mfc="white", ls=":"),
    "bristles + Newton step": dict(marker="^", color="#4f8a4f", ls=":"),
}

#: Of each family.
MARKERS = {"lattice": "o", "rough": "^", "scattered": "s"}

COLUMNS = 3

#: Of time in a panel, at least.
DECADES = 3.0


def bench_figures(bench: Bench) -> dict[str, Figure]:
    """The figures of what was measured, by the stem of the file each belongs in.

    "work-precision" : time against true error, a panel for each scene, the frontier dashed
    "cost"           : time of a press against the number of asperities
    """
    figures = {"cost": cost_figure(bench)}
    panels = [panel for panel in bench.panels if panel.reference is not None]
    if panels:
        figures["work-precision"] = work_figure(panels)
    return figures


def work_figure(panels: Sequence[Panel]) -> Figure:
    """Below and to the left is better."""
    columns = min(COLUMNS, len(panels)) if len(panels) != 4 else 2
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(DOUBLE, 2.1 * rows + 0.9), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
    for axes, panel in zip(grid.flat, panels, strict=False):
        _draw_panel(axes, panel)
    for axes in list(grid.flat)[len(panels) :]:
        axes.set_visible(False)
    for column in range(columns):
        last = max(i for i in range(rows) if i * columns + column < len(panels))
        grid[last, column].tick_params(labelbottom=True)
    figure.supxlabel("largest error of a load / largest load", fontsize=LABEL)
    figure.supylabel("seconds", fontsize=LABEL)
    handles = {
        name: line
        for axes in grid.flat
        for line, name in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    order = [name for name in (*LOOKS, "frontier") if name in handles]
    names = ["newton (default)" if name == "newton" else name for name in order]
    figure.legend(
        [handles[name] for name in order],
        names,
        loc="outside upper center",
        ncols=3,
        fontsize=TICK,
        frameon=False,
        handlelength=2.2,
    )
    return figure


def _draw_panel(axes: Axes, panel: Panel) -> None:
    axes.set(xscale="log", yscale="log")
    for name, look in LOOKS.items():
        points = [row for row in condensed(panel.rows) if row.solver == name and row.known]
        points.sort(key=lambda row: row.error)
        if points:
            style: dict[str, Any] = {"ms": 4.5, "mew": 0.9, "lw": 0.8, "ls": "none"} | look
            x, y = _coordinates(points)
            axes.plot(x, y, label=name, **style)
    best = sorted((row for row in panel.rows if row.frontier), key=lambda row: row.error)
    if best:
        x, y = _coordinates(best)
        # Up from the most accurate point, down to the left of the fastest.
        x, y = np.append(x, 10.0), np.append(y, y[-1])
        axes.step(x, y, "-", where="post", color=FAINT, lw=2.5, zorder=0, label="frontier")
    if len({row.solver for row in panel.rows if row.known}) == 1:
        place: dict[str, Any] = dict(transform=axes.transAxes, ha="right", va="top", color="0.4")
        axes.text(0.96, 0.95, "others: too slow,\ntoo large, or refused", fontsize=TICK, **place)
    axes.set_title(f"{panel.asperities:,} ({panel.family})", fontsize=TICK, loc="left")
    axes.set_xlim(1e-17, 1.0)
    axes.xaxis.set_major_locator(LogLocator(base=1e4, numticks=6))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(labelsize=TICK)
    # At least so many decades: otherwise noise fills the panel.
    low, high = axes.dataLim.intervaly
    room = max(0.3, (DECADES - np.log10(high / low)) / 2.0)
    axes.set_ylim(low * 10.0**-room, high * 10.0**room)


def _coordinates(rows: Sequence[Row]) -> tuple[Any, Any]:
    error = np.maximum([row.error for row in rows], 1e-17)  # an exact answer has to be somewhere
    return error, np.array([row.seconds for row in rows])


def cost_figure(bench: Bench) -> Figure:
    """Log-log, with the fitted exponent, and slope 1 to compare."""
    figure = Figure(figsize=(SINGLE, 2.9), layout="constrained")
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log")
    answered = [row for row in bench.cost if row.outcome == "answered"]
    for family, marker in MARKERS.items():
        rows = [row for row in answered if row.family == family]
        if not rows:
            continue
        x, y = np.array([(row.asperities, row.seconds) for row in rows]).T
        name = family
        if np.isfinite(b := bench.exponent(family)):  # type: ignore[arg-type]
            name = f"{family}: $n^{{{b:.2f}}}$"
        emphasised = family == "lattice"
        axes.plot(
            x,
            y,
            marker=marker,
            ls="-" if emphasised else "--",
            color=ROUGH if emphasised else "0.45",
            mfc=ROUGH if emphasised else "white",
            lw=1.2,
            ms=5,
            label=name,
        )
    if answered:
        sizes = np.array(sorted({float(row.asperities) for row in answered}))
        ends = sizes[[0, -1]]
        low = min(row.seconds / row.asperities for row in answered)
        axes.plot(ends, 0.6 * low * ends, ":", color="0.3", lw=1.0, label="slope 1")
        axes.legend(fontsize=TICK, frameon=False, loc="lower right")
        axes.set_xlim(10.0 ** np.floor(np.log10(ends[0])), 10.0 ** np.ceil(np.log10(ends[1])))
    label(axes, "asperities", "seconds for a press, certified")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    return figure
