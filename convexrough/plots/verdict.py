"""The figure of a verdict: the map of asperities, with marks on wrong claims."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from convexrough.arrays import Array
from convexrough.normal.claims import Claim
from convexrough.plots import style
from convexrough.plots.asperity_map import CROWDED, Layer, draw_map, even_radii
from convexrough.plots.measure import measure
from convexrough.plots.notebook import Figures, panels
from convexrough.plots.style import DOUBLE, SINGLE, UNSURE

#: The indices of at most this many suspects, the likeliest, are written.
NUMBERED = 5

#: Grey shade of each status.
SHADES = {"open": "0.93", "contact": "0.72", "partial": "0.72", "sliding": "0.45"}
NAMES = {"partial": "partial slip"}

#: Marks of wrong claims, different in shape for print without colours.
MARKS = ["o", "X"]


def verdict_figures(verdict: Claim, sheared: Claim | None = None) -> Figures:
    """The figure of a verdict.

    "verdict" : map of the proved statuses, with marks on wrongly claimed asperities and indices of
        the likeliest suspects; a second map for shear forces, if they are claimed

    >>> print(*cr.plots.verdict_figures(cr.verify(scene, contact.loads, approach=5e-5)))
    verdict
    """
    claims: list[Claim] = [each for each in (verdict, sheared) if each is not None]
    width = SINGLE if len(claims) == 1 else DOUBLE
    figure, maps = panels(width, 3.9, 1, len(claims))
    for axes, claim in zip(maps, claims, strict=True):
        draw_claim(axes, claim)
    return Figures({"verdict": figure})


def draw_claim(axes: Axes, claim: Claim) -> None:
    """Draw the map of one claim."""
    status, points = claim.status, claim.of.asperities.positions
    length = measure(float(np.ptp(points)), claim.of.units.length)
    size = even_radii(points, np.ones(len(points), dtype=bool))
    layers = [
        Layer(name, np.where(status == name, size, 0.0), shade)
        for name, shade in SHADES.items()
        if name in status
    ]
    draw_map(axes, points, layers, length)
    said = [each.status for each in layers]
    handles = [style.disc_handle(SHADES[status], NAMES.get(status, status)) for status in said]
    marked = list(zip(MARKS, claim.wrong.items(), strict=True))
    for mark, (what, those) in [*marked, ("^", ("undecided", claim.undecided))]:
        if len(those):
            handles.append(_mark(axes, length.of(points[those]), mark, f"{what} ({len(those):,})"))
    for i in claim.suspects[:NUMBERED]:
        style.write_beside(axes, str(i), length.of(points[i]))
    verdict = "holds" if claim.holds else "does not hold"
    style.title(axes, f"{claim.many}: the claim {verdict}")
    style.legend_below(axes, handles=handles)


def _mark(axes: Axes, points: Array, mark: str, what: str) -> Line2D:
    size = float(np.clip(120.0 / np.sqrt(len(points)), 2.5, 7.0))
    (line,) = axes.plot(*points.T, mark, ls="", mfc="white", mec=UNSURE, mew=1.1, ms=size,
                        label=what, rasterized=len(points) > CROWDED)  # fmt: skip
    return line
