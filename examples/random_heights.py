"""Compute how random heights change the energy loss of a cycle at a given load.

With equal heights the rough contact loses less energy than a smooth sphere at small amplitudes, and
more at large ones. With random heights fewer asperities carry the load, and some carry little.
These slide at small forces, so the loss increases at every amplitude, most of all at small ones.
The script prints means over eight surfaces for four standard deviations of the heights.

    python examples/random_heights.py

Each loss is checked against the indentation curve of the same surface: it must be 8 c_t f^2 times
the error of the trapezoid rule on this curve, which is computed without shear.
"""

import numpy as np

import convexrough as cr

Pairs = list[tuple[str, float, float]]

LOAD, FRICTION, NU = 3.6e-7, 0.5, 0.3
SPREADS = (0.0, 1e-6, 2e-6, 4e-6)
FRACTIONS = np.array([0.1, 0.3, 0.5, 0.8])


def surface(height_std: float, seed: int) -> cr.Scene:
    """A scene with equal tips and random heights of this standard deviation."""
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025, tip_radius=0.02, within=0.0152, height_std=height_std, seed=seed
    )
    return cr.Scene(
        1.0,
        asperities,
        cr.Material(contact_modulus=1.0, poisson_ratio=NU),
        FRICTION,
        geometry="summit",
    )


def loss_from_indentation(scene: cr.Scene, fraction: float) -> float:
    """8 c_t f^2 times the trapezoid error of D0 over the loads from (1 - fraction) P to P."""
    ratio = (2 - NU) / (2 * (1 - NU))
    nodes, weights = np.polynomial.legendre.leggauss(32)
    half = fraction * LOAD / 2
    loads = LOAD - half + half * nodes
    area = half * weights @ [cr.press(scene, load=load).approach for load in loads]
    ends = [cr.press(scene, load=load).approach for load in ((1 - fraction) * LOAD, LOAD)]
    return float(8 * ratio * FRICTION**2 * (area - half * sum(ends)))


def compare() -> Pairs:
    """Return (quantity, computed value, reference value) of losses of single surfaces."""
    pairs = []
    for spread in SPREADS:
        scene = surface(spread, seed=0)
        contact = cr.press(scene, load=LOAD)
        assert contact.certificate.scope == "global"
        for fraction in (0.5, 0.8):
            cycle = cr.cycle(contact, maximum=fraction * FRICTION * contact.load)
            reference = loss_from_indentation(scene, fraction)
            name = f"loss over that of the indentation curve, heights {spread:g}, Q/(fP) {fraction}"
            pairs.append((name, cycle.loss / reference, 1.0))
    return pairs


def mean_losses(height_std: float, surfaces: int = 8) -> list[float]:
    """Mean over surfaces of the loss at FRACTIONS of f P, divided by that of the smooth sphere."""
    ratios = []
    for seed in range(surfaces):
        contact = cr.press(surface(height_std, seed), load=LOAD)
        cycles = cr.cycles(contact, FRACTIONS * FRICTION * contact.load)
        ratios.append([cycle.loss_normalised / cycle.smooth_normalised for cycle in cycles])
    return [float(mean) for mean in np.mean(ratios, axis=0)]


if __name__ == "__main__":
    print("loss over smooth, at Q/(fP) =", *(f"{fraction:8.1f}" for fraction in FRACTIONS))
    for spread in SPREADS:
        print(f"heights of spread {spread:<10g}", *(f"{x:8.4f}" for x in mean_losses(spread)))
    for name, computed, reference in compare():
        print(f"{name:<72} {computed:10.8f} {reference:4.1f}")
