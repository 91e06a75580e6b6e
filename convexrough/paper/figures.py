"""Figures like Figs. 3 to 9 of the source paper (Dini and Hills 2009)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.patheffects import withStroke

from convexrough import checks, fields
from convexrough.contact import Contact
from convexrough.friction.shear import ShearState
from convexrough.paper.curves import forces_figure, loss_figure
from convexrough.paper.states import SHARE, PaperStates
from convexrough.plots.asperity_map import SLIDING, STICK, Layer, draw_contact
from convexrough.plots.cycle import MOST_ASPERITIES, loops_figure
from convexrough.plots.measure import Measure, Scale, measure, quantity
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.press import pressure_figure
from convexrough.plots.shear import draw_state, legend_handles
from convexrough.plots.style import (
    COLOURS,
    DASHED,
    DOTTED,
    DOUBLE,
    ROUGH,
    SMOOTH,
    TICK,
    abscissae,
    bar,
    label,
    legend_above,
    legend_outside,
    no_contact,
    title,
    towards_rim,
)
from convexrough.scene.rings import evenly_chosen
from convexrough.sphere.smooth import smooth


def paper_figures(contact: Contact, found: PaperStates | None = None) -> Figures:
    """The figures of the paper's example, or of any contact with asperities in rings.

    "fig3_pressure"   : contact pressure
    "fig4_rings"      : rings of asperities, those that slide at Q / (f P) = 0.5, and the force at
        which the first asperity of each ring starts to slide
    "fig5_traction"   : shear traction at Q / (f P) = 0.5, of all asperities and on the central one
    "fig6_section"    : traction and f * pressure along y = 0, also of the smooth sphere
    "fig7_asperities" : force and displacement of an asperity of each ring from Q = 0 to f P
    "fig8_loops"      : hysteresis loops between -0.5 f P and 0.5 f P: rough and smooth contact,
        single asperities
    "fig9_energy"     : energy per cycle against amplitude, rough and smooth, and their crossing

    Rings have letters as in the paper: A is the outermost.

    found : the states and paths of the figures, if already computed
    """
    if not contact.loads.any():
        return no_contact("fig3_pressure", "fig4_rings", "fig5_traction", "fig6_section",
                          "fig7_asperities", "fig8_loops", "fig9_energy")  # fmt: skip
    scale = Scale(contact)
    found = found or PaperStates.of(contact)
    some = evenly_chosen(list(found.named), MOST_ASPERITIES)
    firsts = [int(found.named[name][0]) for name in some]
    pressure = contact.scene.units.pressure
    f = checks.friction(contact.scene.friction)
    traction = measure(f * scale.peak, pressure, "(fp_0)")
    return Figures(
        fig3_pressure=pressure_figure(scale),
        fig4_rings=_rings_figure(found, scale),
        fig5_traction=_traction_figure(found.half, firsts[0], scale, traction),
        fig6_section=_section_figure(found.half, scale, traction),
        fig7_asperities=forces_figure(found, scale),
        fig8_loops=loops_figure([found.steady], firsts, some, "ring", scale, [found.loop]),
        fig9_energy=loss_figure(found, scale),
    )


def _rings_figure(found: PaperStates, scale: Scale) -> Figure:
    contact, named, onsets = found.contact, found.named, found.onsets
    figure = Figure(figsize=(DOUBLE, 3.4), layout="constrained")
    chart, bars = figure.subplots(1, 2, width_ratios=[1.0, 0.9], gridspec_kw={"wspace": 0.06})
    draw_state(chart, found.half, scale)
    left, right = chart.get_xlim()
    chart.set(xlim=(1.08 * left, 1.08 * right), ylim=(1.08 * left, 1.08 * right))  # for letters
    shifted = contact.scene.contact_points + np.array([0.015 * scale.typical, 0.0])
    halo = [withStroke(linewidth=1.5, foreground="white")]
    for name, ring in named.items():
        for i in ring:
            x, y = scale.length.of(shifted[i] + np.array([contact.contact_radii[i], 0.0]))
            chart.text(x, y, name, va="center", fontsize=7, path_effects=halo, clip_on=True)
    slides = [name for name, ring in named.items() if (found.half.status[ring] == "sliding").any()]
    title(chart, f"slide at $Q/(fP)$ = {SHARE:g}: {', '.join(slides) or 'none'}")

    rows = np.arange(len(named))
    start = np.array([onsets[ring].min() for ring in named.values()])
    look: dict[str, Any] = {"height": 0.62, "ec": SMOOTH, "lw": 0.4}
    bars.barh(rows, start, color=STICK, **look)
    bars.barh(rows, 1.0 - start, left=start, color=SLIDING, **look)
    bars.axvline(SHARE, ls=DASHED, lw=1.0, color=SMOOTH)
    bars.set_yticks(rows, [f"{name} ({len(ring)})" for name, ring in named.items()])
    bars.set(xlim=(0.0, 1.0), ylim=(len(rows) - 0.4, -0.6))
    bars.tick_params(axis="y", length=0)
    for row, value in zip(rows, start, strict=True):
        bars.text(1.02, row, f"{value:.4f}", fontsize=TICK, va="center")
    limit = f"$fP$ = {quantity(scale.limit, scale.units.force)}"
    label(bars, f"$Q\\,/\\,(fP)$  ({limit})", "ring (asperities)")
    title(bars, "light: stick in part; dark: slide")
    bars.annotate("from", (1.02, 1.0), xytext=(0, 6), va="baseline", fontsize=TICK,
                  textcoords="offset points", xycoords="axes fraction")  # fmt: skip
    legend_outside(figure, legend_handles([found.half], scale), "upper center", 4)
    return figure


def _traction_figure(state: ShearState, centre: int, scale: Scale, unit: Measure) -> Figure:
    contact = state.contact
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    chart, profile = figure.subplots(1, 2, width_ratios=[1.0, 1.05], gridspec_kw={"wspace": 0.08})
    _draw_tractions(chart, state, scale, unit)
    chart.set_anchor("E")
    title(chart, f"$Q/(fP)$ = {SHARE:g}")

    a, c = contact.contact_radii[centre], state.stick_radii[centre]
    x = np.unique(np.concatenate((a * towards_rim(), c * towards_rim())))
    line = contact.scene.contact_points[centre] + np.column_stack((x, np.zeros_like(x)))
    if c > 0:
        profile.axvspan(-c / a, c / a, fc=STICK, alpha=0.5, lw=0, label="stick disc")
    fp = unit.of(checks.friction(contact.scene.friction) * fields.pressure(contact, line))
    profile.plot(x / a, fp, ls=DASHED, lw=1.2, color=SMOOTH, label="$fp$")
    profile.plot(x / a, unit.of(fields.traction(state, line)), lw=1.4, color=ROUGH, label="$q$")
    profile.set(xlim=(-1.08, 1.08), ylim=(0.0, 1.06 * fp.max()))
    title(profile, "central asperity")
    across = f"$x\\,/\\,a_i$  ($a_i$ = {quantity(a, scale.units.length)})"
    label(profile, across, unit.label("q"))
    legend_above(profile)
    return figure


def _draw_tractions(axes: Axes, state: ShearState, scale: Scale, unit: Measure) -> None:
    """Draw each traction as a stack of discs, from the rim to the stick disc and to the centre."""
    contact = state.contact
    touching = contact.loads > 0
    a, c = contact.contact_radii, np.where(state.status == "sliding", 0.0, state.stick_radii)
    steps = int(np.clip(1000 // touching.sum(), 8, 24))
    slip = np.sqrt(1.0 - np.divide(c, a, out=np.zeros(len(a)), where=touching) ** 2)

    def radii(s: Any) -> Any:
        return np.concatenate((a * np.sqrt(1.0 - (slip * s) ** 2), c * np.sqrt(1.0 - s**2)))

    s = np.arange(steps)[:, None] / steps
    middle = radii(s + 0.5 / steps)[..., None] * (1.0, 0.0) + contact.scene.contact_points
    tractions = unit.of(np.abs(fields.traction(state, middle)))
    colours = ScalarMappable(Normalize(0.0, float(tractions[:, touching].max())), COLOURS)
    layers = [
        Layer("contact discs", np.where(touching, outer, 0.0), shades, None)
        for outer, shades in zip(radii(s), colours.to_rgba(tractions), strict=True)
    ]
    draw_contact(axes, scale, layers)
    bar(axes, colours, unit.short("q"), above=True)


def _section_figure(state: ShearState, scale: Scale, unit: Measure) -> Figure:
    contact, sphere = state.contact, smooth(state.contact.scene, load=state.contact.load)
    figure = Figure(figsize=(DOUBLE, 2.9), layout="constrained")
    axes = figure.subplots()
    points, radii = contact.scene.contact_points, contact.contact_radii
    edge = 1.06 * max(scale.typical, float((np.hypot(*points.T) + radii)[contact.loads > 0].max()))
    x = np.union1d(abscissae(points, radii, edge), abscissae(points, state.stick_radii, edge))
    line = np.column_stack((x, np.zeros_like(x)))
    f = checks.friction(contact.scene.friction)
    fp, q = unit.of(f * fields.pressure(contact, line)), unit.of(fields.traction(state, line))
    across = scale.length.of(x)
    axes.fill_between(across, fp, fc=(ROUGH, 0.15), ec=ROUGH, lw=0.8, label="asperities: $fp$")
    axes.fill_between(across, q, fc=(ROUGH, 0.65), ec=ROUGH, lw=0.8, label="asperities: $q$")
    s = scale.typical * towards_rim()
    s = np.union1d(s, towards_rim() * sphere.stick_radius(state.force))
    smooth_fp, smooth_q = f * sphere.pressure(np.abs(s)), sphere.traction(np.abs(s), state.force)
    for values, ls, name in ((smooth_fp, DASHED, "$fp$"), (smooth_q, DOTTED, "$q$")):
        axes.plot(scale.length.of(s), unit.of(values), ls=ls, lw=1.4, color=SMOOTH,
                  label=f"smooth sphere: {name}")  # fmt: skip
    most = max(float(unit.of(f * scale.peak)), float(fp.max()))
    axes.set(xlim=(-scale.length.of(edge), scale.length.of(edge)), ylim=(0.0, 1.05 * most))
    label(axes, scale.length.label("x"), unit.label("q"))
    title(axes, f"$y$ = 0, $Q/(fP)$ = {SHARE:g}")
    legend_above(axes, ncols=4)
    return figure
