"""Figures of a verdict, a map with marks on wrong claims, and of a comparison, which show times."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from convexrough import checks
from convexrough.comparison import Comparison
from convexrough.normal.claims import Claim
from convexrough.plots import asperity_map as maps
from convexrough.plots import style
from convexrough.plots.notebook import Figures, panels
from convexrough.plots.style import DOUBLE, ROUGH, SINGLE, TICK, UNSURE

#: The indices of at most this many suspects, the likeliest, are written.
NUMBERED = 5

#: Grey shade and label of each status.
SHADES: maps.Looks = {
    "open": ("0.93", "open"),
    "contact": ("0.72", "contact"),
    "partial": ("0.72", "partial slip"),
    "sliding": ("0.45", "sliding"),
}


def verdict_figures(verdict: Claim, sheared: Claim | None = None) -> Figures:
    """The figure of a verdict.

    "verdict" : map of the proved statuses, with marks on wrongly claimed asperities and indices of
        the likeliest suspects; a second map for shear forces, if they are claimed

    >>> print(*cr.plots.verdict_figures(cr.verify(scene, contact.loads, approach=5e-5)))
    verdict
    """
    claims = [verdict] if sheared is None else [verdict, sheared]
    for claim in claims:
        checks.instance("verdict", claim, Claim)
    figure, places = panels(SINGLE if sheared is None else DOUBLE, 3.9, 1, len(claims))
    for axes, claim in zip(places, claims, strict=True):
        draw_claim(axes, claim)
    return Figures({"verdict": figure})


def draw_claim(axes: Axes, claim: Claim) -> None:
    """Draw the map of one claim; marks of wrong claims differ also without colours."""
    status, points = claim.status, claim.of.asperities.positions
    length = style.measure(float(np.ptp(points)), claim.of.units.length)
    maps.draw_statuses(axes, points, length, status, maps.even_radius(points), looks=SHADES)
    handles = maps.status_handles(status, SHADES)
    marked = {**claim.wrong, "undecided": claim.undecided}
    for mark, (what, those) in zip("oX^", marked.items(), strict=True):
        if len(those):
            ms = float(np.clip(120.0 / np.sqrt(len(those)), 2.5, 7.0))
            handles += axes.plot(*length.of(points[those]).T, mark, mfc="white", mec=UNSURE,
                                 mew=1.1, ms=ms, label=f"{what} ({len(those):,})",
                                 rasterized=len(those) > maps.CROWDED)  # fmt: skip
    for i in claim.suspects[:NUMBERED]:
        style.write_beside(axes, str(i), length.of(points[i]))
    verdict = "holds" if claim.holds else "does not hold"
    style.title(axes, f"{claim.many}: the claim {verdict}")
    style.legend(axes, "below", handles=handles)


def draw_times(axes: Axes, comparison: Comparison) -> None:
    """Draw a dot at the time of each entry; one without a result has its outcome as text."""
    names = [entry.solver for entry in comparison.entries]
    for place, entry in enumerate(comparison.entries):
        if entry.contact is not None:
            axes.plot(entry.contact.seconds, place, "o", color=ROUGH, clip_on=False)
        else:
            axes.text(0.02, place, entry.outcome, transform=axes.get_yaxis_transform(),
                      va="center", fontsize=TICK, color=UNSURE)  # fmt: skip
    axes.set(xscale="log", ylim=(len(names) - 0.5, -0.5), xmargin=0.1)
    axes.set_yticks(range(len(names)), names, fontsize=TICK)
    style.log_ticks(axes.xaxis, most=4)
    style.label(axes, "time [s]", "")
