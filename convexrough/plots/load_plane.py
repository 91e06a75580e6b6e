"""The plane of normal load P and T = Q / f: paths in it, memory curves, what is kept for ever."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from convexrough.arrays import Array
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.cycle import Cycle
from convexrough.friction.path import LoadPath
from convexrough.plots.measure import Measure, measure
from convexrough.plots.style import (
    DASHED,
    FAINT,
    ROUGH,
    SMOOTH,
    TICK,
    UNSURE,
    label,
    legend_below,
    mark_points,
    shades_of,
    title,
)
from convexrough.scene.rings import evenly_chosen

MOST_CURVES = 4

#: Memory curves differ by the pattern of their lines, too, to be told apart in grey.
PATTERNS = ("-", (0, (5, 1.5)), (0, (3, 1.2, 1, 1.2)), (0, (1, 1)), "-")


def draw_path(axes: Axes, path: LoadPath, force_unit: str) -> None:
    """The path, and the memory curve at some of its points."""
    f, unit = path.scene.friction or 1.0, _plane(axes, float(path.loads.max()), force_unit)
    P, T = unit.of(path.loads), unit.of(path.forces / f)
    axes.plot(np.append(unit.of(path.start), P), np.append(0.0, T), color=FAINT, lw=0.9)
    chosen = evenly_chosen(range(len(P)), MOST_CURVES)
    for k, shade, pattern in zip(chosen, shades_of(len(chosen)), PATTERNS, strict=False):
        s, heights = _vertices(path.curves[k], unit)
        axes.plot(s, heights, color=shade, lw=1.5, ls=pattern, label=f"memory at {k + 1}")
    mark_points(axes, P, T)
    legend_below(axes, handlelength=2.2)


def draw_curve(axes: Axes, curve: MemoryCurve, force_unit: str) -> None:
    """One state: its vertices, and its front."""
    unit = _plane(axes, float(curve.load), force_unit)
    axes.plot(*_vertices(curve, unit), "o-", color=ROUGH, lw=1.4, ms=3.5)
    if curve.front is None:
        return
    front = unit.of(float(curve.front))
    axes.axvline(front, color=UNSURE, lw=0.9, ls=DASHED)
    side = -1 if curve.front > curve.load / 2 else 1
    axes.annotate("front", (front, 0.04), (3 * side, 0), xycoords=axes.get_xaxis_transform(),
                  textcoords="offset points", fontsize=TICK, color=UNSURE,
                  ha="left" if side > 0 else "right")  # fmt: skip


def draw_closed(axes: Axes, found: Cycle, force_unit: str) -> None:
    """A closed path, and the two lines that keep the point (L*, T*) for ever."""
    f, unit = found.scene.friction or 1.0, _plane(axes, float(found.loads.max()), force_unit)
    P, T = (np.append(each, each[0]) for each in (found.loads, found.forces / f))
    level, height = found.level, found.force_level / f
    ends = np.array([level, P.max()])
    for sign in (1.0, -1.0):
        axes.plot(unit.of(ends), unit.of(height + sign * (ends - level)), color=FAINT, lw=0.9,
                  ls=DASHED)  # fmt: skip
    axes.plot(unit.of(P), unit.of(T), color=ROUGH, lw=1.2)
    axes.plot([unit.of(level)], [unit.of(height)], "o", ms=5, color=UNSURE)
    title(axes, "dot: $(L^*, T^*)$, kept for ever")


def _plane(axes: Axes, most: float, force_unit: str) -> Measure:
    """Names of the axes, and |T| = P, gross sliding; the measure of both."""
    unit = measure(most, force_unit, "P_m")
    for sign in (1.0, -1.0):
        axes.plot([0.0, unit.of(most)], [0.0, unit.of(sign * most)], color=SMOOTH, lw=0.7,
                  ls=DASHED)  # fmt: skip
    label(axes, unit.label("P"), unit.short("T = Q/f" if unit.said and not unit.symbol else "T"))
    return unit


def _vertices(curve: MemoryCurve, unit: Measure) -> tuple[Array, Array]:
    pair = ([float(each) for each in values] for values in (curve.levels, curve.heights))
    levels, heights = (unit.of(np.array(each)) for each in pair)
    return levels, heights
