"""An asperity that loses contact as the load rises, though no contact discs overlap.

More load brings two rough bodies together, so one expects contacts to be made, not lost. But a
short asperity amid tall ones is also carried down by them. With all contacts at contact radii a and
its own still open, its indentation changes with the approach at the rate

    1 - sum_i x_i / r_i,    sum_j K_ij x_j = 1,    K_ii = pi / (2 a_i),  K_ij = 1 / r_ij,

the derivative of w_i(P) = D_i (docs/theory/convexity.md, (1)), r_i its distance from contact i.
For three equal contacts at distance r it is negative from a = pi r / (2 (3 - 2 / sqrt(3))) on, or
0.851 r, and their discs first overlap at 0.866 r. Random searches over places and sizes of up to
seven contacts found no rate below -0.03; a short one is repeated here. So the window is narrow:
contact is lost only where the model is about to end. `python examples/losing_contact.py`
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

import convexrough as cr

Array = NDArray[np.float64]
Pairs = list[tuple[str, float, float]]


def rate(points: Array, radii: Array) -> float:
    """Of the indentation of an open asperity at the origin, over that of the approach."""
    apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, 2 * radii / np.pi)
    return float(
        1.0 - (1.0 / np.hypot(*points.T)) @ np.linalg.solve(1.0 / apart, np.ones(len(radii)))
    )


def fits(points: Array, radii: Array) -> bool:
    """No disc overlaps another, or covers the open asperity."""
    apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    near = radii[:, None] + radii[None] <= apart
    return bool(near.all() and (radii > 0).all() and (radii <= np.hypot(*points.T)).all())


def least_rate(contacts: int, starts: int = 8, steps: int = 1500) -> float:
    """The least that a random local search finds for so many contacts."""
    random = np.random.default_rng(contacts)
    least = 1.0
    for _ in range(starts):
        angles = 2 * np.pi * (np.arange(contacts) + random.uniform(0, 0.3, contacts)) / contacts
        points = np.column_stack((np.cos(angles), np.sin(angles)))
        radii, size = np.full(contacts, 0.05), 0.2
        here = rate(points, radii)
        for _ in range(steps):
            moved = points + random.normal(0, size, points.shape)
            grown = np.abs(radii + random.normal(0, size, contacts))
            if fits(moved, grown) and (there := rate(moved, grown)) < here:
                points, radii, here = moved, grown, there
            else:
                size = max(0.997 * size, 1e-4)
        least = min(least, here)
    return least


def radius_of_least_gap() -> float:
    """Contact radius over distance at which the asperity is nearest to touching, from solutions."""
    case = cr.gallery.case("losing-contact-touching")
    asperities, load = case.scene.asperities, float(case.exact_load)
    lower = asperities.heights - 1e-6 * np.array([1.0, 0.0, 0.0, 0.0])
    low = cr.Asperities(asperities.positions, asperities.tip_radii, lower)
    scene = cr.Scene(case.scene.sphere_radius, low, case.scene.material, geometry="summit")
    found = minimize_scalar(
        lambda part: cr.press(scene, load=part * load).gaps[0] * 1e6,
        bracket=(0.8, 1.0, 1.04),
        tol=1e-7,
    )
    contact = cr.press(scene, load=found.x * load)
    return float(contact.contact_radii[1] / np.hypot(*asperities.positions[1]))


def compare() -> Pairs:
    """(quantity, computed, reference)."""
    pairs: Pairs = []
    for stage, touching in (("before", 3), ("touching", 4), ("after", 3)):
        case = cr.gallery.case(f"losing-contact-{stage}")
        contact = cr.press(case.scene, load=case.load)
        pairs.append((f"touching, {stage}", float((contact.status == "contact").sum()), touching))
        pairs.append((f"open, {stage}", float((contact.status == "open").sum()), 4.0 - touching))
        pairs.append((f"discs overlap, {stage}", float(contact.crowding >= 1), 0.0))
    threshold = np.pi / (2 * (3 - 2 / np.sqrt(3)))
    pairs.append(("radius of the least gap, over the distance", radius_of_least_gap(), threshold))
    least = min(least_rate(contacts) for contacts in (2, 3, 4, 5))
    pairs.append(("a rate below 0 is found, and none below -0.04", float(-0.04 < least < 0), 1.0))
    return pairs


if __name__ == "__main__":
    for name, computed, reference in compare():
        print(f"{name:<46} {computed:12.9g} {reference:12.9g}")
