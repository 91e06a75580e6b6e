"""What somebody claims, held against what is proved: who is off, who stands out, does it add up."""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Array, Indices, frozen

#: How far a sum may be off the prescribed total, relatively, unless `within` says so.
TOTAL_WITHIN = 1e-6

#: A suspect is off by at least this part of what the worst one is off by.
SUSPICIOUS = 1e-3


def total_agrees(given: float, prescribed: float, within: float | None) -> bool:
    """Whether a sum is the prescribed one."""
    return abs(given - prescribed) <= (within or TOTAL_WITHIN) * abs(prescribed)


def beyond(errors: Array, within: float | None, largest: float) -> Indices:
    """Those whose bounds are not within that part of the largest, largest bound first."""
    if within is None:
        return frozen(np.zeros(0, dtype=np.intp))
    order = np.argsort(-errors, kind="stable")
    return frozen(order[~(errors[order] <= within * largest)])


def standing_out(apart: Array, bounds: Array) -> Indices:
    """Those that are off by more than the solution may be, and not by little beside the worst."""
    least = np.maximum(np.where(np.isfinite(bounds), bounds, 0.0), SUSPICIOUS * apart.max())
    order = np.argsort(-apart, kind="stable")
    return frozen(order[(apart > least)[order]])
