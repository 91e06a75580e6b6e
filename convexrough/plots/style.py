"""The shared look of the figures: sizes, colours, labels, ticks, legends, bars."""

from __future__ import annotations

from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike, NDArray

from convexrough.arrays import Array
from convexrough.plots.measure import literal as literal

LABEL, TICK = 9, 8  # points
SINGLE, DOUBLE = 3.5, 7.0  # inches: one and two columns of a journal
COLOURS = "viridis_r"  # darkens steadily towards the peak, so that it also reads in grey
ROUGH, UNSURE = "#2b5c8a", "#c1440e"
SMOOTH, FAINT = "0.15", "0.65"  # greys
DASHED, DOTTED = (0, (4, 2.5)), (0, (1, 1.5))

#: Options of the legends of axes, and of those of figures ("outside" all axes), by their places.
LEGENDS: dict[str, dict[str, Any]] = {
    "inside": dict(loc="upper left"),
    "above": dict(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, borderpad=0.2,
                  columnspacing=1.0, handletextpad=0.4, handlelength=1.6),
    "below": dict(loc="upper center", bbox_to_anchor=(0.45, -0.2), ncols=2, fontsize=TICK - 1,
                  columnspacing=1.0, handletextpad=0.4),
    "outside": dict(handletextpad=0.5, columnspacing=1.4, borderpad=0.2),
}  # fmt: skip


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
    label(found.ax, "", "" if above else name)
    if above:
        title(found.ax, name, "center")
    return found


def legend(where: Any, place: str, **more: Any) -> None:
    """Add a legend to axes or a figure, at a place of `LEGENDS`, with more options."""
    where.legend(**{"fontsize": TICK, "frameon": False, **LEGENDS[place], **more})


def disc_handle(colour: str, text: str) -> Line2D:
    """The legend entry of discs of this colour."""
    return Line2D([], [], ls="", marker="o", ms=6, mew=0.4, mec=SMOOTH, mfc=colour, label=text)


def round_ticks(most: int = 6, *, whole: bool = False) -> MaxNLocator:
    return MaxNLocator(most, steps=[1, 2, 5, 10], integer=whole)


def write_beside(axes: Axes, text: str, place: ArrayLike) -> None:
    """Write a small text next to a place, readable on any background."""
    x, y = np.asarray(place)
    box = dict(boxstyle="round,pad=0.15", fc="white", ec="none", alpha=0.85)
    axes.annotate(text, (x, y), xytext=(6, 6), textcoords="offset points", fontsize=TICK - 1,
                  bbox=box, zorder=5)  # fmt: skip


def say_nothing(axes: Axes, why: str = "no contact") -> None:
    """Write a reason into an empty panel, and remove the ticks."""
    axes.set(xticks=[], yticks=[])
    axes.text(0.5, 0.5, why, transform=axes.transAxes, fontsize=LABEL, ha="center", va="center")


def not_proved(state: Any) -> str:
    """A text in brackets on what is not proved about a state or contact; "" if all is proved."""
    if state.certificate.scope == "none":
        return " (not proved)"
    unsure = np.count_nonzero(state.status == "undecided")
    return f" ({unsure:,} undecided)" if unsure else ""


def doubtful(state: Any) -> NDArray[np.bool_]:
    """(n,) True for undecided asperities; if nothing is proved, only for those with a load."""
    unsure: NDArray[np.bool_] = state.status == "undecided"
    loads = getattr(state, "contact", state).loads
    return unsure & (loads > 0) if state.certificate.scope == "none" else unsure


def shades_of(count: int, low: float = 0.3) -> Array:
    """(count, 4) colours of curves, darker from first to last, all visible on white."""
    return np.asarray(matplotlib.colormaps[COLOURS](np.linspace(low, 1.0, count)))
