"""Compare the asperity model with boundary elements.

The package treats every asperity as a Hertzian contact that acts on the others as a point force.
This script does not use that model. It cuts the same shapes, the sphere and the envelope of the
asperities, into square pixels of uniform pressure on an elastic half-space. The contact law then
holds at each pixel:

    p >= 0,    g = K p - h >= 0,    p g = 0,

with the pressures p, the gaps g, the overlap h of the undeformed bodies at the given approach, and
the compliance K of the half-space. A pixel with h <= 0 stays open, because pressure only pushes the
surfaces apart.

    python examples/boundary_elements.py --pixels 1024

For the scene of Dini and Hills (2009) the load converges to 3.59667e-7. The total load of the
geometry "closest" differs from it by -0.016 %, and the load of the worst ring by +0.25 %. For the
geometry "summit" the differences are +0.33 % and -7.6 %. Coarse pixels change the loads of rings:
the +0.25 % becomes +0.29 % with 512 pixels, and +0.36 % with 384 pixels.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

import convexrough as cr
from convexrough.surface.boundary_elements import half_space, touch

Array = NDArray[np.float64]
Owner = NDArray[np.intp]  # index of the contact of each pixel
Shape = Callable[[Array, Array], tuple[Array, Owner]]  # overlap and owner at the pixels x, y
Pair = tuple[str, float, float]  # name, computed value, reference value

SPHERE_RADIUS, APPROACH, CONTACT_MODULUS = 1.0, 5e-5, 1.0
#: Outside this circle the sphere stays above a plane through the tips, so nothing can touch.
HALF_WIDTH = np.sqrt(2 * SPHERE_RADIUS * APPROACH)
RINGS = "FEDCBA"  # names of the rings in the paper, from the axis outwards


def smooth_sphere(x: Array, y: Array, x0: float = 0.0, y0: float = 0.0) -> tuple[Array, Owner]:
    """Overlap of a sphere about (x0, y0) with a flat half-space: a single contact."""
    overlap = APPROACH - ((x[:, None] - x0) ** 2 + (y - y0) ** 2) / (2 * SPHERE_RADIUS)
    return overlap, np.zeros(overlap.shape, dtype=np.intp)


def rough_sphere(x: Array, y: Array, asperities: cr.Asperities) -> tuple[Array, Owner]:
    """Overlap of the sphere with the envelope of the asperities, and the asperity at each pixel.

    h = D0 - r^2 / (2 R) + max_i (z_i - |r - r_i|^2 / (2 rho_i)). Between asperities there is no
    surface.
    """
    envelope = np.full((len(x), len(y)), -np.inf)
    owner = np.zeros(envelope.shape, dtype=np.intp)
    shapes = zip(asperities.positions, asperities.tip_radii, asperities.heights, strict=True)
    for i, ((x_i, y_i), rho, z) in enumerate(shapes):
        width = np.sqrt(2 * rho * (APPROACH + z))  # beyond this it overlaps nothing
        near_x = slice(*np.searchsorted(x, (x_i - width, x_i + width)))
        near_y = slice(*np.searchsorted(y, (y_i - width, y_i + width)))
        near = near_x, near_y
        cap = z - ((x[near_x, None] - x_i) ** 2 + (y[near_y] - y_i) ** 2) / (2 * rho)
        owner[near] = np.where(cap > envelope[near], i, owner[near])
        envelope[near] = np.maximum(cap, envelope[near])
    return smooth_sphere(x, y)[0] + envelope, owner


def loads_by_level(shape: Shape, contacts: int, levels: list[int]) -> Array:
    """Load of each contact at each level. A level has half the pixel size of the one before."""
    loads: list[Array] = []
    pressure = np.empty((0, 0))
    for n in levels:
        size = 2 * HALF_WIDTH / n
        centres = (np.arange(n) + 0.5) * size - HALF_WIDTH
        overlap, owner = shape(centres, centres)
        coarse = pressure.repeat(2, axis=0).repeat(2, axis=1)
        start = coarse if loads else CONTACT_MODULUS * overlap / HALF_WIDTH
        pressure = touch(half_space((n, n), (size, size), CONTACT_MODULUS), overlap, start, 1e-6)
        forces = np.bincount(owner.ravel(), pressure.ravel() * size**2, contacts)
        loads.append(forces.astype(np.float64))
    return np.array(loads)


def check_smooth_sphere() -> list[Pair]:
    """Compare with Hertz, P = (4/3) E* sqrt(R) D0^(3/2): the error falls as the pixel size squared.

    On coarse grids the error varies by a third of itself with the position of the edge of the
    contact relative to the pixels. It is therefore averaged over eight positions of the axis.
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
    """Compare boundary elements with Hertz, then the asperity model with boundary elements.

    pixels : number across the circle that could touch, on the finest of three levels
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
    parser.add_argument("--pixels", type=int, default=512, help="number across the circle")
    pixels: int = parser.parse_args().pixels
    print(f"{'':28}{'computed':>16}{'reference':>16}{'difference':>13}")
    for name, computed, reference in compare(pixels):
        print(f"{name:28}{computed:16.6e}{reference:16.6e}{computed / reference - 1:+13.4%}")


if __name__ == "__main__":
    main()
