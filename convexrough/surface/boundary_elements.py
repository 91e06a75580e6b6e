"""The contact of a whole map by boundary elements, for comparison with the asperity model.

Each pixel is a rectangle of uniform pressure p on an elastic half-space. The contact law is

    p >= 0,    g = K p - h >= 0,    p g = 0

for each pixel. Here g is the gap, h the overlap of the undeformed bodies at the given approach, and
K the compliance operator of the half-space. Pixels with h <= 0 are open, because pressures can only
increase gaps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError, SolverError
from convexrough.influence.convolution import SiteBox
from convexrough.record import Along, Table
from convexrough.surface.pixels import centres
from convexrough.surface.surface import Surface

#: Largest number of steps of conjugate gradients, and accepted error of gaps / largest overlap.
STEPS, ACCURACY = 2000, 1e-4

#: The operator from pressures on pixels to displacements [length] at their centres.
HalfSpace = Callable[[Array], Array]


def half_space(
    shape: tuple[int, int], pixel: tuple[float, float], contact_modulus: float
) -> HalfSpace:
    """The operator from pressures to the sum of the normal displacements of both bodies.

    It contains the integral of 1 / (pi E* r) over a pixel, by Love (1929).
    """

    def influence(i: Indices, j: Indices, _: Array) -> list[Array]:
        sides = zip((i, j), pixel[::-1], strict=True)
        y, x = ((np.append(each, each[-1:] + 1) - 0.5) * size for each, size in sides)
        y = y[:, None]
        corner = x * np.arcsinh(y / abs(x)) + y * np.arcsinh(x / abs(y))  # d2/dxdy of this: 1/r
        return [np.diff(np.diff(corner, axis=0), axis=1) / (np.pi * contact_modulus)]

    box = SiteBox(shape, np.diag(pixel[::-1]))
    (kernel,) = box.kernels(influence, np.float64)

    def displacement(pressure: Array) -> Array:
        field = box.field(np.float64)
        field[:, : shape[1]] = pressure
        return np.asarray(box.convolve(field, kernel.spectrum)[:, : shape[1]])

    return displacement


def touch(
    displacement: HalfSpace, overlap: Array, start: Array, accuracy: float = ACCURACY
) -> Array:
    """Pressures that solve the contact law, by conjugate gradients on the touching pixels.

    This is the method of Polonsky and Keer (Wear 231, 1999) at a given approach. It ends if
    |g| <= accuracy * max h on pixels with p > 0, and g >= -accuracy * max h where p = 0 < h.
    """
    allowed = overlap > 0
    pressure = np.where(allowed, start, 0.0)
    gap = displacement(pressure) - overlap
    direction = np.zeros_like(gap)
    previous = np.inf
    for _ in range(STEPS):
        touching = pressure > 0
        if np.where(touching, abs(gap), -gap)[allowed].max() <= accuracy * overlap.max():
            return pressure
        gradient = np.where(touching, gap, 0.0)
        square = float(np.vdot(gradient, gradient))
        direction = np.where(touching, gradient + square / previous * direction, 0.0)
        change = displacement(direction)
        step = float(np.vdot(gradient, direction) / np.vdot(change, direction))
        trial = pressure - step * direction
        pressure = np.maximum(trial, 0.0)
        entering = allowed & (pressure == 0) & (gap < 0)
        pressure[entering] = -step * gap[entering]
        previous = np.inf if entering.any() else square  # infinite: the directions restart
        if entering.any() or trial.min() < 0:
            gap = displacement(pressure) - overlap
        else:
            gap -= step * change
    raise SolverError(
        f"pressures not found to {accuracy:g} of the overlap in {STEPS} steps",
        solver="boundary elements",
        advice="use a smaller approach, or a smoother map",
    )


@dataclass(frozen=True, eq=False, repr=False)
class Whole(Table):
    """Contacts at the same approach: of a whole map by boundary elements, and of asperities.

    contact   : contact of the asperities
    pressures : (ny, nx) [force/length^2] pressures on the pixels
    loads     : (n,) [force] total load on the pixels nearest to each asperity
    load, area : [force], [length^2] total load and contact area of the map
    pieces    : number of connected regions of loaded pixels
    resolution : relative change of the load for pixels twice as wide, a measure of the error due
        to the pixel size

    An example is under `press_whole`.
    """

    _along: ClassVar[Along] = {("asperity",): ("loads",), ("row", "column"): ("pressures",)}

    contact: Contact
    pressures: Array
    loads: Array
    load: float
    area: float
    pieces: int
    resolution: float

    def compared(self) -> list[tuple[str, float, float]]:
        """For each quantity its name, its value for the asperities, and for the whole map."""
        model = self.contact
        return [
            ("load", model.load, self.load),
            ("area of contact", model.area, self.area),
            ("contacts", int(np.count_nonzero(model.loads)), self.pieces),
            ("largest load", float(model.loads.max()), float(self.loads.max())),
        ]

    def _rows(self) -> Iterator[tuple[str, str]]:
        for name, model, whole in self.compared():
            yield name, f"{whole:.6g}; of the asperities {model:.6g}, {model / whole - 1:+.1%}"
        yield "resolution", f"{self.resolution:.2g}"


def press_whole(surface: Surface, contact: Contact) -> Whole:
    """The contact of a whole map by boundary elements, one per pixel.

    contact : contact of the summits of the map. Its approach is prescribed, and its sphere is
        pressed on the middle of the map

    Raises InputError if the asperities are not `Summits` of this map, if no pixel touches, or if
    the contact reaches the edge of the map.

    >>> scan = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1)
    >>> on_summits = cr.press(cr.Scene(1e4, scan.summits(), cr.Material(1.0, 0.3)), load=10.0)
    >>> whole = cr.surface.press_whole(scan, on_summits)
    >>> print(f"{on_summits.load / whole.load - 1:+.0%}")
    -18%
    """
    checks.instance("surface", surface, Surface)
    checks.instance("contact", contact, Contact)
    origin = getattr(contact.scene.asperities, "origin", None)
    there = surface.unit, surface.pixel, surface.heights.shape, surface.checksum
    if origin is None or (origin.unit, origin.pixel, origin.shape, origin.checksum) != there:
        found = "summits of another map" if origin else "asperities that are no summits of a map"
        expected = f"those of this map (in {surface.unit or 'no unit'}), as surface.summits() finds"
        raise InputError("contact", found=found, expected=expected)
    pressures, load = _pressed(surface, contact, 1)
    touching = pressures > 0
    if touching.sum() > touching[1:-1, 1:-1].sum():
        expected = "a larger map, a smaller approach or load, or no --whole"
        raise InputError("map", found="contact at the edge of the map", expected=expected)
    row, column = np.nonzero(touching)
    x, y = centres(surface.heights.shape, surface.pixel)
    area = surface.pixel[0] * surface.pixel[1]
    tree = cKDTree(contact.scene.contact_points)
    _, nearest = tree.query(np.column_stack((x[column], y[row])))
    loads = np.bincount(nearest, pressures[touching] * area, len(contact.loads))
    _, pieces = ndimage.label(touching, structure=np.ones((3, 3)))
    return Whole(
        contact=contact,
        pressures=frozen(pressures),
        loads=frozen(loads.astype(np.float64)),
        load=load,
        area=len(row) * area,
        pieces=int(pieces),
        resolution=abs(_pressed(surface, contact, 2)[1] / load - 1.0),
    )


def _pressed(surface: Surface, contact: Contact, every: int) -> tuple[Array, float]:
    """The pressures on pixels `every` times as wide, and the total load [force]."""
    x, y = (each[::every] for each in centres(surface.heights.shape, surface.pixel))
    overlap = contact.approach + surface.heights[::every, ::every]
    for radius, axes in contact.scene.curved:
        for axis in np.arange(2)[axes]:
            overlap = overlap - (y[:, None] ** 2 if axis else x**2) / (2.0 * radius)
    row, column = (np.flatnonzero((overlap > 0).any(axis=axis)) for axis in (1, 0))
    if len(row) == 0:
        raise InputError("map", found="no pixel that touches", expected="a larger approach or load")
    box = np.s_[row[0] : row[-1] + 1, column[0] : column[-1] + 1]
    inside = overlap[box]
    checks.fits_in_memory("pixels of the map", inside.size, 200)
    pixel = (surface.pixel[0] * every, surface.pixel[1] * every)
    modulus = contact.scene.material.contact_modulus
    displacement = half_space((inside.shape[0], inside.shape[1]), pixel, modulus)
    width = max(inside.shape) * max(pixel)
    pressures = np.zeros_like(overlap)
    pressures[box] = touch(displacement, inside, modulus * inside / width)
    return pressures, float(pressures.sum()) * pixel[0] * pixel[1]
