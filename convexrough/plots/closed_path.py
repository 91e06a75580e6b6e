"""Closed load paths: what stays for ever, and what a cycle costs at which phase and size."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from convexrough.friction.cycle import Cycle
from convexrough.friction.phases import PhaseLosses
from convexrough.plots.load_plane import PATTERNS, draw_closed
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import COLOURS, DOUBLE, SINGLE, SMOOTH, TICK, label, quantity
from convexrough.plots.words import draw_words, word_handles

MOST_FACTORS = 5


def steady_figures(found: Cycle, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figure of a closed path.

    "steady" : the path in the load plane, with the two lines that keep the point (L*, T*) for ever;
        and what each asperity does in every later cycle
    """
    figure = Figure(figsize=(DOUBLE, 3.3), layout="constrained")
    plane, place = figure.subplots(1, 2)
    draw_closed(plane, found, force_unit)
    draw_words(place, found.scene, found.contact.contact_radii, found.status)
    if handles := word_handles(np.unique(found.status)):
        place.legend(handles=handles, fontsize=TICK, frameon=False, loc="upper left",
                     bbox_to_anchor=(1.0, 1.0))  # fmt: skip
    label(place, f"$x$ {length_unit}".strip(), f"$y$ {length_unit}".strip())
    lost = quantity(found.loss, f"{force_unit} {length_unit}".strip())
    place.set_title(f"every later cycle loses {lost}", fontsize=TICK, loc="left")
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
    shades = matplotlib.colormaps[COLOURS](np.linspace(0.3, 1.0, len(sizes)))
    cubes = np.abs(found.factors) ** 3
    unit = float((found.losses / cubes).max()) or 1.0
    for size, shade, pattern in zip(sizes, shades, (*PATTERNS, "-"), strict=False):
        those = found.factors == size
        order = np.argsort(found.phases[those])
        turns = np.degrees(found.phases[those][order])
        rough, smooth = (
            (each / cubes)[those][order] / unit for each in (found.losses, found.smooth)
        )
        axes.plot(turns, rough, color=shade, lw=1.5, ls=pattern, label=f"{size:g}")
        axes.plot(turns, smooth, color=SMOOTH, lw=0.7, ls=pattern)
    axes.plot([], [], color=SMOOTH, lw=0.7, label="smooth sphere")
    axes.legend(fontsize=TICK - 1, frameon=False, title="factor", title_fontsize=TICK, ncols=3,
                loc="upper center", bbox_to_anchor=(0.5, -0.2))  # fmt: skip
    axes.set_ylim(bottom=0.0)
    name = quantity(unit, f"{force_unit} {length_unit}".strip())
    label(axes, "phase [°]; 90: in step", f"loss / factor$^3$ / {name}")
