"""Figures of steady cycles: hysteresis loops and energy losses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from convexrough.arrays import Array
from convexrough.friction.cycle import Cycle, Loop
from convexrough.friction.cycle import loops as steady_loops
from convexrough.plots import style
from convexrough.plots.load_plane import draw_closed
from convexrough.plots.measure import Scale
from convexrough.plots.notebook import Figure, Figures, panels
from convexrough.plots.style import DASHED, DOUBLE, FAINT, ROUGH, SMOOTH, TICK
from convexrough.scene.rings import one_of_each_ring
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import SmoothSphere

MOST_LOOPS, MOST_ASPERITIES = 4, 6
POINTS = 400  # number of points of a loop
#: Line styles of the chosen asperities, from the centre outwards; distinct without colours, too.
DASHES: list[Any] = ["-", (0, (5, 1.5)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (7, 2, 2, 2)), "-"]


def cycle_figures(
    cycles: Sequence[Cycle],
    *,
    loops: Sequence[Loop] | None = None,
    asperities: Sequence[int] | None = None,
) -> Figures:
    """The figures of steady cycles of one contact.

    loops      : the loop of each cycle; None to compute them
    asperities : indices of asperities whose loops are drawn; default: one at each distance from the
        centre, at most 6

    "hysteresis" : loops of the cycles and of the smooth sphere. If there are more than 4 cycles,
        only those whose ranges are nearest to 1, 3/4, 1/2 and 1/4 of the widest are drawn. Also
        loops of the asperities in the cycle of the widest range
    "loss" : energy against amplitude, for cycles of several ranges

    >>> forces = 0.5 * contact.load * np.array([0.1, 0.3, 0.5])
    >>> print(*cr.plots.cycle_figures(cr.cycles(contact, forces)))
    hysteresis loss
    """
    if not cycles:
        return Figures()
    contact = cycles[0].contact
    several = len(np.unique([each.maximum - each.minimum for each in cycles])) > 1
    if not contact.loads.any():
        return style.no_contact("hysteresis", *(["loss"] if several else []))
    scale = Scale(contact)
    by_range = sorted(range(len(cycles)), key=lambda i: cycles[i].force_amplitude)
    cycles = [cycles[i] for i in by_range]
    loops = None if loops is None else [loops[i] for i in by_range]
    r = np.hypot(*(contact.scene.contact_points - scale.centre).T)
    known = np.arange(len(r)) if loops is None else loops[0].asperities
    rings = one_of_each_ring(r[known], contact.loads[known], MOST_ASPERITIES)
    chosen = known[rings].tolist() if asperities is None else list(asperities)
    names = [f"{scale.length.of(each):.3g}" for each in r[chosen]]
    shown = _spread([each.force_amplitude for each in cycles])
    some, theirs = [cycles[i] for i in shown], loops and [loops[i] for i in shown]
    meaning = scale.length.short("r")
    figure = loops_figure(some, chosen, names, meaning, scale, theirs, len(cycles))
    figures = Figures({"hysteresis": figure})
    if several:
        figures["loss"] = _loss_figure(cycles, scale)
    return figures


def _spread(amplitudes: Sequence[float]) -> list[int]:
    """Indices of the loops to draw: all, or those nearest to 1/4, 1/2, 3/4, 1 of the largest."""
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
    scale: Scale,
    loops: Sequence[Loop] | None = None,
    count: int = 0,
) -> Figure:
    """The figure of loops: the contact, the same less its elastic part, and single asperities.

    names, meaning : entries and title of the legend for the asperities
    loops : loops of the cycles, with those of the asperities;  count : number of all cycles; only
        `cycles` are drawn
    """
    loops = steady_loops(cycles, POINTS, asperities) if loops is None else loops
    figure, (whole, upright, single) = panels(DOUBLE, 3.0, 1, 3, width_ratios=[1, 1, 1.1])
    x, q = scale.displacement, scale.force
    for cycle, loop in zip(cycles, loops, strict=True):
        for axes, slope in ((whole, 0.0), (upright, 2.0 / 3.0 * scale.travel / scale.limit)):
            draw_loop(axes, scale, loop, slope)
        end = loop.displacements[0] - slope * loop.forces[0]
        upright.annotate(_range(cycle, scale), (x.of(end), q.of(loop.forces[0])), xytext=(4, 2),
                         textcoords="offset points", fontsize=7, va="center",
                         path_effects=[withStroke(linewidth=2.0, foreground="white")])  # fmt: skip
    style.label(whole, x.short("X"), q.short("Q"))
    style.label(upright, x.short("X - Q/k") if x.said and not x.symbol
          else f"$X\\,/\\,{x.symbol} - \\frac{{2}}{{3}}\\,Q\\,/\\,(fP)$", "")  # fmt: skip
    upright.sharey(whole)
    upright.tick_params(labelleft=False)
    upright.set_xlim(right=upright.get_xlim()[1] + 0.22 * np.ptp(upright.get_xlim()))
    which = f": {len(cycles)} of {count}" if count > len(cycles) else ""
    style.title(whole, f"whole contact{which}")
    style.title(upright, "less its elastic part")
    _draw_asperity_loops(single, loops[-1], asperities, names, cycles[-1], scale)
    style.title(single, f"asperities, $Q/(fP)$ = {_range(cycles[-1], scale)}")
    single.legend(title=meaning, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=TICK,
                  title_fontsize=TICK, frameon=False, handlelength=2.4, handletextpad=0.5,
                  borderpad=0.2)  # fmt: skip
    for axes in (whole, upright, single):
        axes.xaxis.set_major_locator(style.round_ticks(4))
    handles = {line.get_label(): line for line in reversed(whole.lines)}
    style.legend_outside(figure, list(handles.values())[::-1], "upper left", 2)
    elastic = ",   $k = 3fP/(2X_0)$" if x.said and not x.symbol else ""
    figure.supxlabel(f"{scale.footnote()},   $s_i$: gross slip{elastic}", fontsize=TICK)
    return figure


def draw_cycle(axes: Axes, cycle: Cycle) -> None:
    """Draw the loop of a cycle or, if the normal load varies, its path in the plane of loads."""
    if np.ptp(cycle.loads) > 0:
        return draw_closed(axes, cycle)
    scale = Scale(cycle.contact)
    draw_loop(axes, scale, cycle.loop(asperities=[]))
    style.legend_inside(axes)
    return style.label(axes, scale.displacement.label("X"), scale.force.label("Q"))


def draw_loop(axes: Axes, scale: Scale, loop: Loop, slope: float = 0.0) -> None:
    """Draw Q against X - slope * Q, for the rough contact and, if there is one, the smooth one."""
    Q = loop.forces
    rough = scale.displacement.of(loop.displacements - slope * Q)
    axes.plot(rough, scale.force.of(Q), color=ROUGH, lw=1.2, label="asperities")
    if scale.sphere is not None:
        smooth = scale.displacement.of(smooth_loop(scale.sphere, Q) - slope * Q)
        axes.plot(smooth, scale.force.of(Q), color=SMOOTH, lw=1.0, ls=DASHED, label=scale.name)


def smooth_loop(sphere: SmoothSphere, forces: Array) -> Array:
    """[length] displacements X of the smooth sphere at the forces of a steady loop.

    After a turning point (Q1, X1), X = X1 + 2 X0((Q - Q1) / 2), where X0(Q) is the displacement
    after loading from rest to Q. The loading from rest goes to the turning point with the larger
    |Q|.
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
    scale: Scale,
) -> None:
    """Draw Q_i / (f P_i) against X_i + slip_i; the ordinate is 1 or -1 while an asperity slides."""
    limits = scale.limit * cycle.contact.loads / cycle.contact.load
    kept = loop.asperities.tolist()
    for order, (i, name) in enumerate(zip(asperities, names, strict=True)):
        at = kept.index(i)
        moved = scale.displacement.of(loop.asperity_displacements[:, at])
        axes.plot(moved, loop.asperity_forces[:, at] / limits[i], lw=1.1, label=name,
                  ls=DASHES[order % len(DASHES)],
                  color=ring_colour(order, len(asperities)))  # fmt: skip
    style.label(axes, scale.displacement.short("(X_i + s_i)"), "$Q_i\\,/\\,(fP_i)$")
    for limit in (-1.0, 1.0):
        axes.axhline(limit, lw=0.5, color=FAINT, zorder=0.5)


