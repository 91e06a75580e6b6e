"""The figure of a verdict: the array, with those marked that are not what is claimed."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.friction.verdict import ShearVerdict
from convexrough.normal.claims import Claim
from convexrough.plots.style import DOUBLE, SINGLE, TICK, UNSURE, label, literal, round_ticks
from convexrough.verdict import Verdict

#: From so many asperities on each is a cell of a mosaic: dots would make a pattern of their own.
MOSAIC = 2000

#: Suspects that are numbered, likeliest first.
NUMBERED = 5

#: Open, touching or sticking, sliding; undecided. They also differ in grey.
SHADES = ["0.93", "0.72", "0.45"]

#: Marks of what is wrong: apart in shape, as colours are not in print.
MARKS = ["o", "X"]


def verdict_figures(
    verdict: Verdict, sheared: ShearVerdict | None = None, *, length_unit: str = ""
) -> dict[str, Figure]:
    """ "verdict" : map of the array, its proved words, and who is not as claimed; with that of the
    shear forces beside it where there is one. Numbers are the likeliest suspects'.

    Units are only said, never converted.
    """
    claims: list[Claim] = [each for each in (verdict, sheared) if each is not None]
    width = SINGLE if len(claims) == 1 else DOUBLE
    figure = Figure(figsize=(width, 3.9), layout="constrained")
    points = verdict.scene.asperities.positions
    for axes, claim in zip(figure.subplots(1, len(claims), squeeze=False)[0], claims, strict=True):
        draw_claim(axes, claim, points, length_unit)
    return {"verdict": figure}


def draw_claim(axes: Axes, claim: Claim, points: Array, length_unit: str = "") -> None:
    """The map of one claim."""
    unit = f"  [{literal(length_unit)}]" if length_unit else ""
    label(axes, f"$x${unit}", f"$y${unit}")
    words = claim.status
    shades = np.select([words == "open", words == "sliding"], [0, 2], default=1)
    margin = 0.04 * float(np.ptp(points, axis=0).max()) or 1.0
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    low, high = (low + high) / 2 - (high - low).max() / 2, (low + high) / 2 + (high - low).max() / 2
    shown = np.unique(shades[words != "undecided"])
    names = ["open", "contact" if "contact" in words else "partial slip", "sliding"]
    if len(points) < MOSAIC:
        size = float(np.clip(150.0 / np.sqrt(len(points)), 2.5, 11.0))
        for shade in shown:
            chosen = points[(shades == shade) & (words != "undecided")]
            look = dict(ms=size, mec="0.4", mew=0.3, color=SHADES[shade])
            axes.plot(*chosen.T, "o", ls="", label=names[shade], **look)
    else:
        size = 5.0
        _draw_mosaic(axes, points, shades, low, high)
        for shade in shown:
            axes.plot(
                [], [], "s", ms=6, mec="0.4", mew=0.3, color=SHADES[shade], label=names[shade]
            )
    for mark, (what, who) in zip(MARKS, claim.wrong.items(), strict=True):
        _mark(axes, points[who], mark, size, f"{what} ({len(who):,})")
    _mark(axes, points[claim.undecided], "^", size, f"undecided ({len(claim.undecided):,})")
    _number(axes, points, claim.suspects[:NUMBERED])
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.xaxis.set_major_locator(round_ticks(5))
    axes.yaxis.set_major_locator(round_ticks(5))
    verdict = "holds" if claim.holds else "does not hold"
    kind = "shear forces" if isinstance(claim, ShearVerdict) else "loads"
    axes.set_title(f"{kind}: the claim {verdict}", fontsize=TICK, loc="left")
    legend: Any = dict(loc="upper left", bbox_to_anchor=(-0.02, -0.17), ncols=2, fontsize=TICK - 1)
    axes.legend(frameon=False, columnspacing=1.0, handletextpad=0.3, **legend)


def _mark(axes: Axes, points: Array, mark: str, size: float, what: str) -> None:
    if len(points):
        look: Any = dict(ms=0.8 * size, mew=1.1, mec=UNSURE, rasterized=len(points) > MOSAIC)
        axes.plot(*points.T, mark, ls="", mfc="white", label=what, **look)


def _number(axes: Axes, points: Array, suspects: Indices) -> None:
    """The indices of the likeliest suspects, beside them."""
    for i in suspects:
        x, y = points[i]
        place: Any = dict(xytext=(5, 5), textcoords="offset points", fontsize=TICK - 1)
        box = dict(boxstyle="round,pad=0.15", fc="white", ec="none", alpha=0.8)
        axes.annotate(str(i), (x, y), bbox=box, zorder=5, **place)


def _draw_mosaic(
    axes: Axes, points: Array, shades: NDArray[np.intp], low: Array, high: Array
) -> None:
    """Each place in the shade of the nearest asperity; white far from all."""
    from scipy.spatial import cKDTree  # 0.1 s to import: only when asked

    pixels = 700
    x, y = np.linspace(low, high, pixels).T
    tree = cKDTree(points)
    apart = np.asarray(tree.query(points[:: max(1, len(points) // 1000)], k=2)[0])[:, 1]
    places = np.stack(np.meshgrid(x, y), axis=-1)
    distances, nearest = map(
        np.asarray, tree.query(places, distance_upper_bound=1.5 * float(np.median(apart)))
    )
    shown = np.ma.masked_where(np.isinf(distances), np.append(shades, 0)[nearest])
    whole = (low[0], high[0], low[1], high[1])
    axes.imshow(shown, origin="lower", extent=whole, cmap=ListedColormap(SHADES), vmin=0, vmax=2,
                interpolation="nearest")  # fmt: skip
