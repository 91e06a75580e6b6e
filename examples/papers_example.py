"""The source paper's example: press, shear, cycle, and its numbers beside ours.

Dini and Hills (2009) press a sphere on a hexagonal array of asperities and shear it by half of what
friction can bear. They solve it with a commercial nonlinear solver and a guessed active set; here
nothing is guessed, and every word is proved. `python examples/papers_example.py`
"""

import numpy as np

import convexrough as cr

Pairs = list[tuple[str, float, float]]


def compare() -> Pairs:
    """(quantity, computed, reference): the paper's counts, and an independent computation."""
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    scene = cr.Scene(1.0, asperities, material, friction=0.5, geometry="summit")

    # One convex program, solved; and its active set, proved by code that knows no solver.
    contact = cr.press(scene, approach=5e-5)
    assert contact.certificate.holds

    # Half of gross sliding. The pressed state is the certified starting point.
    limit = 0.5 * contact.load
    half = cr.shear(contact, force=0.5 * limit)
    assert half.certificate.holds
    onsets = cr.onset_of_sliding(contact) / limit

    # What a cycle of that amplitude costs, against a smooth sphere under the same load.
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
