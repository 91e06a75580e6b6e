"""Closed load paths: what stays for ever, and what a cycle costs at which phase and size."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from convexrough.friction.cycle import Cycle
from convexrough.friction.phases import PhaseLosses
from convexrough.plots.asperity_map import draw_map, status_handles, status_layers
from convexrough.plots.load_plane import PATTERNS, draw_closed
from convexrough.plots.measure import Scale, measure, product, quantity
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import (
    DOUBLE,
    SINGLE,
    SMOOTH,
    TICK,
    label,
    legend_below,
    legend_outside,
    shades_of,
    title,
)

MOST_FACTORS = 5


def steady_figures(found: Cycle, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figure of a closed path.

    "steady" : the path in the load plane, with the two lines that keep the point (L*, T*) for ever;
        and what each asperity does in every later cycle
    """
    figure = Figure(figsize=(DOUBLE, 3.5), layout="constrained")
    plane, place = figure.subplots(1, 2)
    draw_closed(plane, found, force_unit)
    length = Scale(found.contact, length_unit, force_unit).length
    layers = status_layers(found.status, found.contact.contact_radii)
    draw_map(place, found.scene.contact_points, layers, length)
    if handles := status_handles(np.unique(found.status)):
        legend_outside(figure, handles, "lower center", len(handles))
    lost = quantity(found.loss, product(force_unit, length_unit))
    title(place, f"every later cycle loses {lost}")
    return Figures({"steady": figure})


def phase_figures(found: PhaseLosses, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figure of losses at several phases and sizes.

    "phase_losses" : loss per cycle against the phase, a line for each size; and the smooth sphere's
    """
    figure = Figure(figsize=(SINGLE, 3.4), layout="constrained")
    draw_losses(figure.subplots(), found, length_unit, force_unit)
    return Figures({"phase_losses": figure})


def draw_losses(axes: Axes, found: PhaseLosses, length_unit: str, force_unit: str) -> None:
    """Loss over factor^3, as losses of small cycles are of third order: lines come together."""
    sizes = np.unique(found.factors)[-MOST_FACTORS:]
    cubes = np.abs(found.factors) ** 3
    most = float((found.losses / cubes).max()) or 1.0
    unit = measure(most, product(force_unit, length_unit), "W_m")
    for size, shade, pattern in zip(sizes, shades_of(len(sizes)), PATTERNS, strict=False):
        those = np.flatnonzero(found.factors == size)
        those = those[np.argsort(found.phases[those])]
        turns = np.degrees(found.phases[those])
        rough, smooth = (unit.of(each / cubes)[those] for each in (found.losses, found.smooth))
        axes.plot(turns, rough, color=shade, lw=1.5, ls=pattern, label=f"{size:g}")
        axes.plot(turns, smooth, color=SMOOTH, lw=0.7, ls=pattern)
    axes.plot([], [], color=SMOOTH, lw=0.7, label="smooth sphere")
    legend_below(axes, 3, title="factor", title_fontsize=TICK)
    axes.set_ylim(bottom=0.0)
    label(
        axes,
        "phase [°]; 90: in step",
        unit.label(r"W\,/\,\mathrm{factor}^3"),
    )
