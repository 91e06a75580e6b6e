"""The source paper's figures with curves: asperity forces (Fig. 7) and energy (Fig. 9)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from convexrough.arrays import Array
from convexrough.paper.states import AMPLITUDES, PaperStates
from convexrough.plots.cycle import ring_colour
from convexrough.plots.measure import Scale
from convexrough.plots.notebook import Figure
from convexrough.plots.style import (
    DASHED,
    DOTTED,
    DOUBLE,
    ROUGH,
    SMOOTH,
    TICK,
    UNSURE,
    label,
    title,
)

#: Amplitude Q / (f P) at which, by the paper, the curves of its Fig. 9 cross.
READ_CROSSING = 0.37


def forces_figure(found: PaperStates, scale: Scale) -> Figure:
    """The figure of force and displacement of the first asperity of each ring, for Q = 0 to f P."""
    figure = Figure(figsize=(DOUBLE, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2, gridspec_kw={"wspace": 0.06})
    firsts = {name: int(ring[0]) for name, ring in found.named.items()}
    path, share = found.path, found.fractions
    force = 100.0 * path.asperity_forces / found.limit
    moved = scale.displacement.of(path.asperity_displacements)
    own = moved - scale.displacement.of(path.slips)
    for order, i in enumerate(firsts.values()):
        start = min(found.onsets[i], 1.0)
        look: dict[str, Any] = {"color": ring_colour(order, len(firsts)), "lw": 1.2}
        slid = np.searchsorted(share, start)
        left.plot(share, force[:, i], **look)
        right.plot(share, moved[:, i], **look)
        right.plot(share[slid:], own[slid:, i], **(look | {"lw": 0.9, "ls": DOTTED}))
        for axes, values in ((left, force), (right, moved)):
            axes.plot(start, values[slid, i], "o", ms=4, mec=SMOOTH, mew=0.4, mfc=look["color"],
                      clip_on=False, zorder=3, label="_onset")  # fmt: skip
    for axes, values in ((left, force), (right, moved)):
        axes.set(xlim=(0.0, 1.0))
        axes.set_ylim(0.0, 1.04 * float(values.max()))
        _letters(axes, list(firsts), values[-1, list(firsts.values())])
    label(left, "$Q\\,/\\,(fP)$", "$Q_i\\,/\\,(fP)$  [%]")
    title(left, "asperity of each ring; dot: slides from here")
    label(right, "$Q\\,/\\,(fP)$", scale.displacement.short("(X_i + s_i)"))
    title(right, "with gross slip; dotted: without")
    figure.supxlabel(scale.footnote(), fontsize=TICK)
    return figure


def _letters(axes: Axes, names: list[str], heights: Array) -> None:
    """Write the name of each curve right of its end, without overlaps."""
    low, high = axes.get_ylim()
    apart = 0.055 * (high - low)
    order = np.argsort(heights)
    placed = heights[order].astype(float)
    for _ in range(100):
        close = np.maximum(apart - np.diff(placed), 0.0)
        if not (close > 1e-9 * apart).any():
            break
        placed[:-1] -= close / 2
        placed[1:] += close / 2
    for k, y in zip(order, placed, strict=True):
        where: dict[str, Any] = {"textcoords": "offset points", "xytext": (6, 0)}
        axes.annotate(
            names[k], (1.0, y), fontsize=TICK, va="center", annotation_clip=False, **where
        )


def loss_figure(found: PaperStates, scale: Scale) -> Figure:
    """The figure of energy per cycle against amplitude, rough and smooth, with a zoom."""
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    whole, zoom = figure.subplots(1, 2, gridspec_kw={"wspace": 0.06})
    energy = scale.energy(max(each.loss for each in found.cycles))
    rough = np.array([energy.of(each.loss) for each in found.cycles])
    smooth = energy.of(scale.work) * np.array([each.smooth_normalised for each in found.cycles])
    for axes in (whole, zoom):
        axes.plot(AMPLITUDES, rough, lw=1.3, color=ROUGH, label="asperities")
        axes.plot(AMPLITUDES, smooth, ls=DASHED, lw=1.1, color=SMOOTH, label=scale.name)
    crossing = cross(AMPLITUDES, rough, smooth)
    middle = READ_CROSSING if crossing is None else crossing
    window = np.clip(middle, 0.07, 0.93) + np.array([-0.07, 0.07])
    inside = (window[0] <= AMPLITUDES) & (window[1] >= AMPLITUDES)
    energies = np.concatenate((rough[inside], smooth[inside]))
    margin = 0.04 * float(np.ptp(energies))
    low, high = float(energies.min()) - margin, float(energies.max()) + margin
    whole.set(xlim=(0.0, 1.0), ylim=(0.0, 1.04 * float(max(rough.max(), smooth.max()))))
    zoom.set(xlim=tuple(window), ylim=(low, high))
    box = Rectangle((window[0], low), np.ptp(window), high - low, fill=False, ec=SMOOTH, lw=0.8)
    whole.add_patch(box)
    whole.annotate("zoom", (float(window[1]), high), xytext=(-2, 3), textcoords="offset points",
                   ha="right", va="bottom", fontsize=TICK)  # fmt: skip
    if crossing is not None:
        _mark_crossing(zoom, crossing, float(np.interp(crossing, AMPLITUDES, smooth)))
    label(whole, "amplitude of $Q\\,/\\,(fP)$", energy.label("W"))
    label(zoom, "amplitude of $Q\\,/\\,(fP)$", energy.short("W"))
    whole.legend(loc="upper left", fontsize=TICK, frameon=False)
    title(whole, "energy lost per cycle")
    title(zoom, "zoom")
    return figure


def cross(amplitude: Array, rough: Array, smooth: Array) -> float | None:
    """The first amplitude at which the two plotted curves cross; None if they do not."""
    ratio = rough[1:] / smooth[1:] - 1.0
    (before,) = np.nonzero(ratio[:-1] * ratio[1:] < 0)
    if len(before) == 0:
        return None
    i = before[0]
    part = ratio[i] / (ratio[i] - ratio[i + 1])
    return float(amplitude[i + 1] + part * (amplitude[i + 2] - amplitude[i + 1]))


def _mark_crossing(axes: Axes, crossing: float, height: float) -> None:
    axes.axvline(READ_CROSSING, ls=DOTTED, lw=1.0, color=SMOOTH, label="_read")
    axes.plot(crossing, height, "o", ms=5, mfc="white", mec=UNSURE, mew=1.3, label="_crossing")
    axes.annotate(f"curves cross at {crossing:.3f}", (crossing, height), xytext=(10, -14),
                  textcoords="offset points", fontsize=TICK, color=UNSURE)  # fmt: skip
    said = f"read off the paper's\ngraph: about {READ_CROSSING:g}"
    axes.annotate(said, (READ_CROSSING, axes.get_ylim()[0]), xytext=(4, 4), fontsize=TICK,
                  textcoords="offset points", va="bottom")  # fmt: skip
