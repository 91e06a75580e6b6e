"""The counterparts of Figs. 3 to 9 of the source paper (Dini & Hills 2009)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from convexrough import checks, fields
from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.friction.cycle import cycle
from convexrough.friction.onset import onset_of_sliding
from convexrough.friction.shear import ShearState, shear
from convexrough.paper.curves import forces_figure, loss_figure
from convexrough.paper.example import lettered
from convexrough.plots.cycle import MOST_ASPERITIES, loops_figure
from convexrough.plots.press import pressure_figure
from convexrough.plots.shear import SLIDING, STICK, draw_state, legend_handles
from convexrough.plots.style import (
    COLOURS,
    DASHED,
    DOUBLE,
    ROUGH,
    SMOOTH,
    TICK,
    Scale,
    ShearScale,
    abscissae,
    draw_discs,
    draw_smooth,
    frame_map,
    label,
    legend_above,
    map_edge,
    no_contact_figure,
    quantity,
    towards_rim,
)
from convexrough.scene.rings import evenly_chosen
from convexrough.sphere.smooth import smooth

#: Q / (f P) of the paper's Figs. 4 to 6 and 8.
SHARE = 0.5


def paper_figures(
    contact: Contact, *, length_unit: str = "", force_unit: str = ""
) -> dict[str, Figure]:
    """The figures of the paper's example, or of any contact whose asperities stand in rings.

    "fig3_pressure"   : contact pressure
    "fig4_rings"      : rings of asperities, those that slide at Q / (f P) = 0.5, and the
        force from which each ring slides (the first of its asperities)
    "fig5_traction"   : shear traction at 0.5, overall and on the central asperity
    "fig6_section"    : traction and f * pressure along y = 0, with the smooth sphere's
    "fig7_asperities" : force and displacement of an asperity of each ring from Q = 0 to f P
    "fig8_loops"      : hysteresis loops at 0.5: rough and smooth contact, single asperities
    "fig9_energy"     : energy per cycle against amplitude, rough and smooth, and where they cross

    Rings have letters as in the paper: A is the outermost.
    """
    if not contact.loads.any():
        return _no_contact(contact, length_unit, force_unit)
    scale = Scale.of(contact, length_unit, force_unit)
    friction = ShearScale.of(contact, length_unit, force_unit)
    state = shear(contact, force=SHARE * friction.force)
    onsets = onset_of_sliding(contact) / friction.force
    named = lettered(contact)
    steady = cycle(contact, maximum=SHARE * friction.force)
    some = evenly_chosen(list(named), MOST_ASPERITIES)
    firsts = [int(named[name][0]) for name in some]
    centre = firsts[0]
    return {
        "fig3_pressure": pressure_figure(contact, scale),
        "fig4_rings": _rings_figure(state, named, onsets, scale, friction),
        "fig5_traction": _traction_figure(state, centre, scale, friction),
        "fig6_section": _section_figure(state, scale),
        "fig7_asperities": forces_figure(contact, named, onsets, friction),
        "fig8_loops": loops_figure([steady], firsts, some, "ring", friction),
        "fig9_energy": loss_figure(contact, friction),
    }


def _rings_figure(
    state: ShearState, named: dict[str, Indices], onsets: Array, scale: Scale, friction: ShearScale
) -> Figure:
    contact = state.contact
    figure = Figure(figsize=(DOUBLE, 3.4), layout="constrained")
    chart, bars = figure.subplots(1, 2, width_ratios=[1.0, 0.9], gridspec_kw={"wspace": 0.06})
    draw_state(chart, state, scale)
    frame_map(chart, 1.08 * map_edge(contact, scale))  # room for the letters
    points = contact.scene.contact_points / scale.length
    halo = [withStroke(linewidth=1.5, foreground="white")]
    for name, ring in named.items():
        for i in ring:
            x, y = points[i]
            beside = x + contact.contact_radii[i] / scale.length + 0.015
            chart.text(beside, y, name, va="center", fontsize=7, path_effects=halo, clip_on=True)
    label(chart, scale.length_label("x"), "$y\\,/\\,a_H$")
    slides = ", ".join(name for name, ring in named.items() if _slides(state, ring)) or "none"
    chart.set_title(f"slide at $Q/(fP)$ = {SHARE:g}: {slides}", fontsize=TICK, loc="left")

    rows = np.arange(len(named))
    start = np.array([onsets[ring].min() for ring in named.values()])
    bars.barh(rows, start, height=0.62, color=STICK, ec=SMOOTH, lw=0.4, label="stick in part")
    bars.barh(
        rows, 1.0 - start, left=start, height=0.62, color=SLIDING, ec=SMOOTH, lw=0.4, label="slide"
    )
    bars.axvline(SHARE, ls=DASHED, lw=1.0, color=SMOOTH)
    bars.set_yticks(rows, [f"{name} ({len(ring)})" for name, ring in named.items()])
    bars.set(xlim=(0.0, 1.0), ylim=(len(rows) - 0.4, -0.6))
    bars.tick_params(axis="y", length=0)
    for row, value in zip(rows, start, strict=True):
        bars.text(1.02, row, f"{value:.4f}", fontsize=TICK, va="center")
    label(bars, f"$Q\\,/\\,(fP)$  ({friction.limit()})", "ring (asperities)")
    bars.set_title("light: stick in part; dark: slide", fontsize=TICK, loc="left")
    above: dict[str, Any] = {"textcoords": "offset points", "xycoords": "axes fraction"}
    bars.annotate("from", (1.02, 1.0), xytext=(0, 6), va="baseline", fontsize=TICK, **above)
    figure.legend(
        handles=legend_handles(contact, [state], scale),
        loc="outside upper center",
        ncols=4,
        fontsize=TICK,
        frameon=False,
        handletextpad=0.5,
        columnspacing=1.4,
    )
    return figure


def _slides(state: ShearState, ring: Indices) -> bool:
    return bool((state.status[ring] == "sliding").any())


def _traction_figure(state: ShearState, centre: int, scale: Scale, friction: ShearScale) -> Figure:
    contact = state.contact
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    chart, profile = figure.subplots(1, 2, width_ratios=[1.0, 1.05], gridspec_kw={"wspace": 0.08})
    unit = _traction_unit(state, scale)
    top = _draw_tractions(chart, state, scale, unit)
    draw_smooth(chart, scale)
    frame_map(chart, map_edge(contact, scale))
    chart.set_anchor("E")
    label(chart, scale.length_label("x"), "$y\\,/\\,a_H$")
    chart.set_title(f"$Q/(fP)$ = {SHARE:g}", fontsize=TICK, loc="left")
    bar = figure.colorbar(ScalarMappable(Normalize(0, top), COLOURS), ax=chart, aspect=28, pad=0.02)
    bar.ax.tick_params(labelsize=TICK)
    bar.ax.set_title("$q\\,/\\,(fp_0)$", fontsize=TICK)

    a, c = contact.contact_radii[centre], state.stick_radii[centre]
    middle = contact.scene.contact_points[centre]
    x = np.unique(np.concatenate((a * towards_rim(), c * towards_rim())))
    line = middle + np.column_stack((x, np.zeros_like(x)))
    if c > 0:
        profile.axvspan(-c / a, c / a, fc=STICK, alpha=0.5, lw=0, label="stick disc")
    fp = checks.friction(contact.scene.friction) * fields.pressure(contact, line) / unit
    profile.plot(x / a, fp, ls=DASHED, lw=1.2, color=SMOOTH, label="$fp$")
    profile.plot(x / a, fields.traction(state, line) / unit, lw=1.4, color=ROUGH, label="$q$")
    profile.set(xlim=(-1.08, 1.08), ylim=(0.0, 1.06 * fp.max()))
    across = f"$x\\,/\\,a_i$  ($a_i$ = {quantity(a, scale.length_unit)})"
    profile.set_title("central asperity", fontsize=TICK, loc="left")
    label(profile, across, _traction_label(unit, scale))
    legend_above(profile)
    return figure


def _traction_unit(state: ShearState, scale: Scale) -> float:
    """f p0 [force / length^2]."""
    return checks.friction(state.contact.scene.friction) * scale.pressure


def _traction_label(unit: float, scale: Scale) -> str:
    return f"$q\\,/\\,(fp_0)$  ($fp_0$ = {quantity(unit, scale.pressure_unit)})"


def _draw_tractions(axes: Axes, state: ShearState, scale: Scale, unit: float) -> float:
    """Each traction as a stack of discs, from the rim to the stick disc and on to the centre.

    Radii go by equal steps of the pressure's shape, and of the same shape on the stick disc. The
    result is the largest traction [unit], the top of the colours.
    """
    contact = state.contact
    touching = contact.loads > 0
    centres, a = contact.scene.contact_points[touching], contact.contact_radii[touching]
    c = np.where(state.status[touching] == "sliding", 0.0, state.stick_radii[touching])
    steps = int(np.clip(1000 // len(a), 8, 24))
    s = np.arange(steps)[:, None] / steps
    slip = np.sqrt(1.0 - (c / a) ** 2)  # the shape at the edge of the stick disc
    outer = np.concatenate((a * np.sqrt(1.0 - (slip * s) ** 2), c * np.sqrt(1.0 - s**2)))
    s = s + 0.5 / steps
    mid = np.concatenate((a * np.sqrt(1.0 - (slip * s) ** 2), c * np.sqrt(1.0 - s**2)))
    places = np.stack((centres[:, 0] + mid, np.broadcast_to(centres[:, 1], mid.shape)), axis=2)
    tractions = np.abs(fields.traction(state, places)) / unit
    top = float(tractions.max())
    colours = ScalarMappable(Normalize(0.0, top), COLOURS)
    for k, (radii, shown) in enumerate(zip(outer, tractions, strict=True)):
        word = "contact discs" if k == 0 else "_inner discs"
        some = radii > 0
        look = {"facecolors": colours.to_rgba(shown[some]), "linewidths": 0}
        draw_discs(axes, centres[some] / scale.length, radii[some] / scale.length, word, **look)
    return top


def _section_figure(state: ShearState, scale: Scale) -> Figure:
    """f p and q along y = 0, of the asperities and of the smooth sphere."""
    contact, sphere = state.contact, smooth(state.contact.scene, load=state.contact.load)
    figure = Figure(figsize=(DOUBLE, 2.9), layout="constrained")
    axes = figure.subplots()
    unit = _traction_unit(state, scale)
    edge = map_edge(contact, scale)
    points = contact.scene.contact_points
    x = np.union1d(
        abscissae(points, contact.contact_radii, edge * scale.length),
        abscissae(points, state.stick_radii, edge * scale.length),
    )
    line = np.column_stack((x, np.zeros_like(x)))
    fp = checks.friction(contact.scene.friction) * fields.pressure(contact, line) / unit
    q = fields.traction(state, line) / unit
    x = x / scale.length
    axes.fill_between(x, fp, fc=(ROUGH, 0.15), ec=ROUGH, lw=0.8, label="asperities: $fp$")
    axes.fill_between(x, q, fc=(ROUGH, 0.65), ec=ROUGH, lw=0.8, label="asperities: $q$")
    s = np.union1d(towards_rim(), towards_rim() * sphere.stick_radius(state.force) / scale.length)
    smooth_q = sphere.traction(np.abs(s) * scale.length, state.force) / unit
    axes.plot(s, np.sqrt(1.0 - s**2), ls=DASHED, lw=1.3, color=SMOOTH, label="smooth sphere: $fp$")
    axes.plot(s, smooth_q, ls=(0, (1, 1)), lw=1.5, color=SMOOTH, label="smooth sphere: $q$")
    axes.set(xlim=(-edge, edge), ylim=(0.0, 1.05 * max(1.0, float(fp.max()))))
    label(axes, scale.length_label("x"), _traction_label(unit, scale))
    axes.set_title(f"$y$ = 0, $Q/(fP)$ = {SHARE:g}", fontsize=TICK, loc="left")
    legend_above(axes, ncols=4)
    return figure


def _no_contact(contact: Contact, length_unit: str, force_unit: str) -> dict[str, Figure]:
    amplitude = "amplitude of $Q$"
    return {
        "fig3_pressure": pressure_figure(contact, Scale.of(contact, length_unit, force_unit)),
        "fig4_rings": no_contact_figure(("$x$", "$y$"), ("$Q$", "ring")),
        "fig5_traction": no_contact_figure(("$x$", "$y$"), ("$x$", "traction")),
        "fig6_section": no_contact_figure(("$x$", "traction")),
        "fig7_asperities": no_contact_figure(("$Q$", "$Q_i$"), ("$Q$", "$X_i$ + slip")),
        "fig8_loops": no_contact_figure(("$X$", "$Q$"), ("$X_i$ + slip", "$Q_i$")),
        "fig9_energy": no_contact_figure((amplitude, "$W$")),
    }
