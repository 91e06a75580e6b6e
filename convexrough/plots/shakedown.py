"""Figures of shakedown limits: a map of asperities, and a map of load and shear amplitudes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from convexrough import checks
from convexrough.arrays import Array
from convexrough.melan.shakedown import Shakedown
from convexrough.plots import style
from convexrough.plots.asperity_map import Layer, draw_map, even_radius
from convexrough.plots.notebook import Figure, Figures, panels
from convexrough.plots.style import COLOURS, DASHED, FAINT, SINGLE, SMOOTH, UNSURE

#: Number of points of the map along each axis.
FINE = 240


def shakedown_figures(found: Shakedown) -> Figures:
    """The figures of a shakedown limit, with dimensionless forces. P0 is the mean load.

    "shakedown" : for each asperity, the largest factor of the path at which its sliding dies out,
        or above which it opens, if that limits the path; for the kind "vector", its slip in the
        mechanism
    "shakedown_map" : number of asperities that slide or open in every cycle, against the amplitudes
        of load and shear; at constant load, against mean and amplitude of the shear force. Only for
        the kind "exact", and if more than one asperity has a factor

    >>> swing = 0.5 * contact.load * np.array([1.0, -1.0])
    >>> found = cr.shakedown(scene, load=contact.load, force_amplitudes=swing)
    >>> print(*cr.plots.shakedown_figures(found))
    shakedown shakedown_map
    """
    checks.instance("found", found, Shakedown)
    figure, (axes,) = panels(SINGLE + 0.7, 3.4)
    draw_factors(axes, found)
    figures = Figures({"shakedown": figure})
    if found.kind == "exact" and np.count_nonzero(np.isfinite(found.factors)) > 1:
        figures["shakedown_map"] = _map(found)
    return figures


def draw_factors(axes: Axes, found: Shakedown) -> None:
    """Draw each asperity in a shade for its factor; if the kind is "vector", for its slip."""
    vector = found.kind == "vector"
    known, points = np.isfinite(found.factors), found.scene.contact_points
    values = np.linalg.norm(found.mechanism, axis=-1).max(axis=0) if vector else found.factors
    low, high = values[known].min(initial=np.inf), values[known].max(initial=-np.inf)
    spread = Normalize(min(low, high), high if high > low else low * 1.01 + 1e-300)
    colours = ScalarMappable(spread, COLOURS)
    radii = np.where(known, even_radius(points), 0.0)
    first = known & (found.factors <= found.factor * (1 + 1e-6)) & (not vector)
    layers = [
        Layer("first", np.where(first, 1.25 * radii, 0.0), UNSURE, None),
        Layer("known", radii, colours.to_rgba(np.nan_to_num(values))),
    ]
    length = style.measure(float(np.ptp(points)), found.scene.units.length)
    draw_map(axes, points, length, layers)
    keeps, least = "keep sliding", "factor up to which sliding dies out"
    if found.limited_by == "opening":
        keeps, least = "open in every cycle", "factor above which it opens"
    ringed = f"\nringed: the first to {keeps}" if first.any() else ""
    style.title(axes, f"{found.kind}: {found.factor:.5g}{ringed}")
    if high > low:
        style.bar(axes, colours, "slip in the mechanism [1]" if vector else least)


def _fall(found: Shakedown, along: Array, across: Array) -> Array:
    """(P0 - L*) / P0 for factors of the load amplitudes (along) and of the shear ones (across).

    Asperities that first touch above the load L* slide or open in every cycle.
    """
    p, t = found.load_amplitudes, found.force_amplitudes / (found.scene.friction or 1.0)
    sides = (along[..., None] * p + sign * across[..., None] * t for sign in (1.0, -1.0))
    return np.asarray(-sum(side.min(axis=-1) for side in sides) / (2.0 * found.load))


def _map(found: Shakedown) -> Figure:
    """The map: how many asperities slide or open in every cycle; hatched where |Q| > f P."""
    figure, (axes,) = panels(SINGLE, 3.4)
    limit = (found.scene.friction or 1.0) * found.load
    p, t = found.load_amplitudes / found.load, found.force_amplitudes / limit
    unit_p, unit_t, mean = np.ptp(p) / 2.0, np.ptp(t) / 2.0, float(found.force) / limit
    varies, part = unit_p > 0, (np.arange(FINE) + 0.5) / FINE
    x, y = np.meshgrid(part, part)
    along = x / unit_p if varies else np.zeros_like(x)
    across = y / unit_t if unit_t > 0 else np.zeros_like(y)
    T = (np.full_like(x, mean) if varies else x)[..., None] + across[..., None] * t
    borne = (np.abs(T) <= 1.0 + along[..., None] * p).all(axis=-1)
    # The loads, over P0, at which the asperities with a known factor first touch.
    fall = float(_fall(found, np.array(1.0), np.array(1.0)))
    onsets = np.sort(1.0 - found.factors[np.isfinite(found.factors)] * fall)
    sliding = len(onsets) - np.searchsorted(onsets, 1.0 - _fall(found, along, across), side="right")
    filled = axes.pcolormesh(part, part, np.ma.masked_where(~borne, sliding), cmap=COLOURS, vmin=0,
                             vmax=len(onsets), rasterized=True)  # fmt: skip
    axes.patch.set(hatch="////", edgecolor=FAINT, facecolor="white")
    slides = np.where(borne, sliding > 0, np.nan).astype(float)
    if np.nanmin(slides) < np.nanmax(slides):
        axes.contour(x, y, slides, [0.5], colors=UNSURE, linewidths=1.4)
    if varies:
        reach = np.array([0.0, 1.0 / max(unit_p, unit_t)])
        axes.plot(unit_p * reach, unit_t * reach, color=SMOOTH, lw=0.8, ls=DASHED)
    at = unit_p * found.factor if varies else mean
    axes.plot([at], [unit_t * found.factor], "o", ms=5, mfc="white", mec=UNSURE, mew=1.4)
    axes.set(xlim=(0, 1), ylim=(0, 1), aspect="equal")
    style.bar(axes, filled, "asperities that keep sliding, or open")
    across_label = "load amplitude / $P_0$" if varies else "mean shear $Q_0\\,/\\,(fP_0)$"
    style.label(axes, across_label, "shear amplitude / $(fP_0)$")
    style.title(axes, "hatched: gross sliding; line: limit\ndot: this path at its limit")
    return figure
