"""The contact of a smooth ellipsoid on a half-space (docs/theory/bodies.md).

Source: Johnson, Contact Mechanics (1985), 3.5 and 4.2; Carlson's integrals R_D, R_F: DLMF 19.16.
"""

from __future__ import annotations

import math


def slenderness(ratio: float) -> float:
    """The ratio b / a <= 1 of the contact ellipse for radii with the ratio Rx / Ry >= 1."""
    from scipy.optimize import brentq
    from scipy.special import elliprd

    def excess(log: float) -> float:
        q = math.exp(2.0 * log)
        return math.log(elliprd(0.0, 1.0, q) / elliprd(0.0, q, 1.0) / ratio)

    # The ratio is 1 at b = a, and above Rx / Ry at b / a = Ry / Rx.
    return 1.0 if ratio == 1.0 else math.exp(brentq(excess, -math.log(ratio), 0.0, xtol=1e-15))


def semi_axes(
    load: float, contact_modulus: float, radii: tuple[float, float]
) -> tuple[float, float]:
    """[length] the semi-axes of the contact ellipse, a along x and b along y."""
    from scipy.special import elliprd

    largest = max(radii)
    q = slenderness(largest / min(radii))
    a = math.cbrt(load * largest / (math.pi * contact_modulus) * float(elliprd(0.0, q * q, 1.0)))
    return (a, q * a) if radii[0] == largest else (q * a, a)


def approach(load: float, contact_modulus: float, axes: tuple[float, float]) -> float:
    """[length] the approach delta of distant points of the two bodies."""
    from scipy.special import elliprf

    a, b = axes
    return 1.5 * load / (math.pi * contact_modulus) * float(elliprf(0.0, a * a, b * b))
