"""The shape of the pressed body: a sphere, an ellipsoid, a cylinder or a flat.

The shape is the paraboloid x^2 / (2 Rx) + y^2 / (2 Ry) about the axis. A sphere has one radius R; a
flat has R = inf. An ellipsoid has a pair (Rx, Ry); for a cylinder one of the two radii is inf.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np

from convexrough import checks
from convexrough.errors import InputError

#: R of a sphere or flat, or (Rx, Ry) of another shape.
Radius: TypeAlias = float | tuple[float, float]


def checked(radius: Any) -> Radius:
    """The radius, checked; a pair of equal radii becomes one number. Raises InputError."""
    if np.ndim(radius) == 0:
        return _length("sphere_radius", radius)
    if len(radius) != 2:
        expected = "a number, or the two radii of an ellipsoid, along x and along y"
        raise InputError("sphere_radius", found=repr(radius)[:60], expected=expected)
    along_x, along_y = (_length(f"sphere_radius[{i}]", each) for i, each in enumerate(radius))
    return along_x if along_x == along_y else (along_x, along_y)


def along(radius: Radius) -> tuple[float, float]:
    """The radii of curvature Rx along x and Ry along y."""
    return radius if isinstance(radius, tuple) else (radius, radius)


def curved(radius: Radius) -> list[tuple[float, slice]]:
    """Each finite radius R, with the slice of the axes (0 is x, 1 is y) that have this radius."""
    parts = [(R, slice(i, i + 1)) for i, R in enumerate(along(radius))]
    if not isinstance(radius, tuple):
        parts = [(radius, slice(0, 2))]
    return [(R, axes) for R, axes in parts if math.isfinite(R)]


def named(radius: Radius) -> str:
    """The name of the shape, such as "a sphere"."""
    if not curved(radius):
        return "a flat"
    if not isinstance(radius, tuple):
        return "a sphere"
    return "a cylinder" if math.inf in radius else "an ellipsoid"


def sphere_radius(radius: Radius, what: str) -> float:
    """The radius, if the shape is a sphere. Raises InputError for other shapes."""
    if isinstance(radius, tuple) or not curved(radius):
        raise InputError(what, found=named(radius), expected="a sphere")
    return radius


def _length(what: str, value: Any) -> float:
    return math.inf if value == math.inf else checks.positive(what, value)
