"""Check loads from another source: how large their errors are, and which claims are right.

The first loads are rounded to six digits. In the second, the load of one asperity is missing. The
certificate does not depend on how loads were computed.

    python examples/verify_anyones_loads.py
"""

import numpy as np

import convexrough as cr

Pairs = list[tuple[str, float, float]]


def compare() -> Pairs:
    """Return (quantity, computed value, reference value)."""
    material = cr.Material.from_youngs(210e9, 0.3)  # steel, SI units
    asperities = cr.Asperities.hexagonal(
        spacing=25e-6, tip_radius=2e-4, within=126e-6, height_std=1e-8, seed=1
    )
    scene = cr.Scene(0.01, asperities, material, geometry="summit")
    contact = cr.press(scene, approach=0.5e-6)

    # Six digits: every status is proved, and the error bound has the size of the rounding.
    six = np.array([float(f"{load:.5e}") for load in contact.loads])
    rounded = cr.certify(scene, six, approach=0.5e-6)

    # One load missing: its asperity is proved to touch, and its error bound is the missing load.
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
        ("one load missing: detected", float(missing), 1.0),
        ("one load missing: its bound", caught.load_errors[3], contact.loads[3]),
    ]


if __name__ == "__main__":
    for name, computed, reference in compare():
        print(f"{name:<46} {computed:8.3g} {reference:8.3g}")
