"""Times of solvers, and of the methods for a load path."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from convexrough.compare import Comparison
from convexrough.friction.side_by_side import PathComparison, PathEntry
from convexrough.plots.style import ROUGH, TICK, UNSURE, label


def draw_times(axes: Axes, comparison: Comparison | PathComparison) -> None:
    """Draw a dot at the time of each entry; one without a result has its outcome as text."""
    rows = [_took(entry) for entry in comparison.entries]
    for place, (_, seconds, outcome) in enumerate(rows):
        if seconds is None:
            axes.text(0.02, place, outcome, transform=axes.get_yaxis_transform(),
                      va="center", fontsize=TICK, color=UNSURE)  # fmt: skip
        else:
            axes.plot(seconds, place, "o", color=ROUGH, clip_on=False)
    axes.set(xscale="log", ylim=(len(rows) - 0.5, -0.5))
    axes.set_yticks(range(len(rows)), [name for name, *_ in rows], fontsize=TICK)
    if times := [seconds for _, seconds, _ in rows if seconds]:  # whole decades: the axis is short
        powers = np.floor(np.log10(min(times))), np.ceil(np.log10(1.01 * max(times)))
        axes.set_xlim(*(10.0**power for power in powers))
        axes.xaxis.set_major_locator(LogLocator(numticks=4))
        axes.xaxis.set_minor_formatter(NullFormatter())
    label(axes, "time [s]", "")


def _took(entry: Any) -> tuple[str, float | None, str]:
    if isinstance(entry, PathEntry):
        return entry.way, entry.seconds if entry.path else None, entry.outcome
    return entry.solver, entry.contact.seconds if entry.contact else None, entry.outcome
