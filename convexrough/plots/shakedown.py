"""Limits of shakedown: asperity by asperity, and over the amplitudes of load and shear."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from convexrough.arrays import Array
from convexrough.melan.shakedown import Shakedown
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import (
    COLOURS,
    CROWDED,
    DASHED,
    DENSE,
    FAINT,
    LABEL,
    SINGLE,
    SMOOTH,
    TICK,
    UNSURE,
    draw_mosaic,
    draw_open,
    frame_map,
    label,
)

#: Points of the map along each of its axes.
FINE = 240


def shakedown_figures(found: Shakedown, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figures of a limit of shakedown; forces are drawn without units.

    "shakedown" : up to which factor of the path each asperity stops to slide, and which is first
    "shakedown_map" : how many slide for ever where load and shear swing by different factors; at
        constant load, where the shear force swings about different means. Of kind "exact", where
        every onset is known
    """
    figure = Figure(figsize=(SINGLE, 3.4), layout="constrained")
    draw_factors(figure.subplots(), found, length_unit)
    figures = Figures({"shakedown": figure})
    if found.kind == "exact" and len(onsets := _onsets(found)) > 1:
        figures["shakedown_map"] = _map(found, onsets)
    return figures


def draw_factors(axes: Axes, found: Shakedown, length_unit: str) -> None:
    """Each asperity in the shade of its factor; by "vector", which has one for all, of its slip."""
    scene, vector = found.scene, found.kind == "vector"
    known = np.isfinite(found.factors)
    values = np.linalg.norm(found.mechanism, axis=-1).max(axis=0) if vector else found.factors
    points = scene.contact_points
    reach = np.hypot(*points.T)
    edge = 1.12 * float(reach[known].max(initial=0.0) or reach.max() or 1.0)
    low, high = values[known].min(initial=np.inf), values[known].max(initial=-np.inf)
    spread = Normalize(min(low, high), high if high > low else low * 1.01 + 1e-300)
    if int(known.sum()) >= CROWDED:
        shades = colormaps[COLOURS](spread(np.nan_to_num(values)))
        draw_mosaic(axes, points, shades, known, edge, 320)
        mapped = axes.scatter([], [], c=[], cmap=COLOURS, norm=spread)
        ringed = ""
    else:
        draw_open(axes, points[~known & (reach < 1.2 * edge)])
        size = min(4.8e3 / max(8.0, float(known.sum())), 120.0)
        look: dict[str, Any] = {"s": size, "rasterized": int(known.sum()) >= DENSE}
        x, y = points[known].T
        shaded: dict[str, Any] = {"c": values[known], "cmap": COLOURS, "norm": spread}
        mapped = axes.scatter(x, y, lw=0.4, ec=SMOOTH, **shaded, **look)
        first = known & (found.factors <= found.factor * (1 + 1e-6)) & (not vector)
        x, y = points[first].T
        axes.scatter(x, y, fc="none", ec=UNSURE, lw=1.4, **look)
        ringed = "\nringed: the first to slide on" if first.any() else ""
    frame_map(axes, edge)
    label(axes, f"$x$ {length_unit}".strip(), f"$y$ {length_unit}".strip())
    axes.set_title(f"{found.kind}: {found.factor:.5g}{ringed}", fontsize=TICK, loc="left")
    if not high > low:
        return
    bar = axes.figure.colorbar(mapped, ax=axes, shrink=0.8)
    what = "slip in the mechanism [1]" if vector else "factor up to which sliding ceases"
    bar.set_label(what, fontsize=LABEL)
    bar.ax.tick_params(labelsize=TICK)


def _onsets(found: Shakedown) -> Array:
    """(k,) sigma_i over P0 of the asperities whose factor is known, in falling order."""
    fall = _fall(found, np.array(1.0), np.array(1.0))
    return np.sort(1.0 - found.factors[np.isfinite(found.factors)] * float(fall))[::-1]


def _fall(found: Shakedown, along: Array, across: Array) -> Array:
    """(P0 - L*) / P0 where p and t are scaled apart, by factors of the same shape."""
    f = found.scene.friction or 1.0
    p, t = found.load_amplitudes, found.force_amplitudes / f
    reached = [
        (-(along[..., None] * p + sign * across[..., None] * t)).max(axis=-1)
        for sign in (1.0, -1.0)
    ]
    return np.asarray(sum(reached) / (2.0 * found.load))


def _map(found: Shakedown, onsets: Array) -> Figure:
    """How many of those whose onset is known slide for ever; hatched: all slide, or pulled off."""
    figure = Figure(figsize=(SINGLE, 3.4), layout="constrained")
    axes = figure.subplots()
    f = found.scene.friction or 1.0
    varies = np.ptp(found.load_amplitudes) > 0
    unit_p = np.ptp(found.load_amplitudes) / 2.0 / found.load
    unit_t = np.ptp(found.force_amplitudes) / 2.0 / (f * found.load)
    part = (np.arange(FINE) + 0.5) / FINE
    x, y = np.meshgrid(part, part)
    mean = np.full_like(x, float(found.force) / (f * found.load)) if varies else x
    along = x / unit_p if varies else np.zeros_like(x)
    across = y / unit_t if unit_t > 0 else np.zeros_like(y)
    P = 1.0 + along[..., None] * found.load_amplitudes / found.load
    T = mean[..., None] + across[..., None] * found.force_amplitudes / (f * found.load)
    borne = (np.abs(T) <= P).all(axis=-1)
    level = 1.0 - _fall(found, along, across)
    sliding = len(onsets) - np.searchsorted(onsets[::-1], level, side="right")
    shown = np.ma.masked_where(~borne, sliding)
    look: dict[str, Any] = {"cmap": COLOURS, "vmin": 0, "vmax": len(onsets), "rasterized": True}
    filled = axes.pcolormesh(part, part, shown, **look)
    axes.patch.set(hatch="////", edgecolor=FAINT, facecolor="white")
    limit = np.where(borne, sliding > 0, np.nan).astype(float)
    if np.nanmin(limit) < np.nanmax(limit):
        axes.contour(x, y, limit, [0.5], colors=UNSURE, linewidths=1.4)
    if varies:
        reach = np.array([0.0, 1.0 / max(unit_p, unit_t)])
        axes.plot(unit_p * reach, unit_t * reach, color=SMOOTH, lw=0.8, ls=DASHED)
    at = unit_p * found.factor if varies else float(found.force) / (f * found.load)
    axes.plot([at], [unit_t * found.factor], "o", ms=5, mfc="white", mec=UNSURE, mew=1.4)
    axes.set(xlim=(0, 1), ylim=(0, 1), aspect="equal")
    bar = figure.colorbar(filled, ax=axes, shrink=0.8)
    bar.set_label("asperities that slide on, or open", fontsize=LABEL)
    bar.ax.tick_params(labelsize=TICK)
    across_label = "load amplitude / $P_0$" if varies else "mean shear $Q_0\\,/\\,(fP_0)$"
    label(axes, across_label, "shear amplitude / $(fP_0)$")
    axes.set_title(
        "hatched: gross sliding\nline: the limit; dot: of this path", fontsize=TICK, loc="left"
    )
    return figure
