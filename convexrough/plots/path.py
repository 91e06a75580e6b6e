"""Load paths: the load plane, the loop, energy, and maps of who sticks."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from convexrough.friction.path import LoadPath, load_path
from convexrough.plots.load_plane import dots, draw_path, number
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import DOUBLE, ROUGH, TICK, label, quantity
from convexrough.plots.words import draw_words, word_handles
from convexrough.scene.rings import evenly_chosen
from convexrough.sphere import hertz

MOST_MAPS = 8

#: Points between two of the path at which loops are drawn, of so many asperities and segments.
BETWEEN, MOST_BETWEEN, MOST_SEGMENTS = 8, 2000, 24


def path_figures(path: LoadPath, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figures of a load path.

    "path" : its points in the load plane, with the memory curve at some; Q against X; energy lost
    "path_stick_slip" : who sticks and who slides, at some of its points
    """
    unit = float(path.loads.max()) or 1.0
    figure = Figure(figsize=(DOUBLE, 3.1), layout="constrained")
    plane, loop, cost = figure.subplots(1, 3)
    draw_path(plane, path, force_unit)
    fine = between_points(path)
    travel = float(np.abs(fine.displacements).max()) or 1.0
    f = path.scene.friction or 1.0
    x, q = fine.displacements / travel, fine.forces / (f * unit)
    loop.plot(np.append(0.0, x), np.append(0.0, q), color=ROUGH, lw=1.2)
    x, q = path.displacements / travel, path.forces / (f * unit)
    dots(loop, x, q)
    number(loop, x, q)
    loop.margins(0.12)
    label(
        loop,
        f"$X$ / {quantity(travel, length_unit)}",
        f"$Q\\,/\\,f$ / {quantity(unit, force_unit)}",
    )
    work = float(path.losses.max()) or 1.0
    steps = np.linspace(0.0, len(path.loads), len(fine.losses) + 1)
    cost.plot(steps, np.append(0.0, fine.losses) / work, color=ROUGH, lw=1.2)
    dots(cost, np.arange(1.0, len(path.loads) + 1), path.losses / work)
    name = f"{force_unit} {length_unit}".strip()
    label(cost, "point", f"energy lost / {quantity(work, name)}")
    cost.set_ylim(bottom=0.0)
    return Figures({"path": figure, "path_stick_slip": _maps(path)})


def between_points(path: LoadPath) -> LoadPath:
    """The same path with points in between, where that is affordable; loops are curved."""
    m, n = path.asperity_forces.shape
    if n > MOST_BETWEEN or m > MOST_SEGMENTS or path.order == "fails":
        return path
    corners = np.vstack(([0.0, 0.0], np.column_stack((path.loads, path.forces))))
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
        radii = hertz.contact_radius(path.asperity_loads[k], modulus, path.scene.relative_radii)
        draw_words(axes, path.scene, radii, path.status[k])
        slide = int((path.status[k] == "sliding").sum())
        touch = int((path.asperity_loads[k] > 0).sum())
        axes.set_title(f"{k + 1}: {slide:,} of {touch:,} slide", fontsize=TICK)
        axes.tick_params(labelbottom=False, labelleft=False)
    for axes in places.ravel()[len(chosen) :]:
        axes.set_axis_off()
    handles = word_handles(np.unique(path.status[chosen]))
    if handles:
        figure.legend(handles=handles, fontsize=TICK, frameon=False, ncols=len(handles),
                      loc="outside lower center")  # fmt: skip
    return figure
