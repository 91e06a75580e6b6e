"""Figures of a measured surface: a map with summits, histograms, and results against pruning."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D

from convexrough import checks
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.plots import style
from convexrough.plots.asperity_map import Layer, draw_discs, draw_map, draw_outline, even_radius
from convexrough.plots.notebook import Figure, Figures, panels
from convexrough.plots.style import DASHED, FAINT, ROUGH, SINGLE, TICK, UNSURE, Scale, ink
from convexrough.surface.provability import OVERLAP, TOO_FAR, Provability, crowded
from convexrough.surface.summits import Summits
from convexrough.surface.surface import Surface

#: Above this number of summits, vector files contain the dots of the summits as pixels.
MANY = 1000

#: Colour of summits, bright on every grey.
SUMMIT = "#ffd24a"

#: Mark and colour for each scope of a certificate. The shapes differ for print without colours.
SCOPES = {"global": ("o", ROUGH), "local": ("s", ROUGH), "none": ("X", UNSURE),
          "failed": ("^", UNSURE)}  # fmt: skip


def surface_figures(
    surface: Surface,
    maxima: Summits,
    summits: Summits,
    curve: Provability | None = None,
    contact: Contact | None = None,
) -> Figures:
    """The figures of a surface, each under its file name without extension.

    "map"         : heights and summits, and contacts if `contact` is given
    "histograms"  : histograms of summits, with the curves that spectral moments predict
    "provability" : contacts, crowding and model error against pruning, if `curve` is given

    maxima  : all summits of this surface;  summits : the summits left by pruning
    contact : the contact of the summits left by pruning

    >>> scan = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1)
    >>> print(*cr.plots.surface_figures(scan, scan.summits(0.0), scan.summits(0.05)))
    map histograms
    """
    checks.instance("surface", surface, Surface)
    checks.instance("maxima", maxima, Summits)
    checks.instance("summits", summits, Summits)
    figures = Figures(map=_map(surface, summits, contact))
    figures["histograms"] = _histograms(surface, maxima, summits)
    if curve is not None:
        figures["provability"] = _provability_figure(curve, summits.origin.prune)
    return figures


def draw_surface(axes: Axes, surface: Surface) -> tuple[AxesImage, style.Measure, style.Measure]:
    """Draw the heights in greys; return the image, and the measures of its axes and heights."""
    x = style.measure(surface.size[0] / 2, surface.unit)
    z = style.measure(float(np.abs(surface.heights).max()), surface.unit)
    width, height = (x.of(side / 2) for side in surface.size)
    whole = (-width, width, -height, height)
    image = axes.imshow(z.of(surface.heights), origin="lower", extent=whole, cmap="gray",
                        interpolation="nearest", rasterized=True)  # fmt: skip
    style.label(axes, x.short("x"), x.short("y"))
    style.few_ticks(axes)
    return image, x, z


def draw_summit_map(axes: Axes, summits: Summits) -> None:
    """Draw a disc at each summit."""
    radii = np.full(len(summits), even_radius(summits.positions))
    layer = Layer("summits", radii, SUMMIT)
    length = style.measure(float(np.ptp(summits.positions)) / 2, summits.unit)
    draw_map(axes, summits.positions, length, [layer])


def draw_provability(axes: Axes, curve: Provability) -> None:
    """Draw the number of touching summits against the pruning; marks show what is proved."""
    axes.plot(range(len(curve.prune)), curve.summits, "--", lw=1.1, color=ink(), label="summits")
    # A logarithmic axis cannot show 0.
    _draw_by_scope(axes, curve, np.where(curve.contacts > 0, curve.contacts, np.nan), "contacts")
    axes.set_yscale("log")
    style.log_ticks(axes.yaxis)
    style.label(axes, "pruning  [% of $Sz$]", "number")


def _provability_figure(curve: Provability, chosen: float) -> Figure:
    """Contacts, crowding and model error against pruning: dotted at the chosen one, grey below the
    smallest at which the assumptions of the asperity model are met."""
    figure, (upper, middle, lower) = panels(SINGLE, 5.0, 3, 1)
    draw_provability(upper, curve)
    upper.legend(fontsize=TICK - 1, frameon=False, loc="lower left", handlelength=1.6)
    for axes, values, limit, name in (
        (middle, curve.crowding, OVERLAP, "crowding"),
        (lower, 100 * curve.model_error, 100 * TOO_FAR, "model error  [%]"),
    ):
        _draw_by_scope(axes, curve, values)
        axes.axhline(limit, color=UNSURE, lw=0.9, ls=DASHED)
        axes.set_ylim(0.0, 1.1 * max(limit, float(np.nanmax(values, initial=0.0))))
        style.label(axes, upper.get_xlabel() if axes is lower else "", name)
    upper.set_xlabel("")
    first = curve.trusted_from
    until, at = np.searchsorted(curve.prune, [first, chosen]).tolist()
    for axes in (upper, middle, lower):
        axes.axvspan(-0.5, until - 0.5, color="0.5", alpha=0.2, lw=0.0, zorder=0)
        axes.axvline(at, color=ink(), lw=0.9, ls=":")
    met = "at no pruning" if np.isnan(first) else f"from {100 * first:.3g} %"
    style.title(upper, f"assumptions met {met}")
    return figure


def _draw_by_scope(axes: Axes, curve: Provability, values: Array, name: str = "") -> None:
    """Draw values against the pruning, with a mark for each scope, named if `name` is given."""
    places = np.arange(len(curve.prune))
    axes.plot(places, values, "-", lw=0.9, color=FAINT, zorder=1)
    for scope, (mark, colour) in SCOPES.items():
        chosen = (curve.scope == scope) & np.isfinite(values)
        if chosen.any():
            said = f"{name}, proof: {scope}" if name else "_nothing"
            axes.plot(places[chosen], values[chosen], mark, ls="", ms=4.5, mew=0.0, color=colour,
                      label=said, clip_on=False, zorder=3)  # fmt: skip
    shown = places[:: 1 + len(places) // 12]
    axes.set_xticks(shown, [f"{100 * each:.2g}" for each in curve.prune[shown]])
    axes.set_xlim(-0.5, len(places) - 0.5)


def _map(surface: Surface, summits: Summits, contact: Contact | None) -> Figure:
    figure, (axes,) = panels(SINGLE + 0.9, 4.1)
    image, length, z = draw_surface(axes, surface)
    style.bar(axes, image, z.short("z"), above=True)
    positions, handles = length.of(summits.positions), []
    if contact is not None and contact.loads.any():
        edge = _draw_contacts(axes, Scale(contact), length)
        handles = [style.disc_handle(UNSURE, f"contacts ({np.count_nonzero(contact.loads):,})")]
        handles += [Line2D([], [], ls=DASHED, lw=0.9, color=ink(), label="smooth contact")]
        positions = positions[np.abs(positions).max(axis=1) <= edge]
        width, height = (min(edge, length.of(side / 2)) for side in surface.size)
        axes.set(xlim=(-width, width), ylim=(-height, height))
    size = float(np.clip(60.0 / np.sqrt(len(positions) + 1), 0.4, 4.0))
    axes.plot(*positions.T, "o", ms=size, mew=0.0, color=SUMMIT, zorder=0.9,  # below contacts
              rasterized=len(positions) > MANY)  # fmt: skip
    some = f"{len(positions):,} of " if len(positions) < len(summits) else ""
    handles.insert(0, style.disc_handle(SUMMIT, f"summits ({some}{len(summits):,})"))
    style.legend(figure, "outside", handles=handles, loc="outside lower center", ncols=3)
    return figure


def _draw_contacts(axes: Axes, scale: Scale, length: style.Measure) -> float:
    """Draw contacts, smooth contact and most crowded pair; return half the width of the view."""
    contact, points = scale.contact, length.of(scale.points)
    touching, radii = contact.loads > 0, length.of(contact.contact_radii)
    reach = np.abs(points).max(axis=1) + radii
    edge = 1.2 * float(max(length.of(scale.typical), reach[touching].max()))
    least = edge * float(np.clip(0.1 / np.sqrt(touching.sum()), 0.002, 0.01))
    discs = np.where(touching, np.maximum(radii, least), 0.0)
    draw_discs(axes, points, Layer("_contacts", discs, UNSURE, "white"))
    draw_outline(axes, [length.of(axis) for axis in scale.axes], colour="white")
    for i, j in crowded(contact)[0][:1]:
        middle = contact.scene.asperities.positions[[i, j]].mean(axis=0)
        style.write_beside(axes, f"{i}, {j}", length.of(middle))
    return edge


def _histograms(surface: Surface, maxima: Summits, summits: Summits) -> Figure:
    figure, (left, middle, right) = panels(style.DOUBLE, 2.7, 1, 3)
    moments, level = surface.moments, summits.origin.level
    unit = style.measure(float(np.abs(maxima.heights - level).max()), surface.unit)
    heights = [unit.of(each.heights - level) for each in (maxima, summits)]
    edges = _draw_both(left, np.linspace(heights[0].min(), heights[0].max(), 30), *heights)
    mean, spread = unit.of(moments.mean_height), unit.of(moments.height_std)
    if spread > 0:  # if 0, no Gaussian surface has these moments
        z = np.linspace(edges[0], edges[-1], 200)
        normal = np.exp(-(((z - mean) / spread) ** 2) / 2) / (spread * np.sqrt(2 * np.pi))
        expected = moments.density * summits.origin.area * (edges[1] - edges[0])
        left.plot(z, expected * normal, "--", lw=1.1, color=ink(), label="by spectral moments")
    left.xaxis.set_major_locator(style.round_ticks(4))
    style.label(left, unit.short(r"\mathrm{height}"), "summits")

    unit = style.measure(float(np.median(maxima.tip_radii)), surface.unit)
    radii = [unit.of(each.tip_radii) for each in (maxima, summits)]
    _draw_both(middle, np.geomspace(radii[0].min(), radii[0].max(), 30), *radii)
    middle.axvline(unit.of(1 / moments.mean_curvature), color=ink(), ls="--", lw=1.1)
    middle.set_xscale("log")
    style.log_ticks(middle.xaxis, most=4)
    style.label(middle, unit.short(r"\mathrm{tip\ radius}"), "")

    _draw_both(right, np.linspace(0.0, 1.0, 21), maxima.eccentricities, summits.eccentricities)
    right.set_xlim(0.0, 1.0)
    style.label(right, "eccentricity of the tip", "")
    handles = left.get_legend_handles_labels()[0]
    style.legend(figure, "outside", handles=handles, loc="outside lower center", ncols=3)
    return figure


def _draw_both(axes: Axes, edges: Array, maxima: Array, summits: Array) -> Array:
    """Draw both histograms; return the edges of their bins."""
    if edges[-1] - edges[0] <= 1e-9 * abs(edges[0]):  # all are equal
        edges = edges[0] + np.linspace(-0.5, 0.5, len(edges)) * (abs(edges[0]) or 1.0)
    axes.hist(maxima, edges.tolist(), histtype="step", lw=1.0, color=ink(), label="all maxima")
    axes.hist(summits, edges.tolist(), color=ROUGH, alpha=0.75, label="summits left by pruning")
    return edges
