"""Estimate the scatter of a loss from its gradient, and find where the estimate fails.

The heights vary independently with a common standard deviation. To first order, the standard
deviation of the loss is that of the heights times the length of the gradient of the loss. This
estimate needs no sampling. It holds as long as the deviation of the heights is small compared with
the smallest gap and the smallest indentation. For larger deviations, asperities make and lose
contact, and the estimate is too small. But the first-order term is still a good control variate:
its mean over the random heights is 0, so subtract it, multiplied by a fitted coefficient, from
every sample and average the remainder.

    python examples/scatter_of_heights.py --samples 400
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import convexrough as cr

Array = NDArray[np.float64]
Pair = tuple[str, float, float]  # name, computed value, reference value

LOAD, FRICTION, FRACTION = 3.60853389e-7, 0.5, 0.5
SMALL, LARGE = 1e-7, 1e-6  # [length] 0.2 % and 2 % of the approach


def scene() -> cr.Scene:
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    return cr.Scene(1.0, asperities, cr.Material(1.0, 0.3), FRICTION, geometry="summit")


def loss(heights: Array) -> cr.Cycle:
    mean = scene()
    a = mean.asperities
    there = replace(mean, asperities=cr.Asperities(a.positions, a.tip_radii, heights))
    return cr.cycle(cr.press(there, load=LOAD), maximum=FRACTION * FRICTION * LOAD)


def sampled(deviation: float, samples: int) -> tuple[Array, Array]:
    """Losses for random heights, and first-order estimates, over the loss of equal heights."""
    equal = loss(np.zeros(61))
    slopes = equal.gradient(holding="load").heights
    rng = np.random.default_rng(0)
    heights = deviation * rng.normal(size=(samples, 61))
    found = np.array([loss(each).loss for each in heights])
    return found / equal.loss, 1.0 + heights @ slopes / equal.loss


def estimated(deviation: float) -> float:
    """The standard deviation of the loss to first order."""
    equal = loss(np.zeros(61))
    length = np.linalg.norm(equal.gradient(holding="load").heights)
    return float(deviation * length / equal.loss)


def unexplained(found: Array, first_order: Array) -> float:
    """The fraction of the standard deviation that remains with the control variate."""
    centred, known = found - found.mean(), first_order - first_order.mean()
    rest = centred - (centred @ known) / (known @ known) * known
    return float(rest.std() / centred.std())


def compare(samples: int = 60) -> list[Pair]:
    """The first order is right for small deviations only; a control variate helps for both."""
    small, large = sampled(SMALL, samples), sampled(LARGE, samples)
    return [
        ("small: deviation over estimate", small[0].std() / small[1].std(), 1.0),
        ("small: rest with a control variate < 0.1", float(unexplained(*small) < 0.1), 1.0),
        ("large: first order fails by a fifth", float(large[1].std() < 0.85 * large[0].std()), 1.0),
        ("large: rest with a control variate < 0.8", float(unexplained(*large) < 0.8), 1.0),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description="the scatter of a loss")
    parser.add_argument("--samples", type=int, default=200)
    samples: int = parser.parse_args().samples
    for deviation in (SMALL, LARGE):
        found, first = sampled(deviation, samples)
        print(f"heights {deviation:g}: loss {found.mean():.4f} of that of equal ones")
        print(f"  deviation  {found.std():.4f}, estimate {estimated(deviation):.4f}")
        print(f"  left by a control variate  {unexplained(found, first):.2f} of this deviation")


if __name__ == "__main__":
    main()
