"""Maps of what each asperity does on a load path: discs, or a mosaic where they are many."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.plots.shear import SLIDING, SLIP, STICK, UNKNOWN
from convexrough.plots.style import (
    CROWDED,
    DENSE,
    SMOOTH,
    draw_discs,
    draw_mosaic,
    draw_open,
    frame_map,
)
from convexrough.scene.scene import Scene

#: The more it moves the darker, also in grey.
LOOKS = {
    "stuck": (STICK, "sticks"),
    "partial": (SLIP, "slips in part"),
    "sliding": (SLIDING, "slides"),
    "intermittent": ("#5b5b9a", "loses contact"),
    "undecided": (UNKNOWN, "undecided"),
}


def draw_words(axes: Axes, scene: Scene, radii: Array, words: NDArray[np.str_]) -> None:
    """Contacts in the colour of their word, open asperities as dots.

    radii : (n,) of contact [length]
    """
    points, touching = scene.contact_points, radii > 0
    reach = np.hypot(*points.T) + radii
    edge = 1.06 * float(reach[touching].max(initial=0.0) or reach.max() or 1.0)
    if int(touching.sum()) >= CROWDED:
        shades = np.array([to_rgba(LOOKS[word][0]) for word in LOOKS])
        which = np.array([list(LOOKS).index(word) if word in LOOKS else 0 for word in words])
        draw_mosaic(axes, points, shades[which], touching, edge, 320)
    else:
        draw_open(axes, points[~touching & (np.abs(points).max(axis=1) < edge)])
        many = int(touching.sum()) >= DENSE
        for word, (colour, _) in LOOKS.items():
            if (these := touching & (words == word)).any():
                rim: dict[str, Any] = {"edgecolors": SMOOTH, "linewidths": 0.0 if many else 0.4}
                draw_discs(axes, points[these], radii[these], word, facecolors=colour, **rim)
    frame_map(axes, edge)


def word_handles(words: NDArray[np.str_]) -> list[Line2D]:
    """For a legend: the words that there are."""
    return [
        Line2D([], [], ls="", marker="o", ms=6, mew=0.4, mec=SMOOTH, mfc=colour, label=text)
        for word, (colour, text) in LOOKS.items()
        if word in words
    ]
