"""Figures of every stage, for print and notebooks.

Functions named `..._figures` return a dictionary from stems of file names to figures. If the scene
names its units, axes are in SI units with prefixes. No global state of matplotlib is changed.
`save` writes a figure; vector files of dense scenes contain pixels, so give a `dpi` for these too.

`plot` draws the main picture of a result into given axes; `contact.plot()` is the same.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
