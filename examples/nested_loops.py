"""A history with nested loops: which turning points the contact remembers, and which it forgets.

A small loop inside a large one closes. Once the force passes the point where the small loop began,
the contact behaves as if the small loop had never been (return-point memory). The total energy loss
is the sum over the loops.

    python examples/nested_loops.py
"""

import numpy as np

import convexrough as cr

Pairs = list[tuple[str, float, float]]


def compare() -> Pairs:
    """Return (quantity, computed value, reference value)."""
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025, tip_radius=0.02, within=0.0126, height_std=1e-6, tip_radius_cv=0.1, seed=7
    )
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    contact = cr.press(
        cr.Scene(1.0, asperities, material, friction=0.5, geometry="summit"), approach=5e-5
    )
    limit = 0.5 * contact.load

    plain = cr.history(contact, forces=np.array([0.6, -0.6, 0.6]) * limit)
    nested = cr.history(contact, forces=np.array([0.6, -0.2, 0.3, -0.1, 0.3, -0.6, 0.6]) * limit)

    # The loop from 0.3 to -0.1 is inside that from -0.2 to 0.3, which is inside 0.6 to -0.6.
    outer = cr.cycle(contact, maximum=0.6 * limit).loss
    middle = cr.cycle(contact, maximum=0.3 * limit, minimum=-0.2 * limit).loss
    inner = cr.cycle(contact, maximum=0.3 * limit, minimum=-0.1 * limit).loss
    spent = nested.losses[-1] - nested.losses[0]
    return [
        (
            "displacement at the end, over the plain one",
            float(nested.displacements[-1] / plain.displacements[-1]),
            1.0,
        ),
        (
            "largest force difference at the end",
            float(np.abs(nested.asperity_forces[-1] - plain.asperity_forces[-1]).max() / limit),
            0.0,
        ),
        ("energy, over the sum of the loops", float(spent / (outer + middle + inner)), 1.0),
    ]


if __name__ == "__main__":
    for name, computed, reference in compare():
        print(f"{name:<46} {computed:12.9g} {reference:12.9g}")
