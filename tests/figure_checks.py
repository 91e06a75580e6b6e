"""What a figure shows once it is drawn."""

from itertools import combinations
from typing import Any

from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.text import Text


def texts(figure: Figure) -> list[Text]:
    """Every text that is drawn, after drawing the figure."""
    figure.draw_without_rendering()
    ticks, found = set(), []
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            slack = 1e-9 * (high - low)
            ticks |= {label for tick in axis.get_major_ticks() for label in tick.findobj(Text)}
            for place, tick in zip(axis.get_majorticklocs(), axis.get_major_ticks(), strict=True):
                if low - slack <= place <= high + slack:
                    found += [tick.label1, tick.label2]
    others = [t for t in figure.findobj(Text) if isinstance(t, Text) and t not in ticks]
    return [t for t in found + others if t.get_visible() and t.get_text().strip()]


def fits(*figures: Figure) -> None:
    """Every text is of a size to print, inside its figure, and clear of every other."""
    for figure in figures:
        boxes = {text: text.get_window_extent() for text in texts(figure)}
        for text, box in boxes.items():
            assert 6 < float(text.get_fontsize()) < 10
            assert figure.bbox.padded(1).contains(box.x0, box.y0), text
            assert figure.bbox.padded(1).contains(box.x1, box.y1), text
        for one, other in combinations(boxes, 2):
            assert not boxes[one].overlaps(boxes[other]), (one, other)


def discs(axes: Any, label: str) -> int:
    """How many discs bear this label."""
    named = [each for each in axes.collections if each.get_label() == label]
    return sum(len(each.get_offsets()) for each in named if isinstance(each, EllipseCollection))
