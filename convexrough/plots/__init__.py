"""Figures of every stage, for print and notebooks.

Functions named `..._figures` return a dictionary from stems of file names to figures. If the scene
names its units, axes are in SI units with prefixes. No global state of matplotlib is changed.
`save` writes a figure; vector files of dense scenes contain pixels, so give a `dpi` for these too.

`plot` draws the main picture of a result into given axes; `contact.plot()` is the same.
"""

from convexrough.plots.axes import plot, thumbnail
from convexrough.plots.between import between
from convexrough.plots.cycle import cycle_figures
from convexrough.plots.fretting import fretting_figures
from convexrough.plots.gradient import gradient_figures
from convexrough.plots.load_plane import phase_figures, steady_figures
from convexrough.plots.notebook import save
from convexrough.plots.path import path_figures
from convexrough.plots.press import press_figures
from convexrough.plots.shakedown import shakedown_figures
from convexrough.plots.shear import shear_figures
from convexrough.plots.verdict import verdict_figures

__all__ = [
    "between",
    "cycle_figures",
    "fretting_figures",
    "gradient_figures",
    "path_figures",
    "phase_figures",
    "plot",
    "press_figures",
    "save",
    "shakedown_figures",
    "shear_figures",
    "steady_figures",
    "thumbnail",
    "verdict_figures",
]
