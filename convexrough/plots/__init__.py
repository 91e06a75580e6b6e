"""Figures of every stage, fit to print.

`..._figures` return figures by the stem of the file each belongs in; units are only said, never
converted. No global state of matplotlib is touched: save a figure, or show it in a notebook. Discs
of dense scenes are pixels inside a vector file: save that with a `dpi` too.

`plot` draws the main picture of any result into axes of your own; `contact.plot()` is the same.
"""

from convexrough.plots.axes import plot
from convexrough.plots.closed_path import phase_figures, steady_figures
from convexrough.plots.cycle import cycle_figures
from convexrough.plots.gradient import gradient_figures
from convexrough.plots.history import history_figures
from convexrough.plots.path import path_figures
from convexrough.plots.press import press_figures
from convexrough.plots.shakedown import shakedown_figures
from convexrough.plots.shear import shear_figures
from convexrough.plots.surface import provability_figure, surface_figures

__all__ = [
    "cycle_figures",
    "gradient_figures",
    "history_figures",
    "path_figures",
    "phase_figures",
    "plot",
    "press_figures",
    "provability_figure",
    "shakedown_figures",
    "shear_figures",
    "steady_figures",
    "surface_figures",
]
