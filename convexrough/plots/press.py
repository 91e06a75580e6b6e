"""Figures of a pressed contact: pressure and loads."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from convexrough import fields
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import (
    COLOURS,
    CROWDED,
    DOUBLE,
    ROUGH,
    SINGLE,
    SMOOTH,
    TICK,
    UNSURE,
    Scale,
    abscissae,
    census,
    draw_density,
    draw_discs,
    draw_mosaic,
    draw_open,
    draw_smooth,
    frame_map,
    label,
    legend_above,
    literal,
    map_edge,
    round_ticks,
    say_no_contact,
    smooth_name,
    towards_rim,
)
from convexrough.sphere import hertz

#: Half the width of the strip whose peak pressures stand for a profile [a_H].
STRIP = 0.1


def press_figures(contact: Contact, *, length_unit: str = "", force_unit: str = "") -> Figures:
    """The figures of a pressed contact, by the stem of the file each belongs in.

    "pressure" : map of the contact discs, and the profile along y = 0 with that of the smooth
        sphere (Dini & Hills 2009, Fig. 3)
    "loads"    : load of each touching asperity by its distance from the axis

    Units are only said, never converted. Discs of dense scenes are pixels inside a vector file:
    save that with a `dpi` too.
    """
    scale = Scale.of(contact, length_unit, force_unit)
    loads = _loads_figure(contact, scale) if contact.loads.any() else _no_loads(scale)
    return Figures({"pressure": pressure_figure(contact, scale), "loads": loads})


def pressure_figure(contact: Contact, scale: Scale) -> Figure:
    """Map and profile of the pressure."""
    if not contact.loads.any():
        return _no_pressure(contact, scale)
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    chart, profile = figure.subplots(1, 2, width_ratios=[1.0, 1.05], gridspec_kw={"wspace": 0.08})
    colours, edge = draw_pressure(chart, contact, scale)
    top = colours.get_clim()[1] or 1.0
    chart.set_anchor("E")
    label(chart, scale.short("x"), scale.short("y"))
    draw_pressure_bar(chart, contact, colours, scale)
    _draw_profile(profile, contact, scale, edge)
    profile.set(xlim=(-edge, edge), ylim=(0.0, 1.04 * top))
    label(profile, scale.length_label("x"), scale.pressure_label())
    profile.xaxis.set_major_locator(round_ticks())
    return figure


def draw_pressure(axes: Axes, contact: Contact, scale: Scale) -> tuple[ScalarMappable, float]:
    """The map of the contact discs; its colours up to the largest p / p0, and half its width."""
    touching = contact.loads > 0
    points = contact.scene.contact_points / scale.length
    radii = contact.contact_radii[touching] / scale.length
    peaks = fields.peak_pressures(contact) / scale.pressure
    edge = map_edge(contact, scale)
    top = max(1.0, float(peaks.max()))

    colours = ScalarMappable(Normalize(0.0, top), COLOURS)
    if len(radii) < CROWDED:
        draw_open(axes, points[~touching & (np.abs(points).max(axis=1) < edge)])
        _draw_peaks(axes, points[touching], radii, peaks[touching], colours)
    else:
        draw_mosaic(axes, points, colours.to_rgba(peaks), touching, edge, 500)
    draw_smooth(axes, scale)
    frame_map(axes, edge)
    axes.set_title(census(contact), fontsize=TICK, loc="left")
    return colours, edge


def draw_pressure_bar(axes: Axes, contact: Contact, colours: ScalarMappable, scale: Scale) -> None:
    """Beside a map of the pressure, what its colours mean."""
    bar = axes.figure.colorbar(colours, ax=axes, aspect=28, pad=0.02)
    bar.ax.tick_params(labelsize=TICK)
    peak = "" if np.count_nonzero(contact.loads) < CROWDED else "peak "
    bar.ax.set_title(peak + scale.short_pressure(), fontsize=TICK)


def _draw_peaks(
    axes: Axes, centres: Array, radii: Array, peaks: Array, colours: ScalarMappable
) -> None:
    """Each pressure p0 sqrt(1 - s^2) as a stack of discs in equal steps of pressure.

    centres : (n, 2) [a_H];  radii : (n,) [a_H];  peaks : (n,) [p0]
    """
    n = len(radii)
    steps = int(np.clip(1000 // n, 8, 40))
    for step in range(steps):
        inner = radii * np.sqrt(1.0 - (step / steps) ** 2)  # where p = p0 step / steps
        shades = colours.to_rgba(peaks * (step + 0.5) / steps)
        word = "contact discs" if step == 0 else "_inner discs"
        draw_discs(axes, centres, inner, word, facecolors=shades, linewidths=0)


def _draw_profile(axes: Axes, contact: Contact, scale: Scale, edge: float) -> None:
    """Pressure along y = 0, of the asperities and of the smooth sphere, for |x| < edge [a_H].

    Of many asperities the peak pressures about y = 0, as density and median.
    """
    points, touching = contact.scene.contact_points / scale.length, contact.loads > 0
    if np.count_nonzero(touching) < CROWDED:
        x = abscissae(contact.scene.contact_points, contact.contact_radii, edge * scale.length)
        rough = fields.pressure(contact, np.column_stack((x, np.zeros_like(x)))) / scale.pressure
        axes.fill_between(
            x / scale.length,
            rough,
            facecolor=(ROUGH, 0.2),
            edgecolor=ROUGH,
            lw=float(np.clip(3000 / len(x), 0.4, 0.9)),
            label="asperities, $y=0$",
        )
    else:
        near = touching & (np.abs(points[:, 1]) < STRIP)
        peaks = fields.peak_pressures(contact)[near] / scale.pressure
        word = f"peaks, $|y|<{STRIP:g}\\,a_H$"
        draw_density(axes, points[near, 0], peaks, float(peaks.max()), ROUGH, word)
    if scale.smooth is not None:
        s = towards_rim()
        x, p = scale.smooth[0] * s, hertz.pressure(s, 1.0, 1.0)
        axes.plot(x, p, "--", lw=1.3, color=SMOOTH, label=smooth_name(contact))
    legend_above(axes, ncols=3 if np.count_nonzero(touching) < CROWDED else 2)


def _loads_figure(contact: Contact, scale: Scale) -> Figure:
    figure = Figure(figsize=(SINGLE, 2.6), layout="constrained")
    axes = figure.subplots()
    touching = contact.loads > 0
    unsure = contact.status == "undecided"
    if contact.certificate.scope == "none":  # every asperity is: show those with a load
        unsure &= touching
    distance = np.hypot(*contact.scene.contact_points.T) / scale.length
    share = 100.0 * contact.loads / contact.load

    _draw_smooth_share(axes, contact, scale)
    n = int(touching.sum())
    size = float(np.clip(40.0 / np.sqrt(n), 1.2, 4.0))
    many = n >= CROWDED
    if many:
        top = float(np.quantile(share[touching], 0.9999))
        draw_density(axes, distance[touching], share[touching], top, ROUGH, "touching")
    for word, chosen, marker, colour in (
        ("touching", touching & ~unsure & (not many), "o", ROUGH),
        ("undecided", unsure, "x", UNSURE),
    ):
        if chosen.any():
            axes.plot(
                distance[chosen],
                share[chosen],
                marker,
                ms=size,
                mew=0.0 if marker == "o" else 0.8,
                color=colour,
                label=word,
                clip_on=False,
                rasterized=many,
                zorder=3,
            )
    axes.set_xlim(0.0, 1.05 * max(1.0, float(distance[touching | unsure].max())))
    axes.set_ylim(0.0, 1.06 * (axes.dataLim.ymax or 1.0))
    axes.yaxis.get_offset_text().set_fontsize(TICK)
    label(axes, scale.length_label("r"), "asperity load  [% of total]")
    legend_above(axes, markerscale=1.0 if many else 4.0 / size, ncols=2 if many else 3)
    return figure


def _draw_smooth_share(axes: Axes, contact: Contact, scale: Scale) -> None:
    """Percentage of the load that the smooth sphere's pressure lays on the cell of an asperity.

    100 p(r) A / P, with p0 = 3 P / (2 pi a_H^2) and A the median cell of the touching asperities;
    left out where fewer than seven of these have a whole cell, and where the base is no sphere.
    """
    if scale.smooth != (1.0, 1.0):
        return
    points = contact.scene.contact_points
    sample = np.argsort(np.hypot(*points.T))[:5000]  # of very many, those nearest to the axis
    areas = fields.cell_areas(points[sample])
    whole = np.isfinite(areas) & (contact.loads[sample] > 0)
    if whole.sum() < 7:
        return
    area = np.median(areas[whole])
    s = towards_rim()
    s = s[s >= 0.0]
    share = 100.0 * hertz.pressure(s, 1.0, 1.5 / np.pi) * area / scale.length**2
    label = "smooth $p(r)$ × cell area"
    axes.plot(s, share, "--", lw=1.1, color=SMOOTH, label=label)


def _no_pressure(contact: Contact, scale: Scale) -> Figure:
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    chart, profile = figure.subplots(1, 2)
    chart.set_title(census(contact), fontsize=TICK, loc="left")
    draw_open(chart, contact.scene.contact_points)
    chart.set_aspect("equal", adjustable="datalim")
    chart.locator_params(nbins=5)
    x, y, p = (
        f"${name}$" + (f"  [{literal(unit)}]" if unit else "")
        for name, unit in (
            ("x", scale.length_unit),
            ("y", scale.length_unit),
            ("p", scale.pressure_unit),
        )
    )
    label(chart, x, y)
    label(profile, x, p)
    say_no_contact(profile)
    return figure


def _no_loads(scale: Scale) -> Figure:
    figure = Figure(figsize=(SINGLE, 2.6), layout="constrained")
    axes = figure.subplots()
    unit = f"  [{literal(scale.length_unit)}]" if scale.length_unit else ""
    label(axes, "$r$" + unit, "asperity load  [% of total]")
    say_no_contact(axes)
    return figure
