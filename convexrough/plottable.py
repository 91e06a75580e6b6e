"""The method `plot` of results; it imports the plotting modules, a higher layer, when called."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Plottable:
    """A result that can be plotted."""

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the main figure of the result, as `convexrough.plots.plot`; return the axes."""
        from convexrough.plots import plot  # it imports matplotlib

        return plot(self, axes)

    def _picture(self) -> str:
        """A small map as an HTML image, made without solving anything."""
        from convexrough.plots import thumbnail

        return thumbnail(self)
