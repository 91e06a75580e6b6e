"""The shared look of the figures: sizes, colours, labels, legends, bars, numbered points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike

from convexrough.arrays import Array
from convexrough.plots.measure import literal as literal
from convexrough.plots.notebook import Figures, panels

LABEL, TICK = 9, 8  # points
SINGLE, DOUBLE = 3.5, 7.0  # inches: one and two columns of a journal
COLOURS = "viridis_r"  # darkens steadily towards the peak, so that it also reads in grey
ROUGH, UNSURE = "#2b5c8a", "#c1440e"
SMOOTH, FAINT = "0.15", "0.65"  # greys
DASHED, DOTTED = (0, (4, 2.5)), (0, (1, 1.5))

#: Largest numbers of points that are numbered, and that are marked.
MOST_NUMBERS, MOST_DOTS = 12, 60


def label(axes: Axes, x: str, y: str) -> None:
    """Label the axes in the font size of print."""
    axes.set_xlabel(x, fontsize=LABEL)
    axes.set_ylabel(y, fontsize=LABEL)
    axes.tick_params(labelsize=TICK)
    for axis in (axes.xaxis, axes.yaxis):
        axis.get_offset_text().set_fontsize(TICK)


def title(axes: Axes, text: str, loc: Literal["left", "center"] = "left") -> None:
    axes.set_title(text, fontsize=TICK, loc=loc)


def bar(axes: Axes, mapped: ScalarMappable, name: str, *, above: bool = False) -> Colorbar:
    """A colour bar, added to the right of the axes, with its name above it or along it."""
    found = axes.figure.colorbar(mapped, ax=axes, aspect=28, pad=0.02)
    found.ax.tick_params(labelsize=TICK)
    found.ax.yaxis.get_offset_text().set_fontsize(TICK)
    if above:
        title(found.ax, name, "center")
    else:
        found.set_label(name, fontsize=LABEL)
    return found


def round_ticks(most: int = 6, *, whole: bool = False) -> MaxNLocator:
    return MaxNLocator(most, steps=[1, 2, 5, 10], integer=whole)


def few_ticks(axis: Axis) -> None:
    """Label at most 6 powers of ten; on a short axis also 2 and 5 times these."""
    low, high = axis.get_view_interval()
    subs = (1.0, 2.0, 5.0) if high / low < 50 else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=6))
    axis.set_major_formatter(LogFormatterSciNotation() if len(subs) == 1 else "{x:g}")
    axis.set_minor_formatter(NullFormatter())


def legend_inside(axes: Axes) -> None:
    axes.legend(loc="upper left", fontsize=TICK, frameon=False)


def legend_above(axes: Axes, ncols: int = 3) -> None:
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=ncols, fontsize=TICK,
                frameon=False, borderpad=0.2, columnspacing=1.0, handletextpad=0.4,
                handlelength=1.6)  # fmt: skip


def legend_below(axes: Axes, ncols: int = 2, **more: Any) -> None:
    axes.legend(loc="upper center", bbox_to_anchor=(0.45, -0.2), ncols=ncols, fontsize=TICK - 1,
                frameon=False, columnspacing=1.0, handletextpad=0.4, **more)  # fmt: skip


def disc_handle(colour: str, text: str) -> Line2D:
    """The legend entry of discs of this colour."""
    return Line2D([], [], ls="", marker="o", ms=6, mew=0.4, mec=SMOOTH, mfc=colour, label=text)


def write_beside(axes: Axes, text: str, place: ArrayLike) -> None:
    """Write a small text next to a place, readable on any background."""
    x, y = np.asarray(place)
    box = dict(boxstyle="round,pad=0.15", fc="white", ec="none", alpha=0.85)
    axes.annotate(text, (x, y), xytext=(6, 6), textcoords="offset points", fontsize=TICK - 1,
                  bbox=box, zorder=5)  # fmt: skip


def legend_outside(figure: Any, handles: Sequence[Any], place: str, ncols: int) -> None:
    """Add one legend for all panels."""
    figure.legend(handles=list(handles), loc=f"outside {place}", ncols=ncols, fontsize=TICK,
                  frameon=False, handletextpad=0.5, columnspacing=1.4, borderpad=0.2)  # fmt: skip


def no_contact(*stems: str) -> Figures:
    """Figures under these names, each with the text that nothing touches."""
    figures = Figures()
    for stem in stems:
        figures[stem], (axes,) = panels(SINGLE, 2.6)
        say_nothing(axes)
    return figures


def say_nothing(axes: Axes, why: str = "no contact") -> None:
    """Write a reason into an empty panel, and remove the ticks."""
    axes.set(xticks=[], yticks=[])
    axes.text(0.5, 0.5, why, transform=axes.transAxes, fontsize=LABEL, ha="center", va="center")


def not_proved(scope: str, status: Any) -> str:
    """A text in brackets on what is not proved about a state; "" if all is proved."""
    if scope == "none":
        return " (not proved)"
    unsure = int((status == "undecided").sum())
    return f" ({unsure:,} undecided)" if unsure else ""


def shades_of(count: int, low: float = 0.3) -> Array:
    """(count, 4) colours of curves, darker from first to last, all visible on white."""
    return np.asarray(matplotlib.colormaps[COLOURS](np.linspace(low, 1.0, count)))


def mark_points(axes: Axes, x: Array, y: Array) -> None:
    """Mark points with dots and numbers, if there are few points.

    Dots are drawn for at most `MOST_DOTS` points, numbers for at most `MOST_NUMBERS`. Points at
    nearly the same place share a label.
    """
    if len(x) <= MOST_DOTS:
        axes.plot(x, y, "o", ms=3.5, color=SMOOTH, clip_on=False, zorder=3)
    if len(x) > MOST_NUMBERS:
        return
    size = np.array([np.ptp(x) or 1.0, np.ptp(y) or 1.0]) / _inches(axes)
    spots = np.column_stack((x, y)) / size
    groups: dict[int, list[int]] = {}
    for i, spot in enumerate(spots):
        near = [j for j in groups if np.hypot(*(spots[j] - spot)) < 0.06]
        groups.setdefault(near[0] if near else i, []).append(i)
    taken = [spots[i] for i in groups]
    halo = [withStroke(linewidth=2.0, foreground="white")]
    for i, group in groups.items():
        text = ", ".join(str(1 + each) for each in group)
        sides = np.deg2rad([90, -90, 45, -45, 135, -135, 0, 180])
        reach = 0.12 + 0.03 * len(text) * np.abs(np.cos(sides))
        places = spots[i] + np.column_stack((np.cos(sides), np.sin(sides))) * reach[:, None]
        clear = [min(float(np.hypot(*(place - each))) for each in taken) for place in places]
        best = next((k for k, gap in enumerate(clear) if gap > 0.11), int(np.argmax(clear)))
        taken.append(places[best])
        axes.annotate(text, (x[i], y[i]), xytext=tuple((places[best] - spots[i]) * 72.0),
                      textcoords="offset points", fontsize=TICK, ha="center", va="center",
                      path_effects=halo)  # fmt: skip


def _inches(axes: Axes) -> Array:
    """(2,) approximate width and height [inches] of the axes after layout."""
    width, height = axes.get_figure().get_size_inches()  # type: ignore[union-attr]
    place = axes.get_position()
    return np.array([0.75 * place.width * width, 0.75 * place.height * height])


def draw_density(axes: Axes, x: Array, y: Array, top: float, label: str) -> None:
    """Draw the density of points and the median of y along x; `top` is the upper end of y."""
    columns = int(np.clip(len(x) / 50, 20, 80))
    rows = int(np.clip(len(x) / 50, 20, 60))
    span = (float(x.min()), float(x.max()))
    count, across, up = np.histogram2d(x, y, bins=(columns, rows), range=(span, (0.0, top)))
    most = count.max(axis=1, keepdims=True)
    share = np.sqrt(np.divide(count, most, out=np.zeros_like(count), where=most > 0))
    fading = LinearSegmentedColormap.from_list("density", [(1, 1, 1, 0), to_rgba(ROUGH, 0.75)])
    axes.pcolormesh(across, up, share.T, cmap=fading, vmin=0.0, vmax=1.0, rasterized=True, lw=0)
    column = np.clip(np.searchsorted(across, x, side="right") - 1, 0, columns - 1)
    filled = np.unique(column)
    middle = [np.median(y[column == each]) for each in filled]
    axes.fill([], [], color=(*to_rgba(ROUGH)[:3], 0.4), lw=0, label=label)
    axes.plot((across[filled] + across[filled + 1]) / 2, middle, color=ROUGH, lw=1.3,
              label="median")  # fmt: skip


def towards_rim() -> Array:
    """(81,) abscissae from -1 to 1, dense at both ends so that a semicircle looks smooth."""
    return np.sin(np.linspace(-np.pi / 2, np.pi / 2, 81))


def abscissae(centres: Array, radii: Array, edge: float) -> Array:
    """Abscissae from -edge to edge, dense at the rims of discs on y = 0, where pressure is steep.

    centres : (n, 2) [length];  radii : (n,) [length], 0 for no disc
    """
    x, y = centres.T
    crossed = np.abs(y) < radii
    half_chord = np.sqrt(radii[crossed] ** 2 - y[crossed] ** 2)
    places = x[crossed, None] + np.outer(half_chord, towards_rim())
    return np.unique(np.append(places, [-edge, edge]))
