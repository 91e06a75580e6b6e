"""Which asperities matter: a map of derivatives by their heights."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from convexrough.gradients.gradient import Gradient
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import (
    CROWDED,
    LABEL,
    SINGLE,
    SMOOTH,
    TICK,
    Scale,
    draw_discs,
    draw_mosaic,
    draw_open,
    draw_smooth,
    frame_map,
    label,
    map_edge,
)

#: From dark, where a taller asperity lowers the number, to light, where it raises it: also in grey.
SIGNED = "viridis"


def gradient_figures(
    gradient: Gradient, *, of: str = "J", length_unit: str = "", force_unit: str = ""
) -> Figures:
    """The map of the derivatives by heights.

    "gradient" : contact discs, in the colour of D0 / J times dJ / dz; open asperities as dots
    of : what the number is called, as a formula

    Units are only said, never converted.
    """
    figure = Figure(figsize=(SINGLE + 0.7, 3.3), layout="constrained")
    axes = figure.subplots()
    scale = Scale.of(gradient.contact, length_unit, force_unit)
    draw_gradient(axes, gradient, scale, of)
    return Figures({"gradient": figure})


def draw_gradient(axes: Axes, gradient: Gradient, scale: Scale, of: str = "J") -> None:
    """The map, with its bar of colours."""
    contact = gradient.contact
    parts, per = gradient.heights * contact.approach, ""
    if gradient.value:
        parts, per = parts / gradient.value, f"\\,/\\,{of}"
    most = float(np.abs(parts).max()) or 1.0
    colours = ScalarMappable(Normalize(-most, most), SIGNED)
    touching, edge = contact.loads > 0, map_edge(contact, scale)
    points = contact.scene.contact_points / scale.length
    radii = contact.contact_radii[touching] / scale.length
    if len(radii) < CROWDED:
        draw_open(axes, points[~touching & (np.abs(points).max(axis=1) < edge)])
        look = {"facecolors": colours.to_rgba(parts[touching]), "edgecolors": SMOOTH}
        draw_discs(axes, points[touching], radii, "contact discs", linewidths=0.3, **look)
    else:
        draw_mosaic(axes, points, colours.to_rgba(parts), touching, edge, 500)
    draw_smooth(axes, scale)
    frame_map(axes, edge)
    label(axes, scale.length_label("x"), scale.short("y"))
    axes.set_title(f"{gradient.holding} held", fontsize=TICK, loc="left")
    bar = axes.figure.colorbar(colours, ax=axes, aspect=28, pad=0.02)
    bar.ax.tick_params(labelsize=TICK)
    bar.set_label(f"$D_0\\,\\partial {of}/\\partial z{per}$", fontsize=LABEL)
