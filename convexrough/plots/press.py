"""Figures of a pressed contact: pressure and loads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, to_rgba

from convexrough import checks, fields
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.plots import style
from convexrough.plots.asperity_map import CROWDED, draw_values
from convexrough.plots.notebook import Figure, Figures, no_contact, panels
from convexrough.plots.style import DOUBLE, ROUGH, SINGLE, UNSURE, Scale, ink
from convexrough.sphere import hertz

#: (81,) abscissae from -1 to 1, dense at both ends so that a semicircle looks smooth.
TOWARDS_RIM = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 81))


def press_figures(contact: Contact) -> Figures:
    """The figures of a pressed contact; keys are file names without suffix.

    "pressure" : map of the contact discs; and the pressure along y = 0 with that of the smooth
        sphere (Dini & Hills 2009, Fig. 3). If few contact discs cross this line, if asperities are
        not on a lattice or if very many touch, the second plot shows the peak pressures of all
        asperities against the distance from the centre
    "loads"    : load of each touching asperity against its distance from the centre

    >>> print(*cr.plots.press_figures(contact))
    pressure loads
    """
    checks.instance("contact", contact, Contact)
    if not contact.loads.any():
        return no_contact("pressure", "loads")
    scale = Scale(contact)
    return Figures({"pressure": pressure_figure(scale), "loads": _loads_figure(scale)})


def pressure_figure(scale: Scale) -> Figure:
    """Map and profile of the pressure."""
    contact = scale.contact
    figure, (chart, profile) = map_and_profile()
    style.label(profile, scale.length.label("x"), scale.pressure.label("p"))
    colours = draw_pressure(chart, contact, scale)
    chart.set_xlabel(scale.length.short("x"))
    crossed = np.count_nonzero(np.abs(scale.points[:, 1]) < contact.contact_radii)
    touching = np.count_nonzero(contact.loads)
    in_rows = contact.scene.lattice is not None and crossed**2 >= touching
    if touching < CROWDED and (in_rows or crossed == touching):
        _draw_section(profile, scale, chart.get_xlim())
    else:
        _draw_peaks(profile, scale)
    style.legend(profile, "above")
    profile.set_ylim(0.0, 1.04 * colours.get_clim()[1])
    return figure


def map_and_profile() -> tuple[Figure, tuple[Axes, Axes]]:
    """A figure with axes for a map, and beside them axes for a profile."""
    how = {"width_ratios": [1.0, 1.05], "gridspec_kw": {"wspace": 0.08}}
    figure, (chart, profile) = panels(DOUBLE, 3.0, 1, 2, **how)
    chart.set_anchor("E")
    return figure, (chart, profile)


def draw_pressure(axes: Axes, contact: Contact, scale: Scale | None = None) -> ScalarMappable:
    """Draw a map of contact pressures with a colour bar; return the map of colours.

    Each contact, with the pressure p0 sqrt(1 - (r/a)^2), is a stack of discs in equal steps of
    pressure; if there are many, each is one disc in the colour of its peak pressure.
    """
    scale = scale or Scale(contact)
    peaks = scale.pressure.of(fields.peak_pressures(contact))
    n = np.count_nonzero(contact.loads)
    steps = int(np.clip(1000 // n, 8, 40)) if n < CROWDED else 1
    s = np.arange(steps)[:, None] / steps  # p = p0 s at the rim of a disc
    values = peaks * (s + 0.5 / steps) if steps > 1 else peaks
    style.title(axes, f"touching: {n:,} of {len(contact.loads):,}{style.not_proved(contact)}")
    name = ("" if steps > 1 else "peak ") + scale.pressure.short("p")
    most = max(float(scale.pressure.of(scale.peak)), float(peaks.max()))
    radii = contact.contact_radii * np.sqrt(1.0 - s**2)
    return draw_values(axes, scale, values, name, radii=radii, most=most)


def abscissae(centres: Array, radii: Array, edge: float) -> Array:
    """Abscissae from -edge to edge, dense at the rims of discs on y = 0, where pressure is steep.

    centres : (n, 2) [length];  radii : (n,) [length], 0 for no disc
    """
    x, y = centres.T
    crossed = np.abs(y) < radii
    half_chord = np.sqrt(radii[crossed] ** 2 - y[crossed] ** 2)
    places = x[crossed, None] + np.outer(half_chord, TOWARDS_RIM)
    return np.unique(np.append(places, [-edge, edge]))


def _draw_section(axes: Axes, scale: Scale, sides: tuple[float, float]) -> None:
    """Draw the pressure along y = 0."""
    contact, edge = scale.contact, max(-sides[0], sides[1]) * scale.length.size
    x = abscissae(scale.points, contact.contact_radii, edge)
    rough = scale.pressure.of(fields.pressure(contact, np.column_stack((x, np.zeros_like(x)))))
    axes.fill_between(scale.length.of(x), rough, facecolor=(ROUGH, 0.2), edgecolor=ROUGH,
                      lw=float(np.clip(3000 / len(x), 0.4, 0.9)),
                      label="asperities, $y=0$")  # fmt: skip
    _draw_smooth(axes, scale, scale.axes[:1], TOWARDS_RIM)
    axes.set_xlim(*sides)


def _draw_peaks(axes: Axes, scale: Scale) -> None:
    """Draw the peak pressure of each asperity against its distance from the centre."""
    touching = scale.contact.loads > 0
    r = scale.length.of(scale.distances[touching])
    peaks = scale.pressure.of(fields.peak_pressures(scale.contact)[touching])
    _draw_points(axes, r, peaks, float(peaks.max()), "peaks of all")
    _draw_smooth(axes, scale, sorted(set(scale.axes)), np.abs(TOWARDS_RIM[40:]))
    reach = max([scale.typical, *scale.axes])
    axes.set_xlim(0.0, 1.05 * max(float(r.max()), scale.length.of(reach)))
    style.label(axes, scale.length.label("r"), scale.pressure.label("p"))


def _draw_smooth(axes: Axes, scale: Scale, semi_axes: Sequence[float], s: Array) -> None:
    """Draw the smooth contact's pressure at fractions s of each semi-axis."""
    for place, axis in enumerate(semi_axes):
        p = scale.pressure.of(hertz.pressure(s, 1.0, scale.peak))
        axes.plot(scale.length.of(axis * s), p, "--", lw=1.3, color=ink(),
                  label=f"_{scale.name}" if place else scale.name)  # fmt: skip


