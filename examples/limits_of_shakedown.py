"""Compute how far a load path may be scaled before sliding never ends, and compare two models.

In the exact model, the contact that forms below a load L* sticks for ever. An asperity slides in
every cycle if it first touches at a larger load. Melan's theorem assumes that asperities stick
elastically until they slide as a whole. Its limit is lower, because it gives a lightly loaded
asperity the shear force of a contact that sticks everywhere, although in fact the edge of the
contact slips first. The script also draws the maps shakedown.png and shakedown_map.png.

    python examples/limits_of_shakedown.py
"""

import numpy as np

import convexrough as cr
from convexrough import plots

Pairs = list[tuple[str, float, float]]

FRICTION = 0.5


def pressed() -> cr.Contact:
    """The array of Dini and Hills (2009) with Poisson's ratio 0."""
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.0)
    scene = cr.Scene(1.0, asperities, material, friction=FRICTION, geometry="summit")
    return cr.press(scene, approach=5e-5)


def compare() -> Pairs:
    """Return (quantity, computed value, reference value)."""
    contact = pressed()
    scene, P, last = contact.scene, contact.load, 31  # an asperity of ring A, the last to touch
    swing = FRICTION * P * np.array([1.0, -1.0])

    exact = cr.shakedown(scene, load=P, force_amplitudes=swing)
    elastic = cr.shakedown(scene, load=P, force_amplitudes=swing, kind="elastic")
    across = np.column_stack((0 * swing, swing))
    vector = cr.shakedown(scene, load=P, force_amplitudes=across, kind="vector")

    # On first loading the same asperity slides first, at the same force.
    onset = cr.onset_of_sliding(contact, which=[last])[0] / (FRICTION * P)

    # Melan's limit is lower because P_i(s) is convex and 0 at the load sigma at which the asperity
    # first touches: P_i(P) <= (P - sigma) P_i'(P).
    step = 1e-4 * P
    ahead, behind = (cr.press(scene, load=P + s).loads[last] for s in (step, -step))
    sigma = P * (1 - exact.factor)
    tangent = contact.loads[last] / ((ahead - behind) / (2 * step))

    # An ellipse about 0.9 P lowers L* by its factor times sqrt(0.1^2 + 0.2^2) times 0.9 P.
    ellipse = (1 - sigma / (0.9 * P)) / np.hypot(0.1, 0.2)

    # On first loading to 0.6 f P ring A slides. Then only the range of the force matters, not its
    # mean: a range 1 % below the limit changes no slip.
    high = 0.6 * FRICTION * P
    low = high - 0.99 * exact.factor * 2 * FRICTION * P
    slips = cr.history(contact, forces=[high, low, high, low]).slips
    moved = np.abs(np.diff(slips, axis=0)).max() / slips.max()

    # In a cycle 1 % above the limit ring A slides; 1 % below it no asperity does.
    above = cr.steady(scene, loads=[P, P], forces=1.01 * exact.factor * swing)
    below = cr.steady(scene, loads=[P, P], forces=0.99 * exact.factor * swing)
    return [
        ("exact limit over f P, ring A", exact.factor, float(onset)),
        ("elastic limit over f P: P_i / P_i' over P", elastic.factor, float(tangent / P)),
        ("elastic over exact", elastic.factor / exact.factor, float(tangent / (P - sigma))),
        ("vector friction at nu = 0", vector.factor, elastic.factor),
        ("sliding 1 % above", float((above.status == "sliding").sum()), 6),
        ("sliding 1 % below", float((below.status == "sliding").sum()), 0),
        ("slip that goes on after first loading", float(moved), 0.0),
        ("ellipse, factor of ring A", over_both_amplitudes().factor, ellipse),
    ]


def over_both_amplitudes() -> cr.Shakedown:
    """Shakedown of the same array if load and shear force vary, a quarter of a cycle apart."""
    contact = pressed()
    P = 0.9 * contact.load
    p, q = cr.elliptic_path(
        load=0.0, load_amplitude=0.1 * P, force_amplitude=0.2 * FRICTION * P, friction=FRICTION
    )
    return cr.shakedown(contact.scene, load=P, load_amplitudes=p, force_amplitudes=q)


if __name__ == "__main__":
    for name, computed, reference in compare():
        print(f"{name:<46} {computed:14.9g} {reference:14.9g}")
    for stem, figure in plots.shakedown_figures(over_both_amplitudes()).items():
        figure.savefig(f"{stem}.png", dpi=200)
