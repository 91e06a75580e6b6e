"""Find the heights with the largest and the smallest energy loss by gradients.

A joint under a constant load takes an alternating shear force. Each of its sixty-one asperities may
be up to 2 % of the approach taller or shorter; their mean height is fixed. Which heights make a
cycle lose the most energy? The derivatives of the loss with respect to all heights cost only the
solution of two linear systems. Any gradient-based optimiser can be used. Equal heights are neither
the best nor the worst.

    python examples/design_a_damper.py --draw design.png
    python examples/design_a_damper.py --finer 4          # 955 asperities, ten seconds

The derivative with respect to the height of an open asperity is zero, so no optimiser raises it:
start from random heights, several times. Where an asperity makes contact the gradient has a kink,
so second derivatives do not exist there: use a method that needs only first derivatives, such as
L-BFGS-B.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import convexrough as cr

Array = NDArray[np.float64]
Pair = tuple[str, float, float]  # name, computed value, reference value

LOAD, FRICTION, FRACTION = 3.60853389e-7, 0.5, 0.5
FARTHEST = 1e-6  # [length] 2 % of the approach
SEEDS = (0, 2)


def scene(finer: int = 1) -> cr.Scene:
    """The scene of Dini and Hills (2009), or a finer lattice with the same crowding."""
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025 / finer, tip_radius=0.02 / finer, within=0.0102
    )
    return cr.Scene(1.0, asperities, cr.Material(1.0, 0.3), FRICTION, geometry="summit")


def design(sign: float, seed: int, finer: int = 1) -> tuple[Array, float, float]:
    """Heights of the largest (sign 1) or smallest (-1) loss, this loss, and the possible gain.

    The loss and the gain are relative to the loss of equal heights. The gain is that of the best
    further step, to first order. The unknowns of the optimiser are heights divided by FARTHEST,
    because optimisers need numbers of about 1.
    """
    force = FRACTION * FRICTION * LOAD
    loss = cr.Objective(scene=scene(finer), of="loss", load=LOAD, force=force)
    equal, _ = loss(loss.start)

    def cost(z: Array) -> tuple[float, Array]:
        value, slopes = loss(FARTHEST * z)
        return -sign * value / equal, -sign * slopes * FARTHEST / equal

    n = len(loss.start)
    start = np.random.default_rng(seed).uniform(-0.5, 0.5, n)
    bounds = [(-1.0, 1.0)] * n
    search: Any = minimize  # the type of `minimize` does not accept these constraints
    if finer == 1:
        level = {"type": "eq", "fun": np.mean, "jac": lambda z: np.full(n, 1 / n)}
        options: dict[str, float] = {"ftol": 1e-8, "maxiter": 60}
        found = search(
            cost, start, jac=True, method="SLSQP", bounds=bounds, constraints=level, options=options
        )
    else:  # the mean is free: under a prescribed load a shift of all heights changes nothing
        options = {"maxiter": 200, "ftol": 1e-9}
        found = search(cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    z = np.clip(found.x, -1.0, 1.0)
    value, slopes = cost(z)
    return FARTHEST * z, -sign * value, gain(z, -slopes)


def gain(z: Array, slopes: Array) -> float:
    """First-order gain of the best feasible step: raise one height and lower another.

    Heights stay within their bounds, and their mean is fixed by a shift of all heights.
    """
    low, high = slopes[z > -1 + 1e-9], slopes[z < 1 - 1e-9]
    return max(float(high.max() - low.min()), 0.0)


def compare() -> list[Pair]:
    """Largest and smallest loss from several starts; the gradient against a finite difference."""
    most = [design(1.0, seed) for seed in SEEDS]
    least = [design(-1.0, seed) for seed in SEEDS]
    pairs = [
        ("most, over equal heights", max(value for _, value, _ in most), 1.195),
        ("least, over equal heights", min(value for _, value, _ in least), 0.848),
        ("most, from another start", most[0][1], most[1][1]),
        ("no step gains another 1e-4", float(most[0][2] < 1e-4), 1.0),
    ]
    heights, _, _ = most[0]
    force = FRACTION * FRICTION * LOAD
    loss = cr.Objective(scene=scene(), of="loss", load=LOAD, force=force)
    along = np.random.default_rng(1).normal(size=len(heights)) * FARTHEST
    ends = [loss(heights + part * 1e-5 * along)[0] for part in (1, -1)]
    slope = float(loss(heights)[1] @ along)
    return [*pairs, ("slope along a direction", slope, (ends[0] - ends[1]) / 2e-5)]


def draw(path: str, finer: int = 1) -> None:
    """Draw the heights of the largest and the smallest loss as maps of the array."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, 2, figsize=(7.0, 3.3), layout="constrained", sharey=True)
    points = 1e3 * scene(finer).asperities.positions
    for axes, sign, word in zip(panels, (1.0, -1.0), ("most", "least"), strict=True):
        best = max((design(sign, seed, finer) for seed in SEEDS), key=lambda it: sign * it[1])
        look: dict[str, Any] = {"cmap": "viridis", "vmin": -1, "vmax": 1, "edgecolors": "0.3"}
        look |= {"linewidths": 0.4 / finer, "s": 110 / finer**2}
        loss = cr.Objective(scene=scene(finer), of="approach", load=LOAD)
        touch = loss.gradient(best[0]).contact.loads > 0
        dots = axes.scatter(*points[touch].T, c=best[0][touch] / FARTHEST, **look)
        rings = {name: look[name] for name in ("edgecolors", "linewidths", "s")}
        axes.scatter(*points[~touch].T, facecolors="none", **rings)  # open asperities
        axes.set(
            title=f"{word}: {best[1]:.3f} of equal heights", aspect="equal", xlabel="x / (R / 1000)"
        )
    panels[0].set_ylabel("y / (R / 1000)")
    figure.colorbar(dots, ax=panels, label="height / largest height allowed", shrink=0.85)
    figure.savefig(path, dpi=150)


def main() -> None:
    parser = argparse.ArgumentParser(description="heights of the largest and smallest loss")
    parser.add_argument("--draw", metavar="FILE", help="draw the heights")
    parser.add_argument("--finer", type=int, default=1, help="how many times finer the lattice is")
    given = parser.parse_args()
    if given.finer == 1:
        for name, computed, reference in compare():
            print(f"{name:32}{computed:16.6g}{reference:16.6g}")
    else:
        for sign, word in ((1.0, "most"), (-1.0, "least")):
            for seed in SEEDS:
                heights, value, left = design(sign, seed, given.finer)
                print(f"{len(heights):,} asperities: {word} {value:.4f} of equal heights, ", end="")
                print(f"and no step gains {left:.0e} more")
    if given.draw:
        draw(given.draw, given.finer)


if __name__ == "__main__":
    main()
