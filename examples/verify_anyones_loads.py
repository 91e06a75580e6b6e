"""Judge loads from somewhere else: how wrong they are, and which of their claims hold.

The loads of a colleague come with six digits, those of an old program with one asperity forgotten.
The certificate needs to know nothing of either. `python examples/verify_anyones_loads.py`
"""

import numpy as np

import convexrough as cr

Pairs = list[tuple[str, float, float]]


def compare() -> Pairs:
    """(quantity, computed, reference)."""
    material = cr.Material.from_youngs(210e9, 0.3)  # steel, SI units
    asperities = cr.Asperities.hexagonal(
        spacing=25e-6, tip_radius=2e-4, within=126e-6, height_std=1e-8, seed=1
    )
    scene = cr.Scene(0.01, asperities, material, geometry="summit")
    contact = cr.press(scene, approach=0.5e-6)

    # Six digits: every word can still be proved, and the bound is of the size of the rounding.
    six = np.array([float(f"{load:.5e}") for load in contact.loads])
    rounded = cr.certify(scene, six, approach=0.5e-6)

    # One asperity forgotten: it is proved to touch all the same, and the bound is what it carries.
    forgotten = contact.loads.copy()
    forgotten[3] = 0.0
    caught = cr.certify(scene, forgotten, approach=0.5e-6)
    missing = contact.loads[3] <= caught.load_errors[3] and caught.status[3] == "contact"
    return [
        ("six digits: proved", float(rounded.holds), 1.0),
        (
            "six digits: bound covers",
            float(rounded.load_error >= abs(six - contact.loads).max()),
            1,
        ),
        (
            "six digits: bound below 1e-4 of the largest",
            float(rounded.load_error < 1e-4 * six.max()),
            1.0,
        ),
        ("one forgotten: noticed", float(missing), 1.0),
        ("one forgotten: its bound", caught.load_errors[3], contact.loads[3]),
    ]


if __name__ == "__main__":
    for name, computed, reference in compare():
        print(f"{name:<46} {computed:8.3g} {reference:8.3g}")
