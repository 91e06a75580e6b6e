"""Figures of histories and load paths: loops, energy losses, and maps of stick and slip."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize

from convexrough import checks
from convexrough.arrays import Array
from convexrough.friction.path import LoadPath, history, load_path
from convexrough.plots import style
from convexrough.plots.asperity_map import draw_statuses, label_tiles, tiles
from convexrough.plots.notebook import Figure, Figures, no_contact, panels
from convexrough.plots.steady import label_plane, name_statuses, vertices
from convexrough.plots.style import DOUBLE, FAINT, PATTERNS, TICK, Scale, ink
from convexrough.scene.rings import evenly_chosen
from convexrough.sphere import hertz

#: Largest numbers of maps, of memory curves, of points with numbers, and of points with dots.
MOST_MAPS, MOST_CURVES, MOST_NUMBERS, MOST_DOTS = 8, 4, 12, 60

#: Limits when points are added: number of points; touching asperities times points; steps between
#: two given points, at constant load and at varying load, where each needs a normal solution.
MOST_POINTS, AFFORDABLE, MOST_BETWEEN, MOST_VARYING = 500, 16_000, 40, 8


def path_figures(path: LoadPath) -> Figures:
    """The figures of a load path, or of a history, which has constant load.

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
    checks.instance("path", path, LoadPath)
    if path.load_constant and not path.contact.loads.any():
        return no_contact("history")
    scale, fine = Scale(path.contact), _finer(path)
    height, columns = (3.0, 2) if path.load_constant else (3.2, 3)
    figure, (*plane, loop, cost) = panels(DOUBLE, height, 1, columns, gridspec_kw={"wspace": 0.06})
    _draw_loop(loop, path, scale, fine)
    _draw_cost(cost, path, scale, fine)
    figure.supxlabel(scale.footnote(), fontsize=TICK)
    if path.load_constant:
        style.title(cost, "energy lost since the beginning")
        return Figures(history=figure)
    _draw_path(plane[0], path)
    return Figures(path=figure, path_stick_slip=_maps(path, scale))


def draw_loop_or_plane(axes: Axes, path: LoadPath) -> None:
    """Draw the loop of a path; at varying load, its points in the plane of P and Q / f."""
    if path.load_constant:
        _draw_loop(axes, path, Scale(path.contact), _finer(path))
    else:
        _draw_path(axes, path)


def _draw_loop(axes: Axes, path: LoadPath, scale: Scale, fine: LoadPath) -> None:
    """Draw shear force against displacement."""
    x, q = scale.displacement, scale.force
    _draw_darkening(axes, path, x.of(fine.displacements), q.of(fine.forces))
    _mark_points(axes, x.of(path.displacements), q.of(path.forces))
    axes.margins(0.12)
    style.label(axes, x.short("X"), q.short("Q"))


def _draw_cost(axes: Axes, path: LoadPath, scale: Scale, fine: LoadPath) -> None:
    """Draw the energy lost since the beginning against the number of the point."""
    m, each = len(path.losses), len(fine.losses) // len(path.losses)
    energy = scale.energy(float(path.losses.max(initial=0.0)))
    at = np.add.outer(np.arange(m), _parts(each)).ravel()
    colours = _draw_darkening(axes, path, at, energy.of(fine.losses))
    if m <= MOST_NUMBERS:
        axes.plot(np.arange(1.0, m + 1), energy.of(path.losses), "o", ms=3.5, color=ink())
    else:
        style.bar(axes, colours, "step", above=True)
    axes.set_xlim(0, m)
    axes.set_ylim(bottom=0.0)
    axes.xaxis.set_major_locator(style.round_ticks(8, whole=True))
    style.label(axes, "step", energy.label("W"))


def _draw_darkening(axes: Axes, path: LoadPath, x: Array, y: Array) -> ScalarMappable:
    """Draw a curve that darkens from its start at the origin to its end; return the colours."""
    steps = len(path.forces)
    colours = ScalarMappable(Normalize(0, steps), ListedColormap(style.shades_of(256, low=0.15)))
    points = np.column_stack((np.append(0.0, x), np.append(0.0, y)))
    pieces = list(np.stack((points[:-1], points[1:]), axis=1))
    shades = colours.to_rgba(np.linspace(0, steps, len(pieces) + 1)[1:])
    many = len(pieces) > MOST_POINTS
    axes.add_collection(LineCollection(pieces, colors=shades, linewidths=1.2, rasterized=many))
    axes.autoscale_view()
    return colours


