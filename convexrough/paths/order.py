"""Order: no indentation falls as the load rises. Where it holds the memory curve is exact.

docs/theory/load-path-proofs.md, "When it is exact".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from convexrough.paths.levels import Level, Levels

#: "proved" at all levels up to the highest; "proved at the levels used", so that the state solves
#: the program with one step per segment; "checked": seen at the levels used, but closer there than
#: the proved errors; "fails": an indentation falls, or falls at the rate of some level.
Order = Literal["proved", "proved at the levels used", "checked", "fails"]

#: A rate n_i' / D0' below minus this is not rounding.
RATE_ROUNDING = 1e-9


def order_of(levels: Levels, used: Sequence[Level] | None = None) -> Order:
    """The order of the levels that a path has used, lowest first; default all that are known."""
    if levels.crowding_bound <= 1.0:
        return "proved"
    used = levels.known if used is None else used
    errors = np.array([level.indentation_errors for level in used])
    rises = np.diff([level.indentations for level in used], axis=0)
    doubts = errors[1:] + errors[:-1]
    rates = [level.rate for level in used if level.load > 0]
    if (rises < -doubts).any() or min(rates, default=0.0) < -RATE_ROUNDING:
        return "fails"
    return "proved at the levels used" if (rises > doubts).all() else "checked"
