"""The shared look of the figures: sizes, colours, labels, legends, and the units of their axes.

Where the scene names its units, axes show metric units as SI units with suitable prefixes, and
other units unchanged. Where it does not, lengths are in a_H and pressures in p0 (contact radius and
peak pressure of the smooth sphere under the same load), shear forces in f P, and displacements and
energies in X0 and W0 of `Scale`. Where there is no finite smooth contact, lengths and pressures are
unchanged.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Number
from convexrough.contact import Contact
from convexrough.fields import peak_pressures
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import SmoothEllipsoid, smooth_reference
from convexrough.tabular.units import parsed

LABEL, TICK = 9, 8  # points
SINGLE, DOUBLE = 3.5, 7.0  # inches: one and two columns of a journal
COLOURS = "viridis_r"  # darkens steadily towards the peak, so that it also reads in grey
ROUGH, UNSURE = "#2b5c8a", "#c1440e"
SMOOTH, FAINT = "0.15", "0.65"  # greys
DASHED, DOTTED = (0, (4, 2.5)), (0, (1, 1.5))
#: Line patterns that tell up to six curves apart even without colour.
PATTERNS: Any = ("-", (0, (5, 1.5)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (7, 2, 2, 2)), "-")

#: Options of the legends of axes, and of those of figures ("outside" all axes), by their places.
LEGENDS: dict[str, dict[str, Any]] = {
    "inside": dict(loc="upper left"),
    "corner": dict(loc="lower left", fontsize=TICK - 1, frameon=True, handletextpad=0.2),
    "above": dict(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, borderpad=0.2,
                  columnspacing=1.0, handletextpad=0.4, handlelength=1.6),
    "below": dict(loc="upper center", bbox_to_anchor=(0.45, -0.2), ncols=2, fontsize=TICK - 1,
                  columnspacing=1.0, handletextpad=0.4),
    "outside": dict(handletextpad=0.5, columnspacing=1.4, borderpad=0.2),
}  # fmt: skip

#: SI units by their powers of length and force; and prefixes in ascending order.
SYMBOLS = {(1, 0): "m", (0, 1): "N", (-2, 1): "Pa", (1, 1): "J"}
PREFIXES = ("f", "p", "n", "µ", "m", "", "k", "M", "G", "T")


def label(axes: Axes, x: str, y: str) -> None:
    """Label the axes in the font size of print."""
    axes.set_xlabel(x, fontsize=LABEL)
    axes.set_ylabel(y, fontsize=LABEL)
    axes.tick_params(labelsize=TICK)
    for axis in (axes.xaxis, axes.yaxis):
        axis.get_offset_text().set_fontsize(TICK)


def title(axes: Axes, text: str, loc: Literal["left", "center"] = "left") -> None:
    axes.set_title(text, fontsize=TICK, loc=loc)


def ink() -> Any:
    """The colour of lines: `SMOOTH`, or in dark styles that of labels."""
    dark = np.mean(to_rgb(matplotlib.rcParams["axes.facecolor"])) < 0.4
    return matplotlib.rcParams["axes.labelcolor"] if dark else SMOOTH


def halo() -> tuple[AbstractPathEffect, ...]:
    """The path effects of texts on curves."""
    return (withStroke(linewidth=2.0, foreground=matplotlib.rcParams["axes.facecolor"]),)


def bar(axes: Axes, mapped: ScalarMappable, name: str, *, above: bool = False) -> None:
    """A colour bar, added to the right of the axes, with its name above it or along it."""
    found = axes.figure.colorbar(mapped, ax=axes, aspect=28, pad=0.02, ticks=round_ticks())
    label(found.ax, "", "" if above else name)
    if above:
        # Centred, a long name would leave the figure; 2.3 widths are at most where ticks end.
        found.ax.set_title(name, fontsize=TICK, loc="right", x=2.3)


def legend(where: Any, place: str, **more: Any) -> None:
    """Add a legend to axes or a figure, at a place of `LEGENDS`, with more options."""
    where.legend(**{"fontsize": TICK, "frameon": False, **LEGENDS[place], **more})


def disc_handle(colour: str, text: str) -> Line2D:
    """The legend entry of discs of this colour."""
    return Line2D([], [], ls="", marker="o", ms=6, mew=0.4, mec=SMOOTH, mfc=colour, label=text)


def round_ticks(most: int = 5, *, whole: bool = False) -> MaxNLocator:
    return MaxNLocator(most, steps=[1, 2, 5, 10], integer=whole)


def few_ticks(axes: Axes) -> None:
    """At most 6 ticks along each axis; each tick is measured several times when it is drawn."""
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(round_ticks())
        axis.isDefault_majloc = True  # names of categories replace it


def log_ticks(axis: Axis, most: int = 6) -> None:
    """At most so many ticks of a logarithmic axis: powers of ten and, if it is short, 2 and 5."""
    low, high = axis.get_view_interval()
    short = high < 50 * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if short else (1.0,), numticks=most))
    axis.set_major_formatter("{x:,g}" if short else LogFormatterSciNotation())
    axis.set_minor_formatter(NullFormatter())


def note(axes: Axes, text: str, place: Any, offset: Any, **look: Any) -> None:
    """Write a text near a place, at an offset in points."""
    how = {"textcoords": "offset points", "fontsize": TICK, **look}
    axes.annotate(text, place, xytext=offset, **how)


def write_beside(axes: Axes, text: str, place: Any) -> None:
    """Write a small text next to a place, readable on any background."""
    box = dict(boxstyle="round,pad=0.15", fc="white", ec="none", alpha=0.85)
    note(axes, text, place, (6, 6), fontsize=TICK - 1, color="black", bbox=box, zorder=5)


def say_nothing(axes: Axes, why: str = "no contact") -> None:
    """Write a reason into the middle of a panel, and remove the ticks of an empty one."""
    if not axes.has_data():
        axes.set(xticks=[], yticks=[])
    axes.text(0.5, 0.5, why, transform=axes.transAxes, fontsize=LABEL, ha="center", va="center",
              path_effects=halo())  # fmt: skip


def not_proved(state: Any) -> str:
    """A text in brackets on what is not proved about a state or contact; "" if all is proved."""
    if state.certificate.scope == "none":
        return " (not proved)"
    return f" ({n:,} undecided)" if (n := (state.status == "undecided").sum()) else ""


def doubtful(state: Any) -> NDArray[np.bool_]:
    """(n,) True for undecided asperities; if nothing is proved, only for those with a load."""
    unsure: NDArray[np.bool_] = state.status == "undecided"
    loads = getattr(state, "contact", state).loads
    return unsure & (loads > 0) if state.certificate.scope == "none" else unsure


def shades_of(count: int, low: float = 0.3) -> Array:
    """(count, 4) colours of curves, darker from first to last, all visible on white."""
    return np.asarray(matplotlib.colormaps[COLOURS](np.linspace(low, 1.0, count)))


class Measure(NamedTuple):
    """The unit of an axis: values are divided by `size`, which the label names.

    symbol : formula of the divisor, such as a_H, and `said` its value; or "", and `said` the unit
    """

    size: float = 1.0
    symbol: str = ""
    said: str = ""

    def of(self, values: Number) -> Number:
        """The values divided by `size`, as the axis shows them."""
        return values / self.size

    def short(self, name: str) -> str:
        """The label of an axis, without the value of the symbol."""
        if self.symbol:
            return f"${name}\\,/\\,{self.symbol}$"
        return f"${name}$  [{literal(self.said)}]" if self.said else f"${name}$"

    def label(self, name: str) -> str:
        """The label of an axis, with the unit or the value of the symbol."""
        known = f"  (${self.symbol.strip('()')}$ = {self.said})" if self.symbol else ""
        return self.short(name) + known


def measure(size: float, unit: str, symbol: str = "") -> Measure:
    """The measure of an axis with values up to `size`.

    A metric `unit` becomes an SI unit with a prefix; another unit stays. Without a unit, values are
    divided by `size`, whose formula is `symbol`; without unit and symbol, values are not divided.
    """
    if known := _metric(unit):
        name, exponent = known
        si = abs(size) * 10.0**exponent  # a power of a thousand scales it to 1 to 1000
        si = si if 0 < si < math.inf else 1.0
        step = int(np.clip(math.floor(math.log10(si * (1 + 1e-12)) / 3), -5, 4))
        return Measure(10.0 ** (3 * step - exponent), "", f"{PREFIXES[step + 5]}{name}")
    if unit or not symbol:
        return Measure(1.0, "", unit)
    return Measure(size or 1.0, symbol, quantity(size, ""))


def quantity(value: float, unit: str) -> str:
    """The value to three digits with its unit, such as 4.12 µm (SI) or 4.12 × 10^-3 in."""
    if value and _metric(unit):
        prefixed = measure(float(f"{value:.3g}"), unit)
        return f"{prefixed.of(value):.3g} {prefixed.said}"
    number, _, power = f"{value:.3g}".partition("e")
    if power:
        number = f"${number}\\times 10^{{{int(power)}}}$"
    return f"{number} {literal(unit)}".strip()


def literal(text: str) -> str:
    """Text in which no dollar sign begins a formula."""
    return text.replace("$", r"\$")


def _metric(unit: str) -> tuple[str, int] | None:
    """The SI unit of which a unit is 10^power, and the power; None for other units."""
    if (known := parsed(unit)) is None:
        return None
    power = round(math.log10(known.size))
    name = SYMBOLS.get((known.length, known.force))
    return (name, power) if name and known.size * 10 ** (-power) == 1 else None


class Scale:
    """The measures of a contact's figures, and the smooth contact under the same load.

    sphere : the smooth sphere or ellipsoid, or None;  name : its name in legends
    points, length : (n, 2) [length] the contact points, and the measure of lengths
    axes   : semi-axes [length] of the smooth contact, or ()
    typical, peak : radius and peak pressure of the smooth contact, or of the circle about the
        origin that holds all contacts, and of the asperities
    """

    def __init__(self, contact: Contact) -> None:
        self.contact, self.units = contact, contact.scene.units
        self.points = contact.scene.contact_points
        self.sphere = smooth_reference(contact.scene, contact.load) if contact.load else None
        self.name, symbols, self.axes = "smooth sphere", ("", ""), tuple[float, ...]()
        most = float(peak_pressures(contact).max())
        if self.sphere is not None:
            self.typical, self.peak = self.sphere.contact_radius, self.sphere.peak_pressure
            symbols, self.axes = ("a_H", "p_0"), (self.typical, self.typical)
            if isinstance(self.sphere, SmoothEllipsoid):
                self.name, self.axes = "smooth ellipsoid", self.sphere.semi_axes
        else:
            rims = (self.distances + contact.contact_radii)[contact.loads > 0]
            self.typical, self.peak = float(rims.max(initial=0.0)), most
        self.length = measure(self.typical, self.units.length, symbols[0])
        pressure = self.units.name("pressure")
        self.pressure = measure(most if pressure else self.peak, pressure, symbols[1])

    @property
    def distances(self) -> Array:
        """(n,) [length] distances of all contact points from the origin."""
        return np.asarray(np.hypot(*self.points.T))

    @cached_property
    def limit(self) -> float:
        """[force] the friction limit f P."""
        return checks.friction(self.contact.scene.friction) * self.contact.load

    @cached_property
    def travel(self) -> float:
        """[length] X0: displacement at gross sliding of the smooth contact, if any, or of this."""
        if self.sphere is not None:
            return float(self.sphere.displacement(self.limit))
        scene = self.contact.scene  # X0 = c_t f times the approach from first touch
        first = self.contact.approach + float(scene.offsets.max())
        c_t = float(mindlin.ratio(scene.material.poisson_ratio))
        return c_t * checks.friction(scene.friction) * first

    @property
    def work(self) -> float:
        """W0 = 24/5 f P X0 [force length]; for a sphere 9 (2 - nu) f^2 P^2 / (5 G a_H)."""
        return 4.8 * self.limit * self.travel

    @property
    def force(self) -> Measure:
        """The measure of shear forces."""
        return measure(self.limit, self.units.force, "(fP)")

    @property
    def displacement(self) -> Measure:
        """The measure of displacements along the shear."""
        return measure(self.travel, self.units.length, "X_0")

    def energy(self, largest: float) -> Measure:
        """The measure of energies up to the largest."""
        unit, symbol = self.units.name("work"), "W_0" if self.sphere else "(4.8\\,fPX_0)"
        return measure(largest if unit else self.work, unit, symbol)

    def footnote(self) -> str:
        """A line that says what f P and X0 are."""
        whose = f"the {self.name}'s" if self.sphere else "this contact's"
        X0 = quantity(self.travel, self.units.length)
        limit = quantity(self.limit, self.units.force)
        return f"$fP$ = {limit},   $X_0$ = {X0}: {whose} $X$ at gross sliding"
