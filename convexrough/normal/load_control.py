"""An upper bound on the approach under a total load, and the asperities that could touch."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import TINY
from convexrough.arrays import Array, Indices, even, evenly, largest, summed, taken
from convexrough.errors import InputError
from convexrough.influence import Kind, couple
from convexrough.influence.choice import FEW_ASPERITIES
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.base import along
from convexrough.scene.layout import MANY
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

#: The bound is first computed from asperities within LEAST_REACH contact radii of a smooth body. In
#: `all_that_could_touch` a scene extends at least that far. If the weights are 0 beyond this, the
#: bound is computed on a scene WIDER times as large.
LEAST_REACH, WIDER = 1.5, 4.0 / 3.0

#: `_bound_by_discs` is used if its discs cover at least the part COVERED of a rectangle about them,
#: and if the weighted mean depth of their asperities below the highest one is at most DEEP times
#: the bound's height above the first contact (1/3 for a smooth sphere); elsewhere it is poor. If
#: at most the part FEW of all asperities could touch at a poor bound, a better one is computed from
#: these alone. Heuristics.
COVERED, DEEP, FEW = 0.45, 0.45, 0.125

#: Largest depths below the highest asperity that are tried, divided by about the indentation of the
#: sharpest asperity under the whole load: four for each factor of 2.
DEPTHS = 2.0 ** (np.arange(-160, 1) / 4.0)

#: In scenes of at least 2 SAMPLE asperities, `_bound_by_discs` first estimates from about SAMPLE of
#: them how deep those with weights are. Affects speed and, if tips differ, slightly the bound.
SAMPLE = 2**13

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

    weights      : (n,) not negative, not all 0
    displacement : (n,) upper bounds on A times weights
    coefficients, offsets : (n,) k, and lower bounds on d
    load         : L; for m problems, L and the bound are (m, 1) and the other arrays (m, n)
    """
    total = summed(weights)
    q, c = weights / total, displacement / total
    alpha = q * coefficients
    cubes = alpha * alpha * alpha
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
        if not (step > 0.03 * (height - least)).any():
            break  # any height gives a bound; this one is close to the best
    height = np.maximum(height, highest)
    rest = (4.0 / 27.0) * summed(cubes / (height - active) ** 2)
    size = height * load + rest + summed(np.abs(offsets) * q)
    return height * load + rest - summed(offsets * q) + (SAFETY + q.shape[-1] * ROUNDOFF) * size


def highest_approach(scene: Scene, load: float, influence: Kind | None = None) -> float:
    """Upper bound [length] on the approach at every solution of total `load` [force].

    It is `_bound_by_discs` or, where that is poor, `_bound_from` those that could touch at the poor
    bound if these are few, or those near the axis.
    """
    bound, close = _bound_by_discs(scene, load)
    if close:
        return bound
    could_touch = scene.offsets + scene.offset_errors + 6 * ROUNDOFF * abs(bound) > -bound
    if np.count_nonzero(could_touch) <= FEW * len(scene):
        bound = min(bound, _bound_from(could_touch, scene, load, influence))
    else:
        distances = np.hypot(*scene.contact_points.T)
        for reach in _reaches(scene, load, distances):
            bound = _bound_from(distances <= reach, scene, load, influence, distances)
            if not np.isnan(bound):
                break
    if not np.isfinite(bound):
        raise InputError("load", found=load, expected="a load within the range of float64")
    return bound


