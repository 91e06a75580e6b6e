"""An asperity that loses contact as the load rises, although no contact discs overlap.

A larger load brings two rough bodies closer together, so one expects asperities to make contact and
not to lose it. But tall neighbours also displace a short asperity between them. If the neighbours
have contact radii a_i and the short asperity is open, the derivative of its indentation by the
approach is

    1 - sum_i x_i / r_i,    sum_j K_ij x_j = 1,    K_ii = pi / (2 a_i),  K_ij = 1 / r_ij,

by differentiation of (1) in docs/theory/convexity.md. Here r_i is the distance of the short
asperity from neighbour i. For three equal neighbours at the distance r the derivative is negative
if their contact radius exceeds pi r / (2 (3 - 2 / sqrt(3))) = 0.851 r. Their discs overlap above
0.866 r. Random searches over positions and sizes of up to seven neighbours found no derivative
below -0.03; this script repeats a short search. In all cases found, contact discs nearly overlap
where the asperity loses contact. The model is not valid for overlapping discs.

    python examples/losing_contact.py
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

import convexrough as cr

Array = NDArray[np.float64]
Pairs = list[tuple[str, float, float]]


def rate(points: Array, radii: Array) -> float:
    """Derivative of the indentation of an open asperity at the origin by the approach."""
    apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, 2 * radii / np.pi)
    return float(
        1.0 - (1.0 / np.hypot(*points.T)) @ np.linalg.solve(1.0 / apart, np.ones(len(radii)))
    )


def fits(points: Array, radii: Array) -> bool:
    """True if no disc overlaps another or covers the open asperity."""
    apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    near = radii[:, None] + radii[None] <= apart
    return bool(near.all() and (radii > 0).all() and (radii <= np.hypot(*points.T)).all())


def least_rate(contacts: int, starts: int = 8, steps: int = 1500) -> float:
    """The smallest derivative that a random local search finds for this number of contacts."""
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
    """Contact radius over distance at which the gap of the asperity is smallest, from solutions."""
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
    """Return (quantity, computed value, reference value)."""
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
