"""Figures of a pressed contact, fit to print. Nothing is computed here that another room computes.

Lengths are in a_H and pressures in p0: contact radius and peak pressure of the smooth sphere under
the same load. No global state of matplotlib is touched: save a figure, or show it in a notebook.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from convexrough import fields, hertz
from convexrough.checks import Array
from convexrough.contact import Contact

LABEL, TICK = 9, 8  # points
SINGLE, DOUBLE = 3.5, 7.0  # inches: one and two columns of a journal
COLOURS = "viridis_r"  # darkens steadily towards the peak, so that it also reads in grey
ROUGH, UNSURE = "#2b5c8a", "#c1440e"
SMOOTH, FAINT = "0.15", "0.65"  # greys

#: From these numbers of touching asperities on, the discs are pixels inside a vector file, and
#: too small to be drawn.
DENSE, CROWDED = 200, 3000


@dataclass(frozen=True)
class _Scale:
    """What lengths and pressures are divided by, and how the labels say so."""

    length: float  # a_H
    pressure: float  # p0
    length_unit: str
    pressure_unit: str

    @classmethod
    def of(cls, contact: Contact, length_unit: str, force_unit: str) -> _Scale:
        modulus, radius = contact.scene.material.contact_modulus, contact.scene.sphere_radius
        a_H = float(hertz.contact_radius(contact.load, modulus, radius))
        p0 = float(hertz.peak_pressure(a_H, modulus, radius))
        pressure_unit = f"{force_unit}/{length_unit}²" if force_unit and length_unit else ""
        return cls(a_H, p0, length_unit, pressure_unit)

    def length_label(self, name: str) -> str:
        return f"${name}\\,/\\,a_H$  ($a_H$ = {_quantity(self.length, self.length_unit)})"

    def pressure_label(self) -> str:
        return f"$p\\,/\\,p_0$  ($p_0$ = {_quantity(self.pressure, self.pressure_unit)})"


def press_figures(
    contact: Contact, *, length_unit: str = "", force_unit: str = ""
) -> dict[str, Figure]:
    """The figures of a pressed contact, by the stem of the file each belongs in.

    "pressure" : map of the contact discs, and the profile along y = 0 with that of the smooth
        sphere (Dini & Hills 2009, Fig. 3)
    "loads"    : load of each touching asperity by its distance from the axis

    Units are only said, never converted. Discs of dense scenes are pixels inside a vector file:
    save that with a `dpi` too.
    """
    scale = _Scale.of(contact, length_unit, force_unit)
    if not contact.loads.any():
        return {"pressure": _no_pressure(contact, scale), "loads": _no_loads(scale)}
    return {"pressure": _pressure_figure(contact, scale), "loads": _loads_figure(contact, scale)}


def _pressure_figure(contact: Contact, scale: _Scale) -> Figure:
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    chart, profile = figure.subplots(1, 2, width_ratios=[1.0, 1.05], gridspec_kw={"wspace": 0.08})
    touching = contact.loads > 0
    points = contact.scene.contact_points / scale.length
    radii = contact.contact_radii[touching] / scale.length
    peaks = fields.peak_pressures(contact) / scale.pressure
    edge = 1.06 * max(1.0, float((np.hypot(*points[touching].T) + radii).max()))
    top = max(1.0, float(peaks.max()))

    colours = ScalarMappable(Normalize(0.0, top), COLOURS)
    if len(radii) < CROWDED:
        _draw_open(chart, points[~touching & (np.abs(points).max(axis=1) < edge)])
        _draw_discs(chart, points[touching], radii, peaks[touching], colours)
    else:
        _draw_mosaic(chart, points, peaks, colours, edge)
    chart.add_patch(Circle((0, 0), 1.0, fill=False, ls=(0, (4, 2.5)), lw=0.9, ec=SMOOTH))
    chart.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal", anchor="E")
    chart.set_title(_census(contact), fontsize=TICK, loc="left")
    _label(chart, "$x\\,/\\,a_H$", "$y\\,/\\,a_H$")
    bar = figure.colorbar(colours, ax=chart, aspect=28, pad=0.02)
    bar.ax.tick_params(labelsize=TICK)
    peak = "" if len(radii) < CROWDED else "peak "
    bar.ax.set_title(peak + "$p\\,/\\,p_0$", fontsize=TICK)

    _draw_profile(profile, contact, scale, edge)
    profile.set(xlim=(-edge, edge), ylim=(0.0, 1.04 * top))
    _label(profile, scale.length_label("x"), scale.pressure_label())
    for axis in (chart.xaxis, chart.yaxis, profile.xaxis):
        axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    return figure


def _draw_open(axes: Axes, points: Array) -> None:
    """Faint dots, smaller where they are many."""
    size = float(np.clip(25.0 / np.sqrt(len(points) + 1), 0.4, 1.5))
    pixels = len(points) >= CROWDED
    axes.plot(*points.T, "o", ms=size, mew=0, color=FAINT, rasterized=pixels, label="open")


def _draw_discs(
    axes: Axes, centres: Array, radii: Array, peaks: Array, colours: ScalarMappable
) -> None:
    """Each pressure p0 sqrt(1 - s^2) as a stack of discs in equal steps of pressure.

    centres : (n, 2) [a_H];  radii : (n,) [a_H];  peaks : (n,) [p0]
    """
    n = len(radii)
    steps = int(np.clip(1000 // n, 8, 40))
    for step in range(steps):
        across = 2.0 * radii * np.sqrt(1.0 - (step / steps) ** 2)  # where p = p0 step / steps
        discs = EllipseCollection(
            across,
            across,
            np.zeros(n),
            units="xy",
            offsets=centres,
            offset_transform=axes.transData,
            facecolors=colours.to_rgba(peaks * (step + 0.5) / steps),
            linewidths=0,
            rasterized=n >= DENSE,
            label="contact discs" if step == 0 else "_inner discs",
        )
        axes.add_collection(discs, autolim=False)


def _draw_mosaic(
    axes: Axes, points: Array, peaks: Array, colours: ScalarMappable, edge: float
) -> None:
    """Each place in the colour of the nearest asperity's peak pressure; white where that is open.

    points : (n, 2) [a_H];  peaks : (n,) [p0], 0 where open
    """
    from scipy.spatial import cKDTree  # 0.1 s to import: only when asked

    pixels = 500
    x = edge * ((np.arange(pixels) + 0.5) / pixels * 2.0 - 1.0)
    places = np.stack(np.meshgrid(x, x), axis=-1)
    cell = 2.0 * edge / np.sqrt(np.count_nonzero(peaks))  # no asperity so near: outside them all
    _, nearest = cKDTree(points).query(places, distance_upper_bound=cell)
    shown = np.append(peaks, 0.0)[nearest]
    image = colours.to_rgba(np.ma.masked_equal(shown, 0.0))
    whole = (-edge, edge, -edge, edge)
    axes.imshow(image, origin="lower", extent=whole, interpolation="nearest")


def _draw_profile(axes: Axes, contact: Contact, scale: _Scale, edge: float) -> None:
    """Pressure along y = 0, of the asperities and of the smooth sphere, for |x| < edge [a_H]."""
    x = _abscissae(contact, edge * scale.length)
    rough = fields.pressure(contact, np.column_stack((x, np.zeros_like(x)))) / scale.pressure
    fine = len(x) > 100 * len(_towards_rim())  # so many discs that lines would leave no white
    axes.fill_between(
        x / scale.length,
        rough,
        facecolor=(ROUGH, 0.5 if fine else 0.2),
        edgecolor="none" if fine else ROUGH,
        lw=float(np.clip(3000 / len(x), 0.4, 0.9)),
        rasterized=fine,
        label="asperities, $y=0$",
    )
    s = _towards_rim()
    axes.plot(s, hertz.pressure(s, 1.0, 1.0), "--", lw=1.3, color=SMOOTH, label="smooth sphere")
    _legend_above(axes)


def _abscissae(contact: Contact, edge: float) -> Array:
    """x [length] from -edge to edge, close together at the steep rims of the discs on y = 0."""
    touching = contact.loads > 0
    x, y = contact.scene.contact_points[touching].T
    a = contact.contact_radii[touching]
    crossed = np.abs(y) < a
    half_chord = np.sqrt(a[crossed] ** 2 - y[crossed] ** 2)
    places = x[crossed, None] + np.outer(half_chord, _towards_rim())
    return np.unique(np.append(places, [-edge, edge]))


def _towards_rim() -> Array:
    """(81,) from -1 to 1, close together at both ends: a semicircle drawn over them is smooth."""
    return np.sin(np.linspace(-np.pi / 2, np.pi / 2, 81))


def _loads_figure(contact: Contact, scale: _Scale) -> Figure:
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
    for label, chosen, marker, colour in (
        ("touching", touching & ~unsure, "o", ROUGH),
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
                label=label,
                clip_on=False,
                rasterized=n >= CROWDED,
                zorder=3,
            )
    axes.set_xlim(0.0, 1.05 * max(1.0, float(distance[touching | unsure].max())))
    axes.set_ylim(0.0, 1.06 * axes.dataLim.ymax)
    axes.yaxis.get_offset_text().set_fontsize(TICK)
    _label(axes, scale.length_label("r"), "asperity load  [% of total]")
    _legend_above(axes, markerscale=4.0 / size)
    return figure


def _draw_smooth_share(axes: Axes, contact: Contact, scale: _Scale) -> None:
    """Percentage of the load that the smooth sphere's pressure lays on the cell of an asperity.

    100 p(r) A / P, with p0 = 3 P / (2 pi a_H^2) and A the median cell of the touching asperities;
    left out where fewer than seven of these have a whole cell.
    """
    points = contact.scene.contact_points
    sample = np.argsort(np.hypot(*points.T))[:20_000]  # of very many, those nearest to the axis
    areas = fields.cell_areas(points[sample])
    whole = np.isfinite(areas) & (contact.loads[sample] > 0)
    if whole.sum() < 7:
        return
    area = np.median(areas[whole])
    s = _towards_rim()
    s = s[s >= 0.0]
    share = 100.0 * hertz.pressure(s, 1.0, 1.5 / np.pi) * area / scale.length**2
    label = "smooth $p(r)$ × cell area"
    axes.plot(s, share, "--", lw=1.1, color=SMOOTH, label=label)


def _no_pressure(contact: Contact, scale: _Scale) -> Figure:
    figure = Figure(figsize=(DOUBLE, 3.0), layout="constrained")
    chart, profile = figure.subplots(1, 2)
    chart.set_title(_census(contact), fontsize=TICK, loc="left")
    _draw_open(chart, contact.scene.contact_points)
    chart.set_aspect("equal", adjustable="datalim")
    chart.locator_params(nbins=5)
    x, y, p = (
        f"${name}$" + (f"  [{_literal(unit)}]" if unit else "")
        for name, unit in (
            ("x", scale.length_unit),
            ("y", scale.length_unit),
            ("p", scale.pressure_unit),
        )
    )
    _label(chart, x, y)
    _label(profile, x, p)
    _say_no_contact(profile)
    return figure


def _no_loads(scale: _Scale) -> Figure:
    figure = Figure(figsize=(SINGLE, 2.6), layout="constrained")
    axes = figure.subplots()
    unit = f"  [{_literal(scale.length_unit)}]" if scale.length_unit else ""
    _label(axes, "$r$" + unit, "asperity load  [% of total]")
    _say_no_contact(axes)
    return figure


def _say_no_contact(axes: Axes) -> None:
    axes.set(xticks=[], yticks=[])
    place = axes.transAxes
    axes.text(0.5, 0.5, "no contact", transform=place, fontsize=LABEL, ha="center", va="center")


def _census(contact: Contact) -> str:
    """How many touch, and how sure that is."""
    words = f"touching: {np.count_nonzero(contact.loads):,} of {len(contact.loads):,}"
    if contact.certificate.scope == "none":
        return words + " (not proved)"
    unsure = int((contact.status == "undecided").sum())
    return words + (f" ({unsure:,} undecided)" if unsure else "")


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x, fontsize=LABEL)
    axes.set_ylabel(y, fontsize=LABEL)
    axes.tick_params(labelsize=TICK)


def _legend_above(axes: Axes, markerscale: float = 1.0) -> None:
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 0.99),
        ncols=3,
        fontsize=TICK,
        markerscale=markerscale,
        frameon=False,
        borderpad=0.2,
        columnspacing=1.0,
        handletextpad=0.4,
        handlelength=1.6,
    )


def _quantity(value: float, unit: str) -> str:
    """Three digits and the unit, such as  4.12 × 10^-3 mm."""
    digits, _, exponent = f"{value:.2e}".partition("e")
    power = int(exponent)
    number = f"{value:.3g}" if -3 < power < 3 else f"${digits}\\times 10^{{{power}}}$"
    return f"{number} {_literal(unit)}".strip()


def _literal(text: str) -> str:
    """Text in which no dollar sign begins a formula."""
    return text.replace("$", r"\$")
