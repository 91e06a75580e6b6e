"""Rough frictional contact as one convex program, with a proof of which asperities touch.

Each public name is imported when it is first used, so that the command line starts at once.
`__init__.pyi` lists the public names.

The examples in docstrings use these names: `cr` is this package and `np` is numpy; `scene` has the
61 asperities of the source paper (Dini and Hills 2009); `contact` is the contact in the example of
`press`, in which 37 asperities touch; `new_scene` is the scene file that `convexrough new` writes;
`folder` is an empty folder.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
