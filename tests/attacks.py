"""Wrong loads that a certificate is given, and what they cost."""

from typing import Any

import multiprecision
import numpy as np
from flint import arb, ctx

import convexrough as cr
from convexrough.arrays import Array


def excess(scene: cr.Scene, loads: Array, exact: Any, total: float | None = None) -> float:
    """The energy of loads, in many digits scaled to a prescribed total, above that of `exact`."""
    with ctx.workdps(120):
        given = [arb(float(load)) for load in loads]
        if total is not None:
            given = [arb(total) * each / sum(given) for each in given]
        one, other = (
            multiprecision.energy(scene, each, exact.approach) for each in (given, exact.loads)
        )
        return float((one - other).mid())


def attack(kind: str, loads: Array, rng: np.random.Generator) -> Array:
    """Wrong loads: each a mistake that a user or a solver could make."""
    wrong = loads.copy()
    loaded = np.flatnonzero(loads)
    if kind == "dropped" and len(loaded):
        wrong[rng.choice(loaded)] = 0.0
    elif kind == "smallest dropped" and len(loaded):
        wrong[loaded[np.argmin(loads[loaded])]] = 0.0
    elif kind == "added":
        wrong[rng.integers(len(loads))] += loads.max() * 10.0 ** rng.uniform(-16, 0)
    elif kind == "perturbed":
        wrong *= 1 + 10.0 ** rng.uniform(-15, -1) * rng.standard_normal(len(loads))
        wrong = np.maximum(wrong, 0.0)
    elif kind == "swapped":
        i, j = rng.integers(len(loads), size=2)
        wrong[[i, j]] = wrong[[j, i]]
    elif kind == "zero":
        wrong[:] = 0.0
    elif kind == "random":
        wrong = loads.max() * rng.random(len(loads)) ** 4
    elif kind == "huge":
        wrong = loads * 1e6
    elif kind == "scaled":
        wrong = loads * (1 + rng.uniform(-0.1, 0.1))
    elif kind == "rounded":
        digits = int(rng.integers(1, 16))
        wrong = np.array([float(f"{load:.{digits}e}") for load in loads])
    elif kind == "single precision":
        wrong = loads.astype(np.float32).astype(np.float64)
    return wrong


ATTACKS = (
    *("none", "dropped", "smallest dropped", "added", "perturbed", "swapped", "zero", "random"),
    *("huge", "scaled", "rounded", "single precision"),
)
