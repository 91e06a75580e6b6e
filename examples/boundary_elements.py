"""How good is the asperity model?  A boundary-element check that knows of no asperities.

The package replaces every asperity by a Hertz spring and its effect on the others by a point force.
Here the same shapes are pressed with none of that: a sphere on the envelope of the asperities, both
paraboloids, cut into square pixels of uniform pressure, on an elastic half-space. The pressure p is
the solution of a contact law over pixels instead of asperities:

    p >= 0,    g = K p - h >= 0,    p g = 0,

where h is how far the undeformed bodies would overlap at this approach and K is the half-space.
Pressure only ever pushes the surfaces apart, so a pixel with h <= 0 stays open.

    python examples/boundary_elements.py --pixels 512

What it shows on the source paper's scene (pixels to 2048, extrapolated; confirmed by a second
discretisation): the "closest" geometry misses the total load by -0.016 % and no ring by more than
0.25 %; the "summit" geometry by +0.33 %, but its outermost ring by -7.6 %.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import fft

import convexrough as cr

Array = NDArray[np.float64]
Pair = tuple[str, float, float]  # what it is, computed, reference

APPROACH = 5e-5
RINGS = "FEDCBA"  # the paper's names, from the axis outwards
CONTACT_MODULUS = 1.0
SPHERE_RADIUS = 1.0


class HalfSpace:
    """Pressures on a square of pixels to displacements at their centres, both bodies together.

    A pixel of uniform unit pressure displaces the surface by (1 / (pi E*)) times the integral of
    1/r over it, which Love (1929) has in closed form. The product with all pixels is a convolution:
    one Fourier transform on a square twice as wide, so that nothing wraps around.
    """

    def __init__(self, pixels: int, pixel_size: float, contact_modulus: float) -> None:
        self.pixels = pixels
        self.padded = fft.next_fast_len(2 * pixels - 1, real=True)
        steps = np.arange(self.padded)
        steps = np.minimum(steps, self.padded - steps)
        edges = (np.arange(steps.max() + 2) - 0.5) * pixel_size
        x, y = edges[:, None], edges[None, :]
        corner = x * np.arcsinh(y / abs(x)) + y * np.arcsinh(x / abs(y))  # d2/dxdy of it is 1/r
        influence = np.diff(np.diff(corner, axis=0), axis=1) / (np.pi * contact_modulus)
        # An even kernel has a real transform.
        self.symbol = fft.rfft2(influence[np.ix_(steps, steps)], workers=1).real.copy()

    def displacement(self, pressure: Array) -> Array:
        """K p; rows known to be zero, or not wanted, are not transformed."""
        n, padded = self.pixels, self.padded
        rows = fft.rfft(pressure, padded, axis=1, workers=1)
        waves = fft.fft(rows, padded, axis=0, workers=1)
        waves *= self.symbol
        rows = fft.ifft(waves, axis=0, overwrite_x=True, workers=1)[:n]
        return np.asarray(fft.irfft(rows, padded, axis=1, workers=1)[:, :n], dtype=np.float64)


def touch(half_space: HalfSpace, overlap: Array, start: Array, accuracy: float = 1e-6) -> Array:
    """The pressure that solves the contact law, by conjugate gradients on the touching pixels.

    Polonsky and Keer (Wear 231, 1999) at a given approach: step, cut negative pressures to zero,
    and let pixels back in where the bodies overlap; the directions start afresh when one comes in.
    Stops when |g| <= accuracy * max h where p > 0 and g >= -accuracy * max h where p = 0 < h.
    """
    allowed = overlap > 0
    pressure = np.where(allowed, start, 0.0)
    gap = half_space.displacement(pressure) - overlap
    direction = np.zeros_like(gap)
    previous = np.inf
    for _ in range(2000):
        touching = pressure > 0
        if np.where(touching, abs(gap), -gap)[allowed].max() <= accuracy * overlap.max():
            return pressure
        gradient = np.where(touching, gap, 0.0)
        square = float(np.vdot(gradient, gradient))
        direction = np.where(touching, gradient + square / previous * direction, 0.0)
        change = half_space.displacement(direction)
        step = float(np.vdot(gradient, direction) / np.vdot(change, direction))
        trial = pressure - step * direction
        pressure = np.maximum(trial, 0.0)
        entering = allowed & (pressure == 0) & (gap < 0)
        pressure[entering] = -step * gap[entering]
        previous = np.inf if entering.any() else square
        if entering.any() or trial.min() < 0:
            gap = half_space.displacement(pressure) - overlap
        else:
            gap -= step * change
    raise RuntimeError(f"pixel pressures not found to {accuracy:g} of the overlap in 2000 steps")


def smooth_sphere(x: Array, y: Array) -> tuple[Array, NDArray[np.intp]]:
    """Overlap of the sphere with a flat half-space; every pixel belongs to contact 0."""
    overlap = APPROACH - (x[:, None] ** 2 + y**2) / (2 * SPHERE_RADIUS)
    return overlap, np.zeros(overlap.shape, dtype=np.intp)


def rough_sphere(asperities: cr.Asperities) -> Callable[..., tuple[Array, NDArray[np.intp]]]:
    """Overlap of the sphere with the envelope of the asperities, and whose surface a pixel is on.

    h = D0 - r^2 / (2 R) + max_i (z_i - |r - r_i|^2 / (2 rho_i)): there is no flat land between
    asperities, and two of them touching at r = 0 is where the approach starts from.
    """

    def overlap_and_owner(x: Array, y: Array) -> tuple[Array, NDArray[np.intp]]:
        envelope = np.full((len(x), len(y)), -np.inf)
        owner = np.zeros(envelope.shape, dtype=np.intp)
        shapes = zip(asperities.positions, asperities.tip_radii, asperities.heights, strict=True)
        for i, ((x_i, y_i), rho, z) in enumerate(shapes):
            width = np.sqrt(2 * rho * max(APPROACH + z, 0.0))  # further out it overlaps nothing
            columns = slice(*np.searchsorted(x, (x_i - width, x_i + width)))
            rows = slice(*np.searchsorted(y, (y_i - width, y_i + width)))
            cap = z - ((x[columns, None] - x_i) ** 2 + (y[rows] - y_i) ** 2) / (2 * rho)
            higher = cap > envelope[columns, rows]
            envelope[columns, rows][higher] = cap[higher]
            owner[columns, rows][higher] = i
        return smooth_sphere(x, y)[0] + envelope, owner

    return overlap_and_owner


def loads_by_level(
    shape: Callable[..., tuple[Array, NDArray[np.intp]]], contacts: int, pixels: list[int]
) -> list[Array]:
    """Load of each contact at each number of pixels across, every number twice the one before.

    Each level starts from the pressure of the one before. Nothing can touch outside the circle in
    which the smooth sphere would overlap a plane through the tips (no height here is positive).
    """
    half_width = np.sqrt(2 * SPHERE_RADIUS * APPROACH)
    loads, pressure = [], np.empty((0, 0))
    for n in pixels:
        size = 2 * half_width / n
        centres = (np.arange(n) + 0.5) * size - half_width
        overlap, owner = shape(centres, centres)
        start = CONTACT_MODULUS * overlap / half_width
        if pressure.size:
            start = pressure.repeat(2, axis=0).repeat(2, axis=1)
        pressure = touch(HalfSpace(n, size, CONTACT_MODULUS), overlap, start)
        loads.append(np.bincount(owner.ravel(), pressure.ravel() * size**2, contacts))
    return loads


def compare(pixels: int = 512) -> list[Pair]:
    """Boundary elements against Hertz, then the asperity model against boundary elements.

    pixels : pixels across the circle that could touch, on the finest of three levels
    """
    # One smooth sphere: P = (4/3) E* sqrt(R) D0^(3/2). The error falls as the pixel size squared.
    hertz = 4 / 3 * CONTACT_MODULUS * np.sqrt(SPHERE_RADIUS) * APPROACH**1.5
    levels = [16, 32, 64, 128, 256]
    smooth = [float(loads[0]) for loads in loads_by_level(smooth_sphere, 1, levels)]
    pairs = [(f"smooth sphere, {n} pixels", p, hertz) for n, p in zip(levels, smooth, strict=True)]
    order = -np.polyfit(np.log(levels), np.log(abs(np.array(smooth) / hertz - 1)), 1)[0]
    pairs.append(("order of convergence", float(order), 2.0))

    # The paper's scene, extrapolated from the two finest levels with that order.
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    levels = [max(16, pixels // 4) * factor for factor in (1, 2, 4)]
    rough = loads_by_level(rough_sphere(asperities), len(asperities), levels)
    exact = rough[-1] + (rough[-1] - rough[-2]) / 3
    for n, loads in zip(levels, rough, strict=True):
        pairs.append((f"rough sphere, {n} pixels", float(loads.sum()), float(exact.sum())))

    distance = np.round(np.hypot(*asperities.positions.T) / 0.0025, 6)
    material = cr.Material(contact_modulus=CONTACT_MODULUS, poisson_ratio=0.3)
    for geometry in ("closest", "summit"):
        scene = cr.Scene(SPHERE_RADIUS, asperities, material, geometry=geometry)
        model = cr.press(scene, approach=APPROACH).loads
        pairs.append((f"{geometry}, total load", float(model.sum()), float(exact.sum())))
        for name, where in zip(RINGS, np.unique(distance), strict=False):
            ring = distance == where
            pairs.append((f"{geometry}, ring {name}", model[ring].mean(), exact[ring].mean()))
    return pairs


def main() -> None:
    parser = argparse.ArgumentParser(description="the asperity model against boundary elements")
    parser.add_argument("--pixels", type=int, default=512, help="across what could touch")
    pixels: int = parser.parse_args().pixels
    print(f"{'':28}{'computed':>16}{'reference':>16}{'difference':>13}")
    for name, computed, reference in compare(pixels):
        print(f"{name:28}{computed:16.6e}{reference:16.6e}{computed / reference - 1:+13.4%}")


if __name__ == "__main__":
    main()
