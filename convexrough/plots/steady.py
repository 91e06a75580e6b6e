"""Figures of closed paths, in the plane of the loads P and T = Q / f, and of losses by phase.

Q is the shear force and f the coefficient of friction.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.cycle import Cycle
from convexrough.friction.phases import PhaseLosses
from convexrough.plots import style
from convexrough.plots.asperity_map import draw_statuses, status_handles
from convexrough.plots.notebook import Figure, Figures, panels
from convexrough.plots.style import DASHED, DOUBLE, FAINT, PATTERNS, ROUGH, TICK, UNSURE, Scale, ink

#: Losses are drawn for at most this many factors (sizes of elliptic paths), the largest ones.
MOST_FACTORS = 5


def steady_figures(found: Cycle) -> Figures:
    """The figure of a closed path.

    "steady" : the path in the load plane, and two lines through the point (L*, T*); below the load
        L* the memory curve never changes. Also the status of each asperity in every later cycle

    >>> P = contact.load
    >>> found = cr.steady(scene, loads=[0.9 * P, 0.5 * P], forces=[0.2 * P, -0.2 * P])
    >>> print(*cr.plots.steady_figures(found))
    steady
    """
    checks.instance("found", found, Cycle)
    figure, (plane, chart) = panels(DOUBLE, 3.5, 1, 2)
    draw_closed(plane, found)
    length, radii = Scale(found.contact).length, found.contact.contact_radii
    draw_statuses(chart, found.scene.contact_points, length, found.status, radii)
    name_statuses(figure, found.status)
    said = "the loss does not settle"
    if not np.isnan(found.loss):
        said = f"a steady cycle loses {style.quantity(found.loss, found.scene.units.name('work'))}"
    style.title(chart, said)
    return Figures({"steady": figure})


def phase_figures(found: PhaseLosses) -> Figures:
    """The figure of losses at several phases and sizes.

    "phase_losses" : loss per cycle against the phase for each size, and for the smooth sphere

    >>> P = contact.load
    >>> found = cr.phase_losses(scene, load=P, load_amplitude=0.2 * P, force_amplitude=0.1 * P,
    ...                         phases=[0.0, 1.5], chords=6)
    >>> print(*cr.plots.phase_figures(found))
    phase_losses
    """
    checks.instance("found", found, PhaseLosses)
    figure, (axes,) = panels(style.SINGLE, 3.4)
    draw_losses(axes, found)
    return Figures({"phase_losses": figure})


def draw_losses(axes: Axes, found: PhaseLosses) -> None:
    """Draw loss / factor^3 against phase; for small factors the lines coincide."""
    sizes = np.unique(found.factors)[-MOST_FACTORS:]
    cubes = np.abs(found.factors) ** 3
    most = float(np.fmax.reduce(found.losses / cubes, initial=0.0)) or 1.0
    unit = style.measure(most, found.scene.units.name("work"), "W_m")
    for size, shade, pattern in zip(sizes, style.shades_of(len(sizes)), PATTERNS, strict=False):
        those = np.flatnonzero(found.factors == size)
        those = those[np.argsort(found.phases[those])]
        turns = np.degrees(found.phases[those])
        rough, smooth = (unit.of(each / cubes)[those] for each in (found.losses, found.smooth))
        axes.plot(turns, rough, ".", color=shade, lw=1.5, ls=pattern, label=f"{size:g}")
        dot = "." if len(turns) == 1 else ""  # a line of one point is invisible
        axes.plot(turns, smooth, marker=dot, color=ink(), lw=0.7, ls=pattern)
    axes.plot([], [], color=ink(), lw=0.7, label="smooth sphere")
    style.legend(axes, "below", ncols=3, title="factor", title_fontsize=TICK)
    axes.set_ylim(bottom=0.0)
    style.label(axes, "phase [°]  (90: P and Q in phase)", unit.label(r"W\,/\,\mathrm{factor}^3"))


def name_statuses(
    figure: Figure, status: NDArray[np.str_], loc: str = "outside lower center"
) -> None:
    """Add a legend of the statuses that occur."""
    if handles := status_handles(status):
        style.legend(figure, "outside", handles=handles, loc=loc, ncols=len(handles))


def draw_curve(axes: Axes, curve: MemoryCurve) -> None:
    """Draw the vertices and the front of one memory curve."""
    unit = label_plane(axes, float(curve.load))
    axes.plot(*vertices(curve, unit), "o-", color=ROUGH, lw=1.4, ms=3.5)
    if curve.front is not None:
        front = unit.of(float(curve.front))
        axes.axvline(front, color=UNSURE, lw=0.9, ls=DASHED)
        side, ha = (-1, "right") if curve.front > curve.load / 2 else (1, "left")
        look = {"xycoords": axes.get_xaxis_transform(), "color": UNSURE, "ha": ha}
        style.note(axes, "front", (front, 0.04), (3 * side, 0), **look)


def draw_closed(axes: Axes, found: Cycle) -> None:
    """Draw a closed path in the plane, and the two lines that cross at the point (L*, T*)."""
    f = found.scene.friction or 1.0
    unit = label_plane(axes, float(found.loads.max()), found.scene.units.force)
    P, T = (np.append(each, each[0]) for each in (found.loads, found.forces / f))
    axes.plot(unit.of(P), unit.of(T), color=ROUGH, lw=1.2)
    if not np.isnan(level := found.level):
        height = found.force_level / f
        _draw_cross(axes, unit, P.max(), level, height, color=FAINT, lw=0.9)
        axes.plot([unit.of(level)], [unit.of(height)], "o", ms=5, color=UNSURE)
        style.title(axes, "dot: $(L^*, T^*)$; no change below $L^*$")


def label_plane(axes: Axes, most: float, force_unit: str = "") -> style.Measure:
    """Label both axes and draw |T| = P (gross sliding). Returns the measure of both axes."""
    unit = style.measure(most, force_unit, "P_m")
    _draw_cross(axes, unit, most, color=ink(), lw=0.7)
    style.few_ticks(axes)
    T = "T = Q/f" if unit.said and not unit.symbol else "T"
    style.label(axes, unit.label("P"), unit.short(T))
    return unit


def _draw_cross(
    axes: Axes, unit: style.Measure, most: float, level: float = 0, height: float = 0, **look: Any
) -> None:
    """Draw the lines T = height +- (P - level) from P = level to P = most."""
    for sign in (1.0, -1.0):
        T = np.array([height, height + sign * (most - level)])
        axes.plot(unit.of(np.array([level, most])), unit.of(T), ls=DASHED, **look)


def vertices(curve: MemoryCurve, unit: style.Measure) -> tuple[Array, Array]:
    levels, heights = (np.array(each, dtype=float) for each in (curve.levels, curve.heights))
    return unit.of(levels), unit.of(heights)
