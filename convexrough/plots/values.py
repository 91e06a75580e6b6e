"""Maps of a value of each asperity: slip, energy and tractions in fretting, and derivatives."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from convexrough.arrays import Array
from convexrough.friction.fretting import Fretting
from convexrough.gradients.gradient import Gradient
from convexrough.plots import style
from convexrough.plots.asperity_map import draw_values
from convexrough.plots.measure import Measure, Scale, measure
from convexrough.plots.notebook import Figures, panels
from convexrough.plots.style import DOUBLE, SINGLE, TICK


def fretting_figures(worn: Fretting) -> Figures:
    """The figure of fretting in a steady cycle.

    "fretting" : maps of the slip amplitude at the rim of each disc, the energy lost per cycle and,
        at the largest force, the mean and the largest shear traction

    >>> worn = cr.fretting(cr.cycle(contact, maximum=0.25 * contact.load))
    >>> print(*cr.plots.fretting_figures(worn))
    fretting
    """
    if not worn.contact.loads.any():
        return style.no_contact("fretting")
    scale = Scale(worn.contact)
    figure, maps = panels(DOUBLE, 6.2, 2, 2, sharex=True, sharey=True)
    pressure, f = scale.units.pressure, scale.limit / worn.contact.load
    most = _largest(worn.largest_tractions) if pressure else f * scale.peak
    traction = measure(most, pressure, f"(f{scale.pressure.symbol})")
    draw_slip(maps[0], worn, scale)
    energy = measure(_largest(worn.losses), scale.units.work, "W_m")
    _draw(maps[1], scale, worn.losses, energy, "energy lost per cycle", "W_i")
    _draw(maps[2], scale, worn.mean_tractions, traction, "mean traction", "\\bar q_i")
    _draw(maps[3], scale, worn.largest_tractions, traction, "largest traction", "q_i")
    for axes in maps:
        axes.label_outer()
    low, high = worn.minimum / scale.limit, worn.maximum / scale.limit
    between = f"cycle of $Q/(fP)$ from {low:.4g} to {high:.4g}".replace("-", "\u2212")
    figure.suptitle(between, fontsize=TICK)
    return Figures({"fretting": figure})


def draw_slip(axes: Axes, worn: Fretting, scale: Scale | None = None) -> None:
    """Draw the map of slip amplitudes."""
    scale = scale or Scale(worn.contact)
    most = _largest(worn.slip_amplitudes)
    slip = measure(most if scale.units.length else scale.travel, scale.units.length, "X_0")
    _draw(axes, scale, worn.slip_amplitudes, slip, "slip amplitude at the rim", "s_i")


def _largest(values: Array) -> float:
    return float(values.max(initial=0.0, where=np.isfinite(values)))


def _draw(axes: Axes, scale: Scale, values: Array, unit: Measure, name: str, symbol: str) -> None:
    draw_values(axes, scale, np.nan_to_num(unit.of(values)), unit.short(symbol))
    style.title(axes, name)


def gradient_figures(gradient: Gradient, *, of: str = "J") -> Figures:
    """The map of derivatives with respect to heights.

    "gradient" : contact discs, coloured by (D0 / J) dJ / dz, where D0 is the approach, J the
        differentiated number, and z the height of the asperity; open asperities are dots
    of : symbol of J, as a formula

    >>> print(*cr.plots.gradient_figures(contact.gradient(load=1.0), of="P"))
    gradient
    """
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
