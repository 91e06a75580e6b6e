"""Rough frictional contact as one convex program, with a proof of which asperities touch.

Nothing is imported before it is used: the command line starts at once, and an interrupt finds no
import half done. The public names are listed in `__init__.pyi`.

In the examples of docstrings `cr` is this package and `np` numpy, `scene` is that of `Scene` and
`contact` that of `press`: the source paper's, of which 37 of 61 asperities touch; `new_scene` is
what `convexrough new` writes, and `folder` is an empty folder.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
