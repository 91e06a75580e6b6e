"""One sphere under a shear force along x: traction and tangential displacement of the surface.

The theory is that of Cattaneo and Mindlin. Let Q be the shear force, P the load, f the coefficient
of friction, t = Q / (f P), p0 the peak pressure, a the contact radius and c = a (1 - |t|)^(1/3) the
stick radius. For t >= 0 the traction is

    q(r) = f p0 [sqrt(1 - r^2/a^2) - (c/a) sqrt(1 - r^2/c^2)],

without the second term for r > c. As t -> 0, both terms become equal. The functions use
1 - c^2/a^2 = 1 - (1 - |t|)^(2/3), from `mindlin.deflection`, and so keep their relative accuracy.
Source: Johnson, Contact Mechanics (1985), chapters 3 and 7.
"""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Number
from convexrough.sphere import hertz, mindlin


def traction(distance: Number, contact_radius: Number, share: Number, peak: Number) -> Number:
    """[force / length^2] q at a distance r from the centre, with the sign of t; 0 for r > a.

    share : t, from -1 to 1;  peak : f p0 [force / length^2]

    The code computes A - C = (A^2 - C^2) / (A + C), where A = sqrt(1 - r^2/a^2) and
    C = sqrt(c^2/a^2 - r^2/a^2). In the slip annulus, C = 0.
    """
    left_by_stick = np.abs(mindlin.deflection(share))  # 1 - c^2/a^2
    ratio = np.divide(distance, contact_radius)
    whole = np.maximum((1.0 - ratio) * (1.0 + ratio), 0.0)  # A^2
    roots = np.sqrt(whole) + np.sqrt(np.maximum(whole - left_by_stick, 0.0))
    shape = np.minimum(whole, left_by_stick) / np.where(roots > 0, roots, 1.0)
    return np.copysign(peak * shape, share)


def surface_displacement(
    x: Number,
    y: Number,
    contact_radius: Number,
    share: Number,
    peak: Number,
    shear_modulus: float,
    poisson_ratio: float,
) -> Number:
    """[length] the sum of the displacements of both surfaces along x, at the point (x, y).

    share : t, from -1 to 1;  peak : f p0 [force / length^2];  shear_modulus : G

    The traction q0 sqrt(1 - r^2/a^2) moves the surfaces, inside and outside the contact, by

        (q0/(4 G a)) {(2 - nu) [pi (a^2 - b^2) + r^2 (sin(2 phi)/2 - phi cos(2 phi))]
                      + (nu/2) (x^2 - y^2) [phi - sin(4 phi)/4]},   sin(phi) = b/r,  b = min(a, r)

    (Johnson 3.91; [A3] of Dini and Hills 2009, corrected). The stick disc subtracts the same
    expression with c in place of a, except in q0/a. To avoid cancellation, the difference of each
    bracket is computed from the angle phi_a - phi_c by the addition theorems of sine and cosine.
    """
    a_squared, r_squared = np.square(contact_radius), np.square(x) + np.square(y)
    # a^2 - c^2; all areas here are divided by pi
    slip_area = a_squared * np.abs(mindlin.deflection(share))
    b_area = np.maximum(slip_area - np.maximum(a_squared - r_squared, 0.0), 0.0)  # b_a^2 - b_c^2

    sine_a = np.sqrt(np.minimum(a_squared, r_squared))  # r sin(phi_a)
    cosine_a = np.sqrt(np.maximum(r_squared - a_squared, 0.0))
    sine_c = np.sqrt(np.maximum(np.square(sine_a) - b_area, 0.0))
    cosine_c = np.sqrt(np.square(cosine_a) + b_area)
    crossed = sine_a * cosine_c + sine_c * cosine_a
    between = np.arctan2(  # phi_a - phi_c
        r_squared * b_area / np.where(crossed > 0, crossed, 1.0),
        cosine_a * cosine_c + sine_a * sine_c,
    )
    phi_c = np.arctan2(sine_c, cosine_c)
    both = 2.0 * phi_c + between  # phi_a + phi_c

    even = (
        2.0 * phi_c * np.sin(both) * np.sin(between)
        + 2.0 * between * np.sin(both + between / 2.0) * np.sin(between / 2.0)
        - np.cos(both) * hertz.less_sine(between)
    )
    odd = hertz.less_sine(2.0 * between) / 2.0 + np.sin(2.0 * between) * np.square(np.sin(both))
    mean = (2.0 - poisson_ratio) * (np.pi * (slip_area - b_area) + r_squared * even)
    turned = poisson_ratio / 2.0 * (np.square(x) - np.square(y)) * odd
    size = peak / (4.0 * shear_modulus * contact_radius) * (mean + turned)
    return np.copysign(1.0, share) * size
