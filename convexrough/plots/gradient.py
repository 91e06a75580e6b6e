"""Which asperities matter: a map of derivatives by their heights."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from convexrough.gradients.gradient import Gradient
from convexrough.plots.asperity_map import Layer, draw_contact
from convexrough.plots.measure import Scale
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import SINGLE, bar, title

#: From dark, where a taller asperity lowers the number, to light, where it raises it: also in grey.
SIGNED = "viridis"


def gradient_figures(
    gradient: Gradient, *, of: str = "J", length_unit: str = "", force_unit: str = ""
) -> Figures:
    """The map of the derivatives by heights.

    "gradient" : contact discs, in the colour of D0 / J times dJ / dz; open asperities as dots
    of : what the number is called, as a formula
    """
    figure = Figure(figsize=(SINGLE + 0.7, 3.3), layout="constrained")
    scale = Scale(gradient.contact, length_unit, force_unit)
    draw_gradient(figure.subplots(), gradient, scale, of)
    return Figures({"gradient": figure})


def draw_gradient(axes: Axes, gradient: Gradient, scale: Scale, of: str = "J") -> None:
    """The map, with its bar of colours."""
    contact = gradient.contact
    parts, per = gradient.heights * contact.approach, ""
    if gradient.value:
        parts, per = parts / gradient.value, f"\\,/\\,{of}"
    most = float(np.abs(parts).max()) or 1.0
    colours = ScalarMappable(Normalize(-most, most), SIGNED)
    shades = colours.to_rgba(parts)
    draw_contact(axes, scale, [Layer("contact discs", contact.contact_radii, shades)])
    title(axes, f"{gradient.holding} held")
    bar(axes, colours, f"$D_0\\,\\partial {of}/\\partial z{per}$")
