"""A history of shear forces: its path, and the energy it costs."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from convexrough.arrays import Array
from convexrough.friction.path import History, history
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import (
    DOUBLE,
    SMOOTH,
    TICK,
    ShearScale,
    label,
    no_contact_figure,
)

MOST_POINTS, MOST_NUMBERS, MOST_DOTS = 500, 12, 60


def history_figures(past: History, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figure of a history.

    "history" : Q against X, its steps numbered where they are few and in darkening colours; and
        the energy lost since the beginning against the step
    """
    contact = past.contact
    if not contact.loads.any():
        return Figures({"history": no_contact_figure(("$X$", "$Q$"), ("step", "energy lost"))})
    scale = ShearScale.of(contact, length_unit, force_unit)
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    path, cost = figure.subplots(1, 2, gridspec_kw={"wspace": 0.06})
    steps = len(past.forces)
    at, x, q, w = between_steps(past)
    x, q, w = x / scale.displacement, q / scale.force, w / scale.energy
    colours = ScalarMappable(Normalize(0.0, max(1, steps)), _darkening())
    for axes, across, up in ((path, x, q), (cost, at, w)):
        _draw_path(axes, at, across, up, colours)
    label(path, scale.displacement_label(), f"$Q\\,/\\,(fP)$  ({scale.limit()})")
    label(cost, "step", scale.energy_label())
    whose = scale.name if scale.sphere else "this contact"
    path.set_title(f"$X_0$: {whose}, gross sliding", fontsize=TICK, loc="left")
    cost.set_title("energy lost since the beginning", fontsize=TICK, loc="left")
    path.margins(0.12)
    cost.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    cost.set_xlim(0, max(1, steps))
    cost.set_ylim(bottom=0.0)
    if steps <= MOST_DOTS:
        ends = np.flatnonzero(at == np.round(at))
        for axes, across, up in ((path, x, q), (cost, at, w)):
            shades = colours.to_rgba(at[ends])
            axes.scatter(
                across[ends], up[ends], s=14, c=shades, lw=0.4, ec=SMOOTH, zorder=3, clip_on=False
            )
        if steps <= MOST_NUMBERS:
            _number(path, x[ends], q[ends])
    bar = figure.colorbar(colours, ax=cost, aspect=28, pad=0.02)
    bar.ax.yaxis.set_major_locator(MaxNLocator(8, integer=True))
    bar.ax.tick_params(labelsize=TICK)
    bar.ax.set_title("step", fontsize=TICK)
    return Figures({"history": figure})


def _darkening() -> Any:
    """Light first, dark last; nothing so light that it is lost on white."""
    whole = matplotlib.colormaps["viridis_r"]
    return matplotlib.colors.ListedColormap(whole(np.linspace(0.15, 1.0, 256)))


def between_steps(past: History) -> tuple[Array, Array, Array, Array]:
    """Step (from 0), X, Q and energy, at the steps and, where these are few, between them too.

    Fewer points where many asperities touch: each takes time.
    """
    stops = np.concatenate(([0.0], past.forces))
    steps = len(past.forces)
    affordable = min(MOST_POINTS, 8_000 // int(np.count_nonzero(past.contact.loads)))
    each = int(np.clip(affordable // max(1, steps), 1, 40))
    at = np.arange(steps * each + 1) / each
    if each > 1:
        whole = np.floor(at[:-1]).astype(int)
        part = 0.5 - 0.5 * np.cos(np.pi * (at[:-1] - whole))  # close together at the ends
        q = np.append(stops[whole] * (1 - part) + stops[whole + 1] * part, stops[-1])
        past = history(past.contact, forces=q[1:])
        at = np.append(whole + part, float(steps))
    x, q, w = (np.append(0.0, field) for field in (past.displacements, past.forces, past.losses))
    return at, x, q, w


def _draw_path(axes: Axes, at: Array, x: Array, y: Array, colours: ScalarMappable) -> None:
    points = np.column_stack((x, y))
    pieces = np.stack((points[:-1], points[1:]), axis=1)
    lines = LineCollection(
        list(pieces),
        colors=colours.to_rgba(at[1:]),
        linewidths=1.2,
        capstyle="round",
        rasterized=len(pieces) > MOST_POINTS,
    )
    axes.add_collection(lines)
    axes.autoscale_view()


def _number(axes: Axes, x: Array, q: Array) -> None:
    """The number of each step beside its end; steps that end at one place share a label.

    The first of eight sides, outwards first, that keeps off the other ends and labels.
    """
    width, height = np.ptp(x) or 1.0, np.ptp(q) or 1.0
    spots = np.column_stack((x / width, q / height)) * np.array([2.3, 2.0])  # about inches
    groups: dict[int, list[int]] = {}
    for i, spot in enumerate(spots):
        near = [j for j in groups if np.hypot(*(spots[j] - spot)) < 0.06]
        groups.setdefault(near[0] if near else i, []).append(i)
    taken = [spots[i] for i in groups]
    turns = np.sign(np.diff(q, prepend=q[0]) - np.diff(q, append=q[-1]))  # 1 at tops
    for first, group in groups.items():
        text = ", ".join(map(str, group))
        up = 90.0 if turns[group[-1]] >= 0 else -90.0
        sides = np.deg2rad(up + np.array([0, 45, -45, 90, -90, 135, -135, 180]))
        reach = 0.13 + 0.03 * len(text) * np.abs(np.cos(sides))
        places = spots[first] + np.column_stack((np.cos(sides), np.sin(sides))) * reach[:, None]
        clear = [
            min((float(np.hypot(*(place - other))) for other in taken), default=1.0)
            for place in places
        ]
        best = next((k for k, gap in enumerate(clear) if gap > 0.11), int(np.argmax(clear)))
        taken.append(places[best])
        shift = (places[best] - spots[first]) * 72.0
        axes.annotate(
            text,
            (x[first], q[first]),
            xytext=tuple(shift),
            textcoords="offset points",
            fontsize=TICK,
            ha="center",
            va="center",
            path_effects=[withStroke(linewidth=2.0, foreground="white")],
        )
