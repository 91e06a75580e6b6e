"""Figures of speed: time against error, and cost against size."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from convexrough.bench.rows import Bench, Row, frontier
from convexrough.bench.scenes import FAMILIES, Family
from convexrough.plots import style
from convexrough.plots.notebook import Figure, panels
from convexrough.plots.style import DOUBLE, FAINT, LABEL, ROUGH, SINGLE, TICK, UNSURE

#: Marker, line, face and colour of each solver, all different in grey.
LOOKS: dict[str, dict[str, Any]] = {
    "newton": dict(label="newton (default)", marker="o", color=ROUGH, ms=7, mew=1.2, zorder=5),
    "newton, dense": dict(marker="o", color="0.35", mfc="white", ms=6, zorder=4),
    "newton, lattice": dict(marker="X", color="0.35", ms=6, zorder=4),
    "newton, scattered": dict(marker="P", color="0.35", ms=6, zorder=4),
    "conic": dict(marker="s", color=UNSURE, mfc="white", ls="--"),
    "conic + Newton step": dict(marker="s", color=UNSURE),
    "conic in CVXPY": dict(marker="D", color="0.55", mfc="white", ls="--"),
    "conic in CVXPY + Newton step": dict(marker="D", color="0.55"),
    "bristles": dict(marker="^", color="#4f8a4f", mfc="white", ls=":"),
    "bristles + Newton step": dict(marker="^", color="#4f8a4f", ls=":"),
}

#: Marker of each family of scenes.
MARKERS: dict[Family, str] = {"lattice": "o", "rough": "^", "scattered": "s"}

#: Smaller errors, such as 0, are drawn at this value, because the axis is logarithmic.
EXACT = 1e-17


def work_figure(bench: Bench) -> Figure:
    """The figure of time against true error, with a panel for each scene; lower left is better."""
    scenes = [it for it in bench.panels().items() if any(row.known for row in it[1])]
    columns = min(3, max(1, len(scenes)))
    rows = max(1, -(-len(scenes) // columns))
    figure, grid = panels(DOUBLE, 2.1 * rows + 0.9, rows, columns, sharex=True)
    for axes in grid[len(scenes) :]:
        axes.set_visible(False)
    handles: dict[str, Any] = {}
    for axes, ((family, n), tried) in zip(grid, scenes, strict=False):
        _draw_panel(axes, tried)
        style.title(axes, f"{n:,} ({family})")
        axes.tick_params(labelbottom=True)
        lines, names = axes.get_legend_handles_labels()
        handles |= dict(zip(names, lines, strict=True))
    figure.supxlabel("largest error of a load / largest load", fontsize=LABEL)
    figure.supylabel("seconds", fontsize=LABEL)
    order = [*(look.get("label", name) for name, look in LOOKS.items()), "frontier"]
    shown = [handles[name] for name in order if name in handles]
    style.legend(figure, "outside", handles=shown, loc="outside upper center", ncols=3)
    return figure


def _draw_panel(axes: Axes, rows: list[Row]) -> None:
    axes.set(xscale="log", yscale="log", xlim=(EXACT, 1.0))
    for name, look in LOOKS.items():
        if points := [row for row in rows if row.solver == name and row.known]:
            usual: dict[str, Any] = {"ms": 4.5, "mew": 0.9, "lw": 0.8, "ls": "none"}
            axes.plot(*_coordinates(points), **({"label": name} | usual | look))
    if best := frontier(rows):
        x, y = _coordinates(best)
        # Extend the frontier to errors above that of the fastest point.
        x, y = np.append(x, 10.0), np.append(y, y[-1])
        axes.step(x, y, "-", where="post", color=FAINT, lw=2.5, zorder=0, label="frontier")
    style.log_ticks(axes.xaxis, most=5)
    style.log_ticks(axes.yaxis)
    axes.tick_params(labelsize=TICK)


def _coordinates(rows: Iterable[Row]) -> tuple[Any, Any]:
    points = sorted((max(row.error, EXACT), row.seconds) for row in rows)
    return tuple(np.array(points).T)


def cost_figure(bench: Bench) -> Figure:
    """The figure of time to press a scene against its size, with fitted exponents."""
    figure, (axes,) = panels(SINGLE, 2.9)
    axes.set(xscale="log", yscale="log")
    for family in FAMILIES:
        if rows := bench.presses(family):
            x, y = np.array([(row.asperities, row.seconds) for row in rows]).T
            b = bench.exponent(family)
            name = f"{family}: $n^{{{b:.2f}}}$" if np.isfinite(b) else family
            colour = ROUGH if family == "lattice" else "0.45"
            axes.plot(x, y, marker=MARKERS[family], color=colour, lw=1.2, ms=5, label=name)
            if family == "lattice":
                axes.plot(x, 0.6 * min(y / x) * x, ":", color="0.3", lw=1.0, label="slope 1")
    if axes.lines:
        style.legend(axes, "inside", loc="lower right")
    style.label(axes, "asperities", "seconds for a certified press")
    style.log_ticks(axes.xaxis)
    style.log_ticks(axes.yaxis)
    return figure
