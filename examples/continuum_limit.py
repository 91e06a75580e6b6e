"""How rough must a rough sphere be?  From 61 asperities to Hertz, by refinement.

The source paper's lattice is refined k times: spacing and tip radii shrink together, the sphere and
its approach stay. Each asperity is softer than the solid it stands for, by a layer as thick as the
spacing b, so the sphere carries less than a smooth one; the difference fades with b. Richardson's
extrapolation of four loads to b = 0 meets Hertz's load, (4/3) E* sqrt(R) D0^(3/2), and friction
follows: the displacement at half the limiting shear force meets Mindlin's.

    python examples/continuum_limit.py

Every state is certified, and none takes more than a second.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import convexrough as cr

Array = NDArray[np.float64]
Pair = tuple[str, float, float]  # what it is, computed, reference

RADIUS, APPROACH, SPACING, FRICTION = 1.0, 5e-5, 0.0025, 0.5
REFINEMENTS = (8, 16, 32, 64)


def refined(k: float) -> cr.Scene:
    """The paper's lattice with k times as many asperities along each line."""
    asperities = cr.Asperities.hexagonal(
        spacing=SPACING / k, tip_radius=8 * SPACING / k, within=np.sqrt(2 * RADIUS * APPROACH)
    )
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    return cr.Scene(RADIUS, asperities, material, friction=FRICTION, geometry="summit")


def at_zero_spacing(values: list[float]) -> float:
    """Richardson's extrapolation: errors in powers of b, each refinement halving b."""
    table = np.array(values)
    for power in range(1, len(values)):
        table = table[1:] + (table[1:] - table[:-1]) / (2**power - 1)
    return float(table[0])


def compare() -> list[Pair]:
    """Extrapolated load and compliance against the smooth sphere's."""
    loads, ratios, proved = [], [], 0
    for k in REFINEMENTS:
        scene = refined(k)
        contact = cr.press(scene, approach=APPROACH)
        state = cr.shear(contact, force=0.5 * FRICTION * contact.load)
        smooth = cr.smooth(scene, load=contact.load)
        loads.append(contact.load)
        ratios.append(state.displacement / smooth.displacement(state.force))
        proved += contact.certificate.holds and state.certificate.holds
    hertz = 4 / 3 * np.sqrt(RADIUS) * APPROACH**1.5
    return [
        ("load at zero spacing", at_zero_spacing(loads), float(hertz)),
        ("displacement over Mindlin's", at_zero_spacing(ratios), 1.0),
        ("states proved", proved, len(REFINEMENTS)),
    ]


def main() -> None:
    for name, computed, reference in compare():
        print(f"{name:28}{computed:16.8e}{reference:16.8e}{computed / reference - 1:+13.2e}")


if __name__ == "__main__":
    main()
