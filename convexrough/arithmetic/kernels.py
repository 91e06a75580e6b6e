"""The residual of the contact law on balls, with one error bound instead of one per operation."""

from __future__ import annotations

import numpy as np

from convexrough.arithmetic.balls import TINY, UP, Ball, elementwise, positive, power_error
from convexrough.arithmetic.pairs import PAIR_ROUNDOFF, Pair, two_product, two_sum
from convexrough.arrays import Array


def residual(k: Ball, loads: Ball, displacement: Ball, offsets: Ball, approach: Ball) -> Ball:
    """k P^(2/3) + v - d - D for loads P (0 if negative), displacements v and offsets d."""
    return elementwise(_residual, k, loads, displacement, offsets, approach)


def _residual(
    k: Pair, dk: Array, P: Pair, dP: Array, v: Pair, dv: Array,
    d: Pair, dd: Array, D: Pair, dD: Array,
) -> tuple[Pair, Array]:  # fmt: skip
    """The residual. Its rounding error is below 64 squared roundoffs times `sizes`."""
    safe, loaded = positive(P)
    power = safe.two_thirds()
    slope = power.high / safe.high
    local, rest = two_product(k.high, power.high)
    rest = rest + (k.high * power.low + k.low * power.high)
    if safe is not P:
        local, rest = local * loaded, rest * loaded
    total, first = two_sum(local, v.high)
    total, second = two_sum(total, -d.high)
    total, third = two_sum(total, -D.high)
    low = (first + second + third) + (((rest + v.low) - d.low) - D.low)
    mid = Pair(*two_sum(total, low))
    sizes = np.abs(local) + (np.abs(v.high) + np.abs(d.high) + np.abs(D.high))
    radius = dk * power.high
    if dP.any():
        off = power_error(P, dP, dP * slope, lambda x: np.cbrt(x) ** 2)
        radius = radius + (np.abs(k.high) + dk) * off
    lost = PAIR_ROUNDOFF * sizes + TINY * (1.0 + np.abs(k.high) * slope)
    return mid, (radius * UP + (dv + dd + dD) + lost) * UP
