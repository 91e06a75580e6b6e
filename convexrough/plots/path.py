"""Load paths: the memory curve in the load plane, loops, maps of who sticks, shakedown."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from convexrough.arrays import Array
from convexrough.contact import press
from convexrough.paths.path import LoadPath, load_path
from convexrough.paths.shakedown import Shakedown
from convexrough.paths.steady import Steady
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.shear import SLIDING, SLIP, STICK, UNKNOWN
from convexrough.plots.style import (
    COLOURS,
    DASHED,
    DENSE,
    DOUBLE,
    FAINT,
    LABEL,
    ROUGH,
    SINGLE,
    SMOOTH,
    TICK,
    UNSURE,
    draw_discs,
    draw_open,
    frame_map,
    label,
    quantity,
)
from convexrough.scene.rings import evenly_chosen
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

MOST_CURVES, MOST_MAPS, MOST_NUMBERS = 4, 8, 24

#: Points between two of the path at which loops are drawn, of so many asperities and segments.
BETWEEN, MOST_BETWEEN, MOST_SEGMENTS = 8, 2000, 24

LOOKS = {
    "stuck": (STICK, "sticks"),
    "partial": (SLIP, "slips in part"),
    "sliding": (SLIDING, "slides"),
    "intermittent": ("#8f8fb5", "loses contact"),
    "undecided": (UNKNOWN, "undecided"),
}


def path_figures(path: LoadPath, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figures of a load path.

    "path" : its points in the load plane, with the memory curve at some; Q against X; energy lost
    "path_stick_slip" : who sticks and who slides, at some of its points
    """
    unit = float(path.loads.max()) or 1.0
    figure = Figure(figsize=(DOUBLE, 2.9), layout="constrained")
    plane, loop, cost = figure.subplots(1, 3)
    _draw_plane(plane, path, unit, force_unit)
    fine = _between(path)
    travel = float(np.abs(fine.displacements).max()) or 1.0
    f = path.scene.friction or 1.0
    x, q = fine.displacements / travel, fine.applied / (f * unit)
    loop.plot(np.append(0.0, x), np.append(0.0, q), color=ROUGH, lw=1.2)
    loop.plot(path.displacements / travel, path.applied / (f * unit), "o", ms=3.5, color=SMOOTH)
    _number(loop, path.displacements / travel, path.applied / (f * unit))
    label(
        loop,
        f"$X$ / {quantity(travel, length_unit)}",
        f"$Q\\,/\\,f$ / {quantity(unit, force_unit)}",
    )
    work = float(path.energy.max()) or 1.0
    steps = np.linspace(0.0, len(path.loads), len(fine.energy) + 1)
    cost.plot(steps, np.append(0.0, fine.energy) / work, color=ROUGH, lw=1.2)
    cost.plot(np.arange(1, len(path.loads) + 1), path.energy / work, "o", ms=3.5, color=SMOOTH)
    name = f"{force_unit} {length_unit}".strip()
    label(cost, "point", f"energy lost / {quantity(work, name)}")
    cost.set_ylim(bottom=0.0)
    return Figures({"path": figure, "path_stick_slip": _maps(path)})


