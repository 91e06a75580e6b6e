"""The figure of a verdict: the map of asperities, with marks on wrong claims."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from convexrough.arrays import Array, Indices
from convexrough.friction.verdict import ShearVerdict
from convexrough.normal.claims import Claim
from convexrough.plots.asperity_map import CROWDED, Layer, draw_map, even_radii
from convexrough.plots.measure import Measure, measure
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import DOUBLE, SINGLE, TICK, UNSURE, legend_below, title
from convexrough.scene.scene import Scene
from convexrough.verdict import Verdict

#: Number of suspects that are numbered, likeliest first.
NUMBERED = 5

#: Shade of each status, told apart also in grey.
SHADES = {"open": "0.93", "contact": "0.72", "partial": "0.72", "sliding": "0.45"}
NAMES = {"partial": "partial slip"}

#: Marks of wrong claims: they differ in shape for print without colours.
MARKS = ["o", "X"]


def verdict_figures(verdict: Verdict, sheared: ShearVerdict | None = None) -> Figures:
    """The figure of a verdict.

    "verdict" : map of the proved statuses, marks on wrongly claimed asperities and indices of the
        likeliest suspects; a second map for shear forces, if they are claimed
    """
    claims: list[Claim] = [each for each in (verdict, sheared) if each is not None]
    width = SINGLE if len(claims) == 1 else DOUBLE
    figure = Figure(figsize=(width, 3.9), layout="constrained")
    for axes, claim in zip(figure.subplots(1, len(claims), squeeze=False)[0], claims, strict=True):
        draw_claim(axes, claim, verdict.scene)
    return Figures({"verdict": figure})


def draw_claim(axes: Axes, claim: Claim, scene: Scene) -> None:
    """Draw the map of one claim."""
    status, points = claim.status, scene.asperities.positions
    length = measure(float(np.ptp(points)), scene.units.length)
    size = even_radii(points, np.ones(len(points), dtype=bool))
    layers = [
        Layer(name, np.where(status == name, size, 0.0), shade)
        for name, shade in SHADES.items()
        if name in status
    ]
    draw_map(axes, points, layers, length)
    handles = [
        Line2D([], [], ls="", marker="o", ms=6, mec="0.4", mew=0.3, color=SHADES[each.status],
               label=NAMES.get(each.status, each.status)) for each in layers
    ]  # fmt: skip
    marked = list(zip(MARKS, claim.wrong.items(), strict=True))
    for mark, (what, those) in [*marked, ("^", ("undecided", claim.undecided))]:
        if len(those):
            handles.append(_mark(axes, length.of(points[those]), mark, f"{what} ({len(those):,})"))
    _number(axes, points, claim.suspects[:NUMBERED], length)
    verdict = "holds" if claim.holds else "does not hold"
    title(axes, f"{claim.many}: the claim {verdict}")
    legend_below(axes, handles=handles)


def _mark(axes: Axes, points: Array, mark: str, what: str) -> Line2D:
    size = float(np.clip(120.0 / np.sqrt(len(points)), 2.5, 7.0))
    (line,) = axes.plot(*points.T, mark, ls="", mfc="white", mec=UNSURE, mew=1.1, ms=size,
                        label=what, rasterized=len(points) > CROWDED)  # fmt: skip
    return line


def _number(axes: Axes, points: Array, suspects: Indices, length: Measure) -> None:
    """Write the index next to each suspect."""
    for i in suspects:
        place: Any = dict(xytext=(5, 5), textcoords="offset points", fontsize=TICK - 1)
        box = dict(boxstyle="round,pad=0.15", fc="white", ec="none", alpha=0.8)
        axes.annotate(str(i), tuple(length.of(points[i])), bbox=box, zorder=5, **place)
