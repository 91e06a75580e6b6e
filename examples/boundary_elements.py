"""How good is the asperity model?  A boundary-element check that knows of no asperities.

The package makes every asperity a Hertz spring and its effect on the others that of a point force.
Here the same paraboloids, sphere and envelope of asperities, are cut into square pixels of uniform
pressure on an elastic half-space. The contact law is over pixels instead of asperities:

    p >= 0,    g = K p - h >= 0,    p g = 0,

where h is how far the undeformed bodies would overlap at this approach and K is the half-space.
Pressure only ever pushes the surfaces apart, so a pixel with h <= 0 stays open.

    python examples/boundary_elements.py --pixels 1024

On the source paper's scene the load converges to 3.59667e-7. From it the "closest" geometry differs
by -0.016 %, and by +0.25 % in the worst ring; the "summit" geometry by +0.33 %, and by -7.6 %.
Coarse pixels scatter the ring loads: 512 pixels give that 0.25 % as 0.29 %, 384 as 0.36 %.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

import convexrough as cr
from convexrough.surface.boundary_elements import HalfSpace, touch

Array = NDArray[np.float64]
Owner = NDArray[np.intp]  # which contact a pixel belongs to
Shape = Callable[[Array, Array], tuple[Array, Owner]]  # overlap and owner at pixels x, y
Pair = tuple[str, float, float]  # what it is, computed, reference

SPHERE_RADIUS, APPROACH, CONTACT_MODULUS = 1.0, 5e-5, 1.0
#: Outside this circle the sphere stays above a plane through the tips, so nothing can touch.
HALF_WIDTH = np.sqrt(2 * SPHERE_RADIUS * APPROACH)
RINGS = "FEDCBA"  # the paper's names, from the axis outwards


def smooth_sphere(x: Array, y: Array, x0: float = 0.0, y0: float = 0.0) -> tuple[Array, Owner]:
    """Overlap of a sphere about (x0, y0) with a flat half-space: a single contact."""
    overlap = APPROACH - ((x[:, None] - x0) ** 2 + (y - y0) ** 2) / (2 * SPHERE_RADIUS)
    return overlap, np.zeros(overlap.shape, dtype=np.intp)


def rough_sphere(x: Array, y: Array, asperities: cr.Asperities) -> tuple[Array, Owner]:
    """Overlap of the sphere with the envelope of the asperities, and whose surface a pixel is on.

    h = D0 - r^2 / (2 R) + max_i (z_i - |r - r_i|^2 / (2 rho_i)): asperities and nothing between.
    """
    envelope = np.full((len(x), len(y)), -np.inf)
    owner = np.zeros(envelope.shape, dtype=np.intp)
    shapes = zip(asperities.positions, asperities.tip_radii, asperities.heights, strict=True)
    for i, ((x_i, y_i), rho, z) in enumerate(shapes):
        width = np.sqrt(2 * rho * (APPROACH + z))  # further out it overlaps nothing
        near_x = slice(*np.searchsorted(x, (x_i - width, x_i + width)))
        near_y = slice(*np.searchsorted(y, (y_i - width, y_i + width)))
        near = near_x, near_y
        cap = z - ((x[near_x, None] - x_i) ** 2 + (y[near_y] - y_i) ** 2) / (2 * rho)
        owner[near] = np.where(cap > envelope[near], i, owner[near])
        envelope[near] = np.maximum(cap, envelope[near])
    return smooth_sphere(x, y)[0] + envelope, owner


def loads_by_level(shape: Shape, contacts: int, levels: list[int]) -> Array:
    """Load of each contact at each number of pixels; every level halves the pixels of the last."""
    loads: list[Array] = []
    pressure = np.empty((0, 0))
    for n in levels:
        size = 2 * HALF_WIDTH / n
        centres = (np.arange(n) + 0.5) * size - HALF_WIDTH
        overlap, owner = shape(centres, centres)
        coarse = pressure.repeat(2, axis=0).repeat(2, axis=1)
        start = coarse if loads else CONTACT_MODULUS * overlap / HALF_WIDTH
        pressure = touch(HalfSpace((n, n), (size, size), CONTACT_MODULUS), overlap, start, 1e-6)
        forces = np.bincount(owner.ravel(), pressure.ravel() * size**2, contacts)
        loads.append(forces.astype(np.float64))
    return np.array(loads)


def check_smooth_sphere() -> list[Pair]:
    """Against Hertz, P = (4/3) E* sqrt(R) D0^(3/2): the error falls as the pixel size squared.

    How the pixels lie under the edge of contact scatters the error by a third of itself on coarse
    grids: it is averaged over eight places of the axis.
    """
    hertz = 4 / 3 * CONTACT_MODULUS * np.sqrt(SPHERE_RADIUS) * APPROACH**1.5
    levels = [16, 32, 64, 128]
    places = np.random.default_rng(0).uniform(0, 2 * HALF_WIDTH / levels[0], (8, 2))
    spheres = [partial(smooth_sphere, x0=x0, y0=y0) for x0, y0 in places]
    loads = np.mean([loads_by_level(sphere, 1, levels)[:, 0] for sphere in spheres], axis=0)
    slope = np.polyfit(np.log(levels), np.log(loads / hertz - 1), 1)[0]
    named = [(f"smooth sphere, {n} pixels", float(p)) for n, p in zip(levels, loads, strict=True)]
    return [*((name, p, hertz) for name, p in named), ("order of convergence", -float(slope), 2.0)]


def compare(pixels: int = 512) -> list[Pair]:
    """Boundary elements against Hertz, then the asperity model against boundary elements.

    pixels : across the circle that could touch, on the finest of three levels
    """
    pairs = check_smooth_sphere()
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    levels = [pixels // 4 * factor for factor in (1, 2, 4)]
    rough = partial(rough_sphere, asperities=asperities)
    coarsest, coarse, fine = loads_by_level(rough, len(asperities), levels)
    exact = fine + (fine - coarse) / 3  # the error is of second order
    for n, loads in zip(levels, (coarsest, coarse, fine), strict=True):
        pairs.append((f"rough sphere, {n} pixels", float(loads.sum()), float(exact.sum())))

    rings = np.unique(np.round(asperities.distances / 0.0025, 6), return_inverse=True)[1]
    material = cr.Material(contact_modulus=CONTACT_MODULUS, poisson_ratio=0.3)
    closest = cr.Scene(SPHERE_RADIUS, asperities, material, geometry="closest")
    for scene in (closest, replace(closest, geometry="summit")):
        model = cr.press(scene, approach=APPROACH).loads
        pairs.append((f"{scene.geometry}, total load", float(model.sum()), float(exact.sum())))
        for i, name in enumerate(RINGS):
            computed, reference = (float(loads[rings == i].mean()) for loads in (model, exact))
            pairs.append((f"{scene.geometry}, load in ring {name}", computed, reference))
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
