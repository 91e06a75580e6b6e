"""The fields under the sphere, anywhere on the surface, from the loads of its asperities.

So far the normal pressure. Every field with an elliptic profile is one `superpose`: the shear
traction of an asperity will be f p0 on its contact disc less f p0 c/a on its stick disc.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from convexrough import hertz
from convexrough.checks import Array
from convexrough.contact import Contact
from convexrough.errors import InputError


def peak_pressures(contact: Contact) -> Array:
    """p0_i = 2 E* a_i / (pi R_i): (n,) [force / length^2], 0 where open."""
    scene = contact.scene
    peaks: Array = hertz.peak_pressure(
        contact.contact_radii, scene.material.contact_modulus, scene.relative_radii
    )
    return peaks


def pressure(contact: Contact, points: ArrayLike) -> Array:
    """Normal pressure p(r) = sum_i p0_i sqrt(1 - |r - r_i|^2 / a_i^2), over the discs that hold r.

    points : (..., 2) [length]  places on the surface; the axis of the sphere is the origin
    result : (...) [force / length^2]  0 outside every contact disc

    The discs lie about the contact points of the scene: the summits, or in the "closest"
    geometry the places where the paraboloids touch first.
    """
    touching = np.flatnonzero(contact.loads)
    return superpose(
        points,
        contact.scene.contact_points[touching],
        contact.contact_radii[touching],
        peak_pressures(contact)[touching],
    )


def superpose(points: ArrayLike, centres: Array, radii: Array, peaks: Array) -> Array:
    """sum_i peak_i sqrt(1 - |r - r_i|^2 / radius_i^2) over the discs that hold r.

    points : (..., 2) [length];  centres : (n, 2) [length];  radii : (n,) [length], positive
    peaks  : (n,) [any];  result : (...) [as peaks]

    Time and memory grow with the number of points and of the discs about each, not with their
    product: discs are found by a k-d tree, in groups whose radii differ by less than a factor 2.
    """
    from scipy.spatial import cKDTree  # 0.1 s to import: only when asked

    places = _places(points)
    flat = places.reshape(-1, 2)
    total = np.zeros(len(flat))
    if len(flat) == 0:
        return total.reshape(places.shape[:-1])
    tree = cKDTree(flat)
    octaves = np.frexp(radii)[1]
    for octave in np.unique(octaves):
        group = np.flatnonzero(octaves == octave)
        near = tree.sparse_distance_matrix(
            cKDTree(centres[group]), float(radii[group].max()), output_type="ndarray"
        )
        disc = group[near["j"]]
        profile = hertz.pressure(near["v"], radii[disc], peaks[disc])
        total += np.bincount(near["i"], weights=profile, minlength=len(flat))
    return total.reshape(places.shape[:-1])


def _places(points: ArrayLike) -> Array:
    """The given points as float64, shape (..., 2), every number finite."""
    expected = "finite numbers of shape (..., 2): x and y of each point"
    try:
        places = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError("points", found=repr(points)[:60], expected=expected) from error
    if places.ndim == 0 or places.shape[-1] != 2:
        raise InputError("points", found=f"shape {places.shape}", expected=expected)
    if not np.isfinite(places).all():
        raise InputError("points", found="nan or infinity", expected=expected)
    return places
