"""An upper bound on the approach under a total load, and the asperities that could touch."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from convexrough.arrays import Array, Indices, largest, summed
from convexrough.errors import InputError
from convexrough.influence import Kind, couple
from convexrough.influence.choice import FEW_ASPERITIES
from convexrough.influence.coupling import Coupling
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.base import along
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

#: In `all_that_could_touch` a scene extends to at least LEAST_REACH contact radii of a smooth body.
#: If the weights are 0 beyond this, the bound is computed on a scene WIDER times as large.
LEAST_REACH, WIDER = 1.5, 4.0 / 3.0

#: Relative change below which the shift tau of `shifted_to_load` counts as converged. A heuristic:
#: certificates do not rely on the shift.
STRAIGHT = 1e-11


@np.errstate(all="ignore")
def shifted_to_load(indentation: Array, coefficients: Array, load: float) -> Array:
    """Indentations delta + tau, with the tau for which  sum ((delta_i + tau)+ / k_i)^(3/2) = load.

    The sign + means max(., 0). The sum to the power 2/3 is a norm of (delta + tau)+ / k, so it is
    convex and nearly straight in tau. So Newton's method converges to the root from the right.
    """
    highest = indentation.max()
    indentation, inverse = indentation - highest, 1.0 / coefficients
    most = hertz.indentation(load, coefficients.max())  # of one asperity under the whole load
    shift = np.minimum(most, np.maximum(highest, 1e-9 * most))
    for steps in range(200):
        ratio = np.maximum(indentation + shift, 0.0) * inverse
        root = np.sqrt(ratio)
        total = (ratio * root).sum()
        # (total^(2/3) - load^(2/3)) over its slope, without cancellation
        excess = -np.expm1(2 / 3 * np.log1p((load - total) / total)) * total
        step = excess / (root * inverse).sum()
        if steps > 0 and not step > 4 * ROUNDOFF * shift:
            break
        shift = shift - step
        if np.abs(step) < STRAIGHT * shift:
            break
    return np.asarray(indentation + shift)


@np.errstate(all="ignore")
def approach_bound(
    weights: Array, displacement: Array, coefficients: Array, offsets: Array, load: float | Array
) -> Any:
    """Upper bound on the approach at every solution of total load L.

    It is (2) of docs/theory/certificate.md with q = weights / sum(weights), and with a lambda close
    to the one for which (2) is least. In the code, c is A q and alpha is q k.

    weights      : (n,) approximate loads, not negative, not all 0
    displacement : (n,) upper bounds on A times weights
    coefficients, offsets : (n,) k, and lower bounds on d
    load         : L; for m problems, L and the bound are (m, 1) and the other arrays (m, n)
    """
    total = summed(weights)
    q, c = weights / total, displacement / total
    cubes = (q * coefficients) ** 3
    highest, wanted = largest(c), 27.0 * load / 8.0
    if q.ndim == 1:
        active, cubes = c[cubes > 0], cubes[cubes > 0]  # only these matter
    else:
        active = np.where(cubes > 0, c, -np.inf)
    # The best lambda solves S = (8/27) sum alpha^3 / (lambda - c)^3 = L. Newton's method from the
    # left is applied to S^(-1/3), which is concave and nearly straight.
    least = largest(active)
    height = largest(active + np.cbrt(cubes / wanted)) * (1 + SAFETY)
    for _ in range(100):
        nearer = 1.0 / (height - active)
        parts = cubes * (nearer * nearer * nearer)
        excess, slope = summed(parts), summed(parts * nearer)
        step = (np.cbrt(excess / wanted) - 1.0) * excess / slope
        height = height + np.fmax(step, 0.0)  # a step of nan: the height is large enough
        if not (step > 1e-3 * (height - least)).any():
            break  # any height gives a bound; this one is close to the best
    height = np.maximum(height, highest)
    rest = (4.0 / 27.0) * summed(cubes / (height - active) ** 2)
    size = height * load + rest + summed(np.abs(offsets) * q)
    return height * load + rest - summed(offsets * q) + (SAFETY + q.shape[-1] * ROUNDOFF) * size


def highest_approach(scene: Scene, load: float, influence: Kind | None = None) -> float:
    """Upper bound [length] on the approach at every solution of total `load` [force].

    It is `approach_bound` with the weights `smooth_loads`. Where contact discs under these would
    reach their nearest neighbours, smaller loads are the weights, as the bound would be useless.
    """
    modulus = scene.material.contact_modulus
    coefficients = hertz.local_coefficient(modulus, scene.relative_radii)
    weights = smooth_loads(scene, load)
    one_box = scene.lattice is not None and influence in (None, "lattice")
    every = one_box or len(scene) <= FEW_ASPERITIES
    which = np.arange(len(scene)) if every else np.flatnonzero(weights)
    sources = couple(scene, which, 1.0 / (np.pi * modulus), influence)
    if not one_box:
        deepest = sources.separations() ** 2 / scene.relative_radii[which]
        fitting = np.minimum(weights[which], hertz.load(deepest, coefficients[which]))
        if fitting.any():
            weights[which] = fitting
    couplings: list[tuple[Indices, Coupling]] = [(which, sources)]
    if not every:
        others = np.flatnonzero(weights == 0)
        couplings.append((others, sources.onto(scene.contact_points[others])))
    displacement = np.empty(len(scene))
    for index, coupling in couplings:
        displacement[index] = coupling.falloff(weights[which], 1) * (sources.scale * (1 + SAFETY))
    least = scene.offsets - scene.offset_errors
    bound = approach_bound(weights, displacement, coefficients, least, load)
    if not np.isfinite(bound):
        raise InputError("load", found=load, expected="a load within the range of float64")
    return float(bound)


def smooth_loads(scene: Scene, load: float) -> Array:
    """(n,) [force] estimated loads with the total `load`, by Hertz's law at the indentations
    offset - w + tau,  with a number tau and the displacement w by a smooth sphere under this load,
    which has the mean curvature of the body (w = 0 for a flat).
    """
    modulus, sunk = scene.material.contact_modulus, np.zeros(len(scene))
    if scene.curved:
        a = float(hertz.contact_radius(load, modulus, scene.mean_radius))
        sunk = hertz.surface_displacement(scene.asperities.distances, a, scene.mean_radius)
    coefficients = hertz.local_coefficient(modulus, scene.relative_radii)
    indentation = shifted_to_load(scene.offsets - sunk, coefficients, load)
    return np.asarray(hertz.load(indentation, coefficients))


def all_that_could_touch(
    scene_within: Callable[[float], Scene], farthest: Callable[[float], float], load: float
) -> tuple[Scene, float]:
    """The scene with all asperities that could touch under a load, and a bound on the approach.

    scene_within : returns the scene within a distance from the axis [length]
    farthest     : returns the largest distance of asperities that can touch at an approach [length]

    A bound found on a wide scene also holds for a narrower scene that contains all asperities with
    a nonzero weight: in (2) of docs/theory/certificate.md the sum and lambda are then the same.
    """
    axis = scene_within(0.0)
    modulus, radius = axis.material.contact_modulus, max(along(axis.sphere_radius))
    within = LEAST_REACH * float(hertz.contact_radius(load, modulus, radius))
    while True:
        reached = WIDER * within
        grown = scene_within(reached)
        if smooth_loads(grown, load)[grown.asperities.distances > within].any():
            reached, grown = within, scene_within(within)
        bound = highest_approach(grown, load)
        needed = farthest(bound)
        if needed <= reached:
            return scene_within(max(within, needed)), bound
        within = needed
