"""The method `plot` of results. Only its call imports the plotting modules."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Plottable:
    """A result with a method `plot`."""

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the main figure of the result into `axes` (default: new ones); return the axes.

        docs/how-to/results.md, "Plots", lists the figures.

        >>> print(contact.plot().get_title(loc="left"))
        touching: 37 of 61
        """
        from convexrough.plots import plot  # it imports matplotlib

        return plot(self, axes)

    def _picture(self) -> str:
        """A small map of the result as an HTML image."""
        from convexrough.plots import thumbnail

        return thumbnail(self)
