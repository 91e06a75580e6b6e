"""Figures of steady cycles: hysteresis loops, energy losses, and maps of fretting."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from convexrough import checks
from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.friction.cycle import Cycle, Loop
from convexrough.friction.cycle import loops as steady_loops
from convexrough.friction.fretting import Fretting
from convexrough.plots import style
from convexrough.plots.asperity_map import draw_values
from convexrough.plots.notebook import Figure, Figures, no_contact, one_contact, panels
from convexrough.plots.steady import draw_closed
from convexrough.plots.style import DASHED, DOUBLE, FAINT, PATTERNS, ROUGH, TICK, Scale, ink
from convexrough.scene.rings import one_of_each_ring
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import SmoothSphere

MOST_LOOPS, MOST_ASPERITIES = 4, 6
POINTS = 400  # number of points of a loop


def cycle_figures(cycles: Sequence[Cycle], *, loops: Sequence[Loop] | None = None) -> Figures:
    """The figures of steady cycles of one contact.

    loops : the loop of each cycle; None to compute them

    "hysteresis" : loops of the cycles and of the smooth sphere; of more than 4 cycles, of those
        whose ranges are nearest to 1, 3/4, 1/2 and 1/4 of the widest. Also loops, in the cycle of
        the widest range, of one asperity at each of at most 6 distances from the centre
    "loss" : energy against amplitude, for cycles of several ranges

    Raises InputError for cycles of several contacts, or loops that are not those of the cycles.

    >>> forces = 0.5 * contact.load * np.array([0.1, 0.3, 0.5])
    >>> print(*cr.plots.cycle_figures(cr.cycles(contact, forces)))
    hysteresis loss
    """
    checks.sequence("cycles", cycles, "a list of cycles")
    if not (cycles := list(cycles)):
        return Figures()
    contact, ranges = one_contact("cycles", cycles, Cycle), [it.force_amplitude for it in cycles]
    several = len(set(ranges)) > 1
    if not contact.loads.any():
        return no_contact("hysteresis", *(["loss"] if several else []))
    if loops is not None:
        ends, right = [max(it.forces) for it in loops], [it.maximum for it in cycles]
        if len(ends) != len(right) or not np.allclose(ends, right, atol=1e-9 * max(ranges)):
            raise InputError("loops", found="others", expected="the loop of each cycle, in order")
    order = np.argsort(ranges, kind="stable").tolist()
    shown, sizes = order, np.sort(ranges)
    if len(order) > MOST_LOOPS:  # those nearest to 1/4, 1/2, 3/4 and 1 of the widest range
        wanted = sizes[-1] * np.arange(1, MOST_LOOPS + 1) / MOST_LOOPS
        shown = [order[i] for i in np.unique(abs(sizes[:, None] - wanted).argmin(axis=0))]
    scale, some = Scale(contact), [cycles[i] for i in shown]
    r, most = scale.distances, MOST_ASPERITIES
    if loops is None:
        chosen = steady_loops(some, POINTS, one_of_each_ring(r, contact.loads, most))
    else:
        chosen = [loops[i] for i in shown]
    known = chosen[-1].asperities
    rings = known[one_of_each_ring(r[known], contact.loads[known], most)].tolist()
    named = [(f"{scale.length.of(r[i]):.3g}", i) for i in rings]
    meaning = scale.length.short("r")
    figures = Figures(hysteresis=loops_figure(some, chosen, named, meaning, scale, len(cycles)))
    if several:
        figures["loss"] = _loss_figure([cycles[i] for i in order], scale)
    return figures


def loops_figure(
    cycles: Sequence[Cycle],
    loops: Sequence[Loop],
    named: Iterable[tuple[str, int]],
    meaning: str,
    scale: Scale,
    count: int = 1,
) -> Figure:
    """The figure of loops: the contact, the same less a linear part Q / k, and single asperities.

    named, meaning : names of asperities in the legend, with their indices; its title
    count : number of all cycles, of which only `cycles` are drawn
    """
    figure, (whole, upright, single) = panels(DOUBLE, 3.0, 1, 3, width_ratios=[1, 1, 1.1])
    x, q = scale.displacement, scale.force
    slope = 2.0 / 3.0 * scale.travel / scale.limit
    for cycle, loop in zip(cycles, loops, strict=True):
        draw_loop(whole, scale, loop)
        draw_loop(upright, scale, loop, slope)
        place = x.of(loop.displacements[0] - slope * loop.forces[0]), q.of(loop.forces[0])
        look = {"fontsize": 7, "va": "center", "path_effects": style.halo()}
        style.note(upright, _range(cycle, scale), place, (4, 2), **look)
    style.label(whole, x.short("X"), q.short("Q"))
    style.label(upright, x.short("(X - Q/k)"), "")
    upright.sharey(whole)
    upright.tick_params(labelleft=False)
    upright.set_xlim(right=upright.get_xlim()[1] + 0.22 * np.ptp(upright.get_xlim()))
    which = f": {len(cycles)} of {count}" if count > len(cycles) else ""
    style.title(whole, f"whole contact{which}")
    style.title(upright, "less a linear part")
    _draw_asperity_loops(single, loops[-1], list(named), scale)
    style.title(single, f"asperities, $Q/(fP)$ = {_range(cycles[-1], scale)}")
    single.legend(title=meaning, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=TICK,
                  title_fontsize=TICK, frameon=False, handlelength=2.4, handletextpad=0.5,
                  borderpad=0.2)  # fmt: skip
    for axes in (whole, upright, single):
        axes.xaxis.set_major_locator(style.round_ticks(4))
    handles = whole.lines[: 1 + (scale.sphere is not None)]
    style.legend(figure, "outside", handles=handles, loc="outside upper left", ncols=2)
    figure.supxlabel(f"{scale.footnote()},   $s_i$: gross slip,   $k = 3fP/(2X_0)$", fontsize=TICK)
    return figure


def draw_cycle(axes: Axes, cycle: Cycle) -> None:
    """Draw the loop of a cycle or, if the normal load varies, its path in the plane of loads."""
    if np.ptp(cycle.loads) > 0:
        draw_closed(axes, cycle)
    else:
        scale = Scale(cycle.contact)
        draw_loop(axes, scale, cycle.loop(asperities=[]))
        style.legend(axes, "inside")
        style.label(axes, scale.displacement.label("X"), scale.force.label("Q"))


def draw_loop(axes: Axes, scale: Scale, loop: Loop, slope: float = 0.0) -> None:
    """Draw Q against X - slope * Q, for the rough contact and, if there is one, the smooth one."""
    Q = loop.forces
    rough = scale.displacement.of(loop.displacements - slope * Q)
    axes.plot(rough, scale.force.of(Q), color=ROUGH, lw=1.2, label="asperities")
    if scale.sphere is not None:
        smooth = scale.displacement.of(smooth_loop(scale.sphere, Q) - slope * Q)
        axes.plot(smooth, scale.force.of(Q), color=ink(), lw=1.0, ls=DASHED, label=scale.name)


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
    axes: Axes, loop: Loop, named: Sequence[tuple[str, int]], scale: Scale
) -> None:
    """Draw Q_i / (f P_i) against X_i + slip_i; the ordinate is 1 or -1 while an asperity slides."""
    kept = loop.asperities.tolist()
    for order, (name, i) in enumerate(named):
        at, limit = kept.index(i), scale.limit * scale.contact.loads[i] / scale.contact.load
        x = scale.displacement.of(loop.asperity_displacements[:, at])
        look = {"ls": PATTERNS[order % len(PATTERNS)], "color": ring_colour(order, len(named))}
        axes.plot(x, loop.asperity_forces[:, at] / limit, lw=1.1, label=name, **look)
    style.label(axes, scale.displacement.short("(X_i + s_i)"), "$Q_i\\,/\\,(fP_i)$")
    for limit in (-1.0, 1.0):
        axes.axhline(limit, lw=0.5, color=FAINT, zorder=0.5)


def ring_colour(order: int, count: int) -> Any:
    """The colour of ring `order` of `count` rings of asperities; outer rings are lighter."""
    return matplotlib.colormaps["viridis"](0.82 * order / max(1, count - 1))


def _range(cycle: Cycle | Fretting, scale: Scale) -> str:
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
    marks: dict[str, Any] = {"color": ROUGH, "marker": "o", "ls": "", "mew": 0, "clip_on": False}
    marks["ms"] = float(np.clip(20.0 / np.sqrt(len(some)), 1.5, 4.0))
    q, w = scale.force, scale.energy(float(rough.max()))
    ends = q.of(scale.limit)
    t = np.geomspace(min(0.7 * amplitude[0] / scale.limit, 0.3), 1.0, 300)
    if scale.sphere is not None:
        whole = w.of(scale.work) * mindlin.loss(t)
        loss.plot(ends * t, whole, ls=DASHED, lw=1.1, color=ink(), label=scale.name)
    loss.plot(q.of(amplitude), w.of(rough), label="asperities", **marks)
    loss.set(xscale="log", yscale="log", xlim=(ends * t[0], ends))
    style.log_ticks(loss.xaxis)
    style.log_ticks(loss.yaxis)
    style.label(loss, "amplitude of " + q.label("Q"), w.label("W"))
    style.legend(loss, "inside")
    style.title(loss, "energy lost per cycle")
    if scale.sphere is None:
        style.say_nothing(ratio, "no smooth reference")
        return figure
    ratio.axhline(1.0, ls=DASHED, lw=1.1, color=ink())
    smooth = np.array([each.smooth_normalised for each in some]) * scale.work
    ratio.plot(q.of(amplitude), rough / smooth, **marks)
    ratio.set(xlim=(0.0, ends))
    style.label(ratio, "amplitude of " + q.short("Q"), "$W\\,/\\,W_\\mathrm{smooth}$")
    style.title(ratio, f"loss / loss of the {scale.name}")
    return figure


def fretting_figures(worn: Fretting) -> Figures:
    """The figure of fretting in a steady cycle.

    "fretting" : maps of the slip amplitude at the rim of each disc, the energy lost per cycle and,
        at the largest force, the mean and the largest shear traction

    >>> worn = cr.fretting(cr.cycle(contact, maximum=0.25 * contact.load))
    >>> print(*cr.plots.fretting_figures(worn))
    fretting
    """
    checks.instance("worn", worn, Fretting)
    if not worn.contact.loads.any():
        return no_contact("fretting")
    scale = Scale(worn.contact)
    figure, maps = panels(DOUBLE, 6.2, 2, 2, sharex=True, sharey=True)
    pressure, f = scale.units.name("pressure"), scale.limit / worn.contact.load
    most = _largest(worn.largest_tractions) if pressure else f * scale.peak
    traction = style.measure(most, pressure, "(fp_0)" if scale.sphere else "")
    energy = style.measure(_largest(worn.losses), scale.units.name("work"), "W_m")
    draw_slip(maps[0], worn)
    for axes, values, unit, name, symbol in (
        (maps[1], worn.losses, energy, "energy lost per cycle", "W_i"),
        (maps[2], worn.mean_tractions, traction, "mean traction", "\\bar q_i"),
        (maps[3], worn.largest_tractions, traction, "largest traction", "q_i"),
    ):
        draw_values(axes, scale, unit.of(values), unit.short(symbol))
        style.title(axes, name)
    for axes in maps:
        axes.label_outer()
    figure.suptitle(f"cycle of $Q/(fP)$ = {_range(worn, scale)}", fontsize=TICK)
    return Figures({"fretting": figure})


def draw_slip(axes: Axes, worn: Fretting) -> None:
    """Draw the map of slip amplitudes."""
    scale, unit = Scale(worn.contact), worn.contact.scene.units.length
    slip = style.measure(_largest(worn.slip_amplitudes) if unit else scale.travel, unit, "X_0")
    draw_values(axes, scale, slip.of(worn.slip_amplitudes), slip.short("s_i"))
    style.title(axes, "slip amplitude at the rim")


def _largest(values: Array) -> float:
    return float(values.max(initial=0.0, where=np.isfinite(values)))
