"""The shared look of the figures: sizes, colours, scales, labels, and maps of contact discs.

Lengths are in a_H and pressures in p0, contact radius and peak pressure of the smooth sphere under
the same load. Shear forces are in f P, displacements in X0 and energies in W0 (`ShearScale`). Where
the base has no smooth reference, lengths are in r_c, how far contact reaches from the axis, and
pressures in the mean one over the circle of that radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.patches import Ellipse
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.plots.notebook import Figure
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import SmoothEllipsoid, SmoothSphere, smooth_reference

LABEL, TICK = 9, 8  # points
SINGLE, DOUBLE = 3.5, 7.0  # inches: one and two columns of a journal
COLOURS = "viridis_r"  # darkens steadily towards the peak, so that it also reads in grey
ROUGH, UNSURE = "#2b5c8a", "#c1440e"
SMOOTH, FAINT = "0.15", "0.65"  # greys
DASHED = (0, (4, 2.5))

#: From these numbers of touching asperities on, the discs are pixels inside a vector file, and
#: too small to be drawn.
DENSE, CROWDED = 200, 3000


@dataclass(frozen=True)
class Scale:
    """What lengths and pressures are divided by, and how the labels say so.

    smooth : semi-axes of the smooth contact, in a_H; None where there is none
    """

    length: float  # a_H
    pressure: float  # p0
    length_unit: str
    pressure_unit: str
    smooth: tuple[float, float] | None = (1.0, 1.0)

    @classmethod
    def of(cls, contact: Contact, length_unit: str, force_unit: str) -> Scale:
        pressure_unit = f"{force_unit}/{length_unit}²" if force_unit and length_unit else ""
        sphere = smooth_reference(contact.scene, contact.load) if contact.load else None
        if sphere is None:
            touching = contact.loads > 0
            rims = np.hypot(*contact.scene.contact_points.T) + contact.contact_radii
            r_c = float(rims[touching].max(initial=0.0))
            mean = contact.load / (np.pi * r_c**2) if r_c > 0 else 0.0
            return cls(r_c, mean, length_unit, pressure_unit, None)
        a_H, axes = sphere.contact_radius, (1.0, 1.0)
        if isinstance(sphere, SmoothEllipsoid):
            axes = (sphere.semi_axes[0] / a_H, sphere.semi_axes[1] / a_H)
        return cls(a_H, sphere.peak_pressure, length_unit, pressure_unit, axes)

    def short(self, name: str) -> str:
        """A length without what it is divided by."""
        return f"${name}\\,/\\,{self._length}$"

    def length_label(self, name: str) -> str:
        known = f"(${self._length}$ = {quantity(self.length, self.length_unit)})"
        return f"{self.short(name)}  {known}"

    def short_pressure(self) -> str:
        return f"$p\\,/\\,{self._pressure}$"

    def pressure_label(self) -> str:
        known = f"(${self._pressure}$ = {quantity(self.pressure, self.pressure_unit)})"
        return f"{self.short_pressure()}  {known}"

    @property
    def _length(self) -> str:
        return "a_H" if self.smooth else "r_c"

    @property
    def _pressure(self) -> str:
        return "p_0" if self.smooth else "\\bar p"


@dataclass(frozen=True)
class ShearScale:
    """What shear forces, displacements and energies are divided by, and how the labels say so.

    sphere : the smooth sphere under the same load, or None
    displacement : X0, its displacement at gross sliding; where there is none, the contact's own
    energy : W0 = 9 (2 - nu) f^2 P^2 / (5 G a_H), which is 24/5 f P X0
    """

    sphere: SmoothSphere | None
    force: float
    displacement: float
    length_unit: str
    force_unit: str

    @classmethod
    def of(cls, contact: Contact, length_unit: str, force_unit: str) -> ShearScale:
        scene, f = contact.scene, checks.friction(contact.scene.friction)
        sphere, limit = smooth_reference(scene, contact.load), f * contact.load
        if sphere is not None:
            X0 = float(sphere.displacement(limit))
        else:  # by Ciavarella and Jaeger, c_t f times the approach from first touch
            X0 = f * float(mindlin.ratio(scene.material.poisson_ratio))
            X0 *= contact.approach + float(scene.offsets.max())
        return cls(sphere, limit, X0, length_unit, force_unit)

    @property
    def name(self) -> str:
        """What the smooth reference is called."""
        return f"smooth {'ellipsoid' if isinstance(self.sphere, SmoothEllipsoid) else 'sphere'}"

    @property
    def energy(self) -> float:
        return 4.8 * self.force * self.displacement

    def limit(self) -> str:
        """f P, in words for a label."""
        return f"$fP$ = {quantity(self.force, self.force_unit)}"

    def displacement_label(self) -> str:
        return f"$X\\,/\\,X_0$  ($X_0$ = {quantity(self.displacement, self.length_unit)})"

    def footnote(self) -> str:
        """What the letters of short labels are."""
        X0 = quantity(self.displacement, self.length_unit)
        whose = f"the {self.name}'s" if self.sphere else "this contact's"
        return f"{self.limit()},   $X_0$ = {X0}: {whose} $X$ at gross sliding"

    def energy_label(self) -> str:
        both = self.force_unit and self.length_unit
        unit = f"{self.force_unit} {self.length_unit}" if both else ""
        return f"$W\\,/\\,W_0$  ($W_0$ = {quantity(self.energy, unit)})"


def smooth_name(contact: Contact) -> str:
    """What the smooth reference is called."""
    word = "ellipsoid" if isinstance(contact.scene.sphere_radius, tuple) else "sphere"
    return f"smooth {word}"


def map_edge(contact: Contact, scale: Scale) -> float:
    """Half the width of a map that holds every contact disc and the smooth contact [a_H]."""
    touching = contact.loads > 0
    reach = np.hypot(*contact.scene.contact_points[touching].T) + contact.contact_radii[touching]
    return 1.06 * max(*(scale.smooth or (1.0, 1.0)), float(reach.max()) / scale.length)


def frame_map(axes: Axes, edge: float) -> None:
    """A square window round the axis of the sphere."""
    axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
    axes.xaxis.set_major_locator(round_ticks())
    axes.yaxis.set_major_locator(round_ticks())
    axes.tick_params(labelsize=TICK)


def round_ticks(most: int = 6) -> MaxNLocator:
    return MaxNLocator(most, steps=[1, 2, 5, 10])


def draw_smooth(
    axes: Axes, scale: Scale, share: float = 1.0, style: Any = DASHED, colour: str = SMOOTH
) -> None:
    """A circle, or ellipse, about the axis: what the smooth contact would do; this part of it."""
    if scale.smooth is not None:
        width, height = (2.0 * share * axis for axis in scale.smooth)
        axes.add_patch(Ellipse((0, 0), width, height, fill=False, ls=style, lw=0.9, ec=colour))


def draw_open(axes: Axes, points: Array) -> None:
    """Faint dots, smaller where they are many."""
    size = float(np.clip(25.0 / np.sqrt(len(points) + 1), 0.4, 1.5))
    pixels = len(points) >= CROWDED
    axes.plot(*points.T, "o", ms=size, mew=0, color=FAINT, rasterized=pixels, label="open")


def draw_mosaic(
    axes: Axes, points: Array, shades: Array, touching: NDArray[np.bool_], edge: float, pixels: int
) -> None:
    """Each place in the colour of the nearest asperity, white where that is open.

    Where several asperities touch in one pixel it has their mean colour: no pattern of the pixels
    beats with that of the asperities.

    points : (n, 2) [a_H];  shades : (n, 4) colours;  pixels : across the map
    """
    from scipy.spatial import cKDTree  # 0.1 s to import: only when asked

    x = edge * ((np.arange(pixels) + 0.5) / pixels * 2.0 - 1.0)
    places = np.stack(np.meshgrid(x, x), axis=-1)
    cell = 2.0 * edge / np.sqrt(np.count_nonzero(touching))  # none so near: outside them all
    _, nearest = cKDTree(points).query(places, distance_upper_bound=cell)
    shown = np.where(touching[:, None], shades, (1.0, 1.0, 1.0, 0.0))
    image = np.vstack((shown, np.zeros(4)))[nearest]
    bins = np.floor((points + edge) / (2.0 * edge) * pixels).astype(np.intp)
    inside = ((bins >= 0) & (bins < pixels)).all(axis=1)
    column, row = bins[inside].T
    place: Indices = row * pixels + column
    several = np.bincount(place, minlength=pixels**2)
    mean = [np.bincount(place, part, pixels**2) for part in shown[inside].T]
    crowded = several > 1
    image.reshape(-1, 4)[crowded] = (np.stack(mean, axis=1)[crowded].T / several[crowded]).T
    whole = (-edge, edge, -edge, edge)
    axes.imshow(image, origin="lower", extent=whole, interpolation="nearest")


def draw_density(axes: Axes, x: Array, y: Array, top: float, colour: str, word: str) -> None:
    """How many points lie where, the darker the more, and the median of y along x.

    top : of y
    """
    columns = int(np.clip(len(x) / 50, 20, 80))
    rows = int(np.clip(len(x) / 50, 20, 60))
    span = (float(x.min()), float(x.max()))
    count, across, up = np.histogram2d(x, y, bins=(columns, rows), range=(span, (0.0, top)))
    most = count.max(axis=1, keepdims=True)
    share = np.sqrt(np.divide(count, most, out=np.zeros_like(count), where=most > 0))
    fading = LinearSegmentedColormap.from_list("density", [(1, 1, 1, 0), to_rgba(colour, 0.75)])
    axes.pcolormesh(across, up, share.T, cmap=fading, vmin=0.0, vmax=1.0, rasterized=True, lw=0)
    column = np.clip(np.searchsorted(across, x, side="right") - 1, 0, columns - 1)
    order = np.lexsort((y, column))
    starts = np.searchsorted(column[order], np.arange(columns + 1))
    held = np.flatnonzero(np.diff(starts))
    middle = np.array([np.median(y[order[starts[i] : starts[i + 1]]]) for i in held])
    centres = (across[held] + across[held + 1]) / 2.0
    axes.fill([], [], color=(*to_rgba(colour)[:3], 0.4), lw=0, label=word)
    axes.plot(centres, middle, color=colour, lw=1.3, label="their median")


def draw_discs(axes: Axes, centres: Array, radii: Array, label: str, **look: Any) -> None:
    """Discs of true size.

    centres : (n, 2) [a_H];  radii : (n,) [a_H]
    """
    discs = EllipseCollection(
        2.0 * radii,
        2.0 * radii,
        np.zeros(len(radii)),
        units="xy",
        offsets=centres,
        offset_transform=axes.transData,
        rasterized=len(radii) >= DENSE,
        label=label,
        **look,
    )
    axes.add_collection(discs, autolim=False)


def towards_rim() -> Array:
    """(81,) from -1 to 1, close together at both ends: a semicircle drawn over them is smooth."""
    return np.sin(np.linspace(-np.pi / 2, np.pi / 2, 81))


def abscissae(centres: Array, radii: Array, edge: float) -> Array:
    """x from -edge to edge, close together at the rims of the discs on y = 0, steep in pressure.

    centres : (n, 2) [length];  radii : (n,) [length], 0 where there is no disc
    """
    x, y = centres.T
    crossed = np.abs(y) < radii
    half_chord = np.sqrt(radii[crossed] ** 2 - y[crossed] ** 2)
    places = x[crossed, None] + np.outer(half_chord, towards_rim())
    return np.unique(np.append(places, [-edge, edge]))


def no_contact_figure(*labels: tuple[str, str], width: float = DOUBLE) -> Figure:
    """A panel for each pair of axis labels, and the words "no contact" in each."""
    figure = Figure(figsize=(width, 2.6), layout="constrained")
    for axes, (x, y) in zip(figure.subplots(1, len(labels), squeeze=False)[0], labels, strict=True):
        label(axes, x, y)
        say_no_contact(axes)
    return figure


def say_no_contact(axes: Axes) -> None:
    say_nothing(axes, "no contact")


def say_nothing(axes: Axes, why: str) -> None:
    """An empty panel, and why."""
    axes.set(xticks=[], yticks=[])
    place = axes.transAxes
    axes.text(0.5, 0.5, why, transform=place, fontsize=LABEL, ha="center", va="center")


def census(contact: Contact) -> str:
    """How many touch, and how sure that is."""
    words = f"touching: {np.count_nonzero(contact.loads):,} of {len(contact.loads):,}"
    return words + doubt(contact.certificate.scope, contact.status)


def doubt(scope: str, status: Any) -> str:
    """What is not proved of a state, in brackets; nothing if all is."""
    if scope == "none":
        return " (not proved)"
    unsure = int((status == "undecided").sum())
    return f" ({unsure:,} undecided)" if unsure else ""


def label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x, fontsize=LABEL)
    axes.set_ylabel(y, fontsize=LABEL)
    axes.tick_params(labelsize=TICK)


def legend_above(axes: Axes, markerscale: float = 1.0, ncols: int = 3) -> None:
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 0.99),
        ncols=ncols,
        fontsize=TICK,
        markerscale=markerscale,
        frameon=False,
        borderpad=0.2,
        columnspacing=1.0,
        handletextpad=0.4,
        handlelength=1.6,
    )


def quantity(value: float, unit: str) -> str:
    """Three digits and the unit, such as  4.12 × 10^-3 mm."""
    digits, _, exponent = f"{value:.2e}".partition("e")
    power = int(exponent)
    number = f"{value:.3g}" if -3 < power < 3 else f"${digits}\\times 10^{{{power}}}$"
    return f"{number} {literal(unit)}".strip()


def literal(text: str) -> str:
    """Text in which no dollar sign begins a formula."""
    return text.replace("$", r"\$")
