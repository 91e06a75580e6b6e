"""Refine a rough sphere until it behaves as a smooth one.

The lattice of Dini and Hills (2009) is refined k times: spacing and tip radii become smaller in
proportion, while the sphere and its approach stay the same. An asperity is more compliant than the
solid material in its place, as if there were a soft layer of the thickness of the spacing b. So the
rough sphere carries less load than a smooth one, and the difference vanishes with b. Richardson's
extrapolation of four loads to b = 0 gives Hertz's load, (4/3) E* sqrt(R) D0^(3/2). In the same
limit the displacement at half the limiting shear force tends to Mindlin's.

    python examples/continuum_limit.py

Every state is certified. The finest has 120,000 asperities in contact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import convexrough as cr

Array = NDArray[np.float64]
Pair = tuple[str, float, float]  # name, computed value, reference value

RADIUS, APPROACH, SPACING, FRICTION = 1.0, 5e-5, 0.0025, 0.5
REFINEMENTS = (8, 16, 32, 64)


def refined(k: float) -> cr.Scene:
    """The lattice of Dini and Hills with k times as many asperities along each line."""
    asperities = cr.Asperities.hexagonal(
        spacing=SPACING / k, tip_radius=8 * SPACING / k, within=np.sqrt(2 * RADIUS * APPROACH)
    )
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    return cr.Scene(RADIUS, asperities, material, friction=FRICTION, geometry="summit")


def at_zero_spacing(values: list[float]) -> float:
    """Richardson's extrapolation for an error in powers of b, where each refinement halves b."""
    table = np.array(values)
    for power in range(1, len(values)):
        table = table[1:] + (table[1:] - table[:-1]) / (2**power - 1)
    return float(table[0])


def compare() -> list[Pair]:
    """Compare extrapolated load and displacement with those of the smooth sphere."""
    loads, ratios, proved = [], [], 0
    for k in REFINEMENTS:
        scene = refined(k)
        contact = cr.press(scene, approach=APPROACH)
        state = cr.shear(contact, force=0.5 * FRICTION * contact.load)
        smooth = cr.smooth(scene, load=contact.load)
        loads.append(contact.load)
        ratios.append(state.displacement / smooth.displacement(state.force))
        proved += contact.certificate.all_proved and state.certificate.all_proved
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
