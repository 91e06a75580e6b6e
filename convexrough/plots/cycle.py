"""Steady cycles and histories: hysteresis loops, and the energy they cost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure as MatplotlibFigure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

from convexrough.arrays import Array
from convexrough.friction.cycle import Cycle, Loop
from convexrough.friction.cycle import loops as steady_loops
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import (
    DASHED,
    DOUBLE,
    FAINT,
    ROUGH,
    SMOOTH,
    TICK,
    Scale,
    ShearScale,
    label,
    no_contact_figure,
    round_ticks,
    say_nothing,
)
from convexrough.scene.rings import one_of_each_ring
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import SmoothSphere

MOST_LOOPS, MOST_ASPERITIES = 4, 6
POINTS = 400  # of a loop
#: Styles of the chosen asperities, outwards: told apart by more than the colour.
DASHES: list[Any] = ["-", (0, (5, 1.5)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (7, 2, 2, 2)), "-"]


def cycle_figures(
    cycles: Sequence[Cycle],
    *,
    loops: Sequence[Loop] | None = None,
    asperities: Sequence[int] | None = None,
    length_unit: str = "",
    force_unit: str = "",
) -> Figures:
    """The figures of steady cycles of one contact.

    loops      : of each cycle, where they are known; else they are computed
    asperities : whose loops to show; default: one at each distance from the axis, at most 6

    "hysteresis" : the loops of the cycles, with the smooth sphere's; of more than 4 cycles, those
        of about the whole, 3/4, 1/2 and 1/4 of the widest range. And of chosen asperities in the
        cycle of the widest range
    "loss" : where there are cycles of several ranges, energy against amplitude
    """
    if not cycles:
        return Figures()
    contact = cycles[0].contact
    several = len(np.unique([each.maximum - each.minimum for each in cycles])) > 1
    if not contact.loads.any():
        labels = ("$X$", "$Q$"), ("$X_i$ + slip", "$Q_i$")
        figures = Figures({"hysteresis": no_contact_figure(*labels)})
        if several:
            figures["loss"] = no_contact_figure(("amplitude of $Q$", "$W$"))
        return figures
    lengths = Scale.of(contact, length_unit, force_unit)
    scale = ShearScale.of(contact, length_unit, force_unit)
    by_range = sorted(range(len(cycles)), key=lambda i: cycles[i].force_amplitude)
    distances = np.hypot(*contact.scene.contact_points.T)
    if asperities is None:
        known = np.arange(len(distances)) if loops is None else loops[0].asperities
        asperities = one_of_each_ring(distances[known], contact.loads[known], MOST_ASPERITIES)
        asperities = known[asperities].tolist()
    names = [f"{r:.2f}" for r in distances[list(asperities)] / lengths.length]
    shown = _spread([cycles[i].force_amplitude for i in by_range])
    some = [cycles[by_range[i]] for i in shown]
    theirs = None if loops is None else [loops[by_range[i]] for i in shown]
    meaning = lengths.short("r")
    figure = loops_figure(some, asperities, names, meaning, scale, theirs, len(cycles))
    figures = Figures({"hysteresis": figure})
    if several:
        figures["loss"] = _loss_figure([cycles[i] for i in by_range], scale)
    return figures


def _spread(amplitudes: Sequence[float]) -> list[int]:
    """All of few loops; of many those nearest to 1/4, 1/2, 3/4 and all of the widest.

    amplitudes : in rising order
    """
    if len(amplitudes) <= MOST_LOOPS:
        return list(range(len(amplitudes)))
    parts = amplitudes[-1] * np.arange(1, MOST_LOOPS + 1) / MOST_LOOPS
    away = np.abs(np.array(amplitudes)[:, None] - parts)
    return sorted(set(np.argmin(away, axis=0).tolist()))


def loops_figure(
    cycles: Sequence[Cycle],
    asperities: Sequence[int],
    names: Sequence[str],
    meaning: str,
    scale: ShearScale,
    loops: Sequence[Loop] | None = None,
    count: int = 0,
) -> Figure:
    """Loops of the contact, the same sheared upright, and of single asperities in the last cycle.

    names, meaning : entries and title of the legend of the asperities
    loops : of the cycles, with those of the asperities;  count : of cycles from which these are
    """
    loops = steady_loops(cycles, POINTS, None, asperities) if loops is None else loops
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    whole, upright, single = figure.subplots(1, 3, width_ratios=[1, 1, 1.1])
    for cycle, loop in zip(cycles, loops, strict=True):
        forces = _around(cycle, POINTS)
        rough = loop.displacements / scale.displacement
        up, smooth_up = loop.forces / scale.force, forces / scale.force
        for axes, elastic in ((whole, 0.0), (upright, 2.0 / 3.0)):
            look: dict[str, Any] = {"color": ROUGH, "lw": 1.2, "label": "asperities"}
            axes.plot(rough - elastic * up, up, **look)
            if scale.sphere is not None:
                smooth = smooth_loop(scale.sphere, forces) / scale.displacement
                look = {"color": SMOOTH, "lw": 1.0, "ls": DASHED}
                look["label"] = scale.name
                axes.plot(smooth - elastic * smooth_up, smooth_up, **look)
        _name(upright, rough[0] - 2.0 / 3.0 * up[0], up[0], _range(cycle, scale))
    label(whole, "$X\\,/\\,X_0$", "$Q\\,/\\,(fP)$")
    label(upright, r"$X\,/\,X_0 - \frac{2}{3}\,Q\,/\,(fP)$", "")
    upright.sharey(whole)
    upright.tick_params(labelleft=False)
    which = f": {len(cycles)} of {count} cycles" if count > len(cycles) else ""
    whole.set_title(f"whole contact{which}", fontsize=TICK, loc="left")
    upright.set_xlim(right=upright.get_xlim()[1] + 0.22 * np.ptp(upright.get_xlim()))
    upright.set_title("less the smooth elastic part", fontsize=TICK, loc="left")
    _draw_asperity_loops(single, loops[-1], asperities, names, cycles[-1], scale)
    title = f"asperities, $Q/(fP)$ = {_range(cycles[-1], scale)}"
    single.set_title(title, fontsize=TICK, loc="left")
    single.legend(
        title=meaning,
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        fontsize=TICK,
        title_fontsize=TICK,
        frameon=False,
        handlelength=2.4,
        handletextpad=0.5,
        borderpad=0.2,
    )
    for axes in (whole, upright, single):
        axes.xaxis.set_major_locator(round_ticks(5))
    _legend(figure, whole)
    figure.supxlabel(f"{scale.footnote()},   $s_i$: gross slip", fontsize=TICK)
    return figure


def _name(axes: Axes, x: float, y: float, text: str) -> None:
    """The range of a loop, to the right of its upper end."""
    axes.annotate(
        text,
        (x, y),
        xytext=(4, 2),
        textcoords="offset points",
        fontsize=7,
        ha="left",
        va="center",
        path_effects=[withStroke(linewidth=2.0, foreground="white")],
    )


def _around(cycle: Cycle, points: int) -> Array:
    """Forces from the maximum to the minimum and back [force], close together at the ends."""
    middle, half = (cycle.maximum + cycle.minimum) / 2, cycle.force_amplitude
    down = middle + half * np.cos(np.linspace(0.0, np.pi, points // 2 + 1))
    down = np.clip(down, cycle.minimum, cycle.maximum)
    return np.append(down, down[-2::-1])


def smooth_loop(sphere: SmoothSphere, forces: Array) -> Array:
    """X [length] of the smooth sphere at the forces of a steady loop, from a maximum and back.

    From a turning point Q1, X = X1 + 2 X((Q - Q1) / 2) with X(Q) that of first loading; first
    loading goes to the larger of the two forces.
    """
    turn = int(np.argmin(forces))
    maximum, minimum = forces[0], forces[turn]
    first = maximum if abs(maximum) >= abs(minimum) else minimum
    start = sphere.displacement(first) + 2.0 * sphere.displacement((maximum - first) / 2.0)
    there = start + 2.0 * sphere.displacement((forces[: turn + 1] - maximum) / 2.0)
    back = there[-1] + 2.0 * sphere.displacement((forces[turn + 1 :] - minimum) / 2.0)
    return np.append(there, back)


def _draw_asperity_loops(
    axes: Axes,
    loop: Loop,
    asperities: Sequence[int],
    names: Sequence[str],
    cycle: Cycle,
    scale: ShearScale,
) -> None:
    """Q_i / (f P_i) against (X_i + slip_i) / X0: an asperity that slides runs along +-1."""
    limits = scale.force * cycle.contact.loads / cycle.contact.load
    kept = loop.asperities.tolist()
    for order, (i, name) in enumerate(zip(asperities, names, strict=True)):
        at = kept.index(i)
        axes.plot(
            loop.asperity_displacements[:, at] / scale.displacement,
            loop.asperity_forces[:, at] / limits[i],
            lw=1.1,
            ls=DASHES[order % len(DASHES)],
            color=ring_colour(order, len(asperities)),
            label=name,
        )
    label(axes, "$(X_i + s_i)\\,/\\,X_0$", "$Q_i\\,/\\,(fP_i)$")
    for limit in (-1.0, 1.0):
        axes.axhline(limit, lw=0.5, color=FAINT, zorder=0.5)


def ring_colour(order: int, count: int) -> Any:
    """From dark at the axis to lighter outwards."""
    return matplotlib.colormaps["viridis"](0.82 * order / max(1, count - 1))


def _legend(figure: MatplotlibFigure, axes: Axes) -> None:
    """Above all panels, the lines of one, each name once."""
    figure.legend(
        handles=list({line.get_label(): line for line in reversed(axes.lines)}.values())[::-1],
        loc="outside upper left",
        ncols=2,
        fontsize=TICK,
        frameon=False,
        borderpad=0.2,
    )


def _range(cycle: Cycle, scale: ShearScale) -> str:
    """The range of a cycle, in fractions of f P."""
    high, low = cycle.maximum / scale.force, cycle.minimum / scale.force
    if high == -low:
        return f"±{high:.4g}"
    return f"{low:.4g} to {high:.4g}".replace("-", "\u2212")


def _loss_figure(cycles: Sequence[Cycle], scale: ShearScale) -> Figure:
    """Energy against amplitude; `cycles` by amplitude."""
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    loss, ratio = figure.subplots(1, 2, gridspec_kw={"wspace": 0.06})
    some = [each for each in cycles if each.maximum > each.minimum]
    amplitude = np.array([each.force_amplitude for each in some]) / scale.force
    rough = np.array([each.loss for each in some]) / scale.energy
    smooth = np.array([each.smooth_normalised for each in some])
    marks: dict[str, Any] = {
        "color": ROUGH,
        "lw": 1.2,
        "ms": 4 if len(some) < 30 else 2.5,
        "mew": 0,
        "clip_on": False,
    }
    marks |= {"marker": "o", "ls": ""} if len(some) < 100 else {"ls": "-"}

    t = np.geomspace(min(0.7 * amplitude[0], 0.3), 1.0, 300)
    if scale.sphere is not None:
        loss.plot(t, mindlin.loss(t), ls=DASHED, lw=1.1, color=SMOOTH, label=scale.name)
    loss.plot(amplitude, rough, label="asperities", **marks)
    loss.set(xscale="log", yscale="log", xlim=(t[0], 1.0))
    few_ticks(loss.xaxis)
    few_ticks(loss.yaxis)
    label(loss, f"amplitude of $Q\\,/\\,(fP)$  ({scale.limit()})", scale.energy_label())
    loss.legend(loc="upper left", fontsize=TICK, frameon=False)
    loss.set_title("energy lost per cycle", fontsize=TICK, loc="left")

    if scale.sphere is None:
        say_nothing(ratio, "no smooth reference")
        return figure
    ratio.axhline(1.0, ls=DASHED, lw=1.1, color=SMOOTH)
    ratio.plot(amplitude, rough / smooth, **marks)
    ratio.set(xlim=(0.0, 1.0))
    label(ratio, "amplitude of $Q\\,/\\,(fP)$", "$W\\,/\\,W_\\mathrm{smooth}$")
    ratio.set_title(f"the same, over the {scale.name}'s", fontsize=TICK, loc="left")
    return figure


def few_ticks(axis: Axis) -> None:
    """At most 6 labelled powers of ten, or where there are too few, 2 and 5 times them too."""
    low, high = axis.get_view_interval()
    subs = (1.0, 2.0, 5.0) if high / low < 50 else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=6))
    if len(subs) == 1:
        axis.set_major_formatter(LogFormatterSciNotation())
    else:
        axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())
