"""Figures of histories and load paths: loops, energy losses, and maps of stick and slip."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize

from convexrough.arrays import Array
from convexrough.friction.path import LoadPath, history, load_path
from convexrough.plots import style
from convexrough.plots.asperity_map import draw_map, status_handles, status_layers
from convexrough.plots.load_plane import draw_path
from convexrough.plots.measure import Scale
from convexrough.plots.notebook import Figure, Figures, panels
from convexrough.plots.style import DOUBLE, MOST_NUMBERS, TICK
from convexrough.scene.rings import evenly_chosen
from convexrough.sphere import hertz

MOST_MAPS = 8

#: Limits when points are added: number of points; touching asperities times points; steps between
#: two given points.
MOST_POINTS, AFFORDABLE, MOST_BETWEEN = 500, 16_000, 40

#: At varying load, points are added to at most this number of segments, because each point needs a
#: normal solution.
MOST_SEGMENTS = 24


def path_figures(path: LoadPath, *, fine: LoadPath | None = None) -> Figures:
    """The figures of a load path, or of a history, which has constant load.

    fine : the path with the additional points of `between`; None to compute them

    "history" : at constant load: shear force Q against displacement X, with numbered steps if there
        are few; and energy lost since the beginning against the step
    "path" : at varying load: the same, and the points in the plane of P and Q / f, with the memory
        curve at some points
    "path_stick_slip" : at varying load: maps of the asperities that stick and that slide, at some
        of the points

    >>> past = cr.history(contact, forces=0.5 * contact.load * np.array([0.6, -0.2, 0.3]))
    >>> print(*cr.plots.path_figures(past))
    history
    """
    if path.load_constant and not path.contact.loads.any():
        return style.no_contact("history")
    scale = Scale(path.contact)
    height, columns = (3.0, 2) if path.load_constant else (3.2, 3)
    figure, (*plane, loop, cost) = panels(DOUBLE, height, 1, columns, gridspec_kw={"wspace": 0.06})
    fine = fine or between(path)
    for axes in plane:
        draw_path(axes, path)
    draw_loop(loop, path, scale, fine)
    draw_cost(cost, path, scale, fine)
    figure.supxlabel(scale.footnote(), fontsize=TICK)
    if path.load_constant:
        style.title(cost, "energy lost since the beginning")
        return Figures({"history": figure})
    return Figures({"path": figure, "path_stick_slip": _maps(path, scale)})


def draw_loop_or_plane(axes: Axes, path: LoadPath) -> None:
    """Draw the loop of a path; at varying load, its points in the plane of P and Q / f."""
    if path.load_constant:
        draw_loop(axes, path, Scale(path.contact), between(path))
    else:
        draw_path(axes, path)


def draw_loop(axes: Axes, path: LoadPath, scale: Scale, fine: LoadPath) -> None:
    """Draw shear force against displacement."""
    x, q = scale.displacement, scale.force
    _draw_darkening(axes, path, fine, x.of(fine.displacements), q.of(fine.forces))
    style.mark_points(axes, x.of(path.displacements), q.of(path.forces))
    axes.margins(0.12)
    style.label(axes, x.short("X"), q.short("Q"))


def draw_cost(axes: Axes, path: LoadPath, scale: Scale, fine: LoadPath) -> None:
    """Draw the energy lost since the beginning against the number of the point."""
    m = len(path.losses)
    energy = scale.energy(float(path.losses.max(initial=0.0)))
    at = np.arange(1.0, len(fine.losses) + 1) * m / max(1, len(fine.losses))
    colours = _draw_darkening(axes, path, fine, at, energy.of(fine.losses))
    if m <= MOST_NUMBERS:
        axes.plot(np.arange(1.0, m + 1), energy.of(path.losses), "o", ms=3.5, color="0.15")
    else:
        style.bar(axes, colours, "step", above=True)
    axes.set(xlim=(0, max(1, m)))
    axes.set_ylim(bottom=0.0)
    axes.xaxis.set_major_locator(style.round_ticks(8, whole=True))
    style.label(axes, "step", energy.label("W"))


def _draw_darkening(
    axes: Axes, path: LoadPath, fine: LoadPath, x: Array, y: Array
) -> ScalarMappable:
    """Draw a curve that darkens from its start at the origin to its end; return the colours."""
    steps = max(1, len(path.forces))
    colours = ScalarMappable(Normalize(0, steps), ListedColormap(style.shades_of(256, low=0.15)))
    points = np.column_stack((np.append(0.0, x), np.append(0.0, y)))
    pieces = list(np.stack((points[:-1], points[1:]), axis=1))
    shades = colours.to_rgba(np.linspace(0, steps, len(pieces) + 1)[1:])
    axes.add_collection(
        LineCollection(pieces, colors=shades, linewidths=1.2, capstyle="round",
                       rasterized=len(pieces) > MOST_POINTS)
    )  # fmt: skip
    axes.autoscale_view()
    return colours


def _maps(path: LoadPath, scale: Scale) -> Figure:
    chosen = evenly_chosen(range(len(path.loads)), MOST_MAPS)
    columns = min(4, len(chosen))
    rows = -(-len(chosen) // columns)
    figure, places = panels(DOUBLE, 0.5 + 1.9 * rows, rows, columns)
    scene, modulus = path.scene, path.scene.material.contact_modulus
    radii = hertz.contact_radius(path.asperity_loads, modulus, scene.relative_radii)
    room = radii[chosen].max(axis=0)
    for axes, k in zip(places, chosen, strict=False):
        layers = status_layers(path.status[k], radii[k])
        draw_map(axes, scene.contact_points, layers, scale.length, room=room)
        slide = int((path.status[k] == "sliding").sum())
        touch = int((path.asperity_loads[k] > 0).sum())
        style.title(axes, f"{k + 1}: {slide:,} of {touch:,} slide", "center")
        axes.set(xlabel="", ylabel="")
        axes.tick_params(labelbottom=False, labelleft=False)
    for axes in places[len(chosen) :]:
        axes.set_axis_off()
    handles: Any = status_handles(np.unique(path.status[chosen]))
    if handles:
        style.legend_outside(figure, handles, "lower center", len(handles))
    return figure


def between(path: LoadPath) -> LoadPath:
    """The path with points added between the given ones.

    The path is unchanged if these points cost too much, if order fails, if nothing touches, or if a
    path of varying load starts from a pressed contact. The function may solve normal problems.

    >>> past = cr.history(contact, forces=0.5 * contact.load * np.array([0.6, -0.2, 0.3]))
    >>> len(cr.plots.between(past).forces)
    120
    """
    m, touching = len(path.forces), max(1, int(np.count_nonzero(path.contact.loads)))
    each = min(MOST_POINTS, AFFORDABLE // touching) // max(1, m)
    if not path.load_constant:
        each = min(each, 8) if m <= MOST_SEGMENTS else 1
    each = min(each, MOST_BETWEEN)
    follows_on = path.load_constant or path.start == 0.0  # it does not start from another contact
    if each < 2 or path.order == "fails" or not path.contact.loads.any() or not follows_on:
        return path
    corners = np.column_stack((path.loads, path.forces))
    part = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, each) / each)  # denser at the ends
    pieces = [
        np.vstack((a + part[:, None] * (b - a), b))
        for a, b in pairwise(np.vstack(([path.start, 0.0], corners)))
    ]
    P, Q = np.concatenate(pieces).T
    if path.load_constant:
        return history(path.contact, forces=Q)
    limit = (path.scene.friction or 1.0) * P
    return load_path(path.scene, loads=P, forces=np.clip(Q, -limit, limit))
