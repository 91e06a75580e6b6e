"""`result.plot()`: what draws is on a floor above, and is loaded when it is called."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Drawn:
    """A result with a picture of its own."""

    def plot(self, axes: Axes | None = None, **options: Any) -> Axes:
        """`convexrough.plots.plot` of this, which see: axes in, axes out."""
        from convexrough.plots import plot  # it loads matplotlib: only when asked

        return plot(self, axes, **options)

    def _picture(self) -> str:
        """A small map as an image of HTML, for which nothing is solved."""
        from convexrough.plots import thumbnail

        return thumbnail(self)