@np.errstate(all="ignore")
def _bound_by_discs(scene: Scene, load: float) -> tuple[float, bool]:
    """`highest_approach` by (3) of docs/theory/certificate.md, from discs about asperities that do
    not overlap; and False if it is poor (`COVERED`, `DEEP`) or, without a bound, infinite."""
    layout, modulus = scene.asperities.layout, scene.material.contact_modulus
    if np.inf in along(scene.sphere_radius):  # flats and cylinders
        return np.inf, False
    # To find out whether few given points form a lattice takes too long.
    known = layout.made is not None or len(layout.points) > MANY
    if known and (lattice := scene.lattice) is not None:
        radii = even(0.5 * lattice.spacing - 1.5 * lattice.site_error, len(scene))
    else:
        radii = np.maximum(0.5 * scene.nearest * (1 - SAFETY) - 1.5 * scene.point_error, 0.0)
    narrowest, widest = float(radii.min()), float(radii.max())
    offsets = scene.offsets - scene.offset_errors
    top = float(offsets.max())
    depths = top - offsets

    def tried(some: Indices, share: float = 1.0) -> tuple[float, bool]:
        """The bound with weights for `some` asperities only, and False if it is poor. If they are a
        sample, which is this share of all, the bound is an estimate."""
        deep, own = depths[some], taken(radii, some)
        k = evenly(partial(hertz.local_coefficient, modulus), taken(scene.relative_radii, some))
        usual = float(k[0] if k.strides == (0,) else np.median(k))
        weights = evenly(np.square, own / widest) * np.minimum(1.0, (usual / k) ** 1.5)
        locally = weights * (k / usual)
        alone = hertz.indentation(load, float(k.max())) + load / (np.pi * modulus * widest)
        group = np.searchsorted(limits := alone * DEPTHS, deep)
        whole, cubes, below = (
            np.cumsum(np.bincount(group, each, len(DEPTHS) + 1)[:-1]) / share
            for each in (weights, locally * locally * locally, weights * deep)
        )
        local = usual * np.cbrt(cubes) / whole * load ** (2.0 / 3.0)
        moved = load / (np.pi * modulus * widest) * most_potential(whole, narrowest / widest)
        depth, above = below / whole, local + moved + below / whole
        rounding = SAFETY + 4 * len(deep) * ROUNDOFF  # quotients of two sums, term after term
        bounds = above - top + rounding * (above + abs(top))
        # Only asperities that can touch have weights, so the bound holds for a scene of these.
        bounds = np.where(limits - top < bounds, bounds, np.inf)
        bound = float(bounds[best := bounds.argmin()])
        if bound == np.inf or not whole[best] > 1e-50:  # below this, cubes may underflow
            return np.inf, False
        chosen = some[deep <= limits[best]]
        x, y = (2.0 * widest + np.ptp(each[chosen]) for each in scene.contact_points.T)
        covers = np.pi * float((taken(radii, chosen) ** 2).sum()) >= COVERED * share * float(x * y)
        return bound, bool(covers and depth[best] <= DEEP * above[best])

    most = np.inf
    if (step := len(scene) // SAMPLE) > 1:
        most = 1.1 * (top + tried(np.arange(0, len(scene), step), 1.0 / step)[0])
    while True:
        bound, close = tried(np.flatnonzero(depths <= most))
        if top + bound <= most:  # then deeper ones have no weights
            return bound, close
        most = top + bound


def most_potential(whole: Any, least: float) -> Any:
    """Upper bounds on the sum of q_j / r_ij over j other than i, with weights q_j = v_j / `whole`
    and v_j at most s_j^2, for radii s_j of discs that do not overlap: docs/theory/certificate.md,
    before (3).

    whole : the sum of the v_j;  least : the smallest radius of all discs
    """
    return 2.0 / (np.sqrt(whole + least * least) + least)


@np.errstate(all="ignore")
def _reaches(scene: Scene, load: float, distances: Array) -> list[float]:
    """Distances from the axis [length] that `highest_approach` tries: beyond the first, a smooth
    contact, widened by high asperities or by the indentations of asperities, is probably open."""
    if not scene.curved:
        return [np.inf]
    radius, modulus = scene.mean_radius, scene.material.contact_modulus
    a = float(hertz.contact_radius(load, modulus, radius))
    heights = scene.asperities.heights
    inside = np.count_nonzero(distances < a) + 1
    k = hertz.local_coefficient(modulus, scene.relative_radii.mean())
    beyond = max(heights.max() - heights.mean(), hertz.indentation(load / inside, k))
    reach = float(np.sqrt((LEAST_REACH * a) ** 2 + 2.0 * radius * beyond))
    return [reach, 2.0 * reach, 4.0 * reach, np.inf]


@np.errstate(all="ignore")
def _bound_from(
    some: NDArray[np.bool_],
    scene: Scene,
    load: float,
    kind: Kind | None,
    distances: Array | None = None,
) -> float:
    """`approach_bound` with rates dP/dL at the indentations `smooth_indentations` as weights. Where
    contact discs would reach their nearest neighbours, the indentations are reduced, as the bound
    would be useless.

    It is nan if others, which could touch, would have weights, too, or if the weights, as loads,
    may move one of them farther than all of `some`. Two asperities are at least as far apart as
    their distances from the axis differ.

    some      : (N,) True for asperities that may have weights
    distances : (N,) from the axis, if others, which are farther from it, could touch
    """
    near, modulus = scene.asperities.layout.sorted(some), scene.material.contact_modulus
    if len(near) == 0:
        return np.nan
    indentation, least = smooth_indentations(scene, load, near)
    weights = np.maximum(indentation, 0.0)
    few = len(near) <= FEW_ASPERITIES
    one_box = not few and scene.lattice is not None and kind in (None, "lattice")
    every = one_box or few
    which = np.arange(len(near)) if every else np.flatnonzero(weights)
    sources = couple(scene, near[which], 1.0 / (np.pi * modulus), kind)
    radii = taken(scene.relative_radii, near)
    if not one_box:
        fitting = np.minimum(weights[which], sources.separations() ** 2 / radii[which])
        if fitting.any():
            weights[which] = fitting
    coefficients = hertz.local_coefficient(modulus, radii)
    weights = np.sqrt(weights / coefficients) / coefficients  # dP/dL if all rise alike
    displacement = np.empty(len(near))
    displacement[which] = sources.falloff(weights[which], 1)
    if not every:
        others = np.flatnonzero(weights == 0)
        onto = sources.onto(scene.contact_points[near[others]])
        displacement[others] = onto.falloff(weights[which], 1)
    displacement *= sources.scale * (1 + SAFETY)
    if distances is not None and not some.all():
        loaded, far = np.flatnonzero(weights), ~some
        apart = distances[far].min() * (1 - SAFETY) - distances[near[loaded]]
        most = sources.scale * (weights[loaded] / np.maximum(apart, TINY)).sum() * (1 + SAFETY)
        tall = np.flatnonzero(far & (scene.offsets > least))
        if (lowered(scene, load, tall) > least).any() or most > displacement.max():
            return np.nan
    offsets = scene.offsets[near] - scene.offset_errors[near]
    return float(approach_bound(weights, displacement, coefficients, offsets, load))


def smooth_indentations(scene: Scene, load: float, which: Indices) -> tuple[Array, float]:
    """Estimated indentations [length] of the asperities `which`, and a number -tau [length].

    They are `lowered` + tau, with the tau by which loads by Hertz's law have the total `load`. If
    others are lower than -tau, they would be open.
    """
    offsets = lowered(scene, load, which)
    radii = taken(scene.relative_radii, which)
    coefficients = hertz.local_coefficient(scene.material.contact_modulus, radii)
    indentation = shifted_to_load(offsets, coefficients, load)
    return indentation, float(offsets[0] - indentation[0])


def lowered(scene: Scene, load: float, which: Indices) -> Array:
    """(m,) [length] offsets of the asperities `which`, minus the displacements by a smooth sphere
    under this load, which has the mean curvature of the body (0 for a flat).
    """
    offsets = scene.offsets[which]
    if scene.curved:
        a = float(hertz.contact_radius(load, scene.material.contact_modulus, scene.mean_radius))
        distances = np.hypot(*scene.asperities.positions.take(which, axis=0).T)
        offsets = offsets - hertz.surface_displacement(distances, a, scene.mean_radius)
    return offsets


def all_that_could_touch(
    scene_within: Callable[[float], Scene], farthest: Callable[[float], float], load: float
) -> tuple[Scene, float]:
    """The scene with all asperities that could touch under a load, and a bound on the approach.

    scene_within : returns the scene within a distance from the axis [length]
    farthest     : returns the largest distance of asperities that can touch at an approach [length]

    A bound found on a wide scene also holds for a narrower scene that contains all asperities with
    a nonzero weight (docs/theory/certificate.md).
    """
    axis = scene_within(0.0)
    modulus, radius = axis.material.contact_modulus, max(along(axis.sphere_radius))
    within = LEAST_REACH * float(hertz.contact_radius(load, modulus, radius))
    while True:
        reached = WIDER * within
        grown = scene_within(reached)
        indentation, _ = smooth_indentations(grown, load, np.arange(len(grown)))
        if (indentation[grown.asperities.distances > within] > 0).any():
            reached, grown = within, scene_within(within)
        bound = highest_approach(grown, load)
        needed = farthest(bound)
        if needed <= reached:
            return scene_within(max(within, needed)), bound
        within = needed