def _draw_points(axes: Axes, x: Array, y: Array, top: float, name: str) -> None:
    """Draw a dot for each point or, if there are many, their median, and density up to `top`."""
    if len(x) < CROWDED:
        size = float(np.clip(40.0 / np.sqrt(len(x)), 1.2, 4.0))
        axes.plot(x, y, "o", ms=size, mew=0.0, color=ROUGH, label=name, clip_on=False, zorder=3)
        return
    columns, rows = (int(np.clip(len(x) / 50, 20, most)) for most in (80, 60))
    span = (float(x.min()), float(x.max()))
    count, across, up = np.histogram2d(x, y, bins=(columns, rows), range=(span, (0.0, top)))
    most = count.max(axis=1, keepdims=True)
    share = np.sqrt(np.divide(count, most, out=np.zeros_like(count), where=most > 0))
    fading = LinearSegmentedColormap.from_list("density", [(1, 1, 1, 0), to_rgba(ROUGH, 0.75)])
    axes.pcolormesh(across, up, share.T, cmap=fading, vmin=0.0, vmax=1.0, rasterized=True, lw=0)
    column = np.clip(np.searchsorted(across, x, side="right") - 1, 0, columns - 1)
    filled = np.unique(column)
    middle = [np.median(y[column == each]) for each in filled]
    axes.fill([], [], color=(*to_rgba(ROUGH)[:3], 0.4), lw=0, label=name)
    axes.plot((across[filled] + across[filled + 1]) / 2, middle, color=ROUGH, lw=1.3,
              label="median")  # fmt: skip


def _loads_figure(scale: Scale) -> Figure:
    contact = scale.contact
    figure, (axes,) = panels(SINGLE, 2.6)
    touching, unsure = contact.loads > 0, style.doubtful(contact)
    r, share = scale.length.of(scale.distances), 100.0 * contact.loads / contact.load
    _draw_smooth_share(axes, scale)
    sure = touching & ~unsure if touching.sum() < CROWDED else touching
    if sure.any():
        top = float(np.quantile(share[sure], 0.9999))
        _draw_points(axes, r[sure], share[sure], top, "touching")
    if unsure.any():
        axes.plot(r[unsure], share[unsure], "x", ms=4, mew=0.8, color=UNSURE, label="undecided",
                  clip_on=False, rasterized=unsure.sum() >= CROWDED, zorder=3)  # fmt: skip
    reach = max(float(r[touching | unsure].max()), scale.length.of(scale.typical))
    axes.set(xlim=(0.0, 1.05 * reach), ylim=(0.0, 1.06 * (axes.dataLim.ymax or 1.0)))
    style.label(axes, scale.length.label("r"), "asperity load  [% of total]")
    style.legend(axes, "above", ncols=2)
    return figure


def _draw_smooth_share(axes: Axes, scale: Scale) -> None:
    """Draw 100 p(r) A / P for the smooth sphere, with the median cell area A of asperities."""
    if len(set(scale.axes)) != 1:
        return
    scene, touching = scale.contact.scene, scale.contact.loads > 0
    if scene.lattice is not None and scene.asperities.layout.made is not None:  # no site is vacant
        inside = scale.distances < scale.distances.max() - 0.75 * scene.lattice.spacing
        areas = np.full((touching & inside).sum(), abs(np.linalg.det(scene.lattice.basis)))
    else:
        sample = np.argsort(np.hypot(*scale.points.T))[:5000]  # at most 5000, nearest the axis
        areas = fields.cell_areas(scale.points[sample])[touching[sample]]
        areas = areas[np.isfinite(areas)]
    if len(areas) < 7:
        return
    s = TOWARDS_RIM[40:]
    share = hertz.pressure(s, 1.0, 150.0 / np.pi) * np.median(areas) / scale.typical**2
    axes.plot(scale.length.of(scale.typical) * s, share, "--", lw=1.1, color=ink(),
              label="smooth $p(r)$ × cell area")  # fmt: skip
