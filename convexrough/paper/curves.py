"""Curves of the source paper's figures: asperity forces (Fig. 7) and energy (Fig. 9)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.friction.cycle import cycles
from convexrough.friction.path import history
from convexrough.plots.cycle import ring_colour
from convexrough.plots.style import DASHED, DOUBLE, ROUGH, SMOOTH, TICK, UNSURE, ShearScale, label

#: Amplitude Q / (f P) at which the paper reads off its Fig. 9 that the curves cross: "about".
READ_CROSSING = 0.37
AMPLITUDES = 81


def forces_figure(
    contact: Contact, named: dict[str, Indices], onsets: Array, scale: ShearScale
) -> Figure:
    """Force and displacement of the first asperity of each ring, from Q = 0 to f P.

    named : the rings by letter;  onsets : (n,) [f P] where each asperity starts to slide
    """
    figure = Figure(figsize=(DOUBLE, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2, gridspec_kw={"wspace": 0.06})
    firsts = {name: int(ring[0]) for name, ring in named.items()}
    starts = np.minimum(onsets[list(firsts.values())], 1.0)
    even = 1.0 - np.linspace(1.0, 0.0, 61) ** 2  # close together at gross sliding
    share = np.union1d(even, starts)
    past = history(contact, forces=np.minimum(share, 1.0) * scale.force)
    force = 100.0 * past.asperity_forces / scale.force
    moved = past.asperity_displacements / scale.displacement
    own = moved - past.slips / scale.displacement

    for order, (i, start) in enumerate(zip(firsts.values(), starts, strict=True)):
        look: dict[str, Any] = {"color": ring_colour(order, len(firsts)), "lw": 1.2}
        slid = np.searchsorted(share, start)
        left.plot(share, force[:, i], **look)
        right.plot(share, moved[:, i], **look)
        right.plot(share[slid:], own[slid:, i], **(look | {"lw": 0.9, "ls": (0, (1, 1.5))}))
        for axes, values in ((left, force), (right, moved)):
            axes.plot(start, values[slid, i], "o", ms=4, mec=SMOOTH, mew=0.4, mfc=look["color"],
                      clip_on=False, zorder=3, label="_onset")  # fmt: skip
    for axes, values in ((left, force), (right, moved)):
        axes.set(xlim=(0.0, 1.0))
        axes.set_ylim(0.0, 1.04 * float(values.max()))
        _letters(axes, list(firsts), values[-1, list(firsts.values())])
    label(left, f"$Q\\,/\\,(fP)$  ({scale.limit()})", "$Q_i\\,/\\,(fP)$  [%]")
    left.set_title("asperity of each ring; dot: slides from here", fontsize=TICK, loc="left")
    label(right, "$Q\\,/\\,(fP)$", f"$(X_i + s_i)\\,/\\,X_0$  {_of(scale)}")
    right.set_title("with gross slip; dotted: without", fontsize=TICK, loc="left")
    return figure


def _of(scale: ShearScale) -> str:
    """The bracket of a displacement label."""
    return scale.displacement_label().partition("  ")[2]


def _letters(axes: Axes, names: list[str], heights: Array) -> None:
    """The name of each curve right of its end, moved apart where they would collide."""
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


def loss_figure(contact: Contact, scale: ShearScale) -> Figure:
    """Energy per cycle against amplitude, rough and smooth; a zoom on where the curves cross."""
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    whole, zoom = figure.subplots(1, 2, gridspec_kw={"wspace": 0.06})
    even = np.linspace(0.0, 1.0, AMPLITUDES)
    amplitude = np.union1d(even, 1.0 - 0.02 * even[:-1:8] ** 2)  # steep at gross sliding
    steady = cycles(contact, amplitude * scale.force)
    rough = np.array([each.loss_normalised for each in steady])
    smooth = np.array([each.smooth_normalised for each in steady])
    for axes in (whole, zoom):
        axes.plot(amplitude, rough, lw=1.3, color=ROUGH, label="asperities")
        axes.plot(amplitude, smooth, ls=DASHED, lw=1.1, color=SMOOTH, label="smooth sphere")
    crossing = cross(amplitude, rough, smooth)
    middle = READ_CROSSING if crossing is None else crossing
    window = np.clip(middle, 0.07, 0.93) + np.array([-0.07, 0.07])
    inside = (amplitude >= window[0]) & (amplitude <= window[1])
    energies = np.concatenate((rough[inside], smooth[inside]))
    margin = 0.04 * float(np.ptp(energies))
    low, high = float(energies.min()) - margin, float(energies.max()) + margin
    whole.set(xlim=(0.0, 1.0), ylim=(0.0, 1.04 * float(max(rough.max(), smooth.max()))))
    zoom.set(xlim=tuple(window), ylim=(low, high))
    box = Rectangle((window[0], low), np.ptp(window), high - low, fill=False, ec=SMOOTH, lw=0.8)
    whole.add_patch(box)
    whole.annotate(
        "zoom",
        (float(window[1]), high),
        xytext=(-2, 3),
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=TICK,
    )
    if crossing is not None:
        _mark_crossing(zoom, crossing, float(np.interp(crossing, amplitude, smooth)))
    label(whole, f"amplitude of $Q\\,/\\,(fP)$  ({scale.limit()})", scale.energy_label())
    label(zoom, "amplitude of $Q\\,/\\,(fP)$", "$W\\,/\\,W_0$")
    whole.legend(loc="upper left", fontsize=TICK, frameon=False)
    whole.set_title("energy lost per cycle", fontsize=TICK, loc="left")
    zoom.set_title("zoom", fontsize=TICK, loc="left")
    return figure


def cross(amplitude: Array, rough: Array, smooth: Array) -> float | None:
    """Where the two curves drawn first change places, by their ratio; None where they do not."""
    ratio = rough[1:] / smooth[1:] - 1.0
    (before,) = np.nonzero(ratio[:-1] * ratio[1:] < 0)
    if len(before) == 0:
        return None
    i = before[0]
    part = ratio[i] / (ratio[i] - ratio[i + 1])
    return float(amplitude[i + 1] + part * (amplitude[i + 2] - amplitude[i + 1]))


def _mark_crossing(axes: Axes, crossing: float, height: float) -> None:
    axes.axvline(READ_CROSSING, ls=(0, (1, 1.5)), lw=1.0, color=SMOOTH, label="_read")
    axes.plot(crossing, height, "o", ms=5, mfc="white", mec=UNSURE, mew=1.3, label="_crossing")
    axes.annotate(
        f"curves cross at {crossing:.3f}",
        (crossing, height),
        xytext=(10, -14),
        textcoords="offset points",
        fontsize=TICK,
        color=UNSURE,
    )
    axes.annotate(
        f"read off the paper's\ngraph: about {READ_CROSSING:g}",
        (READ_CROSSING, axes.get_ylim()[0]),
        xytext=(4, 4),
        textcoords="offset points",
        fontsize=TICK,
        va="bottom",
    )
