"""Shakedown: asperities that slide on first loading and never again.

Shear the contact to 0.6 of the limiting force: the outer asperities slide. Then let the force
alternate with a range below twice the force at which the first of them slid. From the first
reversal on, all of them stick in part. The sliding has ended, although the largest force is as
large as before.

    python examples/shakedown_of_sliding.py
"""

import numpy as np

import convexrough as cr

Pairs = list[tuple[str, float, float]]


def compare() -> Pairs:
    """Return (quantity, computed value, reference value)."""
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    contact = cr.press(
        cr.Scene(1.0, asperities, material, friction=0.5, geometry="summit"), approach=5e-5
    )
    limit = 0.5 * contact.load
    first = cr.shear(contact, force=0.6 * limit)
    amplitude = float(np.nanmin(cr.onset_of_sliding(contact)))

    below = cr.cycle(contact, maximum=0.6 * limit, minimum=0.6 * limit - 1.99 * amplitude)
    above = cr.cycle(contact, maximum=0.6 * limit, minimum=0.6 * limit - 2.01 * amplitude)

    # In a steady cycle only the range of the force matters, not its mean.
    centred = cr.cycle(contact, maximum=0.995 * amplitude)

    # The history agrees: from one maximum to the next, slips do not change.
    low = 0.6 * limit - 1.99 * amplitude
    history = cr.history(contact, forces=[0.6 * limit, low, 0.6 * limit, low])
    moved = np.abs(np.diff(history.slips, axis=0)).max() / history.slips.max()
    return [
        ("sliding on first loading", float((first.status == "sliding").sum()), 6),
        ("sliding in the cycle below", float((below.status == "sliding").sum()), 0),
        ("sliding in the cycle above", float((above.status == "sliding").sum()), 6),
        ("loss, over that of the centred cycle", below.loss / centred.loss, 1.0),
        ("slip that goes on, relative", float(moved), 0.0),
    ]


if __name__ == "__main__":
    for name, computed, reference in compare():
        print(f"{name:<40} {computed:10.6g} {reference:10.6g}")
