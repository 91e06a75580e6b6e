"""The plane of normal load P and T = Q / f: paths in it, memory curves, what is kept for ever."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from convexrough.arrays import Array
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.cycle import Cycle
from convexrough.friction.path import LoadPath
from convexrough.plots.style import (
    COLOURS,
    DASHED,
    FAINT,
    ROUGH,
    SMOOTH,
    TICK,
    UNSURE,
    label,
    quantity,
)
from convexrough.scene.rings import evenly_chosen

MOST_CURVES, MOST_NUMBERS, MOST_DOTS = 4, 12, 60

#: Memory curves differ by the pattern of their lines, too, to be told apart in grey.
PATTERNS = ("-", (0, (5, 1.5)), (0, (3, 1.2, 1, 1.2)), (0, (1, 1)))


def draw_path(axes: Axes, path: LoadPath, force_unit: str) -> None:
    """The path, and the memory curve at some of its points."""
    f, unit = path.scene.friction or 1.0, float(path.loads.max()) or 1.0
    P, T = path.loads / unit, path.forces / (f * unit)
    _friction_cone(axes, float(P.max()))
    axes.plot(np.append(0.0, P), np.append(0.0, T), color=FAINT, lw=0.9)
    chosen = evenly_chosen(range(len(P)), MOST_CURVES)
    shades = matplotlib.colormaps[COLOURS](np.linspace(0.3, 1.0, len(chosen)))
    for k, shade, pattern in zip(chosen, shades, PATTERNS, strict=False):
        s, heights = _vertices(path.curves[k])
        axes.plot(s / unit, heights / unit, color=shade, lw=1.5, ls=pattern,
                  label=f"memory at {k + 1}")  # fmt: skip
    dots(axes, P, T)
    number(axes, P, T)
    _name(axes, unit, force_unit)
    axes.legend(fontsize=TICK - 1, frameon=False, loc="upper center", handlelength=2.2,
                bbox_to_anchor=(0.45, -0.22), ncols=2)  # fmt: skip


def draw_curve(axes: Axes, curve: MemoryCurve, force_unit: str) -> None:
    """One state: its vertices, and its front."""
    unit = float(curve.load) or 1.0
    s, heights = _vertices(curve)
    _friction_cone(axes, float(curve.load) / unit)
    axes.plot(s / unit, heights / unit, "o-", color=ROUGH, lw=1.4, ms=3.5)
    if curve.front is not None:
        front = float(curve.front) / unit
        axes.axvline(front, color=UNSURE, lw=0.9, ls=DASHED)
        side = -1 if front > 0.5 else 1
        axes.annotate("front", (front, 0.04), (3 * side, 0), xycoords=axes.get_xaxis_transform(),
                      textcoords="offset points", fontsize=TICK, color=UNSURE,
                      ha="left" if side > 0 else "right")  # fmt: skip
    _name(axes, unit, force_unit)


def draw_closed(axes: Axes, found: Cycle, force_unit: str) -> None:
    """A closed path, and the two lines that keep the point (L*, T*) for ever."""
    f, unit = found.scene.friction or 1.0, float(found.loads.max()) or 1.0
    P, T = (np.append(each, each[0]) for each in (found.loads / unit, found.forces / (f * unit)))
    level, height = found.level / unit, found.force_level / (f * unit)
    ends = np.array([level, P.max()])
    for sign in (1.0, -1.0):
        axes.plot(ends, height + sign * (ends - level), color=FAINT, lw=0.9, ls=DASHED)
    _friction_cone(axes, float(P.max()))
    axes.plot(P, T, color=ROUGH, lw=1.2)
    axes.plot([level], [height], "o", ms=5, color=UNSURE)
    axes.set_title("dot: $(L^*, T^*)$, kept for ever", fontsize=TICK, loc="left")
    _name(axes, unit, force_unit)


def dots(axes: Axes, x: Array, y: Array) -> None:
    if len(x) <= MOST_DOTS:
        axes.plot(x, y, "o", ms=3.5, color=SMOOTH, clip_on=False, zorder=3)


def number(axes: Axes, x: Array, y: Array) -> None:
    """1, 2, ... beside points, where they are few; points at one place share a label."""
    if len(x) > MOST_NUMBERS:
        return
    spots = np.column_stack((x, y)) / np.array([np.ptp(x) or 1.0, np.ptp(y) or 1.0])
    groups: dict[int, list[str]] = {}
    for k, spot in enumerate(spots):
        near = [j for j in groups if np.hypot(*(spots[j] - spot)) < 0.08]
        groups.setdefault(near[0] if near else k, []).append(str(k + 1))
    for k, names in groups.items():
        axes.annotate(", ".join(names), (x[k], y[k]), (4, 4), textcoords="offset points",
                      fontsize=TICK - 1)  # fmt: skip


def _vertices(curve: MemoryCurve) -> tuple[Array, Array]:
    pair = ([float(each) for each in values] for values in (curve.levels, curve.heights))
    levels, heights = map(np.array, pair)
    return levels, heights


def _friction_cone(axes: Axes, most: float) -> None:
    """|T| = P: gross sliding."""
    for sign in (1.0, -1.0):
        axes.plot([0.0, most], [0.0, sign * most], color=SMOOTH, lw=0.7, ls=DASHED)


def _name(axes: Axes, unit: float, force_unit: str) -> None:
    name = quantity(unit, force_unit)
    label(axes, f"$P$ / {name}", f"$T = Q\\,/\\,f$ / {name}")
