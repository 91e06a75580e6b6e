"""The example of Dini and Hills (2009): press, shear, cycle, and compare with their numbers.

They press a sphere on a hexagonal array of asperities, and shear it by half of the limiting shear
force. They solve the equations with a commercial nonlinear solver, starting from a guess of the
asperities that touch. Here nothing is guessed, and every status is proved.

    python examples/papers_example.py
"""

import numpy as np

import convexrough as cr

Pairs = list[tuple[str, float, float]]


def compare() -> Pairs:
    """Return (quantity, computed value, reference value), from the paper and independently."""
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    scene = cr.Scene(1.0, asperities, material, friction=0.5, geometry="summit")

    # Solve the convex program. The certificate proves which asperities touch, for any solver.
    contact = cr.press(scene, approach=5e-5)
    assert contact.certificate.all_proved

    # Shear by half of the limiting force.
    limit = 0.5 * contact.load
    half = cr.shear(contact, force=0.5 * limit)
    assert half.certificate.all_proved
    onsets = cr.onset_of_sliding(contact) / limit

    # The energy loss of a cycle of this amplitude, and that of a smooth sphere under this load.
    cycle = cr.cycle(contact, maximum=0.5 * limit)
    return [
        ("asperities in contact", float((contact.status == "contact").sum()), 37),
        ("total load", contact.load, 3.60853389e-7),
        ("load of the central asperity", contact.loads[0], 1.935817e-8),
        ("sliding at half of the limit", float((half.status == "sliding").sum()), 6),
        ("fraction at which the first ring slides", float(np.nanmin(onsets)), 0.352),
        ("loss per cycle, rough", cycle.loss_normalised, 0.00621),
        ("loss per cycle, smooth", cycle.smooth_normalised, 0.00587),
        ("1 + defect of the energy balance", 1 + cycle.balance_defect, 1.0),
    ]


if __name__ == "__main__":
    for name, computed, reference in compare():
        print(f"{name:<42} {computed:14.8g} {reference:14.8g}")
