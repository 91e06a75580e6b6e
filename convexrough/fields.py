"""Pressure, traction and displacement at any points of the surface, from contacts and shear states.

Pressure and traction are sums over the contact discs that contain a point; displacements are sums
over all loaded asperities. Shear is along x. `points` is an array (..., 2) [length] with the axis
of the sphere as origin, and a result is an array (...) with a value for each point. Disc i has the
centre r_i, the contact radius a_i and the peak pressure p0_i. If points are not finite, or an array
has another shape, InputError is raised.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.shear import ShearState
from convexrough.sphere import hertz, surface_shear

#: Number of pairs of a point and an asperity that are evaluated at a time; they fit in a cache.
BLOCK = 2**14

#: Largest number of such pairs for which all distances are computed. Affects speed only.
FEW_PAIRS = 2**20


def peak_pressures(contact: Contact) -> Array:
    """(n,) [force / length^2] peak pressures p0_i = 2 E* a_i / (pi R_i); 0 where open.

    E* is the contact modulus, and R_i is the relative radius of asperity i.

    >>> print(f"{cr.fields.peak_pressures(contact).max():.4f} E*")
    0.0214 E*
    """
    checks.instance("contact", contact, Contact)
    scene = contact.scene
    modulus, R = scene.material.contact_modulus, scene.relative_radii
    return np.asarray(hertz.peak_pressure(contact.contact_radii, modulus, R))


def pressure(contact: Contact, points: ArrayLike) -> Array:
    """(...) [force / length^2] pressure sum_i p0_i sqrt(1 - |r - r_i|^2 / a_i^2) at `points`.

    The sum is over discs that contain the point r. Their centres are the contact points of the
    scene: the summits, or in the "closest" geometry the points where the paraboloids first touch.

    >>> line = np.column_stack((np.linspace(0.0, 0.005, 6), np.zeros(6)))
    >>> print(cr.fields.pressure(contact, line).round(4))
    [0.0214 0.     0.0128 0.0128 0.     0.0181]
    """
    touching, centres, radii = _discs(contact)
    peaks = peak_pressures(contact)[touching]
    return _sum_over_discs(points, hertz.pressure, centres, radii, peaks)


def normal_displacement(contact: Contact, points: ArrayLike) -> Array:
    """(...) [length] sum of the normal displacements of both surfaces.

    The displacement of each surface is relative to distant points of its body. Each asperity
    contributes the displacement under its Hertz pressure (Johnson 1985, equation 3.42).

    >>> far = cr.fields.normal_displacement(contact, [1.0, 0.0])
    >>> print(f"{far * np.pi / contact.load:.4f} / E*")  # as of a point force
    1.0000 / E*
    """
    touching, centres, a = _discs(contact)
    R = contact.scene.relative_radii[touching]
    field = hertz.surface_displacement
    return _sum_everywhere(points, centres, lambda x, y: field(np.hypot(x, y), a, R))


def traction(state: ShearState, points: ArrayLike) -> Array:
    """(...) [force / length^2] shear traction along x on first loading.

    At the distance r from its centre a contact disc contributes f p0 sqrt(1 - r^2/a^2), with the
    coefficient of friction f. Within its stick radius c, f p0 (c/a) sqrt(1 - r^2/c^2) is
    subtracted. If the shear force is negative, the traction has the opposite sign.

    >>> state = cr.shear(contact, force=0.25 * contact.load)
    >>> q, p = cr.fields.traction(state, [0.0, 0.0]), cr.fields.pressure(contact, [0.0, 0.0])
    >>> print(f"{q / (0.5 * p):.3f}")  # below 1, because the centre sticks
    0.094
    """
    return _sum_over_discs(points, surface_shear.traction, *_sheared(state))


def shear_displacement(state: ShearState, points: ArrayLike) -> Array:
    """(...) [length] sum of the displacements of both surfaces along x.

    The displacement of each surface is relative to distant points of its body. Each asperity
    contributes the displacement of Johnson (1985, equation 3.91) for both bodies, which Dini and
    Hills (2009) give as [A3] and [A4]. Where the surfaces stick, the exact sum is the relative
    displacement of the bodies. This sum is only near it, because `shear` averages the compliance
    between two asperities over all directions from one to the other.

    >>> state = cr.shear(contact, force=0.25 * contact.load)
    >>> at_centre = cr.fields.shear_displacement(state, [0.0, 0.0])
    >>> print(f"{at_centre / state.displacement:.3f}")
    1.003
    """
    centres, a, shares, peaks = _sheared(state)
    material = state.contact.scene.material
    body = a, shares, peaks, material.shear_modulus, material.poisson_ratio
    field = surface_shear.surface_displacement
    return _sum_everywhere(points, centres, lambda x, y: field(x, y, *body))


def _discs(contact: Contact) -> tuple[Indices, Array, Array]:
    """The indices of the loaded asperities, their centres (n, 2) and contact radii (n,)."""
    touching = np.flatnonzero(contact.loads)
    return touching, contact.scene.contact_points[touching], contact.contact_radii[touching]


def _sheared(state: ShearState) -> tuple[Array, Array, Array, Array]:
    """Centres (n, 2), contact radii, Q_i / (f P_i) and f p0_i of the n loaded asperities.

    Q_i / (f P_i) is exactly 1 or -1 if the asperity slides.
    """
    checks.instance("state", state, ShearState)
    contact, f = state.contact, checks.friction(state.contact.scene.friction)
    touching, centres, radii = _discs(contact)
    shares = state.forces[touching] / (f * contact.loads[touching])
    return centres, radii, shares, f * peak_pressures(contact)[touching]


def cell_areas(points: Array) -> Array:
    """(n,) [length^2] area of each point's Voronoi cell; nan for points on the convex hull.

    points : (n, 2) [length]

    >>> cr.fields.cell_areas(np.array([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1.0]]))
    array([ 1., nan, nan, nan, nan])
    """
    areas: Array = np.zeros(len(points))
    try:
        cells = scipy.spatial.Voronoi(points)
    except (scipy.spatial.QhullError, ValueError):  # at most three points, or all on one line
        return np.full(len(points), np.nan)
    pairs, ends = cells.ridge_points.T, np.array(cells.ridge_vertices).T
    apart, edge = (np.hypot(*(it[0] - it[1]).T) for it in (points[pairs], cells.vertices[ends]))
    # An edge lies halfway between two points, at a right angle to the line through them.
    part = np.where((ends >= 0).all(axis=0), apart * edge / 4, np.nan)  # -1 is at infinity
    for side in pairs:
        np.add.at(areas, side, part)
    return areas


def _sum_over_discs(
    points: ArrayLike, profile: Callable[..., Array], centres: Array, radii: Array, *more: Array
) -> Array:
    """(...) sum_i profile(|r - r_i|, radii[i], ...) over the discs that may contain the point r;
    the dots are the elements i of the arrays in `more`."""
    flat, shape = _places(points)
    if len(flat) * len(centres) <= FEW_PAIRS:
        apart = np.hypot(*(flat.T[:, None] - centres.T[:, :, None]))
        disc, point = np.nonzero(apart <= radii[:, None])
    else:
        near = scipy.spatial.cKDTree(flat).query_ball_point(centres, radii)
        disc = np.repeat(np.arange(len(centres)), [len(inside) for inside in near])
        point = np.array([i for inside in near for i in inside], dtype=np.intp)
    total, apart = np.zeros(len(flat)), np.hypot(*(flat[point] - centres[disc]).T)
    np.add.at(total, point, profile(apart, radii[disc], *(each[disc] for each in more)))
    return total.reshape(shape)


def _sum_everywhere(
    points: ArrayLike, centres: Array, field: Callable[[Array, Array], Array]
) -> Array:
    """(...) sum_i field_i(r - r_i); `field` takes x and y (m, n) of m points from n centres."""
    flat, shape = _places(points)
    total = np.zeros(len(flat))
    size = max(1, BLOCK // max(1, len(centres)))
    for start in range(0, len(flat), size):
        block = slice(start, start + size)
        x, y = np.moveaxis(flat[block, None] - centres, 2, 0)
        total[block] = field(x, y).sum(axis=1)
    return total.reshape(shape)


def _places(points: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """The points as an array (m, 2), and the shape (...) of a result."""
    expected = "finite numbers of shape (..., 2): x and y of each point"
    places = checks.numbers("points", points, expected)
    if places.ndim == 0 or places.shape[-1] != 2:
        raise InputError("points", found=f"shape {places.shape}", expected=expected)
    if not np.isfinite(places).all():
        raise InputError("points", found="nan or infinity", expected=expected)
    return places.reshape(-1, 2), places.shape[:-1]