def ring_colour(order: int, count: int) -> Any:
    """The colour of ring `order` of `count` rings of asperities; outer rings are lighter."""
    return matplotlib.colormaps["viridis"](0.82 * order / max(1, count - 1))


def _range(cycle: Cycle, scale: Scale) -> str:
    high, low = cycle.maximum / scale.limit, cycle.minimum / scale.limit
    if high == -low:
        return f"±{high:.4g}"
    return f"{low:.4g} to {high:.4g}".replace("-", "\u2212")


def _loss_figure(cycles: Sequence[Cycle], scale: Scale) -> Figure:
    """The figure of energy against amplitude; `cycles` are in order of amplitude."""
    figure, (loss, ratio) = panels(DOUBLE, 3.0, 1, 2, gridspec_kw={"wspace": 0.06})
    some = [each for each in cycles if each.maximum > each.minimum]
    amplitude = np.array([each.force_amplitude for each in some])
    rough = np.array([each.loss for each in some])
    marks: dict[str, Any] = {"color": ROUGH, "lw": 1.2, "ms": 4 if len(some) < 30 else 2.5}
    marks |= {"marker": "o", "ls": ""} if len(some) < 100 else {"ls": "-"}
    marks |= {"mew": 0, "clip_on": False}
    q, w = scale.force, scale.energy(float(rough.max()))
    t = np.geomspace(min(0.7 * amplitude[0] / scale.limit, 0.3), 1.0, 300)
    if scale.sphere is not None:
        whole = w.of(scale.work) * mindlin.loss(t)
        loss.plot(q.of(scale.limit) * t, whole, ls=DASHED, lw=1.1, color=SMOOTH, label=scale.name)
    loss.plot(q.of(amplitude), w.of(rough), label="asperities", **marks)
    ends = q.of(scale.limit)
    loss.set(xscale="log", yscale="log", xlim=(ends * t[0], ends))
    style.few_ticks(loss.xaxis)
    style.few_ticks(loss.yaxis)
    style.label(loss, "amplitude of " + q.label("Q"), w.label("W"))
    style.legend_inside(loss)
    style.title(loss, "energy lost per cycle")
    if scale.sphere is None:
        style.say_nothing(ratio, "no smooth reference")
        return figure
    ratio.axhline(1.0, ls=DASHED, lw=1.1, color=SMOOTH)
    smooth = np.array([each.smooth_normalised for each in some]) * scale.work
    ratio.plot(q.of(amplitude), rough / smooth, **marks)
    ratio.set(xlim=(0.0, ends))
    style.label(ratio, "amplitude of " + q.short("Q"), "$W\\,/\\,W_\\mathrm{smooth}$")
    style.title(ratio, f"loss / loss of the {scale.name}")
    return figure
