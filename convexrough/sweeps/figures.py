"""Figures of quantiles of a measured number against a swept key."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.plots.notebook import new_axes
from convexrough.plots.style import DOUBLE, ROUGH, SMOOTH, TICK, UNSURE, legend
from convexrough.sweeps.batch import Columns

#: Quantiles that are drawn: the ends of the two bands and, in the middle, the line.
AT = (0.05, 0.25, 0.5, 0.75, 0.95)

#: Largest number of combinations of other swept keys that have bands of their own: if there are
#: more, all rows share one pair of bands. Number of bins of x, if x has many values.
MOST_BANDS, BINS = 4, 20

#: Colour, line and marker of each band; all differ also in grey.
LOOKS = ((ROUGH, "-", "o"), (UNSURE, "--", "s"), ("0.25", ":", "^"), ("#4f8a4f", "-.", "D"))


def draw_quantiles(
    columns: Columns, measured: str, over: str, others: Sequence[str], axes: Axes | None = None
) -> Axes:
    """Axes with the median, and bands from 5 to 95 % and 25 to 75 %, of rows that did not fail;
    the marker is open where a row is undecided.

    others : other swept keys that are not random. Up to `MOST_BANDS` combinations of their values
        have bands of their own; otherwise the legend states the number of combinations
    """
    axes = new_axes((0.65 * DOUBLE, 3.0)) if axes is None else axes
    checks.instance("axes", axes, Axes)
    names = list(dict.fromkeys(columns[over].tolist())) if columns[over].dtype.kind == "U" else []
    if names:
        axes.xaxis.update_units(names)  # type: ignore[no-untyped-call]  # in this order
    good = columns["status"] != "failed"
    rows = {name: values[good] for name, values in columns.items()}
    for (name, band), look in zip(_bands(rows, others), cycle(LOOKS), strict=False):
        _draw_band(axes, band[over], band[measured], band["status"] == "undecided", name, look)
    if (rows["status"] == "undecided").any():
        axes.plot([], [], "o", ms=5, color=SMOOTH, mfc="white", label="with undecided scenes")
    if failed := int(np.count_nonzero(~good)):
        axes.set_title(f"{failed:,} scenes failed", fontsize=TICK, loc="left")
    x = rows[over]
    if len(x) and x.dtype.kind != "U" and x.min() > 0 and x.max() > 30 * x.min():
        axes.set_xscale("log")
    low, high = axes.dataLim.intervaly
    if 0 < 300 * low < high:
        axes.set_yscale("log")
    axes.margins(x=0.02)
    if names:
        axes.set_xlim(-0.5, len(names) - 0.5)
    legend(axes, "above", ncols=2)
    return axes


def _bands(columns: Columns, others: Sequence[str]) -> Iterator[tuple[str, Columns]]:
    usual = "median, 25 to 75 %, 5 to 95 %"
    if others:
        keys = [key.partition(".")[2] for key in others]
        rows = np.array([columns[key] for key in others]).T
        different = np.unique(rows, axis=0)
        if len(different) <= MOST_BANDS:
            for values in different:
                some = (rows == values).all(axis=1)
                said = (f"{it:g}" if isinstance(it, float) else str(it) for it in values)
                name = ", ".join(map(" ".join, zip(keys, said, strict=True)))
                yield name, {key: column[some] for key, column in columns.items()}
            return
        usual += f"\nall {', '.join(keys)}: {len(different)} combinations"
    yield usual, columns


def _draw_band(
    axes: Axes, x: Any, y: Array, unsure: Any, name: str, look: tuple[str, str, str]
) -> None:
    colour, line, marker = look
    if len(x) == 0:
        return
    places, groups = _grouped(x)
    known = [y[each][np.isfinite(y[each])] for each in groups]
    rows = [np.quantile(part, AT) if len(part) else np.full(len(AT), np.nan) for part in known]
    low, lower, middle, upper, high = np.array(rows).T
    draw: Any = partial(axes.fill_between, color=colour, lw=0)
    if x.dtype.kind == "U":  # nothing joins names
        line, draw = "", partial(axes.vlines, color=colour, lw=8)
    if max(map(len, known)) > 1:
        draw(places, low, high, alpha=0.16)
        draw(places, lower, upper, alpha=0.30)
    axes.plot(places, middle, color=colour, ls=line, marker=marker, ms=3, lw=1.2, label=name)
    there = [unsure[each].any() for each in groups]
    axes.plot(np.array(places)[there], middle[there], marker, ms=5, color=colour, mfc="white")


def _grouped(x: Any) -> tuple[Any, list[Indices]]:
    """The values of x, and the rows of each value; for many values, the medians of x in bins."""
    if x.dtype.kind == "U":  # names, in the order of the sweep
        return (names := list(dict.fromkeys(x.tolist()))), [np.flatnonzero(x == it) for it in names]
    different, back = np.unique(x, return_inverse=True)
    if len(different) <= max(BINS, len(x) // 4):
        return different, [np.flatnonzero(back == i) for i in range(len(different))]
    bins = np.array_split(np.argsort(x), BINS)
    return np.array([np.median(x[each]) for each in bins]), bins