def steady_figures(found: Steady, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figure of a closed path.

    "steady" : the path in the load plane, with the two lines that keep the point (L*, T*) for ever;
        and what each asperity does in every later cycle
    """
    f, unit = found.scene.friction or 1.0, float(found.loads.max()) or 1.0
    figure = Figure(figsize=(DOUBLE, 3.3), layout="constrained")
    plane, place = figure.subplots(1, 2)
    P, T = (np.append(each, each[0]) for each in (found.loads / unit, found.applied / (f * unit)))
    level, height = found.level / unit, found.force_level / (f * unit)
    ends = np.array([level, P.max()])
    for sign in (1.0, -1.0):
        plane.plot(ends, height + sign * (ends - level), color=FAINT, lw=0.9, ls=DASHED)
    _friction_cone(plane, float(P.max()))
    plane.plot(P, T, color=ROUGH, lw=1.2)
    plane.plot([level], [height], "o", ms=5, color=UNSURE)
    plane.annotate("$(L^*, T^*)$", (level, height), (-6, 8), textcoords="offset points",
                   fontsize=TICK, ha="right")  # fmt: skip
    _plane_labels(plane, unit, force_unit)
    contact = press(found.scene, load=float(found.loads.max()))
    _draw_words(place, found.scene, contact.contact_radii, found.status)
    _draw_legend(place, np.unique(found.status))
    label(place, f"$x$ {length_unit}".strip(), f"$y$ {length_unit}".strip())
    lost = quantity(found.energy, f"{force_unit} {length_unit}".strip())
    place.set_title(f"every later cycle loses {lost}", fontsize=TICK, loc="left")
    return Figures({"steady": figure})


def shakedown_figures(found: Shakedown, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figure of a limit of shakedown.

    "shakedown" : up to which factor of the path each asperity stops to slide, and which is first
    """
    figure = Figure(figsize=(SINGLE, 3.4), layout="constrained")
    axes = figure.subplots()
    scene, known = found.scene, np.isfinite(found.factors)
    points = scene.contact_points
    draw_open(axes, points[~known])
    size = 60.0 / np.sqrt(max(1, int(known.sum()))) * 2.0
    x, y = points[known].T
    rim: dict[str, Any] = {"s": size**1.6, "rasterized": len(x) >= DENSE}
    shades = axes.scatter(x, y, c=found.factors[known], cmap=COLOURS, lw=0.4, ec=SMOOTH, **rim)
    if np.ndim(found.mechanism) == 1:
        first = found.mechanism > 0.5
        x, y = points[first].T
        axes.scatter(x, y, fc="none", ec=UNSURE, lw=1.4, **rim)
    axes.set_aspect("equal")
    bar = figure.colorbar(shades, ax=axes, shrink=0.8)
    bar.set_label("factor up to which sliding ceases", fontsize=LABEL)
    bar.ax.tick_params(labelsize=TICK)
    label(axes, f"$x$ {length_unit}".strip(), f"$y$ {length_unit}".strip())
    axes.set_title(f"{found.kind}: {found.factor:.5g}\nringed: the first to slide on",
                   fontsize=TICK, loc="left")  # fmt: skip
    return Figures({"shakedown": figure})


def _draw_plane(axes: Axes, path: LoadPath, unit: float, force_unit: str) -> None:
    """The path, and the memory curve at some of its points."""
    f = path.scene.friction or 1.0
    P, T = path.loads / unit, path.applied / (f * unit)
    _friction_cone(axes, float(P.max()))
    axes.plot(np.append(0.0, P), np.append(0.0, T), color=FAINT, lw=0.9)
    chosen = evenly_chosen(range(len(P)), MOST_CURVES)
    shades = matplotlib.colormaps[COLOURS](np.linspace(0.25, 1.0, len(chosen)))
    for k, shade in zip(chosen, shades, strict=True):
        curve = path.curves[k]
        levels = np.array([float(each) for each in curve.levels]) / unit
        heights = np.array([float(each) for each in curve.heights]) / unit
        axes.plot(levels, heights, color=shade, lw=1.6, label=f"memory at {k + 1}")
    axes.plot(P, T, "o", ms=3.5, color=SMOOTH)
    _number(axes, P, T)
    _plane_labels(axes, unit, force_unit)
    axes.legend(fontsize=TICK - 1, frameon=False, loc="lower left", handlelength=1.2)


def _friction_cone(axes: Axes, most: float) -> None:
    """|T| = P: gross sliding."""
    for sign in (1.0, -1.0):
        axes.plot([0.0, most], [0.0, sign * most], color=SMOOTH, lw=0.7, ls=DASHED)


def _plane_labels(axes: Axes, unit: float, force_unit: str) -> None:
    name = quantity(unit, force_unit)
    label(axes, f"$P$ / {name}", f"$T = Q\\,/\\,f$ / {name}")


def _number(axes: Axes, x: Array, y: Array) -> None:
    if len(x) <= MOST_NUMBERS:
        for k, place in enumerate(zip(x, y, strict=True)):
            axes.annotate(str(k + 1), place, (3, 3), textcoords="offset points", fontsize=TICK - 1)


def _between(path: LoadPath) -> LoadPath:
    """The same path with points in between, where that is affordable; loops are curved."""
    m, n = path.forces.shape
    if n > MOST_BETWEEN or m > MOST_SEGMENTS or path.order == "fails":
        return path
    corners = np.vstack(([0.0, 0.0], np.column_stack((path.loads, path.applied))))
    parts = (np.arange(1, BETWEEN + 1) / BETWEEN)[:, None]
    pieces = [a + parts * (b - a) for a, b in pairwise(corners)]
    P, Q = np.concatenate(pieces).T
    limit = (path.scene.friction or 1.0) * P
    return load_path(path.scene, loads=P, forces=np.clip(Q, -limit, limit))


def _maps(path: LoadPath) -> Figure:
    chosen = evenly_chosen(range(len(path.loads)), MOST_MAPS)
    columns = min(4, len(chosen))
    rows = -(-len(chosen) // columns)
    figure = Figure(figsize=(DOUBLE, 0.5 + 1.9 * rows), layout="constrained")
    places = figure.subplots(rows, columns, squeeze=False)
    modulus = path.scene.material.contact_modulus
    for axes, k in zip(places.ravel(), chosen, strict=False):
        radii = hertz.contact_radius(path.normal_loads[k], modulus, path.scene.relative_radii)
        _draw_words(axes, path.scene, radii, path.status[k])
        slide = int((path.status[k] == "sliding").sum())
        touch = int((path.normal_loads[k] > 0).sum())
        axes.set_title(f"{k + 1}: {slide} of {touch} slide", fontsize=TICK)
        axes.tick_params(labelbottom=False, labelleft=False)
    for axes in places.ravel()[len(chosen) :]:
        axes.set_axis_off()
    _draw_legend(figure, np.unique(path.status[chosen]), loc="outside lower center")
    return figure


def _draw_words(axes: Axes, scene: Scene, radii: Array, words: Any) -> None:
    """Contact discs in the colour of their word, open asperities as dots."""
    points = scene.contact_points
    many = int((radii > 0).sum()) >= DENSE
    draw_open(axes, points[radii == 0])
    for word, (colour, _) in LOOKS.items():
        which = (radii > 0) & (words == word)
        if which.any():
            look: dict[str, Any] = {"facecolors": colour, "edgecolors": SMOOTH}
            draw_discs(axes, points[which], radii[which], word, linewidths=0.0 if many else 0.4,
                       **look)  # fmt: skip
    reach = np.hypot(*points.T) + radii
    frame_map(axes, 1.06 * float(reach[radii > 0].max(initial=0.0) or reach.max()))


def _draw_legend(place: Axes | Figure, words: Any, **where: Any) -> None:
    handles = [
        Line2D([], [], ls="", marker="o", ms=6, mew=0.4, mec=SMOOTH, mfc=colour, label=text)
        for word, (colour, text) in LOOKS.items()
        if word in words
    ]
    where = where or {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
    place.legend(handles=handles, fontsize=TICK, frameon=False, ncols=1 if "bbox_to_anchor" in where
                 else 5, **where)  # fmt: skip
