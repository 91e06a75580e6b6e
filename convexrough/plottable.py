"""`result.plot()`: the plotting modules are in a higher layer and are imported when called."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Plottable:
    """A result that can be plotted."""

    def plot(self, axes: Axes | None = None, **options: Any) -> Axes:
        """Draw the main figure of the result, as `convexrough.plots.plot`; return the axes."""
        from convexrough.plots import plot  # it loads matplotlib: only when asked

        return plot(self, axes, **options)

    def _picture(self) -> str:
        """A small map as an image of HTML, for which nothing is solved."""
        from convexrough.plots import thumbnail

        return thumbnail(self)