def _mark_points(axes: Axes, x: Array, y: Array) -> None:
    """Mark points with dots and numbers, if there are few; close ones share their label."""
    if len(x) <= MOST_DOTS:
        axes.plot(x, y, "o", ms=3.5, color=ink(), clip_on=False, zorder=3)
    if len(x) > MOST_NUMBERS:
        return
    spans = np.array([np.ptp(x) or 1.0, np.ptp(y) or 1.0])
    inches = 0.75 * np.array(axes.bbox.size) / axes.figure.dpi  # about those after layout
    spots = np.column_stack((x, y)) / spans * inches / (0.22, 0.15)  # about sizes of labels
    groups: dict[int, list[int]] = {}
    for i, spot in enumerate(spots):
        near = (j for j in groups if np.abs(spots[j] - spot).max() < 1)
        groups.setdefault(next(near, i), []).append(i)
    box = {"boxstyle": "round,pad=0.15", "fc": axes.get_facecolor(), "ec": ink(), "lw": 0.6}
    for i, group in groups.items():
        text = ", ".join(str(1 + each) for each in group)
        axes.text(x[i], y[i], text, fontsize=TICK - 1, ha="center", va="center", bbox=box)


def _maps(path: LoadPath, scale: Scale) -> Figure:
    """Maps of stick and slip at some points, all in the same square, with P and Q as titles."""
    chosen = evenly_chosen(range(len(path.loads)), MOST_MAPS)
    figure, places = tiles(len(chosen), 3)
    scene, modulus = path.scene, path.scene.material.contact_modulus
    radii = hertz.contact_radius(path.asperity_loads, modulus, scene.relative_radii)
    room = radii[chosen].max(axis=0)
    unit = style.measure(float(path.loads.max()), scene.units.force, "P_m")
    named = f"${unit.symbol}$" if unit.symbol else style.literal(unit.said)
    for axes, k in zip(places, chosen, strict=True):
        draw_statuses(axes, scale.points, scale.length, path.status[k], radii[k], room=room)
        slide = np.count_nonzero(path.status[k] == "sliding")
        touch = np.count_nonzero(path.asperity_loads[k] > 0)
        load, force = (f"{unit.of(each[k]):.3g} {named}" for each in (path.loads, path.forces))
        said = f"{k + 1}: $P$ = {load}\n$Q$ = {force}\n{slide:,} of {touch:,} slide"
        style.title(axes, said.replace("-", "\u2212"), "center")
    x = scale.length.label("x") + (f"    (${unit.symbol}$ = {unit.said})" if unit.symbol else "")
    label_tiles(figure, places, x, scale.length.short("y"))
    name_statuses(figure, path.status[chosen], "outside upper center")
    return figure


def _parts(each: int) -> Array:
    """(each,) parts of a segment from its beginning, denser at the ends; the last is 1."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(1, each + 1) / each)


def _finer(path: LoadPath) -> LoadPath:
    """The path with points added in between, for which it may solve problems, if they are cheap."""
    m, touching = max(1, len(path.forces)), max(1, int(np.count_nonzero(path.contact.loads)))
    most = MOST_BETWEEN if path.load_constant else MOST_VARYING
    each = min(MOST_POINTS // m, AFFORDABLE // touching // m, most)
    starts_here = path.load_constant or path.start == 0.0
    if each < 2 or path.order == "fails" or not path.contact.loads.any() or not starts_here:
        return path
    ends = np.vstack(([path.start, 0.0], np.column_stack((path.loads, path.forces))))
    steps = np.diff(ends, axis=0)[:, None] * _parts(each)[:, None]
    P, Q = (ends[:-1, None] + steps).reshape(-1, 2).T
    P[each - 1 :: each], Q[each - 1 :: each] = path.loads, path.forces
    if path.load_constant:
        return history(path.contact, forces=Q)
    limit = (path.scene.friction or 1.0) * P
    return load_path(path.scene, loads=P, forces=np.clip(Q, -limit, limit))


def _draw_path(axes: Axes, path: LoadPath) -> None:
    """Draw the path in the plane, and the memory curve at some of its points."""
    f = path.scene.friction or 1.0
    unit = label_plane(axes, float(path.loads.max()), path.scene.units.force)
    P, T = unit.of(path.loads), unit.of(path.forces / f)
    axes.plot(np.append(unit.of(path.start), P), np.append(0.0, T), color=FAINT, lw=0.9)
    chosen = evenly_chosen(range(len(P)), MOST_CURVES)
    for k, shade, pattern in zip(chosen, style.shades_of(len(chosen)), PATTERNS, strict=False):
        memory = vertices(path.curves[k], unit)
        axes.plot(*memory, color=shade, lw=1.5, ls=pattern, label=f"memory at {k + 1}")
    _mark_points(axes, P, T)
    style.legend(axes, "below", handlelength=2.2)
