"""What a prescribed total load implies before the problem is solved: shifts, and the approach."""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.influence import Kind, couple
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz


def shifted_to_load(indentation: Array, coefficients: Array, load: float) -> Array:
    """delta + tau with  sum ((delta_i + tau)+ / k_i)^(3/2) = load.

    The sum grows and is convex in tau, so Newton's method from the right descends on the root. The
    shift is counted from the highest, so that loads of any size come out to all digits.
    """
    indentation = indentation - indentation.max()
    alone = hertz.indentation(load, coefficients)  # one asperity alone would carry it all
    shift = float((alone - indentation).min())
    for _ in range(200):
        loads = hertz.load(indentation + shift, coefficients)
        slope = float(np.sum(np.cbrt(loads) / coefficients)) * 1.5
        step = (float(loads.sum()) - load) / slope
        if not step > 4 * ROUNDOFF * shift:
            break
        shift -= step
    return indentation + shift


def approach_bound(
    weights: Array, displacement: Array, coefficients: Array, offsets: Array, load: float
) -> float:
    """Upper bound on D0 at every solution of total `load` (derived in docs/theory/certificate.md).

    With q = weights / sum(weights), alpha_i = q_i k_i and c = A q, for every lambda >= max c:

        D0 <= lambda L + (4/27) sum alpha_i^3 / (lambda - c_i)^2 - d'q.

    displacement : (n,) no less than A times weights;  offsets : (n,) no more than d
    """
    total = float(weights.sum())
    q, c = weights / total, displacement / total
    alpha = q * coefficients
    active = alpha**3 > 0  # others count for nothing
    cubes, c_active = alpha[active] ** 3, c[active]
    # The best lambda solves (8/27) sum alpha^3 / (lambda - c)^3 = L; Newton from the left.
    height = float((c_active + np.cbrt(8.0 * cubes / (27.0 * load))).max()) * (1 + SAFETY)
    for _ in range(100):
        excess = cubes / (height - c_active) ** 3
        step = (float(excess.sum()) - 27.0 * load / 8.0) / float(
            3.0 * (excess / (height - c_active)).sum()
        )
        height += max(step, 0.0)
        if step <= 1e-3 * (height - float(c_active.max())):
            break  # any height gives a bound; this one is close to the best
    height = max(height, float(c.max()))
    terms = (
        height * load,
        (4.0 / 27.0) * float((cubes / (height - c_active) ** 2).sum()),
        -float(offsets @ q),
    )
    size = terms[0] + terms[1] + float(np.abs(offsets) @ q)
    return sum(terms) + (SAFETY + len(q) * ROUNDOFF) * size


def highest_approach(scene: Scene, load: float, influence: Kind | None = None) -> float:
    """An upper bound on the approach [length] at every solution of total `load` [force].

    `approach_bound` with the loads that Hertz's smooth sphere suggests.
    """
    modulus, radius = scene.material.contact_modulus, scene.sphere_radius
    coefficients = hertz.local_coefficient(modulus, scene.relative_radii)
    a = float(hertz.contact_radius(load, modulus, radius))
    sunk = hertz.surface_displacement(scene.asperities.distances, a, radius)
    indentation = scene.offsets - sunk
    weights = hertz.load(shifted_to_load(indentation, coefficients, load), coefficients)
    touching = np.flatnonzero(weights)
    sources = couple(scene, touching, 1.0 / (np.pi * modulus), influence)
    displacement = np.empty(len(scene))
    others = np.flatnonzero(weights == 0)
    pressing = weights[touching]
    for index, coupling in (
        (touching, sources),
        (others, sources.onto(scene.contact_points[others])),
    ):
        product = coupling.apply(pressing)
        displacement[index] = product + coupling.rounding(pressing).of(product)
    least = scene.offsets - scene.offset_errors
    bound = approach_bound(weights, displacement, coefficients, least, load)
    if not np.isfinite(bound):
        raise InputError("load", found=load, expected="a load this scene's units can hold")
    return bound
