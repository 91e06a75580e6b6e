"""The best-fitting plane, sphere or paraboloid of a map, to be removed before summits are found."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.surface.pixels import centres

Trend = Literal["plane", "sphere", "paraboloid"]
TRENDS: tuple[Trend, ...] = ("plane", "sphere", "paraboloid")

#: Least eigenvalue of the correlation matrix of the terms with which pixels determine a form.
ALIKE = 1e-10


@dataclass(frozen=True, repr=False)
class Removed:
    """A form that was subtracted from a map."""

    kind: Trend
    height: float  # [length] at the middle of the map
    slopes: tuple[float, float]  # along x and y at the middle of the map
    curvatures: tuple[float, float] = (0.0, 0.0)  # [1/length] the larger first; of a hill positive
    angle: float = 0.0  # [degrees] from x towards y, of the axis of the first curvature

    @property
    def curvature(self) -> float:
        """[1/length] mean of `curvatures`."""
        return sum(self.curvatures) / 2

    @property
    def tensor(self) -> Array:
        """(2, 2) [1/length] the curvatures along x and y, and beside the diagonal the twist."""
        first, second = self.curvatures
        turned = math.radians(self.angle)
        axis = np.array([math.cos(turned), math.sin(turned)])
        return (first - second) * np.outer(axis, axis) + second * np.eye(2)

    @property
    def radius(self) -> float:
        """[length] 1 / `curvature`: negative for a bowl, infinite for a plane."""
        return 1.0 / self.curvature if self.curvature else float("inf")

    def scaled(self, scale: float) -> Removed:
        """The same form with all lengths multiplied by `scale`."""
        first, second = self.curvatures
        return replace(self, height=self.height * scale, curvatures=(first / scale, second / scale))

    def __repr__(self) -> str:
        tilt = f"slopes {self.slopes[0]:.3g} and {self.slopes[1]:.3g}"
        if self.kind == "plane":
            return f"plane, {tilt}"
        if self.kind == "paraboloid":
            first, second = (1.0 / each if each else float("inf") for each in self.curvatures)
            radii = f"radii {first:.6g} and {second:.6g}, the first {self.angle:.3g}° from x"
            return f"paraboloid of {radii}, {tilt} in the middle"
        return f"sphere of radius {self.radius:.6g}, {tilt} in the middle"


def principal(tensor: Array) -> tuple[tuple[float, float], float]:
    """The `curvatures` and the `angle` of a form with this `tensor`."""
    (second, first), axes = np.linalg.eigh(tensor)
    angle = math.degrees(math.atan2(axes[1, 1], axes[0, 1]))
    return (float(first), float(second)), (angle + 90.0) % 180.0 - 90.0


def fitted(heights: Array, pixel: tuple[float, float], kind: Trend) -> tuple[Removed, Array]:
    """The form of this kind that fits best by least squares, and its heights (ny, nx).

    Holes (nan) do not count, and stay holes. docs/theory/surfaces.md, "Removing the form", derives
    the method. In the code, lengths are divided by about half the longer side of the map.
    """
    known = ~np.isnan(heights)
    x, y = centres(heights.shape, pixel)
    size = max(float(x[-1]), float(y[-1]))
    x, y = (each[known] / size for each in np.meshgrid(x, y, copy=False))
    level = float(heights[known].mean()) if known.any() else 0.0
    wanted = (heights[known] - level) / size
    terms = [np.ones_like(wanted), x, y]
    if kind == "sphere":  # z = a + b x + c y + k (x^2 + y^2 + z^2) / 2
        terms += [(x * x + y * y + wanted * wanted) / 2]
    elif kind == "paraboloid":
        terms += [x * x / 2, x * y, y * y / 2]
    found = _least_squares(terms, wanted)
    a, b, c, k, kxy, ky = np.append(found, np.zeros(6 - len(found))).tolist()
    if kind == "sphere":
        q = np.append(a + b * x + c * y + k * (x * x + y * y) / 2, a)  # the last: in the middle
        if (under := 1 - 2 * k * q).min() <= 0:
            expected = 'one that covers the map, or "plane"'
            raise InputError("detrend", found="no sphere that fits", expected=expected)
        z = 2 * q / (1 + np.sqrt(under))
        z, q0 = z[:-1], float(z[-1])
        curvature = 0 - k / math.sqrt(b * b + c * c + 1 - 2 * a * k) / size
        slopes = b / (1 - k * q0), c / (1 - k * q0)
        removed = Removed(kind, level + size * q0, slopes, (curvature, curvature))
    else:
        z = np.asarray(sum(each * term for each, term in zip(found, terms, strict=True)))
        bent = principal(0.0 - np.array([[k, kxy], [kxy, ky]]) / size)
        removed = Removed(kind, level + size * a, (b, c), *bent)
    there = np.full(heights.shape, np.nan)
    there[known] = level + size * z
    return removed, there


def _least_squares(factors: list[Array], misfit: Array) -> Array:
    normal = np.array([[float(np.vdot(one, other)) for other in factors] for one in factors])
    scale = np.sqrt(np.diag(normal))
    if not scale.all() or np.linalg.eigvalsh(normal / scale / scale[:, None])[0] < ALIKE:
        expected = "more measured pixels, in rows and columns, or detrend=None"
        raise InputError("detrend", found="too few heights for this form", expected=expected)
    return np.asarray(np.linalg.solve(normal, [float(np.vdot(each, misfit)) for each in factors]))
