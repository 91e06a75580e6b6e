"""The map of derivatives with respect to heights."""

from __future__ import annotations

from matplotlib.axes import Axes

from convexrough import checks
from convexrough.gradients.gradient import Gradient
from convexrough.plots import style
from convexrough.plots.asperity_map import draw_values
from convexrough.plots.notebook import Figures, panels
from convexrough.plots.style import SINGLE, Scale


def gradient_figures(gradient: Gradient, *, of: str = "J") -> Figures:
    """The map of derivatives with respect to heights.

    "gradient" : contact discs, coloured by (D0 / J) dJ / dz, where D0 is the approach, J the
        differentiated number, and z the height of the asperity; open asperities are dots
    of : symbol of J, as a formula

    >>> print(*cr.plots.gradient_figures(contact.gradient(load=1.0), of="P"))
    gradient
    """
    checks.instance("gradient", gradient, Gradient)
    figure, (axes,) = panels(SINGLE + 0.7, 3.3)
    draw_gradient(axes, gradient, of)
    return Figures({"gradient": figure})


def draw_gradient(axes: Axes, gradient: Gradient, of: str = "J") -> None:
    """Draw derivatives with respect to heights: negative ones dark, positive ones light."""
    parts, per = gradient.heights * gradient.contact.approach, ""
    if gradient.value:
        parts, per = parts / gradient.value, f"\\,/\\,{of}"
    name = f"$D_0\\,\\partial {of}/\\partial z{per}$"
    draw_values(axes, Scale(gradient.contact), parts, name, signed=True)
    style.title(axes, f"{gradient.holding} kept constant")
