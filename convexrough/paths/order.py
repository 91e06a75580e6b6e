"""Order: no indentation falls as the load rises. Where it holds the memory curve is exact.

docs/theory/load-paths.md, "When it is exact".
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from convexrough.paths.levels import Levels

#: "proved" at all levels up to the highest; "proved at the levels used", so that the state solves
#: the program with one step per segment; "checked": seen at the levels used, but closer there than
#: the proved errors; "fails": an indentation falls, or falls at the rate of some level.
Order = Literal["proved", "proved at the levels used", "checked", "fails"]

#: A rate n_i' / D0' below minus this is not rounding.
RATE_ROUNDING = 1e-9


def order_of(levels: Levels) -> Order:
    """The order of the levels that a path has used."""
    if levels.crowding_bound <= 1.0:
        return "proved"
    indentations, errors = levels.indentation_bounds()
    rises, doubts = np.diff(indentations, axis=0), errors[1:] + errors[:-1]
    rates = [level.rate for level in levels.known[1:]]
    if (rises < -doubts).any() or min(rates, default=0.0) < -RATE_ROUNDING:
        return "fails"
    return "proved at the levels used" if (rises > doubts).all() else "checked"
