"""Map of the derivatives of a result with respect to the heights of asperities."""

from __future__ import annotations

from matplotlib.axes import Axes

from convexrough.gradients.gradient import Gradient
from convexrough.plots.asperity_map import draw_values
from convexrough.plots.measure import Scale
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import SINGLE, title


def gradient_figures(gradient: Gradient, *, of: str = "J") -> Figures:
    """The map of derivatives with respect to heights.

    "gradient" : contact discs, coloured by D0 / J times dJ / dz, with the approach D0, the number J
        and the height z of the asperity; open asperities as dots
    of : symbol of J, as a formula
    """
    figure = Figure(figsize=(SINGLE + 0.7, 3.3), layout="constrained")
    draw_gradient(figure.subplots(), gradient, of)
    return Figures({"gradient": figure})


def draw_gradient(axes: Axes, gradient: Gradient, of: str = "J") -> None:
    """Draw derivatives with respect to heights: negative ones dark, positive ones light."""
    parts, per = gradient.heights * gradient.contact.approach, ""
    if gradient.value:
        parts, per = parts / gradient.value, f"\\,/\\,{of}"
    draw_values(
        axes,
        Scale(gradient.contact),
        parts,
        f"$D_0\\,\\partial {of}/\\partial z{per}$",
        signed=True,
    )
    title(axes, f"{gradient.holding} kept constant")
